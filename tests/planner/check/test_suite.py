"""Checks of planners: each catches the one thing that is wrong with a small planner, and lets a good one pass."""

from pathlib import Path

import numpy as np
import pytest

from tests.planner.rigs import bad_planners as bad
from tui_gcs.core.protocol.common import Intent, TeamPlan
from tui_gcs.planner.check.declarations import suspects
from tui_gcs.planner.check.plan_form import faults, nonsense, plan_difference
from tui_gcs.planner.check.subject import CheckedPlanner, Finding, checked_planner
from tui_gcs.planner.check.suite import CHECKS, findings
from tui_gcs.planner.runtime.kinematic_fleet import KinematicFleet, scattered, task_for, wanted_position
from tui_gcs.planner.runtime.planner_errors import PlannerError


def subject(folder: Path, source: str) -> CheckedPlanner:
    path = folder / "mine.py"
    path.write_text(source)
    return checked_planner(str(path), 1, True, lambda: None)


def check(name: str, mine: CheckedPlanner) -> list[Finding]:
    return list(findings(CHECKS[name], name, mine))


def failure(name: str, folder: Path, source: str) -> str:
    """The one line that fails, value and advice."""
    bad = [f for f in check(name, subject(folder, source)) if f.verdict == "FAIL"]
    assert len(bad) == 1, bad
    assert bad[0].advice
    return f"{bad[0].check}: {bad[0].value} -> {bad[0].advice}"


@pytest.mark.parametrize("name", CHECKS)
@pytest.mark.parametrize("source", [bad.GOOD, bad.REMEMBERS], ids=["good", "remembers"])
def test_a_good_planner_passes(name: str, source: str, tmp_path: Path) -> None:
    found = check(name, subject(tmp_path, source))
    assert found
    assert [f for f in found if f.verdict == "FAIL"] == []


@pytest.mark.parametrize(
    ("name", "source", "told"),
    [
        ("flies", "RAISES", ("mine.py:2", "in step", "KeyError: 'no such key'")),
        ("flies", "OUTSIDE", ("vehicle 1", "(700, ", "outside the operating area")),
        ("flies", "FAST", ("20.0 m/s asked, 8.0 allowed",)),
        ("parameters", "PARAM", ("at their least value", "ZeroDivisionError")),
        ("same again", "BY_CHANCE", ("same again: step 1 of", "ctx.rng", "mine.py:4 import random")),
        ("same again", "BY_TIME", ("same again: step 1 of", "ctx.t_s", "mine.py:4 import time")),
        ("restart", "FORGETFUL", ("taken over after step 1", "snapshot()")),
        ("vehicle order", "BY_ID", ("the same vehicle, numbered 1 and 4", "is sent 27 m elsewhere")),
        ("vehicle order", "BY_ROW", ("the same vehicle", "elsewhere")),
        ("fleet sizes", "ALONE", ("1 vehicles", "ZeroDivisionError")),
        ("loss and join", "LOSES", (" taken out (step ", "AssertionError: somebody is missing")),
        ("loss and join", "DEAF", ("which is not active", "ctx.fleet.active")),
        ("tracks", "SEES", ("a target that is not confirmed", "Invalid enum value 'chase'", "ctx.tracks")),
        (
            "tracks",
            "FOLLOWS",
            ("targets leave the operating area (step", "follows one and is outside", "keep every place inside"),
        ),
        ("tracks", "PURSUES", ("(250, 468)", "is outside the operating area", "keep every place inside")),
        ("odd zones", "FLIES_OUT", ("a zone outside the area: vehicle", "flies to (59", "stay inside task.area")),
        ("restart", "ROUNDS", ("steps later: vehicle 1 is sent", "so small a difference", "np.float32")),
        ("restart", "CHASES", ("taken over after step", "is sent 9 m elsewhere", "snapshot()")),
        ("odd telemetry", "NAN", ("only positions are known", "goto without a finite position", "np.isfinite")),
        ("memory", "LEAKING", ("MB an hour", "grows with every step: mine.py:2")),
    ],
)
def test_what_is_wrong_is_caught_by_its_check(name: str, source: str, told: tuple[str, ...], tmp_path: Path) -> None:
    line = failure(name, tmp_path, getattr(bad, source))
    assert [words for words in told if words not in line] == [], line
    assert ("so small a difference" in line) is (source == "ROUNDS")


