"""Mission jumps: a vehicle goes on with another item of its mission than the plan on board leads to.

MISSION_SET_CURRENT is answered by MISSION_CURRENT to all, which does not name the sender. But the plan on board
says which item comes next, and how far it is. What the plan does not explain is another station's doing, or a pilot's.
"""

import math

from tui_gcs.core.plans import model as plan
from tui_gcs.core.plans.model import PlanItem

FAR_M = 40.0
"""An item that is farther away than this has not just been reached: the largest usual acceptance radius is 10 m."""
MAX_SPEED_M_S = 25.0
"""So far a vehicle may have flown on in each second without a report."""
FIRST_NAVIGATION, LAST_NAVIGATION = 16, 95
"""MAV_CMD numbers of items that a vehicle flies (MAV_CMD_NAV_LAST); the others are done in passing."""
METRES_PER_DEG = 111_320.0


def jump_words(
    items: tuple[PlanItem, ...], before: int, now: int, here_deg: tuple[float, float], silent_s: float
) -> str:
    """What a vehicle did that went on from item `before` to item `now`; "" if the plan explains it.

    Args:
        items: The whole mission on board.
        before: The index that was current, from 0.
        now: The index that is current.
        here_deg: Latitude and longitude of the vehicle; NaN if unknown.
        silent_s: The time between the two reports.
    """
    if before == now or not (0 <= before < len(items) and 0 <= now < len(items)):
        return ""
    near_m = FAR_M + MAX_SPEED_M_S * silent_s
    if _leads_back(items, before, now) if now < before else not _leaves_out(items, before, now, here_deg, near_m):
        return ""
    return f"went from item {before + 1} to item {now + 1} of its mission"


def _leads_back(items: tuple[PlanItem, ...], before: int, now: int) -> bool:
    """Whether a jump of the plan leads from an item to an earlier one."""
    for jump in items[before:]:
        target = jump.params[0] if jump.command == plan.JUMP else math.nan
        if target <= now and not any(map(_is_flown, items[int(target) : now])):
            return True
    return False


def _leaves_out(
    items: tuple[PlanItem, ...], before: int, now: int, here_deg: tuple[float, float], near_m: float
) -> bool:
    """Whether the vehicle has not been within `near_m` of an item that it has left behind."""
    jumps = any(item.command == plan.JUMP and item.params[0] > before for item in items[: now + 1])
    return not jumps and any(
        _is_flown(item) and item.is_place and not item.has_no_place and _away_m(item, here_deg) > near_m
        for item in items[before:now]
    )


def _is_flown(item: PlanItem) -> bool:
    return FIRST_NAVIGATION <= item.command <= LAST_NAVIGATION


def _away_m(item: PlanItem, here_deg: tuple[float, float]) -> float:
    """Distance on the ground, metres; NaN if one place is unknown, which is never far."""
    north_m = (item.lat_deg - here_deg[0]) * METRES_PER_DEG
    east_m = (item.lon_deg - here_deg[1]) * METRES_PER_DEG * math.cos(math.radians(here_deg[0]))
    return math.hypot(north_m, east_m)
