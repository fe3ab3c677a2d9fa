"""Alarms on the bus: situations that need an operator's act, grouped by cause.

The station computes them and consoles acknowledge them. They travel in `StationStatus.alarms`, the worst that holds
first, so that every console shows the same list and a new one has it with its first status. Times are the station's
monotonic seconds.
"""

import re
from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import Literal

from tui_gcs.core.protocol.base import Message, Request


class AlarmLevel(IntEnum):
    """How soon an alarm must be answered: the three levels of ISA-18.2 and of flight decks (docs/terminal.md D7)."""

    ADVISORY = 1
    """For information: it does not ring, needs no acknowledgement, and ends by itself."""
    CAUTION = 2
    """The operator must know it now and answer it soon."""
    WARNING = 3
    """The operator must answer it now."""


AlarmState = Literal["new", "acknowledged", "over", "shelved"]
"""An alarm is "over" when its cause has ended and it was never acknowledged; an acknowledged one is gone then."""


class Alarm(Message, frozen=True):
    """One cause with all vehicles, links or teams that have it: eight vehicles without GPS are one alarm."""

    cause: str
    """The stable name of the cause, e.g. "lost"."""
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
    """The vehicles of which it is true; of one that is over: of which it was true."""
    fresh: tuple[int, ...] = ()
    """Those of `vehicles` that no operator has acknowledged."""
    names: tuple[str, ...] = ()
    """Links and teams, where it is not about vehicles."""
    text: str = ""
    """Details of the newest raising."""
    by: str = ""
    """The principal that acknowledged or shelved it last."""
    shelved_until_s: float = 0.0

    def words(self) -> str:
        """The title, the vehicles or names, and the details; without what to do."""
        subject = ", ".join([*([vehicles_words(self.vehicles)] if self.vehicles else []), *self.names])
        what = f"{self.title}: {subject}" if subject else self.title
        return f"{what}  {self.text}" if self.text else what


class Acknowledge(Request, frozen=True, tag="acknowledge"):
    """These were seen: causes, with the `raised` that was on the screen. It ends no alarm; it commands nothing."""

    raised: dict[str, int]


class Shelve(Request, frozen=True, tag="shelve"):
    """Hide these causes for some minutes, for the vehicles that have them; refused beyond the limit of their level."""

    raised: dict[str, int]
    minutes: float


class Unshelve(Request, frozen=True, tag="unshelve"):
    """Show these again, as new."""

    causes: tuple[str, ...]


def to_answer(alarms: Iterable[Alarm]) -> Alarm | None:
    """The first alarm of the list that no operator has acknowledged; None if there is none."""
    return next((alarm for alarm in alarms if alarm.state in ("new", "over")), None)


def vehicles_words(vehicles: Iterable[int]) -> str:
    """`vehicle 5`, `vehicles 1-3 6`."""
    text = id_ranges(vehicles)
    # A range such as 1-3 is several vehicles, one id is one.
    return f"vehicle {text}" if text.isdigit() else f"vehicles {text}"


def id_ranges(vehicles: Iterable[int]) -> str:
    """The ids in ascending order with ranges drawn together, e.g. `1-3 6`."""
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
