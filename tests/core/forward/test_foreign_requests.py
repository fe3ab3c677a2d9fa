"""Forwarding in: what other stations may have passed on to vehicles, and how little a stranger can do."""

import re

import pytest
from fastcrc.crc16 import mcrf4xx
from hypothesis import given
from hypothesis import strategies as st

from tests.core.rigs.forward_rig import KEY, OWN, QGC, TEXT, Rig, any_frame, command_long, hold, link, messages
from tui_gcs.core.forward.command_rules import MESSAGES
from tui_gcs.core.forward.request_checks import ForeignRequest, Ruling
from tui_gcs.core.mavlink.dialect import layout
from tui_gcs.core.mavlink.signing import sign
from tui_gcs.core.mavlink.sources import Address

MP: Address = ("192.0.2.8", 14551)


# ---------------------------------------------------------------- commands in


def test_without_leave_everything_is_counted_and_ignored() -> None:
    flight = Rig(link("udpin:a"), commands=False)
    for _ in range(5):
        hold(flight)
        flight.command(400, 1)
    assert not flight.uplink.taken and not flight.links[0].sent and not flight.texts()
    assert flight.forwarder.refused == {"it only listens": 10}
    (partner,) = flight.forwarder.ports[0].partners.values()
    assert partner.refused == {"it only listens": 10}, "the links screen shows it beside the partner"


def test_an_allowed_command_goes_to_the_door_unchanged_with_its_source() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    passed: list[tuple[int, str, str]] = []
    flight.forwarder.on_passed.append(
        lambda vehicle, ruling, station: passed.append((vehicle.id, ruling.what, station))
    )
    raw = flight.command(400, 1)
    assert passed == [(1, "arm", "udpin:a 192.0.2.7:14550 252/190")]
    assert flight.uplink.taken == [(1, raw, "arm", "udpin:a 192.0.2.7:14550 252/190")]
    assert flight.forwarder.passed == 1 and not flight.forwarder.refused
    assert flight.texts() == ["192.0.2.7:14550 252/190: arm, vehicle 1"]
    assert not flight.links[0].sent, "the vehicle answers"


def test_a_refused_command_is_answered_as_its_vehicle_would_and_the_same_once_a_second() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    for _ in range(20):
        flight.command(400, 0, 21196)
        flight.clock.advance(0.25)
    answers = messages(flight.links[0], QGC)
    assert [a.name for a in answers] == ["COMMAND_ACK", "STATUSTEXT"] * 5
    assert {(a.system, a.component) for a in answers} == {(1, 1)}, "programs look for answers of the vehicle only"
    wanted = {"command": 400, "result": 2, "target_system": 252, "target_component": 190}
    assert answers[0].fields.items() >= wanted.items()
    assert answers[1].fields["text"] == f"Station {OWN}: a forced arming or disarming"
    assert flight.forwarder.refused == {"by the rules": 20}
    assert flight.texts() == [
        "192.0.2.7:14550 252/190: COMMAND_LONG refused: vehicle 1: a forced arming or disarming"
    ], "the same once in 30 s"


def test_two_refusals_within_a_second_are_both_answered_and_a_flood_is_not() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    flight.command(400, 0, 21196)
    flight.command(185, 1)
    assert [a.fields["command"] for a in messages(flight.links[0], QGC) if a.name == "COMMAND_ACK"] == [400, 185]
    for command in range(30_000, 31_000):
        flight.command(command)
    assert len([a for a in messages(flight.links[0], QGC) if a.name == "COMMAND_ACK"]) < 20


@pytest.mark.parametrize(("autopilot", "acknowledged"), [(3, 11), (12, 176)])
def test_a_refused_mode_is_acknowledged_as_the_autopilot_does(autopilot: int, acknowledged: int) -> None:
    flight = Rig(link("udpin:a"), commands=True)
    to = {3: 1, 12: 2}[autopilot]
    flight.say("SET_MODE", target_system=to, base_mode=0, custom_mode=1)
    ack, text, _ = messages(flight.links[0], QGC)
    assert (ack.name, ack.system, ack.fields["command"], ack.fields["result"]) == ("COMMAND_ACK", to, acknowledged, 2)
    assert text.fields["text"] == f"Station {OWN}: a mode without its number (base mode "


def test_a_refused_parameter_is_answered_with_the_value_that_the_vehicle_has() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    flight.say("PARAM_SET", **TO, param_id="BATT_X", param_value=0.0, param_type=9)
    assert flight.uplink.asked == [(1, "PARAM_REQUEST_READ", {"param_id": "BATT_X", "param_index": -1})]
    assert [m.name for m in messages(flight.links[0], QGC)] == ["STATUSTEXT"] * 2


