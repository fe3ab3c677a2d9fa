"""The items of a mission in the order in which a vehicle reaches them; jumps are followed as often as they demand."""

from collections.abc import Iterator
from dataclasses import dataclass

from tui_gcs.core.missions.draft import Items
from tui_gcs.core.plans.model import JUMP

MAX_STEPS = 20_000
"""The most steps of one walk: a jump back over many items, many times, is not followed further."""


@dataclass
class ItemWalk:
    """A walk through a mission. After iterating over `steps`, `endless` and `cut` give the reason if it ended early."""

    items: Items
    first: int = 0
    """The index of the item that it begins with."""
    endless: bool = False
    """A jump repeats for ever; it was followed once."""
    cut: bool = False
    """The walk was longer than `MAX_STEPS`."""

    def steps(self) -> Iterator[int]:
        """Iterate over the indices of the items that are not jumps."""
        left: dict[int, int] = {}
        at, taken = self.first, 0
        while at < len(self.items):
            taken += 1
            if taken > MAX_STEPS:
                self.cut = True
                return
            item = self.items[at]
            if item.command != JUMP:
                yield at
                at += 1
                continue
            target, times = item.params[:2]
            if not 0 <= target < len(self.items) or target == at:
                # Its target does not exist, which `core/plans/check` reports.
                at += 1
                continue
            if at not in left:
                # A negative count means for ever (MAV_CMD_DO_JUMP): it is followed once.
                left[at] = int(times) if times >= 0 else 1
                self.endless |= times < 0
            if left[at] > 0:
                left[at] -= 1
                at = int(target)
            else:
                if times < 0:
                    # It repeats for ever: the mission never gets beyond it.
                    return
                del left[at]
                at += 1
