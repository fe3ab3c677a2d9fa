"""The planner that is checked, and how the checks make it fly."""

import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from typing import Literal

import msgspec

from tui_gcs.core.protocol.common import FleetFrame, Plan, PlannerTask, decode, encode
from tui_gcs.planner.api import Planner
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import TEAM, KinematicFleet
from tui_gcs.planner.runtime.planner_errors import error_with_line
from tui_gcs.planner.runtime.planner_file import PlannerFile, load_file, read_source

CheckVerdict = Literal["ok", "FAIL", "note"]
"""note: nothing that must hold, but worth knowing."""


@dataclass(frozen=True)
class Finding:
    """`value` is what was measured, `advice` what to do about it (empty where nothing is to be done)."""

    check: str
    verdict: CheckVerdict
    value: str
    advice: str = ""


def passed(check: str, value: str) -> Finding:
    """It holds."""
    return Finding(check, "ok", value)


def failed(check: str, value: str, advice: str) -> Finding:
    """It does not hold."""
    return Finding(check, "FAIL", value, advice)


def noted(check: str, value: str, advice: str = "") -> Finding:
    """Worth knowing."""
    return Finding(check, "note", value, advice)


class PlannerFailure(Exception):
    """The planner raised: one line, with its file and line."""


class PlannerRefusal(PlannerFailure):
    """`configure` raised a ValueError of its own: that is how a planner says that it cannot do a task."""


@dataclass(frozen=True)
class CheckedPlanner:
    """A planner, from a file or by name."""

    planner: type[Planner]
    name: str
    """As a task names it."""
    path: Path
    """Its source."""
    files: Mapping[str, PlannerFile]
    """Itself, if it is a file's."""
    seed: int
    quick: bool
    beat: Callable[[], None]
    """Called before every call of the planner: whoever watches sees that it still goes on."""

    def host(self, task: PlannerTask, snapshot: bytes = b"") -> PlannerHost:
        """Return a host with the planner loaded anew and configured for `task`.

        Raises:
            PlannerFailure: the planner raised; PlannerRefusal if it refused the task.
        """
        self.beat()
        host = PlannerHost(TEAM, self.files)
        host.set_task(task, snapshot)
        if host.problem:
            error = PlannerRefusal if host.refuses else PlannerFailure
            raise error(error_with_line(host.problem, self.path))
        return host

    def step(self, host: PlannerHost, frame: FleetFrame) -> Plan:
        """One plan, as the station would read it. Raises `PlannerFailure`."""
        self.beat()
        plan = decode(host.answer(frame), Plan)
        if plan.error:
            raise PlannerFailure(error_with_line(plan.error, self.path))
        return plan

    def snapshot(self, host: PlannerHost) -> bytes:
        """What a restarted worker would be given. Raises `PlannerFailure`."""
        self.beat()
        try:
            return host.snapshot()
        except Exception as error:  # noqa: BLE001 - the edge to foreign code
            raise PlannerFailure(error_with_line("".join(traceback.format_exception(error)), self.path)) from None

    def fly(self, host: PlannerHost, world: KinematicFleet, duration_s: float) -> Iterator[tuple[FleetFrame, Plan]]:
        """Step planner and vehicles; every plan with the frame it was made from, before the vehicles follow it."""
        end_s = world.t_s + duration_s
        while world.t_s < end_s:
            frame = world.frame()
            if host.due(frame.t_s):
                plan = self.step(host, frame)
                yield frame, plan
                world.take(plan)
            world.move()


def checked_planner(what: str, seed: int, quick: bool, beat: Callable[[], None]) -> CheckedPlanner:
    """The planner in the file `what`, or the known one of that name. Raises `PlannerError`."""
    if what.endswith(".py"):
        path = Path(what)
        planner = load_file(path)
        file = PlannerFile(planner.name, path, sha256(read_source(path)).hexdigest())
        return CheckedPlanner(planner, planner.name, path, {planner.name: file}, seed, quick, beat)
    planner = registry.load(what)
    module = import_module(planner.__module__)
    return CheckedPlanner(planner, what, Path(module.__file__ or what), {}, seed, quick, beat)


def comparable_bytes(plan: Plan) -> bytes:
    """Everything of a plan that must be the same when it is made again."""
    return encode(msgspec.structs.replace(plan, step_ms=0.0, seq=0, snapshot=None, learnt=None, notes=(), news=()))