def test_a_trail_of_the_last_places_is_no_leak_once_it_is_full(tmp_path: Path) -> None:
    (only,) = check("memory", subject(tmp_path, bad.KEEPS_A_TRAIL))
    assert only.verdict == "ok" and "from step 800 to 1600" in only.value


def test_a_leader_among_vehicles_is_told_how_to_say_so(tmp_path: Path) -> None:
    assert "declare ids_matter = True" in failure("vehicle order", tmp_path, bad.BY_ROW)


def test_a_metric_that_no_station_would_load_is_a_wrong_declaration(tmp_path: Path) -> None:
    metrics = "from tui_gcs.planner.api import Metric; metrics = (Metric('left', of='least'),)"
    line = failure("declares", tmp_path, bad.source(extra=metrics))
    assert "metric left: of = 'least' must be 'last', 'worst' or 'mean'" in line


REFUSALS = {
    "raised by the file": "raise ValueError('too narrow for us')",
    "raised by the file after a library": """
            try:
                np.zeros(0).max()
            except ValueError:
                raise ValueError('too narrow for us') from None""",
}
ACCIDENTS = {
    "of numpy": ("np.zeros(0).max()", "zero-size array"),
    "of Python itself": ("int('one')", "invalid literal for int"),
    "of unpacking": ("a, b = (1,)", "not enough values to unpack"),
}


def of_narrow_zones(statement: str) -> str:
    """A planner that does this in `configure` where a zone is 1 m wide."""
    extra = f"""version = '1'
    def configure(self, task, params, rng):
        self.task, self.gain, self.count, self.kept = task, 1.0, 0, []
        if getattr(task.zone.shape, 'width_m', 0.0) == 100.0:
            {statement}
"""
    return bad.source(extra=extra).replace(
        "def configure(self, task, params, rng):\n        super", "def unused(self, task, params, rng):\n        super"
    )


@pytest.mark.parametrize("statement", REFUSALS.values(), ids=REFUSALS)
def test_a_zone_may_be_refused(statement: str, tmp_path: Path) -> None:
    found = check("odd zones", subject(tmp_path, of_narrow_zones(statement)))
    assert [f.verdict for f in found] == ["note", "ok"]
    assert "1 m wide: refused, as configure may: mine.py:" in found[0].value
    assert found[0].value.endswith("too narrow for us")


@pytest.mark.parametrize(("statement", "told"), ACCIDENTS.values(), ids=ACCIDENTS)
def test_a_value_error_of_a_library_is_no_refusal(statement: str, told: str, tmp_path: Path) -> None:
    line = failure("odd zones", tmp_path, of_narrow_zones(statement))
    assert "a zone 100 m long and 1 m wide: mine.py:13 in configure: ValueError: " in line
    assert told in line


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "source"),
    [
        ("declares", "BOASTS"),
        ("parameters", "NO_LOW_GAIN"),
        ("same again", "SOMETIMES_BY_CHANCE"),
        ("other process", "BY_SET_ORDER"),
        ("restart", "FORGETFUL"),
        ("vehicle order", "BY_ID"),
        ("fleet sizes", "NEEDS_A_TEAM"),
        ("fleet sizes", "FOR_FEW"),
        ("loss and join", "NEEDS_SOMEBODY"),
        ("loss and join", "KNOWS_NO_OTHERS"),
        ("odd telemetry", "NAN"),
        ("odd telemetry", "WANTS_NEWS"),
        ("odd telemetry", "ALWAYS_ON_TIME"),
        ("tracks", "SURE_OF_TARGETS"),
        ("odd zones", "GOES_TO_THE_ZONE"),
        ("step time", "SLOW_WITH_EIGHT"),
        ("memory", "LEAKING"),
    ],
)
def test_a_planner_that_breaks_one_promise_fails_that_check_and_no_other(
    name: str, source: str, tmp_path: Path
) -> None:
    mine = subject(tmp_path, getattr(bad, source))
    assert {f.check for each in CHECKS for f in check(each, mine) if f.verdict == "FAIL"} == {name}


