"""The manual of planner authors: its example is run as it stands."""

import textwrap
from pathlib import Path

from tests.planner.rigs.flights import SMALL, fleet, task_of, zone_of
from tui_gcs.core.protocol.common import TeamPlan, decode
from tui_gcs.planner import api
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.planner_file import PlannerFile


def example() -> str:
    text = api.__doc__ or ""
    lines = text.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("    from tui_gcs.planner.api import"))
    last = next(i for i in range(first, len(lines)) if lines[i] and not lines[i].startswith("    "))
    return textwrap.dedent("\n".join(lines[first:last]))


def test_the_example_of_the_manual_flies(tmp_path: Path) -> None:
    file = tmp_path / "circle.py"
    file.write_text(example())
    assert len([line for line in example().splitlines() if line.strip()]) <= 12
    host = PlannerHost("red", {"circle": PlannerFile("circle", file, "")})
    host.set_task(task_of(zone_of(SMALL), planner="circle", radius_m=20.0))
    plan = decode(host.answer(fleet(3).frame()), TeamPlan)
    assert plan.error == ""
    assert [(i.vehicle, i.kind, i.position_m, i.radius_m) for i in plan.intents] == [
        (vehicle, "orbit", (150.0, 200.0, 20.0 + 7.0 * vehicle), 20.0) for vehicle in (1, 2, 3)
    ]
    assert registry.info("circle", {"circle": PlannerFile("circle", file, "")}).params[0].unit == "m"


def test_everything_public_is_offered() -> None:
    own = {name for name, thing in vars(api).items() if getattr(thing, "__module__", "") == api.__name__}
    assert {name for name in own if not name.startswith("_")} <= set(api.__all__)
    assert all(hasattr(api, name) for name in api.__all__)
