"""Parameter files of QGroundControl (`.params`), Mission Planner (`.param`) and MAVProxy (`.parm`).

| program | line |
| QGroundControl | vehicle, component, name, value, MAV_PARAM_TYPE, tabs between |
| Mission Planner | NAME,value |
| MAVProxy | NAME padded to 16, value; 0x… is read |
"""

import math
from collections.abc import Callable
from dataclasses import replace

from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.content import FormatError, ParamLine, Written, counted
from tui_gcs.core.formats.fence_rally_lists import Lines
from tui_gcs.core.plans.check import MAX_PARAM
from tui_gcs.core.services.parameters.param_values import ParamType, check_name, shown

MAX_PARAMS = 8192
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


def read_params(lines: Lines) -> tuple[tuple[ParamLine, ...], tuple[str, ...]]:
    """Read the parameters in the order of a file, and notes. Raises FormatError."""
    found: dict[tuple[int | None, int | None, str], ParamLine] = {}
    again = 0
    for number, fields in lines:
        line = _read(number, fields)
        key = (line.system, line.component, line.name)
        if key in found:
            # Which one would count is a guess: refuse.
            if found[key].value != line.value:
                before = shown(found[key].value)
                raise FormatError(f"line {number}: {line.name} is {shown(line.value)} here and {before} further up")
            again += 1
        found[key] = line
        if len(found) > MAX_PARAMS:
            raise FormatError(f"more than {MAX_PARAMS} parameters")
    return tuple(found.values()), (f"{counted(again, 'line')} repeated with the same value",) * bool(again)


def _read(number: int, fields: list[str]) -> ParamLine:
    # Directives such as @include name other files: they are not opened.
    if fields[0].startswith("@"):
        raise FormatError(f"line {number}: {clean(fields[0], 20)} is not followed")
    if len(fields) == QGC_FIELDS:
        system, component, kind = (_whole(number, fields[i]) for i in (0, 1, 4))
        known = kind in {each.value for each in ParamType}
        if not known:
            raise FormatError(f"line {number}: type {kind} is not known")
        line = ParamLine(_name(number, fields[2]), _value(number, fields[3]), kind, system, component)
        return _fitting(number, line)
    if len(fields) == 3 and fields[2].upper() == "@READONLY":
        raise FormatError(f"line {number}: {clean(fields[2], 20)} is not followed")
    if len(fields) != 2:
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
