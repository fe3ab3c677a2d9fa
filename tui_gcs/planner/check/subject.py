"""The planner under check, how checks make it fly, and their findings."""

import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from typing import Literal

import msgspec

from tui_gcs.core.protocol.common import FleetFrame, PlannerTask, TeamPlan, decode, encode
from tui_gcs.planner.api import Instances, Planner
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import TEAM, KinematicFleet
from tui_gcs.planner.runtime.planner_errors import error_with_line
from tui_gcs.planner.runtime.planner_file import PlannerFile, load_file, read_source

CheckVerdict = Literal["ok", "FAIL", "note"]
"""A note is no requirement, but worth knowing."""


@dataclass(frozen=True)
class Finding:
    """One line for the planner's author: `value` was measured, `advice` is what to do (empty if nothing)."""

    check: str
    """The name in the report; "": that of the check which yields it."""
    verdict: CheckVerdict
    value: str
    advice: str = ""


def passed(value: str, *, check: str = "") -> Finding:
    """Return a finding of a check that holds."""
    return Finding(check, "ok", value)


def failed(value: str, advice: str, *, check: str = "") -> Finding:
    """Return a finding of a check that does not hold."""
    return Finding(check, "FAIL", value, advice)


def noted(value: str, advice: str = "") -> Finding:
    """Return a finding that is worth knowing."""
    return Finding("", "note", value, advice)


class PlannerFailure(Exception):
    """The planner raised, or its plan is wrong; the text is one line with file and line."""

    advice = "mend what it raises: in flight its vehicles hold, and it is started again once"


@contextmanager
def advising(advice: str) -> Iterator[None]:
    """Give another advice to a `PlannerFailure` within."""
    try:
        yield
    except PlannerFailure as failure:
        failure.advice = advice
        raise


class PlannerRefusal(PlannerFailure):
    """`configure` refused the task by a ValueError of its own."""


@dataclass(frozen=True)
class CheckedPlanner:
    """A planner under check, from a file or by name."""

    planner: type[Planner]
    name: str
    """The name by which tasks request it."""
    path: Path
    """The source file of its class."""
    files: Mapping[str, PlannerFile]
    """The planner itself, if it is in a file."""
    seed: int
    quick: bool
    beat: Callable[[], None]
    """Called before every call of the planner, so that a watching process sees progress."""
    instances: Instances | None = None
    """Whether it is checked with one instance or with one on each vehicle; None: as it declares."""

    def formed(self, task: PlannerTask) -> PlannerTask:
        """Return the task for the form in which the planner is checked."""
        return msgspec.structs.replace(task, instances=self.instances)

    def host(self, task: PlannerTask, snapshot: bytes = b"") -> PlannerHost:
        """Return a host with the planner loaded anew and configured for `task`.

        Raises:
            PlannerFailure: the planner raised; PlannerRefusal if it refused the task.
        """
        self.beat()
        host = PlannerHost(TEAM, self.files)
        host.set_task(self.formed(task), snapshot)
        if host.problem:
            error = PlannerRefusal if host.refuses else PlannerFailure
            raise error(error_with_line(host.problem, self.path))
        return host

    def step(self, host: PlannerHost, frame: FleetFrame) -> TeamPlan:
        """Return one plan as the station would decode it. Raises `PlannerFailure`."""
        self.beat()
        plan = decode(host.answer(frame), TeamPlan)
        if plan.error:
            raise PlannerFailure(error_with_line(plan.error, self.path))
        return plan

    def snapshot(self, host: PlannerHost) -> bytes:
        """Return what a restarted worker would be given. Raises `PlannerFailure`."""
        self.beat()
        try:
            return host.snapshot()
        except Exception as error:  # noqa: BLE001 - the edge to foreign code
            raise PlannerFailure(error_with_line("".join(traceback.format_exception(error)), self.path)) from None

    def fly(self, host: PlannerHost, world: KinematicFleet, duration_s: float) -> Iterator[tuple[FleetFrame, TeamPlan]]:
        """Step planner and vehicles; yield every plan with its frame, before the vehicles follow it."""
        end_s = world.t_s + duration_s
        while world.t_s < end_s:
            frame = world.frame()
            if host.due(frame.t_s):
                plan = self.step(host, frame)
                yield frame, plan
                world.take(plan)
            world.move()


def checked_planner(
    what: str, seed: int, quick: bool, beat: Callable[[], None], instances: Instances | None = None
) -> CheckedPlanner:
    """Return the planner in the file `what`, or the known one of that name. Raises `PlannerError`."""
    if what.endswith(".py"):
        path = Path(what)
        planner = load_file(path)
        file = PlannerFile(planner.name, path, sha256(read_source(path)).hexdigest())
        return CheckedPlanner(planner, planner.name, path, {planner.name: file}, seed, quick, beat, instances)
    planner = registry.load(what)
    module = import_module(planner.__module__)
    return CheckedPlanner(planner, what, Path(module.__file__ or what), {}, seed, quick, beat, instances)


def comparable_bytes(plan: TeamPlan) -> bytes:
    """Return everything of a plan that must be equal when it is made again, encoded."""
    return encode(msgspec.structs.replace(plan, step_ms=0.0, seq=0, snapshot=None, learnt=None, notes=(), news=()))
