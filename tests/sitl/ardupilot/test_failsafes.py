"""ArduCopter takes over: battery by voltage, lost position; joystick, modes offered, oddities of requests."""

import pytest

LOITER, GUIDED, RTL, LAND, ALT_HOLD = 5, 4, 6, 9, 2


def low_battery(ground, volts=11.5):
    ground.param("BATT_LOW_VOLT", 11.8)
    ground.param("BATT_CRT_VOLT", 11.2)
    ground.param("BATT_FS_LOW_ACT", 2)
    ground.param("BATT_FS_CRT_ACT", 1)
    ground.take_off()
    ground.param("SIM_BATT_VOLTAGE", volts)
    return ground.fleet.now_s


@pytest.mark.parametrize(("volts", "mode", "word", "state"), [(11.5, RTL, "low", 2), (11.0, LAND, "critical", 3)])
def test_a_low_voltage_acts_after_10_s_and_is_latched(booted, volts, mode, word, state):
    ground = booted()
    since = low_battery(ground, volts)
    while ground.fleet.mode[0] == GUIDED and ground.fleet.now_s < since + 20.0:
        ground.run(0.05)
    assert ground.fleet.now_s - since == pytest.approx(10.1, abs=0.15)
    assert ground.fleet.mode[0] == mode
    texts = ground.texts(since_s=since)
    assert texts[0].startswith(f"Battery 1 is {word} {volts:.2f}V used ")
    assert texts[1] == "Battery Failsafe"
    ground.command(512, 147)
    assert ground.of("BATTERY_STATUS")[-1]["charge_state"] == state
    assert ground.mode(GUIDED) == 0, "the operator may"
    ground.param("SIM_BATT_VOLTAGE", 12.6)
    ground.run(12.0)
    assert ground.fleet.mode[0] == GUIDED
    assert ground.of("HEARTBEAT")[-1]["system_status"] == 5
    ground.mode(LAND)
    ground.run(30.0)
    ground.mode(GUIDED)
    assert "2 Arm: Battery failsafe" in ground.answers(400, 1)
    assert ground.command(42651, 1, 100) == 0
    assert ground.command(400, 1) == 0


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("BATT_LOW_VOLT", 13.0, "low voltage"),
        ("BATT_CRT_VOLT", 13.0, "critical voltage"),
        ("BATT_LOW_MAH", 99999.0, "low capacity"),
        ("BATT_CRT_MAH", 99999.0, "critical capacity"),
    ],
)
def test_on_the_ground_a_low_battery_refuses_arming_and_latches_nothing(booted, name, value, text):
    ground = booted()
    usual = {"BATT_LOW_VOLT": 10.5}.get(name, 0.0)
    ground.param(name, value)
    ground.run(12.0)
    assert not [said for said in ground.texts() if said.startswith("Battery 1 is")], "a failsafe of armed vehicles"
    ground.mode(GUIDED)
    assert f"2 Arm: Battery 1 {text} failsafe" in ground.answers(400, 1)
    ground.param(name, usual)
    ground.run(2.0)
    assert ground.command(400, 1) == 0


def test_a_short_dip_is_nothing(booted):
    ground = booted()
    low_battery(ground)
    ground.run(9.0)
    ground.param("SIM_BATT_VOLTAGE", 12.6)
    ground.run(10.0)
    assert ground.fleet.mode[0] == GUIDED


def test_without_gps_it_lands_after_8_s_and_wants_no_mode_that_needs_a_position(booted):
    ground = booted()
    ground.ask("EKF_STATUS_REPORT", 5)
    ground.ask("GPS_RAW_INT", 5)
    ground.take_off()
    ground.fleet.break_gps(0)
    since = ground.fleet.now_s
    ground.run(0.5)
    assert ground.of("GPS_RAW_INT")[-1]["fix_type"] == 1
    while ground.fleet.mode[0] == GUIDED:
        ground.run(0.05)
    assert ground.fleet.now_s - since == pytest.approx(8.05, abs=0.15)
    assert ground.fleet.mode[0] == LAND
    ground.run(0.3)
    assert ground.of("EKF_STATUS_REPORT")[-1]["flags"] == 0x25
    assert ground.texts(since_s=since) == ["EKF variance", "EKF Failsafe: changed to LAND Mode"]
    height = ground.fleet.alt_rel_m[0]
    ground.run(3.5)
    assert ground.fleet.alt_rel_m[0] == pytest.approx(height, abs=0.3), "no descent at first"
    assert ground.answers(176, 1, GUIDED) == ["ack 4", "4 Mode change to GUIDED failed: requires position"]
    assert ground.mode(ALT_HOLD) == 0
    assert ground.mode(LAND) == 0
    ground.run(3.5)
    assert "EKF3 IMU0 stopped aiding" in ground.texts()
    ground.fleet.mend_gps(0)
    ground.run(0.8)
    assert ground.of("EKF_STATUS_REPORT")[-1]["flags"] == 0x33F
    ground.run(0.6)
    assert ground.texts()[-1] == "EKF Failsafe Cleared"
    assert ground.fleet.mode[0] == LAND
    assert ground.mode(GUIDED) == 0


