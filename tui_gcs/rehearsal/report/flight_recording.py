"""Records what a report needs of a flight from the bus, once a second: places, idleness, separation, tours, events."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, PositionInterpolator, serving
from tui_gcs.core.geometry.zones import Zone
from tui_gcs.core.judging.flight_measure import GROUND_M
from tui_gcs.core.motion.separation import least_separation
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.common import (
    FleetFrame,
    Freshness,
    JournalEvent,
    Phase,
    RunPhase,
    StationStatus,
    TeamPlan,
    VehicleRow,
    decode,
)
from tui_gcs.core.scenario.model import Round, Scenario, team_sweep, zone_cells

Floats = NDArray[np.floating[Any]]

SAMPLE_PERIOD_S = 1.0
MAX_EVENTS = 2000
"""Further events are only counted; the journal has them all."""


@dataclass
class ZoneRecord:
    """One team's zone in one round."""

    zone: Zone
    team: str
    alone_s: float
    """Ideal worst idleness of one vehicle of the team's mean speed."""
    members: int
    cells_m: Floats
    """(k, 2) centres of cells."""
    cell_m: float
    worst_s: Floats
    """(k,) longest time each cell was unseen after full coverage; infinite without coverage."""
    times_s: list[float] = field(default_factory=list)
    worst_now_s: list[float] = field(default_factory=list)
    average_now_s: list[float] = field(default_factory=list)
    flying: list[int] = field(default_factory=list)
    tour_m: list[tuple[float, float]] = field(default_factory=list)
    metrics: dict[str, float] = field(default_factory=dict)
    """The planner's last metrics while this round was flown."""
    reserve: int = 0
    """The largest number of vehicles that waited at once."""

    @property
    def serving(self) -> int:
        """The largest number of vehicles that flew at once (the team, before any did), without the reserve."""
        return serving(max(self.flying, default=0) or self.members, self.reserve)

    @property
    def ideal_s(self) -> float:
        """Ideal worst idleness of the serving vehicles; infinite for none."""
        return self.alone_s / self.serving if self.serving > 0 else math.inf


@dataclass
class RoundRecord:
    """One round as it was flown."""

    round: Round
    begin_s: float
    zones: list[ZoneRecord]
    paths_m: dict[int, list[tuple[float, float]]] = field(default_factory=dict)
    """East and north of each vehicle, once a second while it flew."""
    flying: frozenset[int] = frozenset()
    """Vehicles that flew when the round ended."""


