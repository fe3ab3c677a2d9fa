"""The planner that is checked, and how the checks make it fly."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec

from tui_gcs.core.messages import FleetFrame, Plan, PlannerTask, decode, encode
from tui_gcs.planner import registry
from tui_gcs.planner.api import Planner
from tui_gcs.planner.check.world import TEAM, World
from tui_gcs.planner.host import PlannerHost
from tui_gcs.planner.planner_file import blame, load_file


class Broken(Exception):
    """The planner raised: one line, with its file and line."""


class Refused(Broken):
    """`configure` raised ValueError: that is how a planner says that it cannot do a task."""


@dataclass(frozen=True)
class Subject:
    """A planner, from a file or by name."""

    planner: type[Planner]
    name: str
    """As a task names it."""
    path: Path
    """Its source."""
    seed: int
    quick: bool
    beat: Callable[[], None]
    """Called before every call of the planner: whoever watches sees that it still goes on."""

    def host(self, task: PlannerTask) -> PlannerHost:
        """A host with the planner configured for `task`. Raises `Broken` or `Refused`."""
        self.beat()
        host = PlannerHost(TEAM)
        host.set_task(task)
        if host.problem:
            error = Refused if "\nValueError: " in host.problem else Broken
            raise error(blame(host.problem, self.path))
        return host

    def step(self, host: PlannerHost, frame: FleetFrame) -> Plan:
        """One plan. Raises `Broken`."""
        self.beat()
        plan = host.step(frame)
        if plan.error:
            raise Broken(blame(plan.error, self.path))
        try:
            decode(encode(plan), Plan)
        except (TypeError, msgspec.ValidationError) as error:
            raise Broken(f"its plan cannot be sent: {error} (plain numbers: float(x), array.tolist())") from None
        return plan

    def snapshot(self, host: PlannerHost) -> bytes:
        """What a restarted worker would be given. Raises `Broken`."""
        self.beat()
        return host._job.planner.snapshot()  # type: ignore

    def restore(self, host: PlannerHost, state: bytes) -> None:
        """Let a fresh host go on where another was. Raises `Broken`."""
        self.beat()
        host._job.planner.restore(state)  # type: ignore

    def fly(self, host: PlannerHost, world: World, duration_s: float) -> Iterator[tuple[FleetFrame, Plan]]:
        """Step planner and vehicles; every plan with the frame it was made from, before the vehicles follow it."""
        end_s = world.t_s + duration_s
        while world.t_s < end_s:
            frame = world.frame()
            if host.due(frame.t_s):
                plan = self.step(host, frame)
                yield frame, plan
                world.take(plan)
            world.move()


def subject_of(what: str, seed: int, quick: bool, beat: Callable[[], None]) -> Subject:
    """The planner in the file `what`, or the known one of that name. Raises `registry.PlannerError`."""
    if what.endswith(".py"):
        path = Path(what)
        planner = load_file(path)
        name = registry.adopt(planner)
        return Subject(planner, name, path, seed, quick, beat)
    planner = registry.load(what)
    module = __import__(planner.__module__, fromlist=["__file__"])
    return Subject(planner, what, Path(module.__file__ or what), seed, quick, beat)


def essence(plan: Plan) -> bytes:
    """Everything of a plan that must be the same when it is made again."""
    return encode(msgspec.structs.replace(plan, step_ms=0.0, seq=0))
