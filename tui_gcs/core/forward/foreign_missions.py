"""Commands and missions of other stations, as data: what they sent, and what is on a vehicle as its mission.

A mission is known only if it passed through this station as a whole. One that came another way is not started for
others.
"""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from tui_gcs.core.mavlink.dialect import MavlinkMessage

CURRENT_ITEM_S = 5.0
"""The next item is known for this long after the vehicle reported it (MISSION_CURRENT comes about once a second)."""

HERE_INT = 2**31 - 1
"""A COMMAND_INT's x or y that means the vehicle's own place."""

Position = tuple[float, float]


@dataclass(frozen=True)
class ForeignCommand:
    """A MAV_CMD as it came: in a COMMAND_LONG, a COMMAND_INT or a mission item."""

    command: int
    params: tuple[float, ...]
    """Param 1 to 7, of which 5 and 6 are as written: a place's latitude and longitude, or anything else."""
    frame: int | None
    """MAV_FRAME; None in a COMMAND_LONG, which has none."""
    is_1e7: bool = False
    """Its place is in whole numbers of 1e-7 degrees."""

    def param(self, number: int) -> float:
        """The parameter `number`, counted from 1."""
        return self.params[number - 1]

    def degrees(self) -> tuple[float, float] | None:
        """(latitude, longitude), not checked; None where it means the vehicle's own place."""
        lat, lon = self.param(5), self.param(6)
        if self.is_1e7:
            lat, lon = (math.nan if value == HERE_INT else value / 1e7 for value in (lat, lon))
        if math.isnan(lat) and math.isnan(lon):
            return None
        return lat, lon


def read_command(message: MavlinkMessage) -> ForeignCommand:
    """The command in a COMMAND_LONG, COMMAND_INT, MISSION_ITEM or MISSION_ITEM_INT."""
    name, fields = message.name, message.fields
    if name == "COMMAND_LONG":
        return ForeignCommand(fields["command"], tuple(fields[f"param{i}"] for i in range(1, 8)), None)
    params = (*(fields[f"param{i}"] for i in range(1, 5)), fields["x"], fields["y"], fields["z"])
    return ForeignCommand(
        fields["command"], params, fields["frame"], is_1e7=name in ("COMMAND_INT", "MISSION_ITEM_INT")
    )


class MissionStep(NamedTuple):
    """One item of a mission that was checked."""

    order: ForeignCommand
    place_m: Position | None = None
    """(x, y) in ENU metres, where it is flown to."""
    jump: int | None = None
    """The item it may jump back to."""


@dataclass
class ForeignMission:
    """A mission of another station: collected item by item, or on board and then unknown until it was accepted."""

    sender: tuple[int, int] | None = None
    """System and component that uploads, or did."""
    count: int = 0
    steps: list[MissionStep] = field(default_factory=list)
    accepted: bool = False
    """The vehicle has acknowledged the whole upload."""
    _current: int = 0
    _current_s: float | None = None

    def forget(self) -> None:
        """What is on board is not known any more."""
        self.sender, self.count, self.steps, self.accepted = None, 0, [], False

    def accept(self, uploaded: "ForeignMission") -> None:
        """The vehicle has acknowledged the whole of `uploaded`."""
        self.sender, self.count, self.steps, self.accepted = uploaded.sender, uploaded.count, uploaded.steps, True

    def on_current(self, seq: int, now: float) -> None:
        """The vehicle reported its current item."""
        self._current, self._current_s = seq, now

    def current(self, now: float) -> int | None:
        """The item to which the vehicle flies next, None if it has not reported it lately."""
        known = self._current_s is not None and now - self._current_s <= CURRENT_ITEM_S
        return self._current if known else None

    def place_before(self, seq: int) -> Position | None:
        """The last place before item `seq`, None if that is wherever the mission is started."""
        return next((step.place_m for step in reversed(self.steps[:seq]) if step.place_m is not None), None)

    def places_from(self, seq: int) -> list[Position]:
        """The places that may be flown to first if the mission goes on at item `seq`."""
        found: list[Position] = []
        seen: set[int] = set()
        waiting = [seq]
        while waiting:
            at = waiting.pop()
            if at in seen or at >= len(self.steps):
                continue
            seen.add(at)
            step = self.steps[at]
            if step.place_m is not None:
                found.append(step.place_m)
                continue
            waiting.append(at + 1)
            if step.jump is not None:
                waiting.append(step.jump)
        return found

    def places(self) -> list[Position]:
        """All places of the mission."""
        return [step.place_m for step in self.steps if step.place_m is not None]
