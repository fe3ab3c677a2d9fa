"""Parameter files and the parameters of a vehicle: what of a file is set on vehicles, and a vehicle as a file."""

from collections.abc import Iterable

from tui_gcs.core.formats.content import Content, FormatError, ParamLine
from tui_gcs.core.formats.file_types import format_of
from tui_gcs.core.formats.params import IDENTITIES, NOT_TO_WRITE, WRITERS, write_mavproxy
from tui_gcs.core.protocol.services import ParamRow
from tui_gcs.core.services.parameters.param_values import ParamType, same

AUTOPILOT_COMPONENT = 1
NETWORK_STEP = 1000
"""The distance between the vehicle numbers of two networks: number modulo this is the MAVLink system id."""


def values_to_set(content: Content) -> tuple[dict[str, int | float], tuple[str, ...]]:
    """Return the values of a file that are meant for vehicles, by name, and a line for each thing left out.

    Values that a vehicle computes itself and those that say which vehicle it is are left out.

    Raises:
        FormatError: it holds no parameters, or those of several vehicles or components.
    """
    if not content.params:
        raise FormatError("holds no parameters")
    owners = {(line.system, line.component) for line in content.params}
    if len(owners) > 1:
        raise FormatError(f"holds parameters of {len(owners)} vehicles or components; take one out")
    computed = [line.name for line in content.params if line.name in NOT_TO_WRITE]
    own = [line.name for line in content.params if line.name in IDENTITIES]
    left_out = [*content.left_out, *content.notes]
    left_out += [f"left out, the vehicle reckons them itself: {', '.join(computed)}"] * bool(computed)
    left_out += [f"left out, part of a vehicle's identity: {', '.join(own)}"] * bool(own)
    skipped = {*computed, *own}
    return {line.name: line.value for line in content.params if line.name not in skipped}, tuple(left_out)


def parameter_file(name: str, vehicle: int, firmware: str, rows: Iterable[ParamRow]) -> bytes:
    """Return a vehicle's parameters in the format of the ending of `name`; MAVProxy's where that has none.

    `firmware` is autopilot and version for the first line.
    """
    target = format_of(name)
    write = WRITERS.get(target.name, write_mavproxy) if target is not None else write_mavproxy
    lines = (ParamLine(row.name, row.value, type_of(row), vehicle % NETWORK_STEP, AUTOPILOT_COMPONENT) for row in rows)
    return f"# vehicle {vehicle} {firmware}".rstrip().encode() + b"\n" + write(tuple(lines)).data


def type_of(row: ParamRow) -> ParamType:
    """Return the type of a row; REAL32 where it is none that is known here."""
    return ParamType.__members__.get(row.type.upper(), ParamType.REAL32)


def holds(row: ParamRow, value: int | float) -> bool:
    """Return whether a vehicle's parameter has this value already, as far as its type can tell."""
    return same(row.value, value, type_of(row))
