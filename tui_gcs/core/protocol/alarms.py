"""Alarms on the bus: what needs an operator's act, grouped by cause; the station computes them, consoles answer.

They travel in `StationStatus.alarms`, the worst that holds first, so that every console shows the same and a new one
has them with its first status. Times are the station's monotonic seconds.
"""

import re
from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import Literal

from tui_gcs.core.protocol.base import Message, Request


class AlarmLevel(IntEnum):
    """facts/terminal.md D7."""

    ADVISORY = 1
    """To be known; nobody is rung for it, nobody acknowledges it, and it goes by itself."""
    CAUTION = 2
    """To be known now, to be answered soon."""
    WARNING = 3
    """To be answered now."""


AlarmState = Literal["new", "acknowledged", "over", "shelved"]
"""over: not true any more, and nobody has acknowledged it. What was acknowledged and is over is gone."""


class Alarm(Message, frozen=True):
    """One cause, whoever has it: eight vehicles without GPS are one alarm."""

    cause: str
    """Stable name, e.g. "lost"."""
    level: AlarmLevel
    tag: str
    """Three letters for a small cell, e.g. "LST"."""
    title: str
    """What is wrong, e.g. "LOST in the air"."""
    action: str
    """What to do; an action of the console stands in brackets: "[hold_all] hold all"."""
    state: AlarmState
    raised: int
    """Number of its newest raising: an acknowledgement names it, so that what came later stays new."""
    since_s: float
    """When the oldest of it was raised."""
    vehicles: tuple[int, ...] = ()
    """Those of which it is true (over: was true)."""
    fresh: tuple[int, ...] = ()
    """Those of them that nobody has acknowledged."""
    names: tuple[str, ...] = ()
    """Links, teams: where it is not about a vehicle."""
    text: str = ""
    """Details, of the newest of it."""
    by: str = ""
    """Who acknowledged or shelved it last."""
    shelved_until_s: float = 0.0

    def words(self) -> str:
        """What is wrong, and with whom; without what to do."""
        who = ", ".join([*([vehicles_words(self.vehicles)] if self.vehicles else []), *self.names])
        what = f"{self.title}: {who}" if who else self.title
        return f"{what}  {self.text}" if self.text else what


class Acknowledge(Request, frozen=True, tag="acknowledge"):
    """These were seen: causes, with the `raised` that was on the screen. It ends no alarm; it commands nothing."""

    raised: dict[str, int]


class Shelve(Request, frozen=True, tag="shelve"):
    """Do not show these for a while, with whom they are now; refused beyond the limit of their level."""

    raised: dict[str, int]
    minutes: float


class Unshelve(Request, frozen=True, tag="unshelve"):
    """Show these again, as new."""

    causes: tuple[str, ...]


def to_answer(alarms: Iterable[Alarm]) -> Alarm | None:
    """Of alarms in their order the first that nobody has seen: what an acknowledgement is for."""
    return next((alarm for alarm in alarms if alarm.state in ("new", "over")), None)


def vehicles_words(vehicles: Iterable[int]) -> str:
    """`vehicle 5`, `vehicles 1-3 6`."""
    text = id_ranges(vehicles)
    return f"vehicle {text}" if text.isdigit() else f"vehicles {text}"


def id_ranges(vehicles: Iterable[int]) -> str:
    """`1-3 6`."""
    ranges: list[list[int]] = []
    for vehicle in sorted(vehicles):
        if ranges and vehicle == ranges[-1][1] + 1:
            ranges[-1][1] = vehicle
        else:
            ranges.append([vehicle, vehicle])
    return " ".join(str(low) if low == high else f"{low}-{high}" for low, high in ranges)


def action_words(action: str, keys: Mapping[str, str]) -> str:
    """`Alarm.action` with the keys of a console (by action) in place of the brackets; without a key only the words."""
    return re.sub(r"\[(\w+)\] ", lambda match: f"{keys[match[1]]} " if keys.get(match[1]) else "", action)
