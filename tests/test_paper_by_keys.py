"""The paper's three rounds, built from an empty scenario with nothing but keys, saved, rehearsed and flown.

Real processes at 1x, on the smallest terminal; about eight minutes.
"""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.pty_operator import DOWN, EMPTY, ENTER, ESCAPE, RIGHT, SAVE, TAB, Operator, end_programs
from tui_gcs.core.scenario import Scenario
from tui_gcs.core.scenario_load import load
from tui_gcs.core.zones import Shape

pytestmark = [pytest.mark.process, pytest.mark.by_keys]
PAPER = Path(__file__).parents[1] / "tui_gcs" / "scenarios" / "swarm-challenge.toml"
KEY_S, AFTER_ESCAPE_S, SETTLE_S = 0.05, 0.8, 1.5
"""Between keys."""
PLACES = "".join(
    f"""
[[place]]
vehicle = {v}
place_m = [{45 if v < 5 else 25}.0, {170 + 20 * ((v - 1) % 4)}.0]
layer_m = {20 + 7 * v}.0
"""
    for v in range(1, 9)
)
ROUNDS = "".join(
    f"""
[[round]]
name = "round {number}"
duration_s = 200.0
[round.area]
shape = "rectangle"
centre_m = [300.0, 200.0]
width_m = 600.0
height_m = 400.0
alt_min_m = 20.0
alt_max_m = 90.0
[[round.zone]]
name = "zone 1"
role = "defend"
shape = "circle"
centre_m = [300.0, 200.0]
radius_m = 30.0
"""
    for number in (1, 2, 3)
)
"""Nothing is in them but what every scenario must have."""
EMPTY_SCENARIO = f"""format = 1
name = "paper"
seed = 42
footprint_radius_m = 15.0
origin = {{lat_deg = 52.0720, lon_deg = -0.6280, ground_amsl_m = 110.0}}
limits = {{speed_m_s = 8.0, accel_m_s2 = 2.5, separation_horizontal_m = 10.0, separation_vertical_m = 5.0}}
results = {{measured_s = 60.0}}

{ROUNDS}
[[team]]
name = "defend"
zone = "zone 1"
planner = "patrol"
vehicles = [1, 2, 3, 4]

[[team]]
name = "attack"
zone = "zone 1"
planner = "patrol"
vehicles = [5, 6, 7, 8]

{PLACES}"""


class Editor(Operator):
    """Fills in forms."""

    def fills(self, *values: str) -> None:
        """From field to field: what shall stand there; "" leaves it, arrows choose."""
        for value in values:
            self.presses(TAB)
            if value.startswith(ESCAPE):
                self.presses(value)
                self.screen(SETTLE_S)  # another shape fills in other fields
            elif value:
                self.says(value)

    def adds(self, name: str, *values: str) -> None:
        """One more zone, to be attacked: its name, then its fields from the shape on."""
        self.press("+", "Esc leave field")
        self.says(name)
        self.fills(RIGHT, *values)
        self.presses(ESCAPE)

    def says(self, value: str) -> None:
        """In the field that has the cursor, key by key."""
        self.presses(EMPTY)
        for key in value:
            self.console.press(key.encode())
            self.screen(KEY_S)
        self.sees(value.split()[0])

    def presses(self, *keys: str) -> None:
        """One after the other; what follows an Esc too soon would be taken for one key with it."""
        for key in keys:
            self.console.press(key.encode())
            self.screen(AFTER_ESCAPE_S if key == ESCAPE else SETTLE_S / 2)


@pytest.fixture
def folder(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    for name in ("RUNTIME", "STATE"):
        monkeypatch.setenv(f"TUI_GCS_{name}_DIR", str(tmp_path_factory.mktemp(name[0])))
    yield tmp_path_factory.mktemp("f")
    end_programs()


def run(*arguments: str) -> str:
    """`tui-gcs ARGUMENTS`, which succeeds."""
    done = subprocess.run(
        [sys.executable, "-m", "tui_gcs.cli", *arguments], capture_output=True, text=True, timeout=900
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def shapes(scenario: Scenario) -> list[tuple[Shape, ...]]:
    """Of each round: its area and zones."""
    return [(each.area.shape, *(zone.shape for zone in each.zones)) for each in scenario.rounds]


def test_the_papers_rounds_are_built_saved_rehearsed_and_flown_by_keys(folder: Path) -> None:
    file = folder / "paper.toml"
    file.write_text(EMPTY_SCENARIO)
    with_keys(file)
    built, paper = load(file), load(PAPER)
    assert shapes(built) == shapes(paper)
    assert [(team.zone, team.vehicles) for team in built.teams] == [(team.zone, team.vehicles) for team in paper.teams]
    run("rehearse", str(file))
    flown(file)


def with_keys(file: Path) -> None:
    """Three rounds on the plan screen."""
    one = Editor(["demo", "--scenario", str(file)], 80, 24)
    try:
        one.sees("8/8", 60.0)
        one.press("p", "rounds and zones")

        one.fills("home", "", "", "150", "200", "80")
        one.presses(ESCAPE)
        one.adds("field", RIGHT, "450", "200", "160", "120")

        one.presses("2", DOWN)
        one.fills("", "", RIGHT, "160", "200", "180", "110", "30")
        one.presses(ESCAPE)
        one.adds("field", "", "450", "210", "75")

        one.presses("3")
        one.fills(RIGHT, "0,100 300,0 600,100 600,300 300,400 0,300")
        one.presses(ESCAPE, DOWN)
        one.fills("", "", RIGHT + RIGHT, "90,130 230,130 230,190 160,190 160,280 90,280")
        one.presses(ESCAPE)
        one.adds("field", RIGHT, "460", "200", "120", "160")

        one.press("t", "Planner")
        one.presses(RIGHT)
        one.fills("", "", "", RIGHT)
        one.presses(ESCAPE)

        one.press(SAVE, "saved to")
        one.leaves()
    finally:
        one.console.end()
    run("stop")


def flown(file: Path) -> None:
    """All three rounds, from start to landing."""
    one = Operator(["demo", "--scenario", str(file)], 80, 24)
    try:
        one.sees("8/8", 60.0)
        one.sees("Space start")
        one.screen(5.0)  # until they have a position
        one.press(" ", "Enter = start")
        one.press(ENTER, "start 1-8: begun for all 8")
        for number in (2, 3):
            one.sees("all 4 on their slots over home", 120.0)
            one.press("o", "y = switch")
            one.press("y", f"R{number}/3")
            one.screen(5.0)
        one.sees("all 4 on their slots over home", 120.0)
        one.press("!", "h HOLD   r return   l land here")
        one.press("r", "RETURN ALL: begun for all 8")
        one.sees("armed 0", 200.0)
        one.leaves()
    finally:
        one.console.end()
    run("stop")
