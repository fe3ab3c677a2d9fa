"""What planners declare about how their flights are judged, and which declarations are refused."""

from pathlib import Path

import pytest

from tui_gcs.core.protocol.common import PlannerInfo, decode, encode
from tui_gcs.core.protocol.planning import Metric
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.planner_errors import PlannerError
from tui_gcs.planner.runtime.planner_file import PlannerFile

SOURCE = """
from tui_gcs.planner.api import Metric, Output, Planner
class Mine(Planner):
    name = "mine"
    {declares}
    def step(self, ctx):
        return Output()
"""


def declared(folder: Path, declares: str) -> PlannerInfo:
    file = folder / "mine.py"
    file.write_text(SOURCE.format(declares=declares))
    return registry.info("mine", {"mine": PlannerFile("mine", file, "")})


def test_a_declaration_travels_on_the_bus(tmp_path: Path) -> None:
    reward = 'metrics = (Metric("reward", "points", gate=3, help="of visits"),); judged_by = "tasks"'
    info = decode(encode(declared(tmp_path, reward)), PlannerInfo)
    assert info.judged_by == "tasks"
    assert info.metrics == (Metric("reward", "points", "higher", 3, "last", "of visits"),)


@pytest.mark.parametrize("declares", ["pass", "def metrics(self): return {}", "metrics = property(lambda self: 1)"])
def test_a_file_of_version_1_is_judged_by_containment_alone(tmp_path: Path, declares: str) -> None:
    info = declared(tmp_path, declares)
    assert (info.metrics, info.judged_by) == ((), "metrics")


@pytest.mark.parametrize(
    ("declares", "why"),
    [
        ('metrics = ("reward",)', "metrics holds 'reward': each is a Metric"),
        ('metrics = (Metric("a b"),)', "metric 'a b': a name is letters"),
        ('metrics = (Metric("late_max"),)', "metric 'late_max': must not end in _min or _max"),
        ('metrics = (Metric("a", better="more"),)', "metric a: better = 'more' must be"),
        ('metrics = (Metric("a", gate=float("nan")),)', "metric a: gate = nan is not a finite number"),
        ('metrics = (Metric("a", gate=True),)', "metric a: gate = True is not a finite number"),
        ('metrics = (Metric("a", of="best"),)', "metric a: of = 'best' must be"),
        ('metrics = (Metric("a"), Metric("a"))', "metric a is declared twice"),
        ('judged_by = "beauty"', "judged_by = 'beauty': must be one of idleness"),
    ],
)
def test_a_wrong_declaration_is_refused_when_it_is_loaded(tmp_path: Path, declares: str, why: str) -> None:
    with pytest.raises(PlannerError) as caught:
        declared(tmp_path, declares)
    assert why in str(caught.value)
    assert "\n" not in str(caught.value)


def test_each_built_in_planner_says_what_it_is_judged_by() -> None:
    assert {name: registry.info(name).judged_by for name in ("guardian", "patrol", "waypoints")} == {
        "guardian": "intruders",
        "patrol": "idleness",
        "waypoints": "metrics",
    }