class FlightRecord:
    """Records one flight from its bus."""

    def __init__(self, scenario: Scenario, bus: Bus) -> None:
        """Subscribe to the bus before the start."""
        self.scenario = scenario
        self.rounds: list[RoundRecord] = []
        self.events: list[JournalEvent] = []
        self.events_left_out = 0
        self.separation: list[tuple[float, float]] = []
        """(mission time, smallest of max(horizontal / limit, vertical / limit) over all pairs in the air)."""
        self.begin_s = math.nan
        self._grids: list[IdlenessGrid] = []
        self._fills: list[PositionInterpolator] = []
        self._returning = False
        self._next_s = -math.inf
        self._index = -1
        bus.subscribe(keys.FLEET, lambda _, data: self._on_frame(decode(data, FleetFrame)))
        bus.subscribe(keys.STATUS, lambda _, data: self._on_status(decode(data, StationStatus)))
        bus.subscribe(keys.EVENT, lambda _, data: self._on_event(decode(data, JournalEvent)))
        bus.subscribe(keys.PLAN.format(team="*"), lambda _, data: self._on_plan(decode(data, TeamPlan)))

    def _on_status(self, status: StationStatus) -> None:
        self._returning = status.run in (RunPhase.RETURNING, RunPhase.IDLE)
        # Before the start the round may still be changed, so a record begins with the first armed vehicle.
        if status.armed and status.round_index != self._index and self._index < status.round_index:
            self._index = status.round_index
            self._begin(self.scenario.rounds[status.round_index], status)
        if self.rounds and status.run is RunPhase.RUNNING:  # a planner does not count on vehicles that hold
            counted = {team.name: team.metrics for team in status.teams if team.metrics}
            reserve = {team.name: team.reserve for team in status.teams}
            for zone in self.rounds[-1].zones:
                zone.metrics = counted.get(zone.team, zone.metrics)
                zone.reserve = max(zone.reserve, reserve.get(zone.team, 0))

    def _begin(self, round_: Round, status: StationStatus) -> None:
        if math.isnan(self.begin_s):
            self.begin_s = status.t_s
        members = {team.name: len(team.members) for team in status.teams}
        footprint_m = self.scenario.smallest_footprint_m
        zones = []
        self._grids, self._fills = [], []
        for team in self.scenario.teams:
            zone = next(z for z in round_.zones if z.name == team.zone)
            seen = zone_cells(self.scenario, round_, zone)
            grid, cells = IdlenessGrid(seen, footprint_m), seen.centres_m()
            alone_s = team.size * seen.ideal_s(*team_sweep(self.scenario, team))
            count = members.get(team.name, 0)
            zones.append(ZoneRecord(zone, team.name, alone_s, count, cells, grid.cell_m, np.zeros(len(cells))))
            self._grids.append(grid)
            self._fills.append(PositionInterpolator())
        self.rounds.append(RoundRecord(round_, status.t_s, zones))

    def _on_frame(self, frame: FleetFrame) -> None:
        if not self.rounds or self._returning:
            return
        rows = frame.rows()
        flying = [row for row in rows if row.team and row.phase is Phase.FLYING]
        record = self.rounds[-1]
        for zone, grid, fill in zip(record.zones, self._grids, self._fills, strict=True):
            places = {row.id: row.position_m[:2] for row in flying if row.team == zone.team}
            for t_s, xy_m in fill.take(frame.t_s, places):
                grid.update(t_s, xy_m)
        if frame.t_s >= self._next_s - 1e-9:
            self._next_s = frame.t_s + SAMPLE_PERIOD_S
            self._sample(frame.t_s, rows, flying, record)

    def _sample(self, now: float, rows: list[VehicleRow], flying: list[VehicleRow], record: RoundRecord) -> None:
        if flying:  # in the last moment before they return, all hold
            record.flying = frozenset(row.id for row in flying)
        for row in flying:
            record.paths_m.setdefault(row.id, []).append(row.position_m[:2])
        for zone, grid in zip(record.zones, self._grids, strict=True):
            zone.times_s.append(now - self.begin_s)
            zone.flying.append(sum(row.team == zone.team for row in flying))
            full = grid.full_cover_t is not None
            zone.worst_now_s.append(grid.worst_now_s(now) if full else math.nan)
            zone.average_now_s.append(grid.average_now_s(now) if full else math.nan)
            idle_s = grid.idleness_s(now)
            # The first sample after full coverage starts the maximum; before that the longest wait is unknown.
            known = full and np.isfinite(zone.worst_s).all()
            zone.worst_s = np.maximum(zone.worst_s, idle_s) if known else np.where(np.isinf(idle_s), np.inf, 0.0)
        self.separation.append((now - self.begin_s, self._least(rows)))

    def _least(self, rows: list[VehicleRow]) -> float:
        """Return the smallest separation of vehicles that fly plans, hold or return, without take-offs and landings."""
        free = [
            row.position_m
            for row in rows
            if row.team
            and row.armed
            and row.freshness is not Freshness.LOST
            and row.position_m[2] > GROUND_M
            and row.phase in (Phase.FLYING, Phase.HOLDING, Phase.BY_HAND, Phase.RETURNING)
        ]
        return least_separation(np.array(free, dtype=float).reshape(-1, 3), self.scenario.limits)

    def _on_plan(self, plan: TeamPlan) -> None:
        if not self.rounds or not plan.annotations:
            return
        for zone in self.rounds[-1].zones:
            tours = [a for a in plan.annotations if a.kind in ("polyline", "polygon")]
            if zone.team == plan.team and tours:
                zone.tour_m = [point for tour in tours for point in (*tour.points_m, (math.nan, math.nan))]

    def _on_event(self, event: JournalEvent) -> None:
        if len(self.events) < MAX_EVENTS:
            self.events.append(event)
        else:
            self.events_left_out += 1
