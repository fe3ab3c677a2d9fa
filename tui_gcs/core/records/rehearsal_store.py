"""Which plans were rehearsed: one line per rehearsal in a small file, found again by what was flown.

A plan is the scenario as it is parsed (comments and order of keys do not count), the planners' code and this program's
own version. `tui-gcs rehearse` writes, a LIVE station reads before a start.
"""

import hashlib
import os
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

import msgspec

import tui_gcs
from tui_gcs.core.protocol.planning import PlannerInfo
from tui_gcs.core.scenario.model import Scenario

FILE = "rehearsals.jsonl"
MAX_LINES = 200
"""Lines; the oldest go."""
MAX_BYTES = 1_000_000
PLANNER_GROUP = "tui_gcs.planners"
"""Entry points by which installed packages bring planners."""


class RehearsalRecord(msgspec.Struct, frozen=True):
    """What came of one."""

    plan: str
    """`plan_digest` of what was flown."""
    passed: bool
    wall_s: float
    scenario: str
    checks_good: int
    checks: int
    autopilots: str = ""
    """What the simulated vehicles were: ardupilot, px4 or mixed."""
    conditions: str = ""
    """What went wrong on purpose, in words."""
    problem: str = ""
    """Why it ended early."""
    by: str = ""
    """Login name of who ran it."""


def plan_digest(scenario: Scenario, planners: dict[str, PlannerInfo]) -> str:
    """The same for the same plan; `planners` are those in files (others may be among them), by name."""
    code = {team.planner: _code_of(planners.get(team.planner), team.planner) for team in scenario.teams}
    flown = msgspec.structs.replace(scenario, remote_id=None)  # where the operator stands changes nothing that flies
    what = (msgspec.json.encode(flown, order="deterministic"), msgspec.json.encode(code, order="deterministic"))
    return hashlib.sha256(b"\0".join((*what, _own_code().encode()))).hexdigest()


def _code_of(info: PlannerInfo | None, name: str) -> str:
    """A planner's code: the hash of its file, or the version of the package that brings it; ours is told elsewhere."""
    if info is not None and info.file:
        return info.sha256
    points = entry_points(group=PLANNER_GROUP, name=name)
    return next((f"{point.dist.name} {point.dist.version}" for point in points if point.dist is not None), "")


@cache
def _own_code() -> str:
    """Our version and the hash of our planners, which are what flies."""
    folder = Path(tui_gcs.__file__).parent / "planner"
    digest = hashlib.sha256(tui_gcs.__version__.encode())
    for file in sorted(folder.rglob("*.py")):
        if file.parent.name == "check":
            continue  # the author's test bench flies nothing
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def remember(path: Path, rehearsal: RehearsalRecord) -> None:
    """Add a line; older ones than `MAX_LINES` go. Raises OSError."""
    lines = [*_lines(path)[-(MAX_LINES - 1) :], msgspec.json.encode(rehearsal)]
    new = path.with_suffix(f".{os.getpid()}.new")
    new.write_bytes(b"\n".join(lines) + b"\n")
    new.replace(path)


class RehearsalStore:
    """The newest rehearsals, read again when the file changes."""

    def __init__(self, path: Path | None) -> None:
        """`path` may not be there (yet); None: there is none."""
        self._path = path
        self._stamp: tuple[int, int] | None = None
        self._known: list[RehearsalRecord] = []

    def newest(self, plan: str) -> RehearsalRecord | None:
        """The newest that passed, else the newest, of this plan; None if it was never rehearsed."""
        self._look()
        found = [rehearsal for rehearsal in self._known if rehearsal.plan == plan]
        return max(found, key=lambda rehearsal: (rehearsal.passed, rehearsal.wall_s), default=None)

    def _look(self) -> None:
        if self._path is None:
            return
        try:
            info = self._path.stat()
        except OSError:
            self._stamp, self._known = None, []
            return
        stamp = (info.st_mtime_ns, info.st_size)
        if stamp != self._stamp:
            self._stamp = stamp
            self._known = [rehearsal for line in _lines(self._path) if (rehearsal := _read(line)) is not None]


def _lines(path: Path) -> list[bytes]:
    """Whole lines; a file that is missing or too large for what we write has none."""
    try:
        if path.stat().st_size > MAX_BYTES:
            return []
        return [line for line in path.read_bytes().splitlines() if line.strip()]
    except OSError:
        return []


def _read(line: bytes) -> RehearsalRecord | None:
    """A line that is not ours, or cut off, says nothing."""
    try:
        return msgspec.json.decode(line, type=RehearsalRecord)
    except msgspec.MsgspecError:
        return None
