"""Rehearsal store: which plans were rehearsed, one line per rehearsal in a small file.

A plan is the scenario as it is parsed (comments and order of keys do not count), the code of the planners and this
program's own version. `tui-gcs rehearse` writes; a LIVE station reads before a start.
"""

import hashlib
import re
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

import msgspec

import tui_gcs
from tui_gcs.core.base.file_replacement import replace_file
from tui_gcs.core.protocol.planning import PlannerInfo
from tui_gcs.core.scenario.model import Scenario

FILE = "rehearsals.jsonl"
RECORDING = "recording: "
"""What `tui-gcs rehearse` prints before the path of its folder."""
FOLDER_NAME = re.compile(r"rehearsal-\d{8}-\d{6}(-\d+)?")
"""Names of those folders, below the state directory of SIM."""
MAX_LINES = 200
"""Older lines are removed."""
MAX_BYTES = 1_000_000
"""A larger file was not written by this program, and is not read."""
PLANNER_GROUP = "tui_gcs.planners"
"""Entry point group by which installed packages provide planners."""


class RehearsalRecord(msgspec.Struct, frozen=True):
    """The result of one rehearsal."""

    plan: str
    """`plan_digest` of the plan that was flown."""
    passed: bool
    wall_s: float
    scenario: str
    checks_good: int
    checks: int
    autopilots: str = ""
    """Autopilots of the simulated vehicles: ardupilot, px4 or mixed."""
    conditions: str = ""
    """Faults that were injected, in words."""
    problem: str = ""
    """Why it ended early; "" if it did not."""
    by: str = ""
    """Login name of the operator."""
    folder: str = ""
    """Name of the folder with its recording, below the state directory of SIM."""
    report: str = ""
    """Path of its report; "" if none was written."""


def plan_digest(scenario: Scenario, planners: dict[str, PlannerInfo]) -> str:
    """Return a digest that is equal for equal plans.

    `planners` are those in files, by name; it may hold others, too.
    """
    code = {team.planner: _code_of(planners.get(team.planner), team.planner) for team in scenario.teams}
    # The operator's position for Remote ID and the operators' own checklist change nothing that flies.
    flown = msgspec.structs.replace(scenario, remote_id=None, checklist=())
    what = (msgspec.json.encode(flown, order="deterministic"), msgspec.json.encode(code, order="deterministic"))
    return hashlib.sha256(b"\0".join((*what, _own_code().encode()))).hexdigest()


def _code_of(info: PlannerInfo | None, name: str) -> str:
    """Return the hash of a planner's file, or the version of the package that provides it; "" for our own planners."""
    if info is not None and info.file:
        return info.sha256
    points = entry_points(group=PLANNER_GROUP, name=name)
    return next((f"{point.dist.name} {point.dist.version}" for point in points if point.dist is not None), "")


@cache
def _own_code() -> str:
    """Return a digest of our version and of our planners, which are what flies."""
    folder = Path(tui_gcs.__file__).parent / "planner"
    digest = hashlib.sha256(tui_gcs.__version__.encode())
    for file in sorted(folder.rglob("*.py")):
        # The author's test bench flies nothing.
        if file.parent.name == "check":
            continue
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def remember(path: Path, rehearsal: RehearsalRecord) -> None:
    """Add a line; the oldest beyond `MAX_LINES` are removed. Raises OSError."""
    lines = [*_lines(path)[-(MAX_LINES - 1) :], msgspec.json.encode(rehearsal)]
    replace_file(path, b"\n".join(lines) + b"\n")


class RehearsalStore:
    """The newest rehearsals, read again when the file changes."""

    def __init__(self, path: Path | None) -> None:
        """Read `path`, which need not exist; None for no file."""
        self._path = path
        self._stamp: tuple[int, int] | None = None
        self._known: list[RehearsalRecord] = []

    def newest(self, plan: str) -> RehearsalRecord | None:
        """Return the newest rehearsal of this plan that passed, else the newest; None if there is none."""
        self._refresh()
        found = [rehearsal for rehearsal in self._known if rehearsal.plan == plan]
        return max(found, key=lambda rehearsal: (rehearsal.passed, rehearsal.wall_s), default=None)

    def _refresh(self) -> None:
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
            self._known = read_rehearsals(self._path)


def read_rehearsals(path: Path) -> list[RehearsalRecord]:
    """Return the rehearsals of a file, the oldest first; none where there is no such file."""
    return [rehearsal for line in _lines(path) if (rehearsal := _read(line)) is not None]


def _lines(path: Path) -> list[bytes]:
    """Return whole lines; none of a file that is missing or larger than `MAX_BYTES`."""
    try:
        if path.stat().st_size > MAX_BYTES:
            return []
        return [line for line in path.read_bytes().splitlines() if line.strip()]
    except OSError:
        return []


def _read(line: bytes) -> RehearsalRecord | None:
    """Decode a line; None if it is foreign or cut off."""
    try:
        return msgspec.json.decode(line, type=RehearsalRecord)
    except msgspec.MsgspecError:
        return None
