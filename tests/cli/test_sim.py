"""`tui-gcs sim` and the faults of `tui-gcs demo`: what the options mean, and what is refused."""

import argparse
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.main import command_line_parser, main
from tui_gcs.cli.sim import _ranges, _relay, _start_lines
from tui_gcs.cli.sim_fleet import spec_of_options
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin

SCENARIO = Path(__file__).parents[2] / "tui_gcs/scenarios/swarm-challenge.toml"


@pytest.fixture(autouse=True)
def own_directories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TUI_GCS_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path / "state"))


def options(*arguments: str) -> argparse.Namespace:
    return command_line_parser().parse_args(["sim", *arguments])


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]):
    """refused(words…): the one line that says why."""

    def line(*arguments: str, command: str = "sim") -> str:
        code = main([command, *arguments])
        said = capsys.readouterr()
        assert (code, said.out) == (2, ""), said.err
        assert said.err.count("\n") == 1, said.err
        return said.err

    return line


# ---------------------------------------------------------------- who stands where


def test_a_count_gives_rows_from_home():
    vehicles = spec_of_options(options("--count", "5", "--home", "47.4,8.5,488,90", "--spacing", "20"))["vehicles"]
    assert [vehicle["system_id"] for vehicle in vehicles] == [1, 2, 3, 4, 5]
    frame = LocalFrame(Origin(47.4, 8.5, 488.0))
    places = [frame.to_enu(vehicle["lat_deg"], vehicle["lon_deg"]) for vehicle in vehicles]
    assert [(round(x), round(y)) for x, y in places] == [(0, 0), (20, 0), (40, 0), (0, 20), (20, 20)]
    assert {(vehicle["ground_amsl_m"], vehicle["heading_deg"]) for vehicle in vehicles} == {(488.0, 90.0)}


def test_without_a_home_they_stand_where_the_demo_is():
    (vehicle,) = spec_of_options(options("--count", "1"))["vehicles"]
    place = (vehicle["lat_deg"], vehicle["lon_deg"], vehicle["ground_amsl_m"])
    assert place == pytest.approx((52.072, -0.628, 110.0), abs=1e-9)


def test_autopilots_take_turns_in_a_mixed_fleet():
    vehicles = spec_of_options(options("--count", "4", "--autopilot", "mixed", "--first", "11"))["vehicles"]
    assert [(v["system_id"], v["autopilot"]) for v in vehicles] == [
        (11, "ardupilot"),
        (12, "px4"),
        (13, "ardupilot"),
        (14, "px4"),
    ]


def test_a_scenario_gives_places_and_seed_and_the_options_give_the_rest():
    spec = spec_of_options(options(str(SCENARIO), "--autopilot", "px4", "--wind", "3,-1", "--gps-noise", "0.5"))
    assert len(spec["vehicles"]) == 8
    assert {vehicle["autopilot"] for vehicle in spec["vehicles"]} == {"px4"}
    assert (spec["seed"], spec["wind_m_s"], spec["gps_noise_m"]) == (42, [3.0, -1.0], 0.5)
    assert spec_of_options(options(str(SCENARIO), "--seed", "7"))["seed"] == 7


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        ((), "--count 8"),
        (("--count", "0"), "--count 0"),
        (("--count", "251"), "within 1 to 250"),
        (("--count", "10", "--first", "245"), "within 1 to 250"),
        (("--count", "1", "--home", "52,0"), "--home 52,0: must be LAT,LON,AMSL"),
        (("--count", "1", "--home", "nan,0,0"), "--home nan"),
        (("--count", "1", "--home", "90,0,0"), "--home 90"),
        (("--count", "1", "--spacing", "0"), "--spacing 0"),
        (("--count", "1", "--wind", "30,0"), "--wind 30,0"),
        (("--count", "1", "--wind", "3"), "EAST,NORTH"),
        (("--count", "1", "--gps-noise", "-1"), "--gps-noise -1"),
        ((str(SCENARIO), "--count", "3"), "the scenario gives"),
    ],
)
def test_options_that_cannot_be(arguments, problem):
    with pytest.raises(CommandError, match=problem) as caught:
        spec_of_options(options(*arguments))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("--count", "2", "--fault", "loss=2"), "--fault loss=2: must be a share"),
        (("--count", "2", "--target", "14550"), "HOST:PORT"),
        (("--count", "2", "--speed", "0"), "--speed 0"),
        (("--count", "2", "--wipe"), "--real arducopter"),
        (("--count", "2", "--real", "px4", "--autopilot", "px4"), "--real names"),
        (("--count", "2", "--real", "px4", "--wind", "1,1"), "for our simulator"),
        (("--count", "2", "--real", "px4", "--fault", "loss=0.1"), "name another target"),
        (("--count", "2", "--real", "arducopter", "--binary", "/nowhere"), "--binary /nowhere"),
    ],
)
def test_nothing_starts_after_a_mistake(arguments, problem, refused):
    assert problem in refused(*arguments)


@pytest.mark.long
def test_the_demo_refuses_bad_faults_too(refused):
    assert "--fault delay=2: must be a time" in refused("--fault", "delay=2", command="demo")
    assert "--wind 30,0: must be EAST,NORTH" in refused("--wind", "30,0", "--headless", command="demo")