def test_without_gps_guided_cannot_be_armed(booted):
    ground = booted()
    ground.mode(GUIDED)
    ground.fleet.break_gps(0)
    ground.run(9.0)
    assert "2 Arm: Need Position Estimate" in ground.answers(400, 1)


def sticks(ground, seconds, **how):
    for _ in range(round(seconds * 10)):
        ground.say("MANUAL_CONTROL", target=1, **{"x": 0, "y": 0, "z": 500, "r": 0, **how})
        ground.run(0.1)


def test_a_joystick_flies_loiter_and_3_s_after_it_stops_the_receivers_throttle_sinks_it(booted):
    ground = booted()
    ground.take_off(30.0)
    sticks(ground, 0.5)
    ground.mode(LOITER)
    sticks(ground, 5.0, x=1000)
    assert ground.fleet.velocity_m_s[0, 0] == pytest.approx(9.4, abs=0.6), "the nose points east"
    assert ground.fleet.alt_rel_m[0] == pytest.approx(30.0, abs=1.0)
    ground.command(512, 65)
    assert ground.of("RC_CHANNELS")[-1]["chan2_raw"] == 1000
    sticks(ground, 4.0)
    height = ground.fleet.alt_rel_m[0]
    ground.run(2.5)
    assert ground.fleet.alt_rel_m[0] == pytest.approx(height, abs=0.5)
    ground.run(4.0)
    assert ground.fleet.alt_rel_m[0] < height - 4.0


def test_a_joystick_of_another_station_is_ignored_and_guided_ignores_all(booted):
    ground = booted()
    ground.take_off(20.0)
    sticks(ground, 2.0, x=1000)
    assert abs(ground.fleet.velocity_m_s[0, 0]) < 0.1
    ground.encoder.system = 250
    ground.run(3.5)
    ground.mode(LOITER)
    sticks(ground, 3.0, x=1000)
    assert abs(ground.fleet.velocity_m_s[0, 0]) < 0.1
    assert ground.fleet.alt_rel_m[0] < 17.0


def test_modes_are_offered_one_by_one_with_junk_behind_their_names(booted):
    ground = booted()
    assert ground.command(512, 435, 0) == 0
    assert len(ground.of("AVAILABLE_MODES")) == 1
    first = ground.of("AVAILABLE_MODES")[0]
    assert (first["number_modes"], first["mode_index"], first["custom_mode"]) == (24, 1, 27)
    assert first["mode_name"].split(b"\0")[0] == b"AUTO RTL"
    assert first["mode_name"].split(b"\0")[1] != b"", "what lies in memory behind the name is sent, too"
    for index in range(1, 25):
        assert ground.command(512, 435, index) == 0
    assert ground.command(512, 435, 25) == 0
    modes = {m["mode_index"]: m["custom_mode"] for m in ground.of("AVAILABLE_MODES")}
    assert len(modes) == 24 and set(modes.values()) == {*range(8), 9, 11, *range(14, 26), 27, 28} - {8, 10, 13, 26}


@pytest.mark.parametrize(("msgid", "result", "reply"), [(162, 0, False), (259, 0, False), (300, 4, False),
    (436, 4, False), (111, 4, False), (397, 4, False), (125, 0, True), (152, 0, True), (42, 0, True)])  # fmt: skip
def test_an_acknowledged_request_is_no_proof_of_a_reply(booted, msgid, result, reply):
    ground = booted()
    since = len(ground.heard)
    assert ground.command(512, msgid) == result
    assert ([f.name for _, _, f in ground.heard[since:]] != ["COMMAND_ACK"]) is reply


def test_a_reboot_forgets_rates_and_mode_and_keeps_parameters_and_missions(booted):
    ground = booted()
    ground.param("RTL_ALT", 3000)
    ground.mode(GUIDED)
    ground.ask("ATTITUDE", 10)
    ground.run(1.0)
    assert ground.command(246, 1) == 0
    since = ground.fleet.now_s
    ground.run(4.0)
    assert ground.of("ATTITUDE", since_s=since + 0.1) == []
    assert ground.fleet.mode[0] == 0
    assert ground.fleet._pilots[0].platform.params["RTL_ALT"] == 3000
    assert "ArduPilot Ready" in ground.texts(since_s=since)