def test_file_transfer_is_refused_in_its_own_protocol() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    payload = [7, 1, 3, 4, 0, 0, 0, 0, 0, 0, 0, 0] + [0] * 239  # sequence 263, session 3, open for reading
    flight.say("FILE_TRANSFER_PROTOCOL", **TO, target_network=0, payload=payload)
    answer, _ = messages(flight.links[0], QGC)[:2]
    assert answer.fields["payload"][:13] == (8, 1, 3, 129, 1, 4, 0, 0, 0, 0, 0, 0, 1)


def test_a_text_longer_than_one_statustext_comes_in_joined_chunks() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    flight.say("PARAM_SET", **TO, param_id="ATC_RAT_RLL_P", param_value=0.0, param_type=9)
    chunks = [m.fields for m in messages(flight.links[0], QGC)]
    text = f"Station {OWN}: parameter ATC_RAT_RLL_P: it is armed, and this station relies on its parameters in flight"
    assert "".join(chunk["text"] for chunk in chunks) == text
    assert {chunk["id"] for chunk in chunks} == {1} and [chunk["chunk_seq"] for chunk in chunks] == [0, 1, 2]


def test_a_set_point_is_answered_with_a_text_now_and_then() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    for _ in range(100):
        flight.say("SET_POSITION_TARGET_GLOBAL_INT", **TO, **POINT, lat_int=0, lon_int=0, alt=0)
        flight.clock.advance(0.1)
    assert [(m.name, m.system) for m in messages(flight.links[0], QGC)] == [("STATUSTEXT", 1)] * 2


def test_different_refusals_are_told_at_most_once_a_second() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    for k in range(40):
        flight.command(1 + k % 15)
        flight.clock.advance(0.25)
    assert len(flight.texts()) == 10
    assert flight.texts()[1].endswith("(3 more since the last such line)")


def test_what_the_door_refuses_is_told_and_answered() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    flight.uplink.why_not = "arm: nothing has been heard of it"
    flight.command(400, 1)
    assert flight.forwarder.refused == {"by the uplink": 1} and flight.forwarder.passed == 0
    assert flight.texts() == [
        "192.0.2.7:14550 252/190: COMMAND_LONG refused: vehicle 1: arm: nothing has been heard of it"
    ]
    assert [m.name for m in messages(flight.links[0], QGC)] == ["COMMAND_ACK", "STATUSTEXT"]


@pytest.mark.parametrize("to", [0, 3, 77, OWN])
def test_a_command_must_name_a_vehicle_of_this_network(to: int) -> None:
    flight = Rig(link("udpin:a"), commands=True)
    hold(flight, to=to)
    assert not flight.uplink.taken
    assert flight.forwarder.refused == {"no such vehicle": 1}
    assert flight.texts()[0].endswith("by its id" if to == 0 else f"there is no system {to} here")


def test_an_endpoint_commands_its_own_network() -> None:
    flight = Rig(link("udpin:n", network="north"), commands=True)
    hold(flight, to=3)
    hold(flight, to=1)
    assert [number for number, *_ in flight.uplink.taken] == [1003]
    flight.beat(system=1)  # an id of the other network is free here
    assert flight.forwarder.refused == {"no such vehicle": 1}


@pytest.mark.parametrize(
    ("system", "reason"), [(0, "system id 0"), (1, "a vehicle's system id"), (OWN, "our own system id")]
)
def test_who_speaks_with_an_id_that_is_not_his_is_not_listened_to(system: int, reason: str) -> None:
    flight = Rig(link("udpin:a"), commands=True)
    for _ in range(100):
        hold(flight, system=system)
        flight.clock.advance(0.5)
    assert not flight.uplink.taken and not flight.links[0].sent
    assert flight.forwarder.refused == {reason: 100}
    assert len(flight.texts()) == 2, "once in 30 s"


def test_a_wrong_crc_is_refused_and_told_once_in_30_s() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    broken = bytearray(flight.frame("COMMAND_LONG", **command_long(193)))
    broken[20] ^= 0xFF
    for _ in range(70):
        flight.links[0].inject(bytes(broken), QGC)
        flight.forwarder.tick()
        flight.clock.advance(1.0)
    assert not flight.uplink.taken
    assert flight.forwarder.refused == {"bad CRC": 70}
    assert len(flight.texts()) == 3 and flight.texts()[0] == "192.0.2.7:14550 sends frames with a wrong CRC: not used"


