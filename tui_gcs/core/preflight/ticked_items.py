"""The scenario's own checklist: which items operators have ticked for the next start.

A tick belongs to the text of an item, so it stays when another part of the scenario changes. It holds for one start.
As a signature it is not kept over a restart of the station.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from tui_gcs.core.protocol.preflight import CHECKLIST, Check, CheckState

_TICK = "do it, then tick it: y in the list"


@dataclass(frozen=True)
class Tick:
    """Who ticked an item, and when."""

    operator: str
    wall_s: float
    """Unix time."""


class TickedItems:
    """Keeps the ticks by the text of the item."""

    def __init__(self) -> None:
        self._ticks: dict[str, Tick] = {}

    def tick(self, text: str, tick: Tick | None) -> bool:
        """Tick an item, or with None take its tick back; return whether this changed anything."""
        changed = (text in self._ticks) != (tick is not None)
        self._ticks.pop(text, None)
        if tick is not None:
            self._ticks[text] = tick
        return changed

    def clear(self) -> None:
        """Forget all ticks: a new start asks again."""
        self._ticks.clear()

    def checks(self, items: Sequence[str], *, live: bool) -> Iterator[Check]:
        """Return one line per item, in the scenario's order; open items refuse the start of real vehicles only."""
        for text in items:
            tick = self._ticks.get(text)
            if tick is not None:
                when = time.strftime("%H:%M:%SZ", time.gmtime(tick.wall_s))
                yield Check(CHECKLIST, CheckState.TICKED, text, f"ticked by {tick.operator} at {when}")
            else:
                yield Check(CHECKLIST, CheckState.FAIL if live else CheckState.WARN, text, _TICK)