def test_a_planner_that_declares_ids_matter_skips_the_order_check(tmp_path: Path) -> None:
    declared = bad.BY_ID.replace("version = '1'", "ids_matter = True")
    (only,) = check("vehicle order", subject(tmp_path, declared))
    assert (only.verdict, only.value) == ("note", "not looked at: ids_matter is declared")
    assert "ids_matter = 'yes': must be" in failure("declares", tmp_path, declared.replace("= True", "= 'yes'"))


def test_the_order_of_a_set_is_another_in_another_process(tmp_path: Path) -> None:
    """In this process it is always the same."""
    line = failure("same again", tmp_path, bad.BY_SET_ORDER)
    assert line.startswith("other process: step 1 of")
    assert "mine.py:2" in line and "a set" in line


def test_a_step_that_takes_most_of_its_period_is_too_slow(tmp_path: Path) -> None:
    mine = subject(
        tmp_path, bad.SLOW.replace("sleep(0.15)", "sleep(0.051)").replace("params =", "rate_hz = 20.0; params =")
    )
    found = [f for f in check("step time", mine) if f.verdict == "FAIL"]
    assert len(found) == 1 and "limit 25 ms" in found[0].value


# ---------------------------------------------------------------- loading


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("def step(:\n", "mine.py:1: invalid syntax"),
        ("import numpyy\n", "mine.py:1: ModuleNotFoundError: No module named 'numpyy'"),
        ("def f():\n    return 1 / 0\nf()\n", "mine.py:2 in f: ZeroDivisionError"),
        ("raise SystemExit(3)\n", "mine.py:1: SystemExit: 3"),
        ("x = 1\n", "mine.py: defines no planner"),
        (bad.GOOD + "\nclass Other(Planner): pass\n", "defines 2 planners (Mine, Other): one file, one planner"),
        ("\0", "is no Python source"),
    ],
)
def test_a_file_that_cannot_be_loaded_is_one_line_with_its_place(source: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(PlannerError) as error:
        subject(tmp_path, source)
    assert told in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("params", "extra", "told"),
    [
        ("Param('gain', float, 9.0, 0.0, 5.0), ", "version = '1'", "its own default 9.0 is refused"),
        ("Param('gain', float, 1.0, 5.0, 0.0), ", "version = '1'", "minimum 5 is above maximum 0"),
        ("Param('gain', list, 1.0), ", "version = '1'", "must be float, int, bool or str"),
        ("Param('gain', float, 1.0), Param('gain', float, 2.0), ", "version = '1'", "declared 2 times"),
        ("Param('gain', float, 1.0)", "version = '1'", "write (Param(…),) with its comma"),
        ("", "version = 2", "version = 2: must be a text"),
    ],
)
def test_declarations_that_make_no_sense(params: str, extra: str, told: str, tmp_path: Path) -> None:
    assert told in failure("declares", tmp_path, bad.source(params=params, extra=extra))


def test_what_asks_for_time_or_chance_is_found_in_the_source() -> None:
    source = b"import time\nfrom random import choice\nimport numpy as np\nx = np.random.rand()\ny = set()\nz = {1}\n"
    expected = "m.py:1 import time, m.py:2 from random import, m.py:4 np.random.rand, m.py:5 set(), m.py:6 a set"
    assert suspects(source, "m.py") == expected


# ---------------------------------------------------------------- vehicles that follow, plans compared


def intent(kind: str = "goto", **fields: object) -> Intent:
    return Intent(1, kind, **({"position_m": (60.0, 60.0, 40.0)} | fields))  # type: ignore[arg-type]