STICKS = {"x": 0, "y": 0, "z": 500, "r": 0, "buttons": 0}
TO = {"target_system": 1, "target_component": 1}
POINT = {"time_boot_ms": 0, "coordinate_frame": 6, "type_mask": 0, "vx": 0, "vy": 0, "vz": 0}
POINT |= {"afx": 0, "afy": 0, "afz": 0, "yaw": 0, "yaw_rate": 0}
CHANNELS = {f"chan{i}_raw": 1500 for i in range(1, 9)}
ATTITUDE = {"time_boot_ms": 0, "type_mask": 0, "q": [1, 0, 0, 0], "thrust": 1}
ATTITUDE |= {"body_roll_rate": 0, "body_pitch_rate": 0, "body_yaw_rate": 0}


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("MANUAL_CONTROL", {"target": 1} | STICKS),
        ("RC_CHANNELS_OVERRIDE", TO | CHANNELS),
        ("SET_ACTUATOR_CONTROL_TARGET", TO | {"time_usec": 0, "group_mlx": 0, "controls": [0] * 8}),
        ("SET_ATTITUDE_TARGET", TO | ATTITUDE),
        ("SET_POSITION_TARGET_GLOBAL_INT", TO | POINT | {"lat_int": 0, "lon_int": 0, "alt": 0}),
        ("SET_POSITION_TARGET_LOCAL_NED", TO | POINT | {"x": 0, "y": 0, "z": 0}),
        ("SETUP_SIGNING", KEY),
    ],
)
def test_set_points_sticks_and_keys_never_come_in(name: str, fields: dict[str, object]) -> None:
    flight = Rig(link("udpin:a"), commands=True)
    flight.say(name, **fields)
    assert not flight.uplink.taken
    assert flight.forwarder.refused == {name: 1}
    assert flight.texts() == [f"192.0.2.7:14550 252/190 sends {name}: never passed on"]


def test_heartbeats_and_other_telemetry_of_stations_end_here() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    flight.beat()
    flight.say("STATUSTEXT", **TEXT)
    flight.say("GPS_RTCM_DATA", flags=0, len=1, data=[0] * 180)
    flight.say("SERIAL_CONTROL", device=100, flags=3, timeout=0, baudrate=0, count=0, data=[0] * 70)
    assert not flight.uplink.taken and not flight.texts()
    assert flight.forwarder.dropped == {"not for a vehicle": 4}


def test_what_is_not_on_the_list_is_told_once_in_a_while() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    flight.say("LOG_ERASE", **TO)
    flight.say("GPS_INJECT_DATA", **TO, len=1, data=[0] * 110)
    assert not flight.uplink.taken
    assert flight.forwarder.refused == {"not on the list": 2}
    assert flight.texts() == ["192.0.2.7:14550 252/190 sends LOG_ERASE for vehicle 1: not passed on"]


def test_a_frame_with_more_in_it_than_we_can_read_is_not_passed_on() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    known = layout(76)
    assert known is not None
    payload = known.pack(*[0.0] * 4, *[0.0] * 3, 193, 1, 1, 0) + b"\x01"
    longer = version2(76, payload, known.extra)
    flight.links[0].inject(longer, QGC)
    flight.forwarder.tick()
    assert flight.forwarder.refused == {"longer than its message": 1} and not flight.uplink.taken


def version2(msgid: int, payload: bytes, extra: bytes) -> bytes:
    """A frame with any payload and a good CRC."""
    body = bytes((len(payload), 0, 0, 0, 252, 190)) + msgid.to_bytes(3, "little") + payload
    return b"\xfd" + body + mcrf4xx(body + extra).to_bytes(2, "little")


# ---------------------------------------------------------------- keys


def test_unsigned_frames_for_a_vehicle_with_a_key_are_refused_and_not_signed_by_us() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    flight.vehicles[1].identity.keyed = True
    raw = hold(flight)
    assert flight.forwarder.refused == {"not signed": 1}
    assert "takes signed frames only" in flight.texts()[0]
    signed = sign(raw, b"k" * 32, 1, 10**9)
    flight.links[0].inject(signed, QGC)
    flight.forwarder.tick()
    assert [taken for _, taken, *_ in flight.uplink.taken] == [signed], "the uplink and the vehicle judge the signature"


# ---------------------------------------------------------------- how much


