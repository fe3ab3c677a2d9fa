"""Remote ID of a simulated ArduCopter, as in ArduPilot's source (AP_OpenDroneID)."""

SYSTEM = {"operator_latitude": 520_725_000, "operator_longitude": -6_275_000}
NOTHING_FOR_IT = {"DID_ENABLE": 1, "DID_OPTIONS": 1}


def rebooted(ground, **params):
    """With other parameters, booted anew."""
    for name, value in params.items():
        ground.param(name, value)
    ground.run(0.1)
    ground.command(246, 1)
    ground.run(6.0)
    return ground


def listed(ground) -> int:
    ground.heard.clear()
    ground.say("PARAM_REQUEST_LIST")
    ground.run(5.0)
    return len({f["param_id"] for f in ground.of("PARAM_VALUE")})


def refusal(ground) -> list[str]:
    return [text for text in ground.answers(400, 1) if "OpenDroneID" in text]


def test_its_parameters_are_listed_once_it_is_switched_on(booted):
    ground = booted()
    before = listed(ground)
    ground.param("DID_ENABLE", 1)
    assert listed(ground) == before + 4


def test_by_default_it_hears_nothing_and_arms(booted):
    ground = booted()
    ground.say("OPEN_DRONE_ID_SYSTEM", **SYSTEM)
    assert ground.mode(4) == 0 and ground.command(400, 1) == 0


def test_what_it_wants_before_it_arms_comes_in_this_order(booted):
    ground = rebooted(booted(), **NOTHING_FOR_IT)
    assert refusal(ground) == ["2 Arm: OpenDroneID: UA_TYPE required in BasicID"]
    ground.say("OPEN_DRONE_ID_BASIC_ID", id_type=1, ua_type=2)
    assert refusal(ground) == ["2 Arm: OpenDroneID: operator location must be set"]
    ground.say("OPEN_DRONE_ID_SYSTEM", **SYSTEM)
    assert refusal(ground) == ["2 Arm: OpenDroneID: ARM_STATUS not available"]
    ground.param("DID_MAVPORT", 1)
    assert not refusal(ground) and ground.command(400, 0) == 0
    ground.run(3.2)
    assert refusal(ground) == ["2 Arm: OpenDroneID: SYSTEM not available"]


def test_an_update_keeps_it_fresh_only_after_a_whole_one(booted):
    ground = rebooted(booted(), **NOTHING_FOR_IT, DID_MAVPORT=1)
    ground.say("OPEN_DRONE_ID_BASIC_ID", id_type=1, ua_type=2)
    ground.say("OPEN_DRONE_ID_SYSTEM_UPDATE", **SYSTEM)
    assert refusal(ground) == ["2 Arm: OpenDroneID: SYSTEM not available"]
    ground.say("OPEN_DRONE_ID_SYSTEM", **SYSTEM)
    ground.run(2.5)
    ground.say("OPEN_DRONE_ID_SYSTEM_UPDATE", **SYSTEM)
    ground.run(2.5)
    assert not refusal(ground)


def test_it_complains_every_5_s_and_its_transmitter_tells_its_own_word(booted):
    ground = rebooted(booted(), **NOTHING_FOR_IT, DID_MAVPORT=1)
    ground.heard.clear()
    ground.run(10.5)
    assert ground.texts().count("ODID: lost operator location") == 2
    reported = ground.of("OPEN_DRONE_ID_ARM_STATUS")
    assert len(reported) in (10, 11)
    assert reported[-1]["status"] == 1 and reported[-1]["error"].rstrip(b"\0") == b"missing operator location"
