"""Parameter files of QGroundControl (`.params`), Mission Planner (`.param`) and MAVProxy (`.parm`).

| program | line |
| QGroundControl | vehicle, component, name, value, MAV_PARAM_TYPE, tabs between |
| Mission Planner | NAME,value |
| MAVProxy | NAME padded to 16, value; 0x… is read |
| ArduPilot's own defaults | NAME value, NAME=value, NAME value @READONLY, @include FILE |

A name that is given twice counts as in its last line: so it is in ArduPilot and in the tools that set line after line.
Each line that does not count is reported.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from tui_gcs.core.base.float32 import shown
from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.bounded import data_of, text_of
from tui_gcs.core.formats.content import FormatError, ParamLine, Written, counted
from tui_gcs.core.formats.fence_rally_lists import Lines, lines_of
from tui_gcs.core.plans.check import MAX_PARAM
from tui_gcs.core.services.parameters.param_values import ParamType, check_name

MAX_PARAMS = 8192
MAX_INCLUDED = 16
"""The most files that one file includes, directly or through others."""
MAX_SUPERSEDED = 10
"""How many lines that do not count are listed."""
MAX_NAME_CELLS = 80
# System, component, name, value and type, separated by tabs.
QGC_FIELDS = 5
NAME_PADDED = 16
WHOLE = {
    **{kind: (0, 2**bits - 1) for kind, bits in ((1, 8), (3, 16), (5, 32))},
    **{kind: (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for kind, bits in ((2, 8), (4, 16), (6, 32))},
}
"""Smallest and largest value of each whole MAV_PARAM_TYPE."""
NOT_TO_WRITE = frozenset(
    {"ARSPD_OFFSET", "CMD_INDEX", "CMD_TOTAL", "FENCE_TOTAL", "FORMAT_VERSION", "GND_ABS_PRESS", "GND_TEMP"}
    | {"LOG_LASTFILE", "MIS_TOTAL", "SYSID_SW_MREV", "SYS_NUM_RESETS"}
)
"""Parameters that vehicles compute themselves: ground stations leave them out when they load a file."""
IDENTITIES = frozenset({"SYSID_THISMAV", "MAV_SYS_ID", "MAV_SYSID"})
"""Parameters with a vehicle's identity: copied to another vehicle, two would answer to one number."""


@dataclass(frozen=True)
class ParamsRead:
    """The contents of a parameter file, in the order in which names are given first."""

    params: tuple[ParamLine, ...]
    left_out: tuple[str, ...] = ()
    """Lines that do not count, because a later one gives the same name another value."""
    notes: tuple[str, ...] = ()


def are_params(lines: Lines) -> bool:
    """Whether lines begin like a parameter file."""
    first = lines[0][1]
    return first[0].startswith("@") or len(first) in (2, QGC_FIELDS) or _is_read_only(first)


def read_params(lines: Lines, path: Path | None = None) -> ParamsRead:
    """Read the lines of a parameter file. Raises FormatError.

    Files that it includes are looked for beside `path`; without one they are refused.
    """
    reader = _Reader()
    reader.read(lines, path)
    notes = [f"{name} is included ({counted(count, 'parameter')})" for name, count in reader.included.items()]
    notes += [f"{counted(reader.repeated, 'line')} repeated with the same value"] * bool(reader.repeated)
    notes += [f"@READONLY of {counted(reader.read_only, 'line')} is not kept"] * bool(reader.read_only)
    more = len(reader.superseded) - MAX_SUPERSEDED
    left_out = [*reader.superseded[:MAX_SUPERSEDED], *([f"and {counted(more, 'more line')}"] * (more > 0))]
    return ParamsRead(tuple(reader.found.values()), tuple(left_out), tuple(notes))


class _Reader:
    """Gathers the parameters of a file and of those that it includes."""

    def __init__(self) -> None:
        self.found: dict[tuple[int | None, int | None, str], ParamLine] = {}
        self.repeated = self.read_only = 0
        self.superseded: list[str] = []
        self.included: dict[str, int] = {}

    def read(self, lines: Lines, path: Path | None) -> None:
        """Take the parameters of one file. Raises FormatError."""
        here: dict[tuple[int | None, int | None, str], int] = {}
        for number, fields in lines:
            if fields[0].startswith("@"):
                self._include(number, fields, path)
                continue
            self.read_only += _is_read_only(fields)
            line = _read(number, fields)
            key = (line.system, line.component, line.name)
            # Only lines of one file contradict each other: to change what is included is what including is for.
            if key in here:
                self._twice(here[key], self.found[key], number, line)
            here[key] = number
            self.found[key] = line
            if len(self.found) > MAX_PARAMS:
                raise FormatError(f"more than {MAX_PARAMS} parameters")

    def _twice(self, first: int, before: ParamLine, number: int, line: ParamLine) -> None:
        if before.value == line.value:
            self.repeated += 1
            return
        later = f"line {number} says {shown(line.value)}, the last counts"
        self.superseded.append(f"line {first}: {line.name} {shown(before.value)}: {later}")

    def _include(self, number: int, fields: list[str], path: Path | None) -> None:
        """Read another file as if its lines stood here. Raises FormatError."""
        what = clean(" ".join(fields), MAX_NAME_CELLS)
        if fields[0] != "@include" or len(fields) != 2:
            raise FormatError(f"line {number}: {what}: not known")
        if path is None:
            raise FormatError(f"line {number}: {what}: other files are not read here")
        other = Path(fields[1])
        if other.is_absolute():
            raise FormatError(f"line {number}: {what}: only files beside this one are read")
        # Each file once: a circle would have no end.
        if len(self.included) == MAX_INCLUDED or what in self.included:
            raise FormatError(f"line {number}: {what}: included twice, or more than {MAX_INCLUDED} files")
        self.included[what] = 0
        before = len(self.found)
        try:
            self.read(lines_of(text_of(data_of(path.parent / other))), path.parent / other)
        except FormatError as error:
            raise FormatError(f"line {number}: {what}: {error}") from None
        self.included[what] = len(self.found) - before


