"""PX4 on the wire: signed frames, unasked streams, texts, events, messages on request."""

import pytest

from sitl.launch.fleet import SimFleet, VehicleSpec
from sitl.px4.modes import OFFBOARD
from tests.sitl.conftest import HOLD, LAT_DEG, LON_DEG, Ground, specs, text_of

OFFBOARD_MAIN = 6
DENIED_TEXT = b"Arming denied: Resolve system health failures first\t"


def silent(**options):
    """A vehicle that nobody talks to."""
    ground = Ground(SimFleet(specs(1, "px4"), **options))
    ground.run(4.0)
    return ground


def test_streams_at_once_and_every_frame_is_signed_with_a_zero_key_and_a_clock_from_0():
    ground = silent()
    raws = [data for _, data in ground.raw]
    assert all(data[0] == 0xFD and data[2] == 1 for data in raws)
    stamps = [int.from_bytes(data[-12:-6], "little") for data in raws]
    assert stamps == list(range(1, len(raws) + 1))
    names = {frame.name for _, _, frame in ground.heard}
    assert {"HEARTBEAT", "ATTITUDE", "GLOBAL_POSITION_INT", "SYS_STATUS", "BATTERY_STATUS", "CURRENT_MODE"} <= names
    assert "RC_CHANNELS" not in names
    assert len(ground.of("GLOBAL_POSITION_INT", since_s=2.0)) == pytest.approx(10, abs=1)


def test_its_sitl_start_script_wants_fifty_hertz():
    spec = VehicleSpec(1, LAT_DEG, LON_DEG, 110.0, autopilot="px4", sitl_rates=True)
    ground = Ground(SimFleet([spec]))
    ground.run(4.0)
    for name in ("ATTITUDE", "GLOBAL_POSITION_INT", "SERVO_OUTPUT_RAW", "ATTITUDE_TARGET"):
        assert len(ground.of(name, since_s=2.0)) == pytest.approx(100, abs=3)
    per_second = len([t for t, _, _ in ground.heard if t > 2.0]) / 2.0
    assert per_second == pytest.approx(368, rel=0.1)


def test_boots_in_hold_first_not_ready_then_standby():
    ground = silent()
    beats = ground.of("HEARTBEAT")
    assert {(b["custom_mode"], b["autopilot"], b["base_mode"]) for b in beats} == {(HOLD, 12, 0x1D)}
    assert beats[0]["system_status"] == 0
    assert beats[-1]["system_status"] == 3
    assert ground.of("CURRENT_EVENT_SEQUENCE")[0]["flags"] == 1


def test_numbers_of_events_begin_just_before_their_wrap(px4):
    ground = px4()
    sequences = [e["sequence"] for e in ground.of("EVENT")]
    assert sequences[0] == 65526
    assert sequences == [(65526 + k) & 0xFFFF for k in range(len(sequences))]
    assert 0 in sequences


def test_texts_wait_for_a_ground_station_for_5_s():
    ground = silent()
    ground.command(176, 1, OFFBOARD_MAIN)
    ground.command(400, 1)
    ground.run(4.0)
    assert ground.texts() == []
    assert "commander_arm_denied_resolve_failures" in ground.events()
    ground.say("HEARTBEAT", type=18)
    ground.listen()
    assert ground.texts() == [], "an onboard computer is no ground station"
    ground.say("HEARTBEAT", type=6)
    ground.listen()
    assert "".join(ground.texts()).encode() == DENIED_TEXT
    ground.run(3.0)
    ground.command(400, 1)
    ground.run(5.5)
    since = ground.fleet.now_s
    ground.say("HEARTBEAT", type=6)
    ground.listen()
    assert ground.texts(since_s=since) == [], "too old"


def test_a_long_text_comes_in_chunks_with_a_tab_and_as_an_event(px4):
    ground = px4()
    ground.acks(176, 1, OFFBOARD_MAIN)
    since = ground.fleet.now_s
    assert ground.acks(400, 1) == [1]
    chunks = ground.of("STATUSTEXT", since_s=since)
    assert [(c["severity"], c["chunk_seq"], c["text"].rstrip(b"\0")) for c in chunks] == [
        (2, 0, DENIED_TEXT[:50]),
        (2, 1, DENIED_TEXT[50:]),
    ]
    assert chunks[0]["id"] == chunks[1]["id"]
    assert "commander_arm_denied_resolve_failures" in ground.events(since_s=since)


def test_lost_events_can_be_asked_for_as_long_as_they_are_kept(px4):
    ground = px4()
    for _ in range(12):
        assert ground.command(400, 1) == 0
        assert ground.command(400, 0) == 0
    said = ground.of("EVENT")
    assert len(said) > 30
    last, gone = said[-2], said[0]
    since = len(ground.of("EVENT"))
    for wanted in (last, gone):
        ground.say("REQUEST_EVENT", first_sequence=wanted["sequence"], last_sequence=wanted["sequence"])
    ground.listen()
    again = ground.of("EVENT")[since:]
    assert [(e["id"], e["sequence"], e["destination_system"]) for e in again] == [(last["id"], last["sequence"], 255)]
    error = ground.of("RESPONSE_EVENT_ERROR")[-1]
    assert (error["sequence"], error["sequence_oldest_available"]) == (gone["sequence"], said[-20]["sequence"])


