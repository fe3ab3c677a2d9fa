"""The items of a mission in the order in which a vehicle comes to them: jumps are taken as often as they say."""

from collections.abc import Iterator
from dataclasses import dataclass

from tui_gcs.core.missions.draft import Items
from tui_gcs.core.plans.model import JUMP

MAX_STEPS = 20_000
"""Of one walk: a jump back over many items, many times, is not followed further."""


@dataclass
class ItemWalk:
    """Iterate over `steps`; afterwards `endless` or `cut` say why it ended before the mission does."""

    items: Items
    endless: bool = False
    """A jump is taken for ever: it was followed once."""
    cut: bool = False
    """More than `MAX_STEPS`."""

    def steps(self) -> Iterator[int]:
        """Indices of the items that are not jumps."""
        left: dict[int, int] = {}
        at = taken = 0
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
                at += 1  # what it leads to is not there: `plan_check` says so
                continue
            if at not in left:
                left[at] = int(times) if times >= 0 else 1
                self.endless |= times < 0
            if left[at] > 0:
                left[at] -= 1
                at = int(target)
            else:
                if times < 0:
                    return  # never gets further than here
                del left[at]
                at += 1
