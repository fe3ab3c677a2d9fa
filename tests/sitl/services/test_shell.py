"""PX4's shell, ArduPilot's serial ports, aircraft that are repeated, where the metadata is."""

import pytest

from tests.sitl.conftest import Ground

RESPOND, EXCLUSIVE = 2, 4


def type_in(ground: Ground, text: str, flags: int = RESPOND, seconds: float = 1.0) -> str:
    """What comes back."""
    since = len(ground.heard)
    ground.say("SERIAL_CONTROL", device=10, flags=flags, count=len(text), data=text.encode().ljust(70, b"\0"))
    ground.run(seconds, 0.01)
    replies = [f.fields for _, _, f in ground.heard[since:] if f.name == "SERIAL_CONTROL"]
    assert all((f["device"], f["flags"]) == (10, 1) for f in replies)
    return b"".join(bytes(f["data"])[: f["count"]] for f in replies).decode()


class TestShell:
    @pytest.fixture
    def ground(self, px4) -> Ground:
        return px4()

    def test_input_is_echoed_and_a_prompt_ends_the_answer(self, ground):
        assert type_in(ground, "\n") == "\npxh> "
        assert type_in(ground, "gps\n") == "gps\npxh> "
        assert type_in(ground, "uptime\n") == (
            "uptime\nInvalid command: uptime\ntype 'help' for a list of commands\npxh> "
        )

    def test_long_answers_come_in_pieces_of_70_bytes_4_ms_apart(self, ground):
        answer = type_in(ground, "help\n")
        assert answer.startswith("help\nBuiltin Commands:\n  actuator_test\n")
        pieces = [f["count"] for f in ground.of("SERIAL_CONTROL")]
        assert set(pieces[:-1]) == {70}
        times = ground.times("SERIAL_CONTROL")
        assert times[-1] - times[0] == pytest.approx(0.004 * (len(pieces) - 1), abs=0.02)

    def test_lines_may_come_in_parts_or_two_at_once(self, ground):
        assert type_in(ground, "gp") == ""
        assert type_in(ground, "s a\ngps b\n") == "gps a\npxh> gps b\npxh> "

    def test_without_respond_nothing_comes_and_it_is_closed(self, ground):
        type_in(ground, "gp")
        assert type_in(ground, "", flags=0) == ""
        assert type_in(ground, "s\n", flags=RESPOND | EXCLUSIVE).startswith("s\nInvalid command: s")

    def test_parameters(self, ground):
        assert "GF_ACTION" in type_in(ground, "param show GF_ACTION\n")
        assert "new: 3" in type_in(ground, "param set GF_ACTION 3\n")
        assert ground.fleet._pilots[0].platform.params["GF_ACTION"] == 3
        assert "not found" in type_in(ground, "param set NO_SUCH 3\n")

    def test_other_devices_are_silent(self, ground):
        ground.say("SERIAL_CONTROL", device=2, flags=RESPOND, count=1, data=(10, *(0,) * 69))
        ground.run(1.0)
        assert not ground.of("SERIAL_CONTROL")


class TestSerialPorts:
    @pytest.mark.parametrize(("device", "answers"), [(0, 0), (1, 0), (2, 1), (10, 0), (100, 1), (101, 0)])
    def test_two_of_them_answer(self, booted, device, answers):
        ground = booted()
        ground.say("SERIAL_CONTROL", device=device, flags=RESPOND, count=0, data=(0,) * 70)
        ground.run(1.0)
        assert len(ground.of("SERIAL_CONTROL")) == answers

    def test_taking_our_own_link_kills_it(self, booted):
        ground = booted()
        ground.say("SERIAL_CONTROL", device=100, flags=EXCLUSIVE, count=0, data=(0,) * 70)
        ground.heard.clear()
        ground.say("SERIAL_CONTROL", device=100, flags=0, count=0, data=(0,) * 70)
        ground.run(25.0)
        assert not ground.heard


class TestTraffic:
    def test_aircraft_are_repeated_only_if_set_up_and_asked_for(self, booted):
        ground = booted()
        for enabled, heard in ((0, 0), (1, 2)):
            ground.say("PARAM_SET", param_id=b"ADSB_TYPE", param_value=float(enabled), param_type=2)
            ground.ask("ADSB_VEHICLE", 1)
            ground.say("ADSB_VEHICLE", ICAO_address=0xABCDEF, lat=1, lon=2, altitude=3, callsign=b"TEST")
            ground.run(2.0)
            assert len(ground.of("ADSB_VEHICLE")) == heard
        assert ground.of("ADSB_VEHICLE")[-1]["ICAO_address"] == 0xABCDEF
        ground.run(10.0)
        ground.heard.clear()
        ground.run(3.0)
        assert not ground.of("ADSB_VEHICLE")


@pytest.mark.parametrize(("msgid", "field"), [(397, "uri"), (395, "general_metadata_uri")])
def test_px4_tells_where_its_metadata_is(px4, msgid, field):
    ground = px4()
    assert ground.command(512, msgid) == 0
    name = {397: "COMPONENT_METADATA", 395: "COMPONENT_INFORMATION"}[msgid]
    assert ground.of(name)[-1][field].rstrip(b"\0") == b"mftp://etc/extras/component_general.json.xz"


def test_a_log_download_refuses_arming_on_a_whole_vehicle(booted):
    ground = booted()
    ground.command(400, 1)
    ground.run(1.0)
    ground.command(400, 0)
    ground.say("LOG_REQUEST_LIST", start=0, end=0xFFFF)
    ground.run(0.1)
    assert ground.of("LOG_ENTRY")[-1]["num_logs"] == 1
    ground.say("LOG_REQUEST_DATA", id=1, ofs=0, count=90)
    assert "2 Arm: Downloading logs" in ground.answers(400, 1)
    ground.say("LOG_REQUEST_END")
    assert ground.command(400, 1) == 0