def plan(*intents: Intent, **fields: object) -> TeamPlan:
    return TeamPlan("check", 1, 1, 100.0, intents=intents, **fields)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (intent(position_m=None), "without a finite position_m"),
        (intent("orbit", radius_m=0.0), "radius_m 0.0: must be positive"),
        (intent("velocity", velocity_m_s=(np.nan, 0.0, 0.0)), "without a finite velocity_m_s"),
        (intent("velocity", velocity_m_s=(1.0, 0.0, 0.0), valid_s=-1.0), "valid_s -1.0"),
        (intent("velocity", velocity_m_s=(1.0, 0.0, 0.0), valid_s=31.0), "at most 30"),
        (intent("trajectory", positions_m=((0.0, 0.0, 30.0),)), "1 positions and 0 velocities"),
        (intent(speed_m_s=-1.0), "must be positive"),
    ],
)
def test_intents_that_no_vehicle_can_follow(wrong: Intent, told: str) -> None:
    assert told in nonsense(wrong, 100.0)


def test_a_trajectory_that_is_over_is_told() -> None:
    over = intent(
        "trajectory", t0_s=0.0, dt_s=1.0, positions_m=((0.0, 0.0, 30.0),) * 3, velocities_m_s=((0.0,) * 3,) * 3
    )
    assert "ended before the plan" in nonsense(over, 100.0)
    assert nonsense(over, 1.5) == ""


@pytest.mark.parametrize(
    ("other", "told"),
    [
        (plan(intent(position_m=(60.0, 61.0, 40.0))), "vehicle 1 is sent 1 m elsewhere"),
        (plan(intent("hold")), "vehicle 1 gets goto in one run and hold in the other"),
        (plan(), "gets an intent in one run and none"),
        (plan(intent(), metrics={"a": 1.0}), "other metrics"),
        (plan(intent(), annotations=()), "other annotations"),
        (plan(intent(), step_ms=5.0), ""),
    ],
)
def test_plans_are_compared_in_words(other: TeamPlan, told: str) -> None:
    text = plan_difference(plan(intent()), other)
    assert told in text and bool(told) == bool(text)


@pytest.mark.parametrize(
    ("asked", "after_2_s"),
    [
        (intent(position_m=(60.0, 0.0, 27.0)), (16.0, 0.0)),
        (intent("velocity", velocity_m_s=(0.0, 3.0, 0.0), valid_s=1.0), (0.0, 3.0)),
        (intent("orbit", position_m=(0.0, 10.0, 27.0), radius_m=10.0, speed_m_s=5.0, clockwise=False), (8.4, 4.6)),
        (intent("hold"), (0.0, 0.0)),
    ],
)
def test_vehicles_follow_their_intents(asked: Intent, after_2_s: tuple[float, float]) -> None:
    world = KinematicFleet(task_for((1,), "mine"), np.zeros((1, 2)))
    world.take(plan(asked))
    for _ in range(20):
        world.move()
    assert world.position_m[0, :2] == pytest.approx(after_2_s, abs=0.4)


def test_faults_of_a_plan_are_what_the_station_would_not_take() -> None:
    task = task_for((1, 2), "mine")
    world = KinematicFleet(task, scattered(2))
    world.gone = {2}
    strange = Intent(2, "hold")
    assert faults(plan(intent()), world.frame(), task) == []
    assert faults(plan(intent(), strange), world.frame(), task) == ["an intent for vehicle 2, which is not active"]
    assert faults(plan(intent(), intent()), world.frame(), task) == ["two intents for vehicle 1"]
    assert "altitude band" in faults(plan(intent(position_m=(60.0, 60.0, 300.0))), world.frame(), task)[0]
    for up, told in ((3.1, []), (3.2, ["vehicle 1: +3.2 m/s up asked, -1.5 to +3.0 allowed"])):
        climbs = intent("velocity", velocity_m_s=(0.0, 0.0, up))
        assert faults(plan(climbs), world.frame(), task) == told
    assert wanted_position(intent("return"), 1.0, 0.0, np.ones(3), 0.1).tolist() == [1.0, 1.0, 1.0]
