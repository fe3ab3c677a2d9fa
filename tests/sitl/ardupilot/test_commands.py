"""Refusals with their acknowledgement and text, rates, parameters."""

import math

import pytest


@pytest.mark.parametrize(
    ("prepare", "command", "said"),
    [
        ([], (176, 1, 99), ["ack 4", "4 No such mode 99"]),
        ([], (176, 0, 4), ["ack 2"]),
        ([], (176, 1, 3), ["ack 0"]),
        ([(176, 1, 3)], (400, 1), ["ack 4", "2 Arm: Mode requires mission"]),
        ([(176, 1, 9)], (400, 1), ["ack 4", "2 Arm: LAND mode not armable"]),
        ([(176, 1, 4)], (22, 0, 0, 0, 0, 0, 0, 15), ["ack 4"]),
        ([(400, 1)], (22, 0, 0, 0, 0, 0, 0, 15), ["ack 4"]),
        ([(400, 1)], (400, 1), ["ack 0"]),
        ([(400, 1)], (400, 0), ["ack 0", "6 Disarming motors"]),
        ([(400, 1)], (241, 1), ["ack 4", "5 Disarm to allow calibration"]),
        ([(400, 1)], (176, 1, 3), ["ack 4", "4 Mode change to AUTO failed: init failed"]),
        ([(400, 1)], (246, 1), ["ack 4"]),
        ([], (9999,), ["ack 3"]),
        ([], (178, 1, -1), ["ack 4"]),
        ([], (192, 0), ["ack 3"]),
        ([], (511, 33, 2500), ["ack 2"]),
        ([], (511, 60000, 100000), ["ack 2"]),
        ([], (512, 300), ["ack 4"]),
        ([], (401,), ["ack 0"]),
        ([(400, 1, 21196)], (400, 0), ["ack 0", "6 Disarming motors"]),
    ],
)
def test_acknowledgement_and_text(booted, prepare, command, said):
    ground = booted()
    for earlier in prepare:
        assert ground.command(*earlier) == 0
    assert ground.answers(*command) == said


def test_a_region_of_interest_turns_the_nose_until_the_next_place(booted):
    """Measured: 195 and 201 as both messages, on the ground, too; 197 leaves the nose where it points."""
    ground = booted()
    west = (195, 0, 0, 0, 0, 52.0720, -0.6380, 100.0)
    assert ground.command(*west) == 0 and ground.command(196) == 3
    ground.take_off()
    assert ground.command(195, 0, 0, 0, 0, 520_720_000, -6_380_000, 100.0, form="INT", frame=0) == 0
    ground.run(5.0)
    assert math.degrees(ground.fleet._vehicles.yaw_rad[0]) == pytest.approx(270.0, abs=1.0)
    assert ground.command(197) == 0 and ground.command(195, 0, 0, 0, 0, 95.0, 0, 0) == 2
    ground.run(2.0)
    assert math.degrees(ground.fleet._vehicles.yaw_rad[0]) == pytest.approx(270.0, abs=1.0)


def test_refusals_in_flight(booted):
    ground = booted()
    ground.take_off()
    assert ground.answers(400, 0) == ["ack 4"]
    assert ground.answers(246, 1) == ["ack 4"]
    assert ground.answers(22, 0, 0, 0, 0, 0, 0, 30) == ["ack 4"]
    assert ground.fleet.armed[0]


def test_forced_disarm_in_flight_falls(booted):
    ground = booted()
    ground.take_off(30.0)
    assert ground.command(400, 0, 21196) == 0
    ground.run(5.0)
    assert ground.fleet.alt_rel_m[0] == 0.0


def test_prearm_checks_say_why(booted):
    ground = booted()
    ground.say("PARAM_SET", param_id=b"ANGLE_MAX", param_value=100.0, param_type=4)
    assert ground.answers(401) == ["ack 0", "2 PreArm: Check ANGLE_MAX"]
    assert ground.answers(400, 1) == ["ack 4", "2 Arm: Check ANGLE_MAX"]
    since = ground.fleet.now_s
    ground.run(30.0)
    assert ground.texts(since_s=since).count("PreArm: Check ANGLE_MAX") >= 1


def test_acknowledgement_goes_to_who_asked(booted):
    ground = booted()
    ground.command(401)
    ack = ground.of("COMMAND_ACK")[-1]
    assert (ack["target_system"], ack["target_component"]) == (255, 190)


def test_set_mode_message_works_without_acknowledgement(booted):
    ground = booted()
    ground.say("SET_MODE", base_mode=1, custom_mode=4)
    ground.run(1.1)
    assert ground.of("HEARTBEAT")[-1]["custom_mode"] == 4
    assert not ground.of("COMMAND_ACK")


def test_commands_for_another_system_are_ignored_component_is_not_checked(booted):
    ground = booted()
    ground.say("COMMAND_LONG", command=401, target_system=7)
    ground.listen()
    assert not ground.of("COMMAND_ACK")
    for component in (0, 25, 190):
        ground.say("COMMAND_LONG", command=401, target_component=component)
    ground.say("COMMAND_LONG", command=401, target_system=0)
    ground.listen()
    assert len(ground.of("COMMAND_ACK")) == 4


@pytest.mark.parametrize("hz", [1, 2, 5, 10, 50])
def test_message_rates_are_exact(booted, hz):
    ground = booted()
    assert ground.ask("ATTITUDE", hz) == 0
    ground.run(10.0)
    assert len(ground.of("ATTITUDE")) == 10 * hz


def test_intervals_are_whole_milliseconds_can_be_read_and_switched_off(booted):
    ground = booted()
    ground.command(511, 30, 33_333)
    ground.command(510, 30)
    assert ground.of("MESSAGE_INTERVAL")[-1] == {"interval_us": 33_000, "message_id": 30}
    ground.command(511, 30, -1)
    ground.run(2.0)
    assert not ground.of("ATTITUDE")


def test_data_streams_are_a_base_that_message_intervals_override(booted):
    ground = booted()
    ground.say("REQUEST_DATA_STREAM", req_stream_id=0, req_message_rate=4, start_stop=1)
    ground.command(511, 30, 100_000)
    ground.run(5.0)
    assert (len(ground.of("GLOBAL_POSITION_INT")), len(ground.of("ATTITUDE"))) == (20, 50)
    assert not ground.of("EXTENDED_SYS_STATE")
    ground.command(511, 30, 0)
    since = ground.fleet.now_s
    ground.run(5.0)
    assert len(ground.of("ATTITUDE", since_s=since + 0.01)) == 20


def test_token_is_in_the_version(booted):
    ground = booted(token="00112233445566ff")
    assert ground.command(512, 148) == 0
    version = ground.of("AUTOPILOT_VERSION")[-1]
    assert bytes(version["flight_custom_version"]).hex() == "00112233445566ff"
    assert version["capabilities"] == 64495


def test_home_position_on_request(booted):
    ground = booted()
    assert ground.command(512, 242) == 0
    home = ground.of("HOME_POSITION")[-1]
    assert (home["latitude"], home["longitude"], home["altitude"]) == (520720000, -6280000, 110000)
    assert math.isnan(home["q"][0])


def test_timesync_is_answered(booted):
    ground = booted()
    ground.say("TIMESYNC", tc1=0, ts1=123456789)
    ground.listen()
    answer = ground.of("TIMESYNC")[-1]
    assert answer["ts1"] == 123456789
    assert answer["tc1"] == pytest.approx(3.2e9)