def test_why_it_cannot_be_armed_is_in_events_only(px4):
    ground = px4()
    summary = next(e for e in ground.of("EVENT") if e["id"] == 0x1A893E0)
    assert summary["log_levels"] == 0x88
    ready = [e for e in ground.of("EVENT") if e["id"] == 0x1A893E0][-1]
    assert bytes(ready["arguments"][:17]).hex() == "000000100080000000b03a7f80b03a7f80", "as recorded"
    assert {"check_modes_mission", "check_modes_offboard_signal", "check_modes_manual_control"} <= set(ground.events())


def test_a_message_comes_before_its_acknowledgement_and_unknown_ones_are_denied(px4):
    ground = px4()
    since = len(ground.heard)
    assert ground.command(512, 148) == 0
    assert [f.name for _, _, f in ground.heard[since:]] == ["AUTOPILOT_VERSION", "COMMAND_ACK"]
    assert ground.of("AUTOPILOT_VERSION")[-1]["capabilities"] == 0xE8FF
    assert ground.command(512, 300) == 0
    assert ground.of("PROTOCOL_VERSION")[-1]["max_version"] == 200
    assert ground.command(512, 32) == 0
    assert ground.command(512, 9999) == 2


def test_interval_0_is_the_modes_rate_and_unknown_ids_fail(px4):
    ground = px4()
    assert ground.command(511, 30, 20_000) == 0
    ground.beat(2.0)
    assert len(ground.of("ATTITUDE", since_s=ground.fleet.now_s - 1.0)) == pytest.approx(50, abs=3)
    assert ground.command(511, 30, 0) == 0
    ground.beat(2.0)
    assert len(ground.of("ATTITUDE", since_s=ground.fleet.now_s - 1.0)) == pytest.approx(15, abs=1)
    assert ground.command(511, 30, -1) == 0
    since = ground.fleet.now_s
    ground.beat(2.0)
    assert ground.of("ATTITUDE", since_s=since) == []
    assert ground.command(511, 9999, 100_000) == 4


def test_modes_are_offered_all_at_once_and_the_usual_ones_have_no_name(px4):
    ground = px4()
    assert ground.command(512, 435, 0) == 0
    modes = ground.of("AVAILABLE_MODES")
    assert [m["mode_index"] for m in modes] == list(range(1, 27))
    names = {m["custom_mode"]: (m["standard_mode"], m["mode_name"].rstrip(b"\0")) for m in modes}
    assert names[HOLD] == (0, b"Hold")
    assert names[OFFBOARD] == (0, b"Offboard")
    assert names[3 << 16] == (1, b"")
    assert sum(m["properties"] == 2 for m in modes) == 8
    assert ground.command(512, 435, 5) == 0
    assert ground.of("AVAILABLE_MODES")[-1]["custom_mode"] == HOLD


def test_a_foreign_component_gets_no_answer(px4):
    ground = px4()
    ground.say("COMMAND_LONG", command=400, param1=1.0, target_component=42)
    ground.beat(1.0)
    assert ground.of("COMMAND_ACK") == []
    assert not ground.fleet.armed[0]


def test_it_is_silent_before_it_has_booted():
    ground = Ground(SimFleet(specs(1, "px4")))
    ground.run(0.3)
    ground.say("COMMAND_LONG", command=400, param1=1.0)
    ground.run(0.3)
    assert ground.heard == []


def test_after_a_restart_clock_numbers_and_events_begin_anew(px4):
    ground = px4()
    assert ground.of("ATTITUDE")[-1]["time_boot_ms"] > 3000
    ground.fleet.power_cycle(0)
    since = ground.fleet.now_s
    count = len(ground.raw)
    ground.run(3.0)
    again = [data for _, data in ground.raw[count:]]
    assert again[0][4] == 0
    assert ground.of("ATTITUDE", since_s=since + 0.01)[0]["time_boot_ms"] < 1500
    assert ground.of("HEARTBEAT", since_s=since + 0.01)[0]["system_status"] == 0
    assert ground.of("CURRENT_EVENT_SEQUENCE", since_s=since + 0.01)[0]["flags"] == 1
    assert ground.of("EVENT", since_s=since + 0.01)[0]["sequence"] == 65526


def test_text_ids_count_every_text(px4):
    ground = px4()
    ground.command(400, 1)
    ground.command(400, 0)
    ground.listen()
    ids = [f["id"] for f in ground.of("STATUSTEXT")]
    assert ids == [0, 1]
    assert [text_of(f) for _, _, f in ground.heard if f.name == "STATUSTEXT"][1] == "Disarmed by external command\t"


def test_a_mixed_fleet_is_one_run():
    def run():
        fleet = SimFleet([*specs(1), *specs(3, "px4")[1:]], seed=3)
        ground = Ground(fleet)
        ground.run(5.0)
        return ground.raw

    first = run()
    assert first == run()
    assert {index for index, _ in first} == {0, 1, 2}
