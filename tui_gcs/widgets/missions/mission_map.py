"""What the map of the missions screen shows: paths, the edited plan, fences, rally points, conflicts."""

import numpy as np

from tui_gcs.core.missions.draft import Items
from tui_gcs.core.missions.mission_findings import fence_regions
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_drawings import MapLine, MapWord
from tui_gcs.widgets.missions.mission_editor import MissionEditor

WAY_DASH = (3.0, 3.0)
FENCE_DASH = (5.0, 3.0)
MAX_NUMBERS = 60
"""The most numbers along a path; with more items only some are numbered, the edited one always."""


def drawings(editor: MissionEditor) -> tuple[list[MapLine], list[MapWord]]:
    """Return lines and words for the draft; the edited vehicle's plan comes last, so that it lies on top."""
    look, edited = editor.forecast, editor.vehicle
    lines: list[MapLine] = []
    words: list[MapWord] = []
    for vehicle in editor.draft.vehicles:
        points = look.path(vehicle).corners_m
        if vehicle != edited and len(points):
            lines.append(MapLine(points[:, :2], Ink.PLAN, dash=WAY_DASH))
            words.append(MapWord(_middle(points), str(vehicle), Ink.MUTED))
    # Drawn last: the edited plan lies on top of the others.
    own = look.draft.of(edited)
    for inside, region in fence_regions(own.fence, look.frame):
        border = np.array(region.exterior.coords)
        lines.append(MapLine(border, Ink.OVERLAY if inside else Ink.NO_FLY, dash=FENCE_DASH if inside else (1.0, 0.0)))
    points = look.path(edited).corners_m
    if len(points):
        lines.append(MapLine(points[:, :2], Ink.EDITED))
    words += [*_numbers(editor), MapWord(look.vehicle(edited).home.place_m, "H", Ink.EDITED)]
    if editor.kind is not PlanKind.RALLY:
        words += [MapWord(place, "R", Ink.ADVISORY) for i in own.rally if (place := editor.place_m(i)) is not None]
    for conflict in look.conflicts:
        sign, ink = ("!", Ink.WARNING) if conflict.together else ("^", Ink.CAUTION)
        words.append(MapWord(conflict.place_m, f"{sign}{conflict.first}-{conflict.second}", ink, must=True))
    return lines, words


def _numbers(editor: MissionEditor) -> list[MapWord]:
    """Return the numbers of the items of the edited kind."""
    items: Items = editor.items
    letter = {PlanKind.MISSION: "", PlanKind.FENCE: "f", PlanKind.RALLY: "R"}[editor.kind]
    step = max(1, len(items) // MAX_NUMBERS)
    words = []
    for i in sorted({*range(0, len(items), step), editor.index}):
        place = editor.place_m(items[i]) if i < len(items) else None
        if place is not None:
            chosen = i == editor.index
            words.append(MapWord(place, f"{letter}{i + 1}", Ink.SELECTED if chosen else Ink.EDITED, must=chosen))
    return words


def _middle(points: np.ndarray) -> tuple[float, float]:
    x, y = points[len(points) // 2][:2]
    return float(x), float(y)
