"""Plans as an operator reads and types them: the fields of an item, and words for tables. Independent of Textual."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from tui_gcs.core.missions.command_reference import FRAMES, ParamLabel, word_of
from tui_gcs.core.missions.mission_conflicts import Conflict
from tui_gcs.core.plans.model import HERE, JUMP, PLAIN_FRAME, POLYGONS, PlanItem, PlanKind
from tui_gcs.widgets.forms.form_text import FieldError, number_text, to_number
from tui_gcs.widgets.missions.mission_editor import MissionEditor
from tui_gcs.widgets.missions.mission_edits import MissionEdits

FRAME_WORDS = tuple(FRAMES.values())
_FRAME_OF = {word: frame for frame, word in FRAMES.items()}
LARGEST = 1e9
"""No coordinate or parameter may be larger."""


@dataclass(frozen=True)
class ItemText:
    """The texts in the fields of one item; a parameter without meaning is empty."""

    command: str = ""
    east_m: str = ""
    north_m: str = ""
    height_m: str = ""
    frame: str = FRAME_WORDS[0]
    params: tuple[str, str, str, str] = ("", "", "", "")


def labels(item: PlanItem) -> tuple[ParamLabel | None, ...]:
    """Return the declaration of each of an item's four parameters; None for one that cannot be set."""
    known = {} if item.command in POLYGONS else dict(word_of(item.command).params)
    return tuple(known.get(index) for index in range(4))


def has_height(item: PlanItem) -> bool:
    """Return whether an item has a height: fences have none."""
    return item.is_place and not 5000 <= item.command < 5100


def item_text(editor: MissionEditor, item: PlanItem) -> ItemText:
    """Return the fields of an item."""
    place = editor.place_m(item)
    east, north = (number_text(round(value, 1)) for value in place) if place is not None else ("", "")
    params = [_param_text(item, i) if label is not None else "" for i, label in enumerate(labels(item))]
    return ItemText(
        word_of(item.command).word,
        east,
        north,
        number_text(item.z) if has_height(item) else "",
        FRAMES.get(PLAIN_FRAME.get(item.frame, item.frame), FRAME_WORDS[0]),
        (params[0], params[1], params[2], params[3]),
    )


def to_item(edits: MissionEdits, texts: ItemText, old: PlanItem) -> PlanItem:
    """Return the item that the fields mean; untouched fields keep their exact value. Raises FieldError."""
    # Another command has other parameters: the texts of the old ones mean nothing for it.
    if texts.command not in ("", word_of(old.command).word):
        return edits.as_command(texts.command)
    editor = edits.editor
    item = old
    before = item_text(editor, old)
    if (texts.east_m, texts.north_m) != (before.east_m, before.north_m) and item.is_place:
        item = _at(editor, texts, item)
    if has_height(item):
        item = replace(item, z=to_number(texts.height_m, "height", item.z))
        if texts.frame != before.frame:
            item = replace(item, frame=_FRAME_OF[texts.frame])
    params = [
        _to_param(item, i, text, label) if label is not None and text != shown else item.params[i]
        for i, (label, text, shown) in enumerate(zip(labels(item), texts.params, before.params, strict=True))
    ]
    return replace(item, params=(params[0], params[1], params[2], params[3]))


def _at(editor: MissionEditor, texts: ItemText, item: PlanItem) -> PlanItem:
    """Return the item at the typed place. Raises FieldError."""
    # Without a place these commands are carried out where the vehicle is.
    if item.command in HERE and not texts.east_m.strip() and not texts.north_m.strip():
        return replace(item, x=0, y=0)
    place = (to_number(texts.east_m, "E"), to_number(texts.north_m, "N"))
    lat_deg, lon_deg = editor.frame.to_geodetic(*place)
    if abs(lat_deg) > 90 or max(map(abs, place)) > LARGEST:
        raise FieldError("E, N: not on earth")
    return replace(item, x=round(lat_deg * 1e7), y=round(lon_deg * 1e7))


def _param_text(item: PlanItem, index: int) -> str:
    value = item.params[index]
    if math.isnan(value):
        return ""
    return number_text(value + 1 if item.command == JUMP and index == 0 else value)


def _to_param(item: PlanItem, index: int, text: str, label: ParamLabel) -> float:
    """Return a parameter's value; empty is NaN where that has a meaning, jumps count from 1. Raises FieldError."""
    if not text.strip() and label.empty:
        return math.nan
    value = to_number(text, label.label)
    if abs(value) > LARGEST:
        raise FieldError(f"{label.label}: too large")
    return value - 1 if item.command == JUMP and index == 0 else value


def clock(seconds: float) -> str:
    """Format seconds as `4:05` or `1:04:05`; `--` if unknown."""
    if not math.isfinite(seconds):
        return "--"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def distance(metres: float) -> str:
    """Format metres as `820 m` or `1.6 km`."""
    return f"{metres:.0f} m" if metres < 1000 else f"{metres / 1000:.1f} km"


def item_title(editor: MissionEditor, item: PlanItem) -> str:
    """Return the title of an item: its number and command, and the distance, time and energy that it takes."""
    title = f"{editor.kind.word} {editor.index + 1}  {word_of(item.command).word}"
    share = editor.forecast.path(editor.vehicle).shares.get(editor.index) if editor.kind is PlanKind.MISSION else None
    if share is None:
        return title
    length_m, duration_s = share
    energy_pct = editor.forecast.performance.energy_pct(duration_s)
    return f"{title}  {distance(length_m)} {clock(duration_s)} {energy_pct:.1f}%"


def conflict_text(conflict: Conflict) -> str:
    """Describe a conflict: which vehicles, how near, when."""
    pair = f"{conflict.first} and {conflict.second}"
    near = f"{conflict.horizontal_m:.0f} m apart, {conflict.vertical_m:.0f} m in height"
    if conflict.together:
        return f"{pair} MEET at {clock(conflict.first_s)}: {near}"
    if conflict.on_tour:
        return f"{conflict.first} crosses the tour of {conflict.second} at {clock(conflict.first_s)}: {near}"
    return f"{pair} cross: {near}, at {clock(conflict.first_s)} and {clock(conflict.second_s)}"


def of_vehicle(found: Sequence[Conflict], vehicle: int) -> list[Conflict]:
    """Return the conflicts that a vehicle is in."""
    return [each for each in found if vehicle in (each.first, each.second)]
