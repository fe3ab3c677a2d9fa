"""The file of a draft: JSON of the items of all vehicles. It is also written after every edit, against crashes.

Files of other programs, one vehicle each, are read and written in `core/formats`.
"""

import math
from dataclasses import dataclass, replace

import msgspec

from tui_gcs.core.missions.draft import Items, MissionDraft, VehicleDraft
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.plans.check import MAX_ITEMS
from tui_gcs.core.plans.model import PlanItem, PlanKind

Params = tuple[float | None, float | None, float | None, float | None]
VERSION = 1
MAX_BYTES = 32 << 20
# System ids are one byte, and 0 is all systems.
MAX_VEHICLES = 255


class DraftFileError(Exception):
    """The file cannot be read or written as a draft; the message is one line."""


class _DraftRow(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True, gc=False):
    """One item.

    Rows hold only numbers, so they are not tracked by the garbage collector: 400,000 are read in 0.2 s instead of 0.8.
    """

    command: int
    frame: int
    params: Params
    """None stands for NaN, which JSON does not have."""
    x: int
    y: int
    z: float
    autocontinue: bool


class _Vehicle(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    mission: tuple[_DraftRow, ...] = ()
    fence: tuple[_DraftRow, ...] = ()
    rally: tuple[_DraftRow, ...] = ()


class _Assumed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    speed_m_s: float
    climb_m_s: float
    descent_m_s: float
    endurance_s: float
    reserve_pct: float


class _DraftFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    missions: int
    """The version of the format."""
    vehicles: dict[int, _Vehicle]
    assumed: _Assumed | None = None


@dataclass(frozen=True)
class SavedDraft:
    """The contents of a file: plans, and the performance that their times were computed with, None if not given."""

    draft: MissionDraft
    performance: Performance | None = None


def to_bytes(saved: SavedDraft) -> bytes:
    """Encode a draft as JSON."""
    draft, craft = saved.draft, saved.performance
    assumed = (
        None
        if craft is None
        else _Assumed(craft.speed_m_s, craft.climb_m_s, craft.descent_m_s, craft.endurance_s, craft.reserve_pct)
    )
    vehicles = {
        number: _Vehicle(*(_rows(each.items(kind)) for kind in PlanKind)) for number, each in draft.vehicles.items()
    }
    return msgspec.json.encode(_DraftFile(VERSION, vehicles, assumed)) + b"\n"


def are_missions(data: bytes) -> bool:
    """Whether the data look like a draft, valid or not."""
    return data[:64].lstrip().startswith(b'{"missions":')


def from_bytes(data: bytes) -> SavedDraft:
    """Decode a draft. Raises DraftFileError."""
    if len(data) > MAX_BYTES:
        raise DraftFileError(f"longer than {MAX_BYTES >> 20} MB")
    try:
        file = msgspec.json.decode(data, type=_DraftFile)
    except (msgspec.MsgspecError, RecursionError) as error:
        raise DraftFileError(f"no missions of this program: {error}") from None
    if file.missions != VERSION:
        raise DraftFileError(f"format {file.missions}: this program reads {VERSION}")
    if len(file.vehicles) > MAX_VEHICLES or any(not 0 < number < 1 << 16 for number in file.vehicles):
        raise DraftFileError("ids or number of its vehicles are impossible")
    # Checked before items are made of the rows, which takes longer than reading them.
    for number, rows in file.vehicles.items():
        if max(len(rows.mission), len(rows.fence), len(rows.rally)) > MAX_ITEMS:
            raise DraftFileError(f"vehicle {number}: more than {MAX_ITEMS} items")
    draft = MissionDraft()
    for number, rows in file.vehicles.items():
        kinds = [_items(rows.mission), _items(rows.fence), _items(rows.rally)]
        # Empty vehicles vanish here, as after an edit.
        draft = draft.with_vehicle(number, VehicleDraft(*kinds))
    return SavedDraft(draft, _performance(file.assumed))


def _performance(assumed: _Assumed | None) -> Performance | None:
    if assumed is None:
        return None
    performance = replace(Performance(), **msgspec.structs.asdict(assumed))
    if why := performance.problem():
        raise DraftFileError(f"what is assumed of vehicles: {why}")
    return performance


def _rows(items: Items) -> tuple[_DraftRow, ...]:
    return tuple(_DraftRow(i.command, i.frame, _params(i), i.x, i.y, i.z, i.autocontinue) for i in items)


def _items(rows: tuple[_DraftRow, ...]) -> Items:
    return tuple(PlanItem(r.command, r.frame, _numbers(r.params), r.x, r.y, r.z, r.autocontinue) for r in rows)


def _params(item: PlanItem) -> Params:
    one, two, three, four = (value if math.isfinite(value) else None for value in item.params)
    return one, two, three, four


def _numbers(params: Params) -> tuple[float, float, float, float]:
    one, two, three, four = (math.nan if value is None else value for value in params)
    return one, two, three, four
