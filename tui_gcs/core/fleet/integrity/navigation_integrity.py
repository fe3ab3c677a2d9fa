"""Navigation integrity: vehicles that report themselves that they do not know where they are.

Learned with a real ArduCopter whose GPS was 67 m off from one moment to the next: its EKF reported that a second later
and flew on by its inertial sensors for 10 s; then it believed its GPS, and every command led it 67 m beside what the
map showed. Until then there is time to hold it where it still knows its position. Of 46,000 reports of real vehicles in
flight, in wind up to 6 m/s and with a tenth of all frames lost, only those of such faults raised this: the largest test
ratio otherwise was 0.53, where 1 counts.
"""

from collections.abc import Mapping

MIN_DURATION_S = 2.0
"""The report must last this long without a break: two EKF reports of an ArduPilot."""
CLEARED_AFTER_S = 5.0
"""After this long without a report the next one is a new finding."""


class NavigationIntegrityMonitor:
    """Finds vehicles that have reported bad navigation for long enough."""

    def __init__(self) -> None:
        self._since_s: dict[int, float] = {}
        self._last_s: dict[int, float] = {}
        self._answered: set[int] = set()

    def look(self, reports: Mapping[int, str], now: float) -> list[tuple[int, str]]:
        """Take what vehicles report now, by id; return (id, why) of those that last and were not answered."""
        self._last_s |= dict.fromkeys(reports, now)
        self._since_s = {vehicle: self._since_s.get(vehicle, now) for vehicle in reports}
        for vehicle in [each for each, last_s in self._last_s.items() if now - last_s > CLEARED_AFTER_S]:
            del self._last_s[vehicle]
            self._answered.discard(vehicle)
        return [
            (vehicle, why)
            for vehicle, why in reports.items()
            if vehicle not in self._answered and now - self._since_s[vehicle] >= MIN_DURATION_S - 1e-9
        ]

    def answer(self, vehicle: int) -> None:
        """Record that it was made to hold: what an operator orders after that is meant, and is not undone again."""
        self._answered.add(vehicle)
