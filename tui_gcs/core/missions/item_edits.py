"""Edits of a list of items: insert, delete, reorder, shift. Jumps lead to the same items as before."""

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace

from tui_gcs.core.missions.draft import Items
from tui_gcs.core.plans.model import JUMP, PlanItem


def insert(items: Items, at: int, new: Iterable[PlanItem]) -> Items:
    """Return the items with `new` before the one at `at`. Jumps within `new` count from its first item."""
    added = tuple(new)
    at = min(max(at, 0), len(items))
    old = _jumps(items, lambda target: target + len(added) * (target >= at))
    return (*old[:at], *_jumps(added, lambda target: target + at), *old[at:])


def delete(items: Items, first: int, count: int = 1) -> Items:
    """Return the items without `count` from `first` on. A jump to one of them leads to the item after them."""
    last = min(first + count, len(items))

    def kept(target: int) -> int:
        return target if target < first else max(first, target - (last - first))

    return _jumps((*items[:first], *items[last:]), kept)


def reorder(items: Items, at: int, by: int) -> tuple[Items, int]:
    """Return the items with the one at `at` moved by `by` places, and its new index."""
    to = min(max(at + by, 0), len(items) - 1)
    order = [i for i in range(len(items)) if i != at]
    order.insert(to, at)
    now = {old: new for new, old in enumerate(order)}
    return _jumps([items[old] for old in order], lambda target: now.get(target, target)), to


def put(items: Items, at: int, item: PlanItem) -> Items:
    """Return the items with `item` instead of the one at `at`."""
    return (*items[:at], item, *items[at + 1 :])


def shifted(items: Items, chosen: Collection[int], north_1e7: int, east_1e7: int) -> Items:
    """Return the items with the chosen ones moved north and east by 1e-7 degrees; items without a place stay."""
    return tuple(
        _moved(item, north_1e7, east_1e7) if i in chosen and item.is_place else item for i, item in enumerate(items)
    )


def _moved(item: PlanItem, north_1e7: int, east_1e7: int) -> PlanItem:
    """Return a moved copy.

    The constructor is called because `replace` takes four times as long for a thousand items.
    """
    x, y = item.x + north_1e7, item.y + east_1e7
    return PlanItem(item.command, item.frame, item.params, x, y, item.z, item.autocontinue)


def jumps_to(items: Items, index: int) -> int:
    """How many jumps lead to an item."""
    return sum(item.command == JUMP and item.params[0] == index for item in items)


def _jumps(items: Iterable[PlanItem], target: Callable[[int], int]) -> Items:
    """Return the items with renumbered jumps. A target that is no index (a file may hold anything) stays."""
    return tuple(
        replace(item, params=(float(target(int(item.params[0]))), *item.params[1:]))
        if item.command == JUMP and abs(item.params[0]) < 1e6
        else item
        for item in items
    )
