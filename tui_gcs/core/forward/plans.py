"""What another station has put on a vehicle as its mission, as far as it passed through here: only that is judged.

A mission on board that came another way is not known, and is not started for others.
"""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from tui_gcs.core.forward.foreign_commands import ForeignCommand

CURRENT_S = 5.0
"""Which item comes next is known for so long after the vehicle said so (MISSION_CURRENT comes about once a second)."""

Position = tuple[float, float]


class MissionStep(NamedTuple):
    """One item of a mission, as judged."""

    order: "ForeignCommand"
    place_m: Position | None = None
    """(x, y) in ENU metres, where it is flown to."""
    jump: int | None = None
    """The item it may jump back to."""


@dataclass
class ForeignMission:
    """One vehicle's mission: nothing is known of it until another station's whole upload was accepted."""

    sender: tuple[int, int] | None = None
    """System and component that uploads, or did."""
    count: int = 0
    steps: list[MissionStep] = field(default_factory=list)
    accepted: bool = False
    """The vehicle said that it has all of it."""
    _current: int = 0
    _current_s: float | None = None

    def begin(self, sender: tuple[int, int], count: int) -> None:
        """An upload begins: the mission before is gone."""
        self.forget()
        self.sender, self.count = sender, count

    def forget(self) -> None:
        """What is on board is not known any more."""
        self.sender, self.count, self.steps, self.accepted = None, 0, [], False

    def add(self, seq: int, step: MissionStep) -> None:
        """An item has been passed on; the same one again changes nothing."""
        if seq == len(self.steps):
            self.steps.append(step)

    def answered(self, system: int, ok: bool) -> None:
        """The vehicle ended an upload or deletion of the station with that system id."""
        if self.sender is not None and system == self.sender[0]:
            if ok and self.steps and len(self.steps) == self.count:
                self.accepted = True
            else:
                self.forget()
        elif ok:  # somebody else's mission is on board now
            self.forget()

    def comes_next(self, seq: int, now: float) -> None:
        """The vehicle named its current item."""
        self._current, self._current_s = seq, now

    def current(self, now: float) -> int | None:
        """The item that the vehicle flies to next, None if it has not said so of late."""
        known = self._current_s is not None and now - self._current_s <= CURRENT_S
        return self._current if known else None

    def place_before(self, seq: int) -> Position | None:
        """The last place before item `seq`, None if it is wherever the mission is started."""
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
