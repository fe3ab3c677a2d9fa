"""Answers to vehicles that ask for the time of day or whether we are there: TIMESYNC and PING (mavlink.md C6)."""

from collections import Counter

from tui_gcs.core.clock import Clock
from tui_gcs.core.door import Door
from tui_gcs.core.fleet import Fields, Fleet
from tui_gcs.core.vehicle import Vehicle

MOST_PER_S = 50
"""Per vehicle: ArduPilot asks every 10 s, PX4 at 10 Hz at most. More is a flood, and is not answered."""


class TimeAnswers:
    """Answers at once, from within `Fleet`'s dispatch."""

    def __init__(self, fleet: Fleet, door: Door, clock: Clock, own_system: int) -> None:
        """Listen to `fleet`, answer through `door` what nobody else than `own_system` is asked."""
        self._for_us = (0, own_system)
        self._door = door
        self._clock = clock
        self._answered: Counter[int] = Counter()
        self._second = 0
        self.ignored = 0
        """Questions that came too fast."""
        fleet.on_message("TIMESYNC", self._timesync)
        fleet.on_message("PING", self._ping)

    def _timesync(self, vehicle: Vehicle, fields: Fields) -> None:
        """A request has tc1 = 0 and the sender's time in ts1; the answer gives ts1 back, with our time in tc1."""
        if fields["tc1"] == 0 and fields.get("target_system", 0) in self._for_us and self._may(vehicle):
            self._door.ask(vehicle.id, "TIMESYNC", tc1=round(self._clock.now() * 1e9), ts1=fields["ts1"])

    def _ping(self, vehicle: Vehicle, fields: Fields) -> None:
        """A request has no target; the answer is the same with the target set."""
        if fields["target_system"] == 0 and self._may(vehicle):
            self._door.ask(vehicle.id, "PING", time_usec=fields["time_usec"], seq=fields["seq"])

    def _may(self, vehicle: Vehicle) -> bool:
        second = int(self._clock.now())
        if second != self._second:
            self._second = second
            self._answered.clear()
        self._answered[vehicle.id] += 1
        if self._answered[vehicle.id] > MOST_PER_S:
            self.ignored += 1
            return False
        return True
