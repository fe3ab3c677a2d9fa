"""The paper's three rounds, built from a new scenario with nothing but keys, saved, rehearsed and flown.

Real processes at 1x, on the smallest terminal; about ten minutes.
"""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.rigs.pty_operator import DOWN, EMPTY, ENTER, ESCAPE, RIGHT, SAVE, TAB, UP, Operator, end_programs
from tui_gcs.core.geometry.zones import Shape
from tui_gcs.core.scenario.load import load
from tui_gcs.core.scenario.model import Scenario

pytestmark = [pytest.mark.process, pytest.mark.by_keys]
PAPER = Path(__file__).parents[2] / "tui_gcs" / "scenarios" / "swarm-challenge.toml"
KEY_S, AFTER_ESCAPE_S, SETTLE_S = 0.05, 0.8, 1.5
"""Between keys."""
LATER_ROUNDS = [("round 2", 200.0), ("round 3", 200.0)]
SHIFT_TAB, LEFT = "\x1b[Z", "\x1b[D"
TEAM, SETTINGS = "Planner", "settings: Esc leaves"
FIELDS_OF_A_PLACE, FIELDS_AT_MOST = 4, 40


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

    def settings(self) -> None:
        """Name, round and take-off places, and how long it is measured."""
        self.press("g", SETTINGS)
        self.says("swarm challenge")
        self.fills("", "", "", "", "", "", "calm", "200", "")
        for v in range(1, 9):
            self.fills("", str(45 if v < 5 else 25), str(170 + 20 * ((v - 1) % 4)), str(20 + 7 * v))
            if v < 8:
                self.presses(*[SHIFT_TAB] * FIELDS_OF_A_PLACE, RIGHT)
        self.goes_to("a round is measured for this long")
        self.says("60")
        self.presses(ESCAPE)

    def goes_to(self, meaning: str) -> None:
        """To the field of which the screen says this."""
        for _ in range(FIELDS_AT_MOST):
            if meaning in self.screen(SETTLE_S):
                return
            self.presses(TAB)
        raise AssertionError(f"no field with {meaning!r}:\n{self.screen()}")

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
        [sys.executable, "-m", "tui_gcs.cli.main", *arguments], capture_output=True, text=True, timeout=900
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def shapes(scenario: Scenario) -> list[tuple[Shape, ...]]:
    """Of each round: its area and zones."""
    return [(each.area.shape, *(zone.shape for zone in each.zones)) for each in scenario.rounds]


def test_the_papers_rounds_are_built_saved_rehearsed_and_flown_by_keys(folder: Path) -> None:
    file = folder / "paper.toml"
    run("scenario", "new", str(file), "--origin", "52.072,-0.628,110", "--vehicles", "8")
    with_keys(file)
    built, paper = load(file), load(PAPER)
    assert shapes(built) == shapes(paper)
    assert built.teams == paper.teams
    assert built.places == paper.places
    assert (built.origin, built.limits) == (paper.origin, paper.limits)
    assert (built.name, built.results.measured_s) == ("swarm challenge", 60.0)
    assert [(each.name, each.duration_s) for each in built.rounds] == [("calm", 200.0), *LATER_ROUNDS]
    assert "nothing is wrong" in run("check", str(file))
    run("rehearse", str(file))
    flown(file)


def with_keys(file: Path) -> None:
    """Three rounds on the plan screen."""
    one = Editor(["demo", "--scenario", str(file)], 80, 24)
    try:
        one.sees("8/8", 60.0)
        one.press("p", "rounds and zones")

        one.presses(UP)
        one.fills("", "300", "200", "900", "700")  # large enough for the places that are there and for those to come
        one.presses(ESCAPE, DOWN)
        one.fills("home", "", "", "150", "200", "80")
        one.presses(ESCAPE)
        one.adds("field", RIGHT, "450", "200", "160", "120")

        one.settings()
        one.presses(UP, UP)
        one.fills("", "300", "200", "600", "400")
        one.presses(ESCAPE)

        one.press("R", "2 round 2")
        one.presses(DOWN)
        one.fills("", "", RIGHT, "160", "200", "180", "110", "30")
        one.presses(ESCAPE, DOWN)
        one.fills("", "", LEFT, "450", "210", "75")
        one.presses(ESCAPE)

        one.press("R", "3 round 3")
        one.presses(UP, UP)
        one.fills(RIGHT, "0,100 300,0 600,100 600,300 300,400 0,300")
        one.presses(ESCAPE, DOWN)
        one.fills("", "", RIGHT, "90,130 230,130 230,190 160,190 160,280 90,280")
        one.presses(ESCAPE, DOWN)
        one.fills("", "", RIGHT, "460", "200", "120", "160")
        one.presses(ESCAPE)

        one.press("t", TEAM)
        one.press("+", "team-2")
        one.fills("attack", "5-8")
        one.presses(SHIFT_TAB, SHIFT_TAB, LEFT)
        one.fills("defend")
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
        one.sees("ready 8/8", 60.0)
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