def _is_read_only(fields: list[str]) -> bool:
    """Whether a line is one of ArduPilot's defaults that a build does not let users change."""
    return len(fields) == 3 and fields[2].upper() == "@READONLY"


def _read(number: int, fields: list[str]) -> ParamLine:
    if len(fields) == QGC_FIELDS:
        system, component, kind = (_whole(number, fields[i]) for i in (0, 1, 4))
        known = kind in {each.value for each in ParamType}
        if not known:
            raise FormatError(f"line {number}: type {kind} is not known")
        line = ParamLine(_name(number, fields[2]), _value(number, fields[3]), kind, system, component)
        return _fitting(number, line)
    if len(fields) != 2 and not _is_read_only(fields):
        raise FormatError(f"line {number}: {counted(len(fields), 'field')} instead of a name and a value")
    return ParamLine(_name(number, fields[0]), _value(number, fields[1]))


def _fitting(number: int, line: ParamLine) -> ParamLine:
    """Return the line with a whole number where its type is whole. Raises FormatError."""
    if line.type not in WHOLE:
        return replace(line, value=float(line.value))
    low, high = WHOLE[line.type]
    if not float(line.value).is_integer() or not low <= line.value <= high:
        raise FormatError(f"line {number}: {line.name}: must be a whole number {low} to {high}")
    return replace(line, value=int(line.value))


def _name(number: int, text: str) -> str:
    if reason := check_name(text):
        raise FormatError(f"line {number}: {reason}")
    return text


def _whole(number: int, text: str) -> int:
    if not text.isascii() or not text.isdigit() or len(text) > 5:
        raise FormatError(f"line {number}: {clean(text, 20)!r} is no number of a vehicle, component or type")
    return int(text)


def _value(number: int, text: str) -> int | float:
    value: int | float = math.nan
    if text.isascii() and "_" not in text:  # Python would accept 1_0
        try:
            # MAVProxy reads hexadecimal numbers.
            value = int(text, 16 if text.lower().lstrip("+-").startswith("0x") else 10)
        except ValueError:
            try:
                value = float(text)
            except ValueError:
                value = math.nan
    if not abs(value) <= MAX_PARAM:  # NaN, too
        raise FormatError(f"line {number}: {clean(text, 20)!r} is no value of a parameter")
    return value


def write_qgc_params(params: tuple[ParamLine, ...]) -> Written:
    """Write a file of QGroundControl, which needs the type of each parameter."""
    untyped = sum(1 for line in params if line.type is None)
    system = next((line.system for line in params if line.system is not None), 1)
    lines = [f"# Onboard parameters for Vehicle {system}\n", "#\n", "# Vehicle-Id Component-Id Name Value Type\n"]
    for line in params:
        kind = line.type
        if kind is None:
            # QGroundControl refuses a line without a type.
            kind = ParamType.INT32 if isinstance(line.value, int) else ParamType.REAL32
        owner = (1 if line.system is None else line.system, 1 if line.component is None else line.component)
        lines.append(f"{owner[0]}\t{owner[1]}\t{line.name}\t{_text(line)}\t{int(kind)}\n")
    lost_text = (
        f"types of {counted(untyped, 'parameter')} are not in such a file: INT32 is written for whole numbers, "
        "REAL32 for others; QGroundControl refuses those that are another type"
    )
    return Written("".join(lines).encode(), (lost_text,) * bool(untyped))


def write_mission_planner(params: tuple[ParamLine, ...]) -> Written:
    """Write a file of Mission Planner: `NAME,value`."""
    kept, lost, notes = _one_component(params)
    return Written("".join(f"{line.name},{_text(line)}\n" for line in kept).encode(), lost, notes)


def write_mavproxy(params: tuple[ParamLine, ...]) -> Written:
    """Write a file of MAVProxy: `NAME             value`."""
    kept, lost, notes = _one_component(params)
    return Written("".join(f"{line.name:<{NAME_PADDED}} {_text(line)}\n" for line in kept).encode(), lost, notes)


def _text(line: ParamLine) -> str:
    """Format a value, exact in 32 bits, and whole where it is whole."""
    return shown(line.value) if isinstance(line.value, int) or line.type is not None else repr(line.value)


def _one_component(params: tuple[ParamLine, ...]) -> tuple[list[ParamLine], tuple[str, ...], tuple[str, ...]]:
    """Return the parameters of the first vehicle and component: these formats cannot name others."""
    if not params:
        return [], (), ()
    owner = (params[0].system, params[0].component)
    kept = [line for line in params if (line.system, line.component) == owner]
    lost = len(params) - len(kept)
    lost_text = f"{counted(lost, 'parameter')} of other vehicles or components than {owner[0]}/{owner[1]}"
    typed = any(line.type is not None for line in params)
    return kept, (lost_text,) * bool(lost), ("types and numbers of vehicles are not in such a file",) * typed


WRITERS: dict[str, Callable[[tuple[ParamLine, ...]], Written]] = {
    "params": write_qgc_params,
    "param": write_mission_planner,
    "parm": write_mavproxy,
}
"""The writers, by the name of the format (`file_types.Format`)."""
