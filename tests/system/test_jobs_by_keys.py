"""What a fleet needs beside its flights, by an operator with nothing but keys and what the screen shows.

Real processes at 1x: an alarm, its moment in the vehicle's log and its cause in the parameters of eight; the vehicle
with the worst link; a calibration of both autopilots. About two minutes each.
"""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.core.rigs.link_rig import free_port
from tests.rigs.pty_operator import DELETE, DOWN, ENTER, TAB, Operator, end_programs

pytestmark = [pytest.mark.process, pytest.mark.by_keys, pytest.mark.xdist_group("operator")]
SIZES = {"80x24": (80, 24), "120x40": (120, 40)}
SCENARIO = Path(__file__).parents[2] / "tui_gcs" / "scenarios" / "swarm-challenge.toml"
POSES = ("level", "on its left side", "on its right side", "nose down", "nose up", "on its back")
LINK_ROW = re.compile(r"│ [! ] *(\d+) +(?:yes|ok|NO) +([\d.]+) ")


@pytest.fixture(autouse=True)
def programs(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for name in ("RUNTIME", "STATE"):
        monkeypatch.setenv(f"TUI_GCS_{name}_DIR", str(tmp_path_factory.mktemp(name[0])))
    yield
    end_programs()


def demo(*options: str) -> pytest.MarkDecorator:
    """A console of `tui-gcs demo OPTIONS`, on the smallest terminal and on a usual one."""
    consoles = [(["demo", *options], *size) for size in SIZES.values()]
    return pytest.mark.parametrize("operator", consoles, indirect=True, ids=list(SIZES))


@pytest.fixture
def operator(request: pytest.FixtureRequest) -> Iterator[Operator]:
    one = Operator(*request.param)
    yield one
    one.console.end()


def run(*arguments: str) -> None:
    """`tui-gcs ARGUMENTS` from another shell; it succeeds."""
    done = subprocess.run(
        [sys.executable, "-m", "tui_gcs.cli.main", *arguments], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stdout + done.stderr


def screen(operator: Operator, letter: str, shows: str) -> None:
    """Open a screen by the menu of all screens."""
    operator.press("S", " Esc = close")
    operator.press(letter, shows)


def select(operator: Operator, words: str, selected: str) -> None:
    """Select vehicles by name."""
    operator.press("s", "select _")
    operator.press(words, f"select {words}_")
    operator.press(ENTER, f"selected {selected}")


@demo()
def test_an_alarm_its_moment_in_the_log_and_its_cause(operator: Operator) -> None:
    operator.sees("ready 8/8", 60.0)
    operator.press(" ", "Enter = start")
    operator.press(ENTER, "begun for all 8")
    operator.sees("armed 8", 60.0)
    for name, value in (("BATT_FS_LOW_ACT", "2"), ("BATT_LOW_VOLT", "13")):  # by somebody else, on one vehicle
        run("vehicle", "params", "set", "3", name, value, "--yes")
    operator.sees("FAILSAFE on board: vehicle 3", 60.0)
    operator.press("!", "h HOLD   r return   l land here")
    operator.press("l", "LAND ALL")
    operator.sees("armed 0", 200.0)

    screen(operator, "o", "u asks the selected vehicles")
    operator.press("3", "select 3_")
    operator.press(ENTER, "selected 3")
    operator.press("u", "list: done for vehicle 3")
    operator.press(ENTER, "download of 1: done for vehicle 3", 120.0)
    operator.press(TAB, "log of 3")
    operator.press(DOWN, "ArduPilot log")  # the flight itself is the newest
    operator.press(ENTER, "journals add", 60.0)
    operator.press("w", "alarms")
    operator.press("w", "notices")
    operator.press("w", "warnings")
    moment = re.search(r"(\d\d:\d\d)  log of 3 +ERROR: battery failsafe", operator.screen())
    assert moment is not None, operator.screen()
    assert re.search(rf"{moment[1]}  vehicle 3 +Battery 1 is low", operator.screen()), "the station heard it then"

    screen(operator, "p", "parameters")
    select(operator, "all", "1-8")
    operator.press("R", "read from vehicles 1-8", 60.0)
    operator.press(TAB, "differing")
    operator.press("/", "find: _")
    operator.press("batt", "find: batt_")
    operator.press(ENTER, "!BATT_FS_LOW_ACT")
    for name, value in (("BATT_FS_LOW_ACT", "0"), ("BATT_LOW_VOLT", "10.5")):
        operator.press(ENTER, f"{name} =")
        operator.press(value + ENTER, f"{name} = {value}: vehicle 3")
        operator.press("y", f"{name} = {value}: set and")
    operator.sees("none that is differing fits: Esc ends the search, Tab the view")
    operator.leaves()
    run("stop")


@pytest.mark.parametrize("size", SIZES.values(), ids=list(SIZES))
def test_the_vehicle_with_the_worst_link(size: tuple[int, int]) -> None:
    port = free_port()
    sim = [sys.executable, "-m", "tui_gcs.cli.main", "sim", "--target", f"127.0.0.1:{port}"]
    fleets = [
        subprocess.Popen([*sim, "--count", "5"], stdout=subprocess.DEVNULL),
        subprocess.Popen([*sim, "--count", "1", "--first", "6", "--fault", "loss=0.2"], stdout=subprocess.DEVNULL),
    ]
    operator = Operator(["fly", str(SCENARIO), "--link", f"udpin:127.0.0.1:{port}", "--kind", "sim"], *size)
    try:
        operator.sees("6/8", 60.0)
        screen(operator, "l", "LINK")
        operator.press("w", "worst first")
        operator.screen(20.0)
        rows = [(int(vehicle), float(loss)) for vehicle, loss in LINK_ROW.findall(operator.screen())]
        assert rows[0][0] == 6 and rows[0][1] > 5.0, operator.screen()
        assert [loss for _, loss in rows] == sorted((loss for _, loss in rows), reverse=True)
        operator.leaves()
    finally:
        operator.console.end()
        for fleet in fleets:
            fleet.terminate()
            fleet.wait(20.0)
    run("stop")


def opens_setup(operator: Operator) -> None:
    """Show the setup of vehicles 1 and 2, with all that they say of it."""
    operator.sees("ready 8/8", 60.0)
    screen(operator, "s", "airframe")
    select(operator, "1-2", "1-2")
    operator.press("R", "read all sections: done", 60.0)


@demo("--autopilot", "mixed")
def test_accelerometers_of_both_autopilots(operator: Operator) -> None:
    opens_setup(operator)
    operator.press(DOWN, "gyro")
    operator.press(ENTER, "accel")
    operator.press(DOWN, "accel: calibrated")
    operator.press(ENTER, "vehicle 1: six poses")
    operator.press("y", "d = it is done")
    for pose in POSES:
        operator.sees(f"place the vehicle {pose}", 30.0)
        operator.press("d", "confirmed: place the vehicle")
    operator.sees("calibrate accel: done, vehicle 2", 120.0)
    operator.sees("reboot it before it flies")
    operator.press("1", "select 1_")
    operator.press(ENTER, "selected 1")
    operator.press("c", "b  reboot")
    operator.press("b", "type 1 and Enter")
    operator.press("1" + ENTER, "reboot 1: done", 60.0)
    operator.sees("8/8", 60.0)
    operator.leaves()
    run("stop")


def calibrate_compass(operator: Operator, last: int) -> None:
    """Begin it on the selected vehicles from the chosen line; `last` is a PX4."""
    operator.press(ENTER, f"vehicle {last}: go outside")
    operator.press("y", "under way: 2")
    operator.sees("compass 3: ", 30.0)
    operator.sees(f"vehicle {last}: turn it slowly about the axis", 30.0)


@demo("--autopilot", "mixed")
def test_compasses_of_both_autopilots(operator: Operator) -> None:
    """No prompt waits for a key: the vehicles report how far they are, PX4 also which side it waits for."""
    opens_setup(operator)
    operator.press(DOWN, "gyro")
    operator.press(ENTER, "Enter calibrate")
    for sensor in ("accel", "simple-accel", "level", "compass"):
        operator.press(DOWN, f"│{sensor}: ")
    calibrate_compass(operator, 2)
    operator.sees("compass calibration done: reboot it before it flies", 120.0)
    operator.sees("calibrate compass: done, vehicle 2", 240.0)
    select(operator, "3-4", "3-4")
    calibrate_compass(operator, 4)
    operator.press(DELETE, "y = cancel it")
    # The ends of the calibrations and of what cancelled them are reported; which of them last depends on the moment.
    operator.press("y", "cancelled; reboot it before it flies")
    shown = operator.screen()
    assert re.search("vehicle 3: (NOT DONE: )?cancelled; reboot it", shown), shown
    assert re.search("vehicle 4: (NOT DONE: )?cancelled", shown), shown
    select(operator, "1", "1")
    operator.press("c", "b  reboot")
    operator.press("b", "type 1 and Enter")
    operator.press("1" + ENTER, "reboot 1: done", 60.0)
    operator.leaves()
    run("stop")
