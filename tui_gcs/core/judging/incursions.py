"""Incursions: which intruders were met before they were in a defended zone, judged from where they really were.

Only a rehearsal knows that: it is told the truth by the simulator, not what sensors found. Met: a vehicle came so near
that the intruder turned round.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import shapely

from tui_gcs.core.geometry.zones import Role, polygon_of
from tui_gcs.core.protocol.common import RunPhase, StationStatus
from tui_gcs.core.scenario.model import Round, Scenario


class IntruderResult(msgspec.Struct):
    """What became of those that came while one round was flown."""

    round: str
    zone: str
    came: int
    """Met or in the zone before the round ended; the others are not counted."""
    met: int
    under_way: int
    """Neither when the round ended, or when the fleet was held."""
    nearest_m: float | None
    """How near to the zone the nearest of those that are counted came, 0 in it; None: none came."""


@dataclass
class _Intruder:
    """One that came while a round was flown."""

    nearest_m: float
    over: bool = False
    met: bool = False


class _Watch:
    """One defended zone in one round."""

    def __init__(self, round_: Round, zone_name: str, outline: shapely.Polygon) -> None:
        """Nobody has come."""
        self.round, self.zone, self._outline = round_.name, zone_name, outline
        self._intruders: dict[int, _Intruder] = {}
        self._known: set[int] = set()

    def see(self, xy_m: Sequence[tuple[float, float]], present: Sequence[bool], met: Sequence[bool]) -> None:
        """Where all intruders are now."""
        for k, (x, y) in enumerate(xy_m):
            if not present[k]:
                continue
            if k not in self._known:
                self._known.add(k)
                if not met[k]:
                    self._intruders[k] = _Intruder(float(shapely.distance(self._outline, shapely.Point(x, y))))
            intruder = self._intruders.get(k)
            if intruder is None or intruder.over:
                continue
            if met[k]:
                intruder.over = intruder.met = True
                continue
            away_m = float(shapely.distance(self._outline, shapely.Point(x, y)))
            intruder.nearest_m = min(intruder.nearest_m, away_m)
            intruder.over = away_m <= 0.0

    def result(self) -> IntruderResult:
        """The count."""
        over = [each for each in self._intruders.values() if each.over]
        nearest_m = min((each.nearest_m for each in over), default=None)
        met, left = sum(each.met for each in over), len(self._intruders) - len(over)
        return IntruderResult(
            self.round, self.zone, len(over), met, left, None if nearest_m is None else round(nearest_m, 1)
        )


class Incursions:
    """Counts for one flight: only those that come while a round is flown."""

    def __init__(self, scenario: Scenario) -> None:
        """Before the start."""
        self._scenario = scenario
        self._done: list[_Watch] = []
        self._now: list[_Watch] = []
        self._index = -1

    def on_status(self, status: StationStatus) -> None:
        """Which round is flown, if any."""
        index = status.round_index if status.run is RunPhase.RUNNING else -1
        if index == self._index:
            return
        self._index = index
        self._done += self._now
        self._now = []
        if index >= 0:
            round_ = self._scenario.rounds[index]
            zones = [zone for zone in round_.zones if zone.role is Role.DEFEND]
            self._now = [_Watch(round_, zone.name, polygon_of(zone.shape)) for zone in zones]

    def see(self, xy_m: Sequence[tuple[float, float]], present: Sequence[bool], met: Sequence[bool]) -> None:
        """Where all intruders are, ENU metres about the scenario's origin; who is there, and who was met."""
        for watch in self._now:
            watch.see(xy_m, present, met)

    def results(self) -> list[IntruderResult]:
        """By round and zone, those to which anybody came."""
        found = [watch.result() for watch in (*self._done, *self._now)]
        return [each for each in found if each.came or each.under_way]