def test_fifty_a_second_per_endpoint_and_a_hold_does_not_wait() -> None:
    flight = Rig(link("udpin:a"), link("udpin:b"), commands=True)
    for _ in range(500):
        flight.clock.advance(0.002)
        flight.say("PARAM_REQUEST_LIST", **TO)
    assert 95 <= len(flight.uplink.taken) <= 101, "50 at once, 50 in the second after"
    assert flight.forwarder.refused.keys() == {"too many"}
    raw = hold(flight)
    assert flight.uplink.taken[-1][1:3] == (raw, "hold")
    flight.command(400, 1)
    assert flight.uplink.whats[-1] == "hold", "arming waits like everything else"
    other = flight.frame("PARAM_REQUEST_LIST", **TO)
    flight.links[1].inject(other, MP)
    flight.forwarder.tick()
    assert flight.uplink.taken[-1][1] == other


def test_stops_are_bounded_too() -> None:
    flight = Rig(link("udpin:a"), commands=True)
    for _ in range(500):
        hold(flight)
    assert flight.uplink.whats == ["hold"] * 50
    flight.clock.advance(1000.0)
    for _ in range(500):
        hold(flight)
    assert flight.uplink.whats == ["hold"] * 100, "a pause saves up nothing"


def test_what_is_too_much_is_not_even_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    flight = Rig(link("udpin:a"), commands=True)
    judged: list[ForeignRequest] = []
    monkeypatch.setattr(
        "tui_gcs.core.forward.forwarder.judge", lambda asked: judged.append(asked) or Ruling("reposition")
    )
    for _ in range(500):
        flight.command(192)
    assert len(judged) == 50


# ---------------------------------------------------------------- streams


def test_a_stream_is_cut_per_sender_wherever_the_pieces_end() -> None:
    flight = Rig(link("tcpin:a", stream=True), commands=True)
    mine, theirs = (flight.frame("COMMAND_LONG", system, **command_long(193)) for system in (252, 251))
    for a, b in zip(mine, theirs, strict=True):
        flight.links[0].inject(bytes((a,)), QGC)
        flight.links[0].inject(bytes((b,)), MP)
    flight.forwarder.tick()
    assert [raw for _, raw, *_ in flight.uplink.taken] == [mine, theirs]


def test_a_stream_that_begins_anew_forgets_its_half_frame_and_a_pause_ends_one() -> None:
    flight = Rig(link("tcpin:a", stream=True), commands=True)
    raw = flight.frame("COMMAND_LONG", **command_long(193))
    for data in (raw[:20], b"", raw):
        flight.links[0].inject(data, QGC)
    flight.forwarder.tick()
    assert [taken for _, taken, *_ in flight.uplink.taken] == [raw]
    assert not flight.forwarder.refused
    flight.links[0].inject(b"\xfd\xff\x00" + raw, QGC)  # noise that announces a long frame
    flight.forwarder.tick()
    assert len(flight.uplink.taken) == 1
    flight.clock.advance(0.6)
    flight.forwarder.tick()
    assert [taken for _, taken, *_ in flight.uplink.taken] == [raw, raw]


def test_senders_of_streams_are_bounded() -> None:
    flight = Rig(link("tcpin:a", stream=True), commands=True)
    for port in range(1000):
        flight.links[0].inject(b"\xfd\xff", ("192.0.2.7", port))
    flight.forwarder.tick()
    assert len(flight.forwarder.ports[0]._streams) == 16


# ---------------------------------------------------------------- anything

DATA = st.lists(st.one_of(any_frame(), st.binary(max_size=600)), max_size=6)


@given(DATA, st.booleans(), st.booleans())
def test_nothing_on_an_endpoint_raises_and_only_frames_on_the_list_reach_the_door(
    chunks: list[bytes], stream: bool, together: bool
) -> None:
    flight = Rig(link("any:a", stream=stream), commands=True)
    for data in [b"".join(chunks)] if together else chunks:
        flight.links[0].inject(data, QGC)
        flight.forwarder.tick()
        flight.clock.advance(0.7)
        flight.forwarder.tick()
    for number, raw, what, source in flight.uplink.taken:
        known = layout(int.from_bytes(raw[7:10], "little"))
        assert known is not None and known.name in MESSAGES
        assert raw[0] == 0xFD and raw in b"".join(chunks)
        assert raw[10 + known.target_system_at] == number and number in (1, 2)
        assert raw[5] not in (0, 1, OWN) and what and re.fullmatch(r"any:a 192\.0\.2\.7:14550 \d+/\d+", source)
    assert all(len(text) < 300 and text.isprintable() for text in flight.texts())
    answers = {"COMMAND_ACK", "FILE_TRANSFER_PROTOCOL", "MISSION_ACK", "MISSION_REQUEST", "STATUSTEXT"}
    assert {m.name for m in messages(flight.links[0])} <= answers | {"MISSION_REQUEST_INT"}
