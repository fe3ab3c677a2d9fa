"""The plans that vehicles are known to hold, on the map: missions, fences, rally points.

These differ without colour, too: a mission is dotted from number to number, an inclusion fence has dashes, an exclusion
fence a solid line, a rally point is an R.
"""

from collections.abc import Sequence

import numpy as np

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.missions.mission_findings import fence_regions
from tui_gcs.core.plans.model import PlanItem, PlanKind
from tui_gcs.core.protocol.services import OnBoardRow
from tui_gcs.core.requests.plan_rows import plan_of
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.map.map_drawings import MapLine, MapWord

WAY_DASH, FENCE_DASH = (2.0, 3.0), (5.0, 3.0)
MAX_NUMBERS = 40
"""The most numbers along one mission; more cannot be read."""


def drawings(rows: Sequence[OnBoardRow], frame: LocalFrame) -> tuple[list[MapLine], list[MapWord]]:
    """Return lines and words for the plans of these vehicles, as far as they are known."""
    lines: list[MapLine] = []
    words: list[MapWord] = []
    for row in rows:
        places = _places(plan_of(PlanKind.MISSION, row.mission or ()).items, frame)
        if places:
            lines.append(MapLine(np.array([place for _, place in places]), Ink.PLAN, dash=WAY_DASH))
            # Numbers that touch each other cannot be read: of many only some are written.
            step = max(1, len(places) // MAX_NUMBERS)
            words += [MapWord(place, f"{row.vehicle}.{i + 1}", Ink.PLAN) for i, place in places[::step]]
        for inside, region in fence_regions(plan_of(PlanKind.FENCE, row.fence or ()).items, frame):
            border = np.array(region.exterior.coords)
            lines.append(
                MapLine(border, Ink.OVERLAY if inside else Ink.NO_FLY, dash=FENCE_DASH if inside else (1.0, 0.0))
            )
            words.append(MapWord(_top(border), f"fence {row.vehicle}", Ink.OVERLAY if inside else Ink.NO_FLY))
        rally = _places(plan_of(PlanKind.RALLY, row.rally or ()).items, frame)
        words += [MapWord(place, f"R{row.vehicle}", Ink.ADVISORY) for _, place in rally]
    return lines, words


def _places(items: Sequence[PlanItem], frame: LocalFrame) -> list[tuple[int, tuple[float, float]]]:
    """Return (index, ENU metres) of the items that have a place."""
    found = []
    for i, item in enumerate(items):
        # 0, 0 is the autopilots' "where the vehicle is", not a place in the Atlantic.
        if item.is_place and (item.x, item.y) != (0, 0):
            x, y = frame.to_enu(item.lat_deg, item.lon_deg)
            found.append((i, (float(x), float(y))))
    return found


def _top(border: np.ndarray) -> tuple[float, float]:
    x, y = border[int(np.argmax(border[:, 1]))][:2]
    return float(x), float(y)
