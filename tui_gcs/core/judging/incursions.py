"""Incursions: how many intruders were met before they entered a defended zone, by their true positions.

Only a rehearsal can count that: its simulator knows where intruders are, sensors only what they detect. An intruder is
met when a vehicle came so near that it turned round.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import msgspec
import shapely

from tui_gcs.core.geometry.zones import Role, polygon_of
from tui_gcs.core.judging.flight_record import RecordedEvent
from tui_gcs.core.protocol.common import RunPhase, StationStatus
from tui_gcs.core.scenario.model import Round, Scenario


class IntruderResult(msgspec.Struct):
    """How many intruders of one round were met."""

    round: str
    zone: str
    came: int
    """Met, or in the zone, before the round ended; others are not counted."""
    met: int
    under_way: int
    """Neither met nor in the zone when the round ended or the fleet was held."""
    nearest_m: float | None
    """Metres from the zone to the nearest counted intruder, 0 inside it; None without intruders."""


Points = Mapping[int, tuple[float, float]]
NOBODY: Points = {}


@dataclass
class _Intruder:
    """One intruder that came while a round was flown."""

    nearest_m: float
    over: bool = False
    met: bool = False
    at_m: tuple[float, float] = (0.0, 0.0)
    """ENU metres where it was seen last."""


class _Watch:
    """Counts the intruders at one defended zone in one round."""

    def __init__(self, round_: Round, zone_name: str, outline: shapely.Polygon) -> None:
        self.round, self.zone, self._outline = round_.name, zone_name, outline
        self._intruders: dict[int, _Intruder] = {}
        self._known: set[int] = set()
        self.records: list[RecordedEvent] = []

    def _record(self, t_s: float, k: int, kind: str, vehicles: Points) -> None:
        x, y = self._intruders[k].at_m
        away_m = {vehicle: math.dist(place, (x, y)) for vehicle, place in vehicles.items()}
        nearest = min(away_m, key=lambda vehicle: away_m[vehicle], default=None)
        near = "" if nearest is None else f"vehicle {nearest} was {away_m[nearest]:.0f} m away"
        by = nearest if kind == "intruder met" else None
        text = ", ".join(filter(None, (f"{self.zone}, at [{x:.0f} {y:.0f}]", near)))
        self.records.append(RecordedEvent(round(t_s, 1), self.round, kind, str(k + 1), by, text))

    def see(
        self,
        xy_m: Sequence[tuple[float, float]],
        present: Sequence[bool],
        met: Sequence[bool],
        t_s: float = math.nan,
        vehicles: Points = NOBODY,
    ) -> None:
        """Take the positions of all intruders at mission time `t_s`, and those of vehicles in the air."""
        for k, (x, y) in enumerate(xy_m):
            if not present[k]:
                continue
            if k not in self._known:
                self._known.add(k)
                # One that was met before this round began has no influence on it.
                if not met[k]:
                    self._intruders[k] = _Intruder(float(shapely.distance(self._outline, shapely.Point(x, y))))
            intruder = self._intruders.get(k)
            if intruder is None or intruder.over:
                continue
            intruder.at_m = (x, y)
            if met[k]:
                intruder.over = intruder.met = True
                self._record(t_s, k, "intruder met", vehicles)
                continue
            away_m = float(shapely.distance(self._outline, shapely.Point(x, y)))
            intruder.nearest_m = min(intruder.nearest_m, away_m)
            if away_m <= 0.0:
                intruder.over = True
                self._record(t_s, k, "intruder in the zone", vehicles)

    def result(self) -> IntruderResult:
        """Count what happened so far."""
        over = [each for each in self._intruders.values() if each.over]
        nearest_m = min((each.nearest_m for each in over), default=None)
        met, left = sum(each.met for each in over), len(self._intruders) - len(over)
        return IntruderResult(
            self.round, self.zone, len(over), met, left, None if nearest_m is None else round(nearest_m, 1)
        )


class Incursions:
    """Counts intruders of one flight; only those that come while a round is flown count."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._done: list[_Watch] = []
        self._now: list[_Watch] = []
        self._index = -1
        self._mission_s = math.nan

    def on_status(self, status: StationStatus) -> None:
        """Take a status: it shows which round is flown, if any."""
        self._mission_s = status.mission_time_s
        # While the fleet is held, nothing can be met, so nothing counts.
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

    def see(
        self,
        xy_m: Sequence[tuple[float, float]],
        present: Sequence[bool],
        met: Sequence[bool],
        vehicles: Points = NOBODY,
    ) -> None:
        """Take all intruders' ENU positions in metres, which are present, and which were met by now.

        `vehicles` are the places of vehicles in the air: records name the one that met an intruder.
        """
        for watch in self._now:
            watch.see(xy_m, present, met, self._mission_s, vehicles)

    def records(self) -> list[RecordedEvent]:
        """Return every meeting and every incursion, in the order of time."""
        found = [each for watch in (*self._done, *self._now) for each in watch.records]
        return sorted(found, key=lambda each: each.t_s)

    def results(self) -> list[IntruderResult]:
        """The results by round and zone, without zones that no intruder approached."""
        found = [watch.result() for watch in (*self._done, *self._now)]
        return [each for each in found if each.came or each.under_way]