# ---------------------------------------------------------------- where they send, and what is told


def test_faults_and_px4s_only_port_need_a_proxy_between():
    assert _relay(options("--count", "1")) is None
    assert _relay(options("--count", "1", "--fault", "loss=0.1")).startswith("127.0.0.1:")
    assert _relay(options("--count", "1", "--real", "px4")) is None
    assert _relay(options("--count", "1", "--real", "px4", "--target", "10.0.0.5:14550")) == "127.0.0.1:14550"
    assert _relay(options("--count", "1", "--real", "arducopter", "--target", "127.0.0.1:14999")) is None


def test_it_is_told_who_sends_where_and_what_to_type_next():
    def told(*arguments: str) -> str:
        given = options(*arguments)
        return _start_lines(given, spec_of_options(given))

    mixed = told("--count", "3", "--autopilot", "mixed", "--fault", "loss=0.1")
    assert "3 vehicles (2 ArduPilot, 1 PX4), ids 1-3, send to 127.0.0.1:14550" in mixed
    assert "station: loss=0.1\n" in mixed
    assert "tui-gcs fly SCENARIO.toml --link udpin:127.0.0.1:14550 --kind sim\n" in mixed
    assert "no heading" in told("--count", "1", "--real", "px4", "--home", "47.4,8.5,488,90")
    assert "8 vehicles (real px4)" in told(str(SCENARIO), "--real", "px4")
    assert f"tui-gcs fly {SCENARIO} --link" in told(str(SCENARIO))
    elsewhere = told("--count", "1", "--target", "10.0.0.5:14550")
    assert "--kind sim" not in elsewhere
    assert "LIVE" in elsewhere


def test_ranges_of_ids():
    assert _ranges([3, 1, 2, 7]) == "1-3,7"
    assert _ranges([5]) == "5"


# ---------------------------------------------------------------- the real thing


@pytest.mark.process
def test_vehicles_come_through_the_faults_and_all_ends_with_the_command(tmp_path):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
        station.bind(("127.0.0.1", 0))
        station.settimeout(30.0)
        target = f"127.0.0.1:{station.getsockname()[1]}"
        command = [
            sys.executable,
            "-m",
            "tui_gcs.cli.main",
            "sim",
            "--count",
            "3",
            "--fault",
            "delay=20ms",
            "--target",
            target,
        ]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        heard: dict[int, tuple[str, int]] = {}
        while len(heard) < 3:
            data, address = station.recvfrom(2048)
            if data[0] == 0xFD:
                heard[data[5]] = address
        process.send_signal(signal.SIGTERM)
        reported, error = process.communicate(timeout=30.0)
    assert (process.returncode, error) == (0, "")
    assert set(heard) == {1, 2, 3}
    assert len(set(heard.values())) == 3
    assert "vehicles heard: 3" in reported


@pytest.mark.process
def test_real_programs_get_directories_of_their_own_under_the_state(tmp_path):
    program = tmp_path / "arducopter"
    program.write_text('#!/bin/sh\necho "$@" > called\necho no such model\nexit 1\n')
    program.chmod(0o755)
    command = [sys.executable, "-m", "tui_gcs.cli.main", "sim", "--count", "2", "--real", "arducopter"]
    command += ["--binary", str(program), "--home", "47.4,8.5,488", "--target", "127.0.0.1:15999"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert "ended with status 1" in done.stderr
    assert "    no such model\n" in done.stderr
    called = (tmp_path / "state/sim/real/arducopter-1/called").read_text()
    assert "--home 47.4000000,8.5000000,488,0" in called
    assert "--sysid 1 --serial0 udpclient:127.0.0.1:15999" in called


# ---------------------------------------------------------------- what else flies


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--count", "2", "--intruders", "4"], "name a SCENARIO.toml"),
        ([str(SCENARIO), "--sensor", "range=60"], "say how many"),
        ([str(SCENARIO), "--intruders", "0"], "1 to 64"),
        ([str(SCENARIO), "--intruders", "4", "--sensor", "reach=60"], "'reach=60' is none of range=1…2000"),
        ([str(SCENARIO), "--intruders", "4", "--sensor", "p=2"], "'p=2' is none of"),
    ],
)
def test_intruders_need_a_zone_and_a_sensor_that_can_be(arguments: list[str], problem: str) -> None:
    with pytest.raises(CommandError, match=re.escape(problem)):
        spec_of_options(options(*arguments))


def test_intruders_come_in_waves_to_the_defended_zone() -> None:
    spec = spec_of_options(options(str(SCENARIO), "--intruders", "4", "--sensor", "range=80,p=0.5"))
    assert spec["sensor"] == {"range_m": 80.0, "probability": 0.5}
    assert len(spec["intruders"]) == 80
    assert [90.0 <= i["begin_s"] <= 100.0 for i in spec["intruders"][:5]] == [True] * 4 + [False]
    assert spec["intruders"] == spec_of_options(options(str(SCENARIO), "--intruders", "4"))["intruders"], "same seed"
