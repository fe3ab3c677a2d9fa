"""Edits of a list of items: insert, delete, reorder, move. Pure; jumps lead to the same items as before."""

from collections.abc import Callable, Collection, Iterable
from dataclasses import replace

from tui_gcs.core.missions.draft import Items
from tui_gcs.core.plans.model import JUMP, PlanItem


def insert(items: Items, at: int, new: Iterable[PlanItem]) -> Items:
    """With `new` before the item that is at `at`; jumps among them count from the first of them."""
    added = tuple(new)
    at = min(max(at, 0), len(items))
    old = _jumps(items, lambda target: target + len(added) * (target >= at))
    return (*old[:at], *_jumps(added, lambda target: target + at), *old[at:])


def delete(items: Items, first: int, count: int = 1) -> Items:
    """Without `count` items from `first` on; a jump to one of them leads to the one after them."""
    last = min(first + count, len(items))

    def kept(target: int) -> int:
        return target if target < first else max(first, target - (last - first))

    return _jumps((*items[:first], *items[last:]), kept)


def reorder(items: Items, at: int, by: int) -> tuple[Items, int]:
    """With the item at `at` so many places further on; and where it is then."""
    to = min(max(at + by, 0), len(items) - 1)
    order = [i for i in range(len(items)) if i != at]
    order.insert(to, at)
    now = {old: new for new, old in enumerate(order)}
    return _jumps([items[old] for old in order], lambda target: now.get(target, target)), to


def put(items: Items, at: int, item: PlanItem) -> Items:
    """With `item` in the place of the one at `at`."""
    return (*items[:at], item, *items[at + 1 :])


def shifted(items: Items, chosen: Collection[int], north_1e7: int, east_1e7: int) -> Items:
    """With the chosen items further north and east, in 1e-7 degrees; what is no place stays."""
    return tuple(
        _moved(item, north_1e7, east_1e7) if i in chosen and item.is_place else item for i, item in enumerate(items)
    )


def _moved(item: PlanItem, north_1e7: int, east_1e7: int) -> PlanItem:
    """Made anew: `replace` takes four times as long, and there may be a thousand."""
    x, y = item.x + north_1e7, item.y + east_1e7
    return PlanItem(item.command, item.frame, item.params, x, y, item.z, item.autocontinue)


def jumps_to(items: Items, index: int) -> int:
    """How many jumps lead to an item."""
    return sum(item.command == JUMP and item.params[0] == index for item in items)


def _jumps(items: Iterable[PlanItem], target: Callable[[int], int]) -> Items:
    """With the targets of jumps renumbered; one that is no index (a file may say anything) stays as it is."""
    return tuple(
        replace(item, params=(float(target(int(item.params[0]))), *item.params[1:]))
        if item.command == JUMP and abs(item.params[0]) < 1e6
        else item
        for item in items
    )
