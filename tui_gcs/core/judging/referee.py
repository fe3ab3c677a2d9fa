"""The referee: measures a flight from what the station publishes, and from nothing else.

A team is measured in each round from the time when every vehicle is on its slot. Warm-up lasts until every cell was
seen once and two slot periods (2 T / n) have passed, whichever is later; after it comes the measured time. Cells that
stay unseen do not hold it up: they count as seen when the vehicles were on their slots, and are reported.

Idleness is the time since a cell was last inside a footprint, over the cells that can be seen (docs/planning.md A1).
Worst idleness is compared with the ideal A / (n v 2r) of the n vehicles on slots; those in reserve serve no zone yet.
Slots are kept when in the measured time no vehicle is far from where its plan has it.
"""

import math
from collections.abc import Mapping, Sequence

import msgspec
import numpy as np
import shapely
from numpy.typing import NDArray

from tui_gcs.core.flight.flights import COLUMN_M
from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, PositionInterpolator
from tui_gcs.core.geometry.zone_cells import UnreachablePart
from tui_gcs.core.geometry.zones import Zone, polygon_of
from tui_gcs.core.judging.flight_record import RecordedEvent
from tui_gcs.core.judging.incursions import Incursions, IntruderResult
from tui_gcs.core.judging.metric_log import MetricLog, MetricSeries, gate_problems
from tui_gcs.core.judging.result_check import ResultCheck, at_least, at_most
from tui_gcs.core.motion.separation import least_separation
from tui_gcs.core.protocol.common import (
    FleetFrame,
    Phase,
    PlannerInfo,
    RunPhase,
    StationStatus,
    TeamStatus,
    Vec3,
    VehicleRow,
)
from tui_gcs.core.protocol.metric_names import seen_pct
from tui_gcs.core.protocol.planning import JudgedBy
from tui_gcs.core.scenario.model import ResultLimits, Round, Scenario, Team, zone_cells

WARM_UP_LIMIT_S = 600.0
"""A zone that is not seen whole within this time will not be."""
LAPS = 3
"""Slot periods after which a cell that was never seen lies beside the tour: one sees everything."""
STALLED_S = 120.0
"""The same for planners without a tour: time without a new cell."""
GROUND_M = 2.0
"""Altitude band and separation count from this height on."""
GAP_S = 0.5
"""Frames come every 0.1 s; in a gap of this length vehicles can pass each other, or a cell, unseen."""


class RoundResult(msgspec.Struct):
    """What one team reached in one round. None: it was not measured."""

    round: str
    zone: str
    role: str
    team: str
    n: int
    """The number of vehicles on slots, without those in reserve."""
    on_slot_after_s: float | None
    measured_s: float
    worst_idleness_s: float | None
    avg_idleness_s: float | None
    coverage: float
    bound_s: float | None
    """Worst idleness that no plan beats; None where no vehicle was on a slot."""
    ratio: float | None
    """Worst idleness over `ideal_s`."""
    period_s: float | None
    off_slot_p95_m: float | None = None
    """The distance from the plan that 95 % of all positions in the measured time keep."""
    off_slot_max_m: float | None = None
    lag_max_s: float | None = None
    """The earliest or latest of all vehicles, smoothed over two seconds."""
    cut_short: bool = False
    """The team lost a vehicle before this was measured: it is not judged, and what follows is measured anew."""
    reserve: int = 0
    """Vehicles that waited in reserve when all were on their slots."""
    judged_by: JudgedBy = "idleness"
    covered_s: float | None = None
    """Seconds from the beginning until every cell was seen once, where that is judged."""
    cover_bound_s: float | None = None
    """The least time that this can take, where it is judged."""
    p99_idleness_s: float | None = None
    """Worst idleness that 99 % of the area keeps."""
    ideal_s: float | None = None
    """A / (n v 2r), A being the area that can be seen; None where no vehicle was on a slot."""
    cells: int = 0
    """Number of cells that can be seen."""
    unseen_cells: int = 0
    """How many of `cells` were never seen."""
    unseen_s: float | None = None
    """For how long they were not seen: since all vehicles were on their slots."""
    unreachable: tuple[UnreachablePart, ...] = ()
    """Parts of the zone that no vehicle can see; they count in no figure."""

    @property
    def unseen(self) -> str:
        """Which cells were not seen, as text; "" if all were."""
        if not self.unseen_cells or self.unseen_s is None:
            return ""
        return f"{self.unseen_cells:,} of {self.cells:,} cells unseen for {self.unseen_s:.0f} s"


class FlightResult(msgspec.Struct):
    """The result of a whole flight."""

    scenario: str
    seed: int
    checks: list[ResultCheck]
    rounds: list[RoundResult]
    frames: int = 0
    """Fleet frames that were measured."""
    frames_lost: int = 0
    """Fleet frames that the station published and the bus dropped on the way to the referee."""
    longest_gap_s: float = 0.0
    """The longest time without a frame while vehicles flew."""
    intruders: list[IntruderResult] = []
    """Results of a rehearsal with intruders."""
    metrics: list[MetricSeries] = []
    """What the planners published, over time."""
    records: list[RecordedEvent] = []
    """What happened one by one: intruders met, tasks done."""

    @property
    def incomplete(self) -> str:
        """What the figures do not cover, as text; "" if no frame was missed."""
        if not self.frames_lost and self.longest_gap_s <= GAP_S:
            return ""
        missed = []
        if self.frames_lost:
            missed.append(f"{self.frames_lost} of {self.frames + self.frames_lost} pictures of the fleet lost")
        if self.longest_gap_s > GAP_S:
            missed.append(f"no picture of the fleet for up to {self.longest_gap_s:.1f} s")
        return "figures are INCOMPLETE: " + ", ".join(missed)

    @property
    def ok(self) -> bool:
        """Whether all checks of the flight hold."""
        return all(check.ok for check in self.checks)


class ZoneMeasure:
    """Measures one team in one round."""

    def __init__(
        self, scenario: Scenario, round_: Round, zone: Zone, team: str, t_s: float, judged_by: JudgedBy = "idleness"
    ) -> None:
        self.judged_by = judged_by
        self.lasts_whole = False
        """Whether the round is flown for all of its duration: what is judged may come at any time."""
        self.open_points = 0
        """Points of interest that the team has still to visit."""
        self._had_points = False
        self._scenario = scenario
        self._round = round_
        self._zone = zone
        self.team = team
        self.part = ""
        """The part of the round that is measured; empty for the whole."""
        self.cut_short = False
        self._begin_s = t_s
        self._cells = zone_cells(scenario, round_, zone)
        self._grid = IdlenessGrid(self._cells, scenario.smallest_footprint_m)
        self._fill = PositionInterpolator()
        self._on_slot_s: float | None = None
        self._window_s: float | None = None
        self._last_s = t_s
        self._period_s = math.nan
        self._n = self._reserve = 0
        self._wanted = self._most_on_slot = 0
        self._ways_s: list[float] = []
        """Where coverage is judged: the vehicles' ways to the zone, when the round began."""
        self._off_slot_m: list[float] = []
        self._lag_s: list[float] = []

    @property
    def round_name(self) -> str:
        """The name of the round that is measured."""
        return self._round.name

    @property
    def done(self) -> bool:
        """Whether it was measured long enough, or never will be: never on slot, or never warm, within the limit."""
        limits = self._scenario.results
        if self.judged_by != "idleness" and self._last_s - self._begin_s >= self._round.duration_s:
            return True
        if self.lasts_whole:
            return False
        if self.judged_by == "coverage":
            return self._grid.full_cover_t is not None
        if self.judged_by == "tasks" and self._had_points:
            return self.open_points == 0
        if self._window_s is not None:
            return self._last_s - self._window_s >= limits.measured_s
        if self._on_slot_s is not None:
            return self._last_s - self._on_slot_s > WARM_UP_LIMIT_S
        # A planner without slots is not waited for: it is measured from the beginning.
        slots_s = limits.measured_s if self.judged_by != "idleness" else 0.0
        return self._last_s - self._begin_s > limits.on_slot_max_s + slots_s

    def on_points(self, open_points: int) -> None:
        """Take how many points of interest the team has still to visit."""
        self.open_points, self._had_points = open_points, self._had_points or open_points > 0

    def on_status(self, status: TeamStatus, wanted: int) -> None:
        """Take the team's status: how many vehicles are on their slots, and the period of the tour."""
        self._period_s = status.metrics.get("period_s", self._period_s)
        self._wanted, self._most_on_slot = wanted, max(self._most_on_slot, status.on_slot)
        if self._on_slot_s is None and status.slots == wanted and status.on_slot == wanted:
            self._on_slot_s = self._last_s
            self._reserve = status.reserve
            self._n = wanted - self._reserve

    def on_frame(self, frame: FleetFrame, rows: list[VehicleRow]) -> None:
        """Measure idleness and distances from the vehicles' positions."""
        if self.done:
            return
        self._last_s = frame.t_s
        if self._on_slot_s is None and self.judged_by == "idleness":
            return
        flying = [r for r in rows if r.team == self.team and r.phase is Phase.FLYING]
        if self.judged_by == "coverage" and not self._ways_s:
            self._ways_s = [self._way_s(r.position_m) for r in flying]
        for t_s, xy_m in self._fill.take(frame.t_s, {r.id: r.position_m[:2] for r in flying}):
            self._grid.update(t_s, xy_m)
        if self._window_s is not None:
            self._off_slot_m += [r.slot_error_m for r in flying if math.isfinite(r.slot_error_m)]
            self._lag_s += [abs(r.lag_s) for r in flying if math.isfinite(r.lag_s)]
        if self._window_s is None and self._warmed_up(frame.t_s):
            self._window_s = frame.t_s
            self._grid.begin_window(frame.t_s, self._begin_s if self._on_slot_s is None else self._on_slot_s)

    def _way_s(self, place_m: Vec3) -> float:
        """The time that a vehicle needs at least until it sees a first bit of the zone."""
        away_m = float(shapely.distance(polygon_of(self._zone.shape), shapely.Point(place_m[:2])))
        return max(0.0, away_m - self._scenario.footprint_radius_m) / self._scenario.limits.speed_m_s

    def why_not_measured(self) -> str:
        """Why idleness and slots were not measured; "" if they were."""
        if self._window_s is not None:
            return ""
        if self._on_slot_s is None and not self._most_on_slot:
            return "no vehicle was on its slot: does its planner say `joined` in its intents?"
        if self._on_slot_s is None:
            most = f"{self._most_on_slot} of {self._wanted} at most"
            return f"never all on their slots: {most} had `joined` and were within 5 m of where their intents had them"
        if self._grid.full_cover_t is None:
            return f"the zone was never seen whole: {seen_pct(self._grid.coverage):.1f} %"
        return "the round ended before it could be measured"

    def _warmed_up(self, t_s: float) -> bool:
        """Whether each slot was flown twice, where the planner publishes a period, and every cell was seen.

        A tour that has seen nothing new for `LAPS` slot periods will not see the rest either. Where idleness is not
        judged, slots alone begin the measured time.
        """
        if self.judged_by != "idleness":
            return self._on_slot_s is not None
        if self._on_slot_s is None:
            return False
        slot_s, whole = self._period_s / max(self._n, 1), self._grid.full_cover_t is not None
        stalled_s = t_s - max(self._on_slot_s, self._grid.new_cell_t)
        if math.isnan(slot_s):
            return whole or stalled_s >= STALLED_S
        return t_s - self._on_slot_s >= 2 * slot_s if whole else stalled_s >= LAPS * slot_s

    def result(self) -> RoundResult:
        """The result so far; figures that are not judged are left out."""
        found = self._figures()
        if self.judged_by == "idleness":
            return found
        found.judged_by = self.judged_by
        found.worst_idleness_s = found.avg_idleness_s = found.p99_idleness_s = None
        found.ideal_s = found.bound_s = found.ratio = found.unseen_s = None
        found.n = found.n or self._wanted
        if self.judged_by == "coverage":
            limits, whole_s = self._scenario.limits, self._grid.full_cover_t
            ways_s = self._ways_s or [0.0] * found.n
            found.covered_s = None if whole_s is None else round(whole_s - self._begin_s, 1)
            found.cover_bound_s = _rounded(
                cover_bound_s(self._cells.reachable_m2, ways_s, limits.speed_m_s, self._scenario.footprint_radius_m)
            )
        return found

    def _figures(self) -> RoundResult:
        limits = self._scenario.limits
        radius_m = self._scenario.footprint_radius_m
        ideal, bound = (
            reckon(self._n, limits.speed_m_s, radius_m) for reckon in (self._cells.ideal_s, self._cells.bound_s)
        )
        grid = self._grid  # its figures are NaN before the window begins
        worst, unseen_s = grid.worst_idleness_s, math.nan
        if grid.unseen and self._on_slot_s is not None:
            unseen_s = self._last_s - self._on_slot_s
        return RoundResult(
            round=self._round.name + self.part,
            zone=self._zone.name,
            role=str(self._zone.role),
            team=self.team,
            n=self._n,
            on_slot_after_s=None if self._on_slot_s is None else round(self._on_slot_s - self._begin_s, 1),
            measured_s=0.0 if self._window_s is None else round(self._last_s - self._window_s, 1),
            worst_idleness_s=_rounded(worst),
            avg_idleness_s=_rounded(grid.average_idleness_s),
            coverage=seen_pct(grid.coverage, 2) / 100,  # the whole is what was seen whole
            bound_s=_rounded(bound),
            ratio=_rounded(worst / ideal if ideal else math.nan),
            period_s=_rounded(self._period_s),
            off_slot_p95_m=_rounded(float(np.percentile(self._off_slot_m, 95))) if self._off_slot_m else None,
            off_slot_max_m=_rounded(max(self._off_slot_m, default=math.nan)),
            lag_max_s=_rounded(max(self._lag_s, default=math.nan)),
            cut_short=self.cut_short,
            reserve=self._reserve,
            p99_idleness_s=_rounded(grid.p99_idleness_s),
            ideal_s=_rounded(ideal),
            cells=grid.cells,
            unseen_cells=grid.unseen,
            unseen_s=_rounded(unseen_s),
            unreachable=self._cells.unreachable,
        )


def cover_bound_s(area_m2: float, ways_s: Sequence[float], speed_m_s: float, footprint_radius_m: float) -> float:
    """Return the least time in which vehicles can see `area_m2` once; `ways_s` are their times to where they see it.

    Each sees one disc when it comes, then a strip as wide as its footprint. The time is infinite for no vehicle.
    """
    swept_m2_s, disc_m2 = 2.0 * footprint_radius_m * speed_m_s, math.pi * footprint_radius_m**2
    least_s = math.inf
    # Those that come first may have seen it all before the others are there.
    for n in range(1, len(ways_s) + 1):
        first = sorted(ways_s)[:n]
        alone_s = max(0.0, area_m2 - n * disc_m2) / (n * swept_m2_s) + sum(first) / n
        least_s = min(least_s, max(alone_s, first[-1]) if n > 1 else alone_s)
    return least_s


class Referee:
    """Watches a whole flight and measures it."""

    def __init__(self, scenario: Scenario, planners: Mapping[str, PlannerInfo] | None = None) -> None:
        """`planners` holds what the teams' planners declare, by name; a flight of any other planner fails."""
        self._scenario = scenario
        self.planners: Mapping[str, PlannerInfo] = planners or {}
        self.metrics = MetricLog()
        self.incursions: Incursions | None = None
        """Counts intruders, where somebody knows where they are; None: none come."""
        self.measures: list[ZoneMeasure] = []
        self._area: Round | None = None
        self._fence = shapely.Polygon()
        self._separation = math.inf
        """The least max(horizontal / limit, vertical / limit) over all airborne pairs; 1 is the limit."""
        self._outside_m = 0.0
        self._band_m = 0.0
        self._places: dict[int, Vec3] = {}
        self._landed_at: dict[int, Vec3] = {}
        self._flew: set[int] = set()
        self._status: StationStatus | None = None
        self.started: tuple[int, ...] = ()
        self.lost: set[int] = set()
        """Leave these vehicles out of what is expected: losing them is part of the flight."""
        self._present: dict[str, ZoneMeasure] = {}
        self._members: dict[str, tuple[int, ...]] = {}
        self._last: FleetFrame | None = None
        self._frames = self._frames_lost = 0
        self._longest_gap_s = 0.0

    def begin_round(self, round_: Round, t_s: float) -> None:
        """Begin to measure a round."""
        self._area, self._fence = round_, polygon_of(round_.area.shape)
        shapely.prepare(self._fence)
        for team in self._scenario.teams:
            self._begin(team, t_s, "")

    def lose(self, vehicle: int, t_s: float) -> None:
        """Measure its team anew without a vehicle that is lost on purpose."""
        self.lost.add(vehicle)
        self._begin_anew(vehicle, t_s, f" -{vehicle}")

    def find(self, vehicle: int, t_s: float) -> None:
        """Measure its team anew with a vehicle that is back."""
        self.lost.discard(vehicle)
        self._begin_anew(vehicle, t_s, f" +{vehicle}")

    def begin_again(self, t_s: float) -> None:
        """Measure every team anew after a hold."""
        for team in self._scenario.teams:
            present = self._present.get(team.name)
            if present is not None:
                present.cut_short = not present.done
                self._begin(team, t_s, f"{present.part} again")

    def _begin_anew(self, vehicle: int, t_s: float, part: str) -> None:
        team = next((t for t in self._scenario.teams if vehicle in self._members.get(t.name, ())), None)
        present = self._present.get(team.name) if team is not None else None
        if team is not None and present is not None:
            present.cut_short = not present.done
            self._begin(team, t_s, present.part + part)

    def _begin(self, team: Team, t_s: float, part: str) -> None:
        if self._area is None:
            return
        zone = next(zone for zone in self._area.zones if zone.name == team.zone)
        info = self.planners.get(team.planner)
        judged_by = info.judged_by if info is not None else "metrics"
        measure = self._present[team.name] = ZoneMeasure(self._scenario, self._area, zone, team.name, t_s, judged_by)
        measure.part = part
        measure.lasts_whole = judged_by == "intruders" and self.incursions is not None
        self.metrics.begin(self._area.name + part, team.name, t_s)
        self.measures.append(measure)

    def present(self) -> list[ZoneMeasure]:
        """The measures that run now, one of each team."""
        return list(self._present.values())

    def on_status(self, status: StationStatus) -> None:
        """Take faults, vetoes, and the teams' slots from a station status."""
        self._status = status
        by_name = {team.name: team for team in status.teams}
        self._members = {team.name: team.members for team in status.teams}
        for measure in self.present():
            team = by_name[measure.team]
            measure.on_points(sum(p.state == "open" and p.team in ("", measure.team) for p in status.points))
            measure.on_status(team, sum(1 for v in team.members if v in self.started and v not in self.lost))
        if status.run is RunPhase.RUNNING and self._area is not None:  # a planner does not count on vehicles that hold
            measured = {name: measure for name, measure in self._present.items() if not measure.done}
            rounds = {name: self._area.name + measure.part for name, measure in measured.items()}
            self.metrics.on_status(status, rounds)

    def on_frame(self, frame: FleetFrame) -> None:
        """Take positions and phases of all vehicles of teams from a fleet frame."""
        self._count(frame)
        rows = [row for row in frame.rows() if row.team]
        for measure in self.present():
            measure.on_frame(frame, rows)
        for row in rows:
            if row.armed and row.position_m[2] > GROUND_M:
                self._flew.add(row.id)
            elif not row.armed and row.id in self._flew:
                self._landed_at[row.id] = row.position_m
            elif not row.armed:
                self._places[row.id] = row.position_m
        self._judge_region([r for r in rows if r.armed and r.position_m[2] > GROUND_M])

    def _count(self, frame: FleetFrame) -> None:
        """Count frames and gaps by the frames' numbers."""
        last, self._last = self._last, frame
        self._frames += 1
        if last is None:
            return
        # Frames are numbered; a restarted station counts from 1 again, which is no loss.
        self._frames_lost += max(0, frame.seq - last.seq - 1)
        # A gap on the ground misses nothing.
        if any(last.armed):
            self._longest_gap_s = max(self._longest_gap_s, frame.t_s - last.t_s)

    def _judge_region(self, flying: list[VehicleRow]) -> None:
        if self._area is not None:
            area, places = self._area.area, _places(flying)
            outside = places[~shapely.intersects_xy(self._fence, places[:, 0], places[:, 1]), :2]
            if len(outside):
                self._outside_m = max(self._outside_m, *shapely.distance(self._fence, shapely.points(outside)).tolist())
            for z in [row.position_m[2] for row in flying if row.phase is Phase.FLYING]:
                self._band_m = max(self._band_m, area.alt_min_m - z, z - area.alt_max_m)
        free = _places([row for row in flying if not self._in_own_column(row)])
        self._separation = min(self._separation, least_separation(free, self._scenario.limits))

    def _in_own_column(self, row: VehicleRow) -> bool:
        place = self._places.get(row.id)
        # In its own column a vehicle may be near others: they stand side by side.
        vertical = row.phase in (Phase.TAKEOFF, Phase.LANDING, Phase.ARMING)
        return vertical and place is not None and math.dist(place[:2], row.position_m[:2]) <= COLUMN_M

    def result(self) -> FlightResult:
        """The result so far."""
        rounds = [measure.result() for measure in self.measures]
        return FlightResult(
            self._scenario.name,
            self._scenario.seed,
            self._checks(rounds),
            rounds,
            self._frames,
            self._frames_lost,
            round(self._longest_gap_s, 2),
            intruders=self.incursions.results() if self.incursions is not None else [],
            metrics=self.metrics.series(self.planners, self._scenario),
            records=sorted(
                [*(self.incursions.records() if self.incursions is not None else []), *self._point_records()],
                key=lambda each: each.t_s,
            ),
        )

    def _round_checks(self, measure: ZoneMeasure, r: RoundResult) -> list[ResultCheck]:
        """The checks of one team in one round: by what its planner is for, and by its own metrics."""
        limits, where, why = self._scenario.results, f"{r.round} {r.zone}", measure.why_not_measured()
        checks: list[ResultCheck] = []
        if measure.judged_by == "idleness":
            checks += _idleness_checks(where, r, limits, why)
        elif measure.judged_by == "coverage":
            checks += _coverage_checks(where, r, limits)
        elif measure.judged_by == "tasks":
            checks += self._task_checks(r)
        elif measure.judged_by == "intruders" and not self._came(r):
            # Nobody came: it is judged by whether it was there.
            checks.append(at_most(f"{where}: all on slot, s", r.on_slot_after_s, limits.on_slot_max_s, why))
        planner = next(team.planner for team in self._scenario.teams if team.name == r.team)
        if (info := self.planners.get(planner)) is None:
            why = f"what planner {planner} is judged by is not known"
            return [*checks, ResultCheck(f"{where}: planner {planner}"[:52], False, None, None, why)]
        return checks + self.metrics.checks(r.round, r.team, info, limits.metrics)

    def _task_checks(self, r: RoundResult) -> list[ResultCheck]:
        """The share of a team's points of interest that was visited in time; none where there was none."""
        points = [p for p in (self._status.points if self._status is not None else ()) if p.team in ("", r.team)]
        points = [point for point in points if point.state != "cancelled"]
        last = [measure for measure in self.measures if measure.team == r.team][-1]
        # Points are of the whole flight: they are judged once, with the last round.
        if not points or r.round != last.round_name + last.part:
            return []
        done = sum(point.state == "done" for point in points)
        check = at_least(f"{r.team}: tasks done in time", done / len(points), self._scenario.results.tasks_done_min)
        return [msgspec.structs.replace(check, why=f"{done} of {len(points)}")]

    def _point_records(self) -> list[RecordedEvent]:
        """What became of each point of interest."""
        status = self._status
        if status is None:
            return []
        begin_s = status.t_s - status.mission_time_s
        return [
            RecordedEvent(
                round(point.ended_s - begin_s, 1),
                "",
                f"task {point.state}",
                point.name,
                point.vehicle or None,
                f"priority {point.priority:g}, {point.ended_s - point.added_s:.0f} s after it was added",
            )
            for point in status.points
            if point.state != "open"
        ]

    def _came(self, r: RoundResult) -> int:
        """How many intruders came to a zone in a round."""
        counted = self.incursions.results() if self.incursions is not None else []
        return sum(i.came for i in counted if r.round.startswith(i.round) and i.zone == r.zone)

    def _intruder_checks(self, rounds: list[RoundResult]) -> list[ResultCheck]:
        """The share of intruders that was met, of every zone that a planner guards, over all rounds."""
        if self.incursions is None:
            return []
        checks, counted = [], self.incursions.results()
        for zone in dict.fromkeys(r.zone for r in rounds if r.judged_by == "intruders" and not r.cut_short):
            came, met = (sum(getattr(i, what) for i in counted if i.zone == zone) for what in ("came", "met"))
            if came:
                why = f"{met} of {came}"
                share = at_least(f"{zone}: intruders met", met / came, self._scenario.results.intruders_met_min)
                checks.append(msgspec.structs.replace(share, why=why))
        return checks

    def _checks(self, rounds: list[RoundResult]) -> list[ResultCheck]:
        limits = self._scenario.results
        checks: list[ResultCheck] = []
        for measure, r in zip(self.measures, rounds, strict=True):
            # A measure that was cut short is not judged; the one that was begun anew is.
            if r.cut_short:
                continue
            checks += self._round_checks(measure, r)
        checks += self._intruder_checks(rounds)
        for gate, problem in gate_problems(self._scenario, self.planners):
            checks.append(
                ResultCheck(f"results.metrics.{gate}", False, None, self._scenario.results.metrics[gate], problem)
            )
        faults = self._status.faults if self._status is not None else {"no status": 1}
        vetoes = self._status.vetoes if self._status is not None else {}
        kept = [v for v in self.started if v not in self.lost]
        missing = [v for v in kept if v not in self._landed_at]
        misses = [math.dist(self._landed_at[v][:2], self._places[v][:2]) for v in kept if v not in missing]
        checks += [
            at_least("vehicles flown", float(len(self._flew)), float(self._scenario.vehicle_count)),
            self._separation_check(),
            at_most("outside operating area, m", self._outside_m, 0.0),
            at_most("outside altitude band, m", max(self._band_m, 0.0), 0.0),
            at_most("not landed and disarmed", float(len(missing)), 0.0),
            at_most("landing error, m", max(misses, default=None), limits.landing_error_max_m),
            at_most("unanswered commands", float(faults.get("unanswered commands", 0)), 0.0),
            at_most("planner intents refused on slot", float(faults.get("refused on slot", 0)), 0.0),
            _no_vetoes(vetoes),
            at_most("planner faults", float(faults.get("planner", 0)), 0.0),
            at_most("link faults", float(faults.get("link", 0)), 0.0),
        ]
        return checks

    def _separation_check(self) -> ResultCheck:
        """The check of separation; it holds without a value where no two vehicles flew at once."""
        name, alone = "separation, x limit", not math.isfinite(self._separation)
        if alone and self._flew:
            return ResultCheck(name, True, None, 1.0, "no two vehicles were in the air at once")
        return at_least(name, None if alone else self._separation, 1.0)


def _idleness_checks(where: str, r: RoundResult, limits: ResultLimits, why: str) -> list[ResultCheck]:
    """The checks of a planner by which each place is seen again and again."""
    checks = [
        at_most(f"{where}: all on slot, s", r.on_slot_after_s, limits.on_slot_max_s, why),
        at_least(f"{where}: coverage", r.coverage, limits.coverage_min),
        at_most(f"{where}: worst / ideal", r.ratio, limits.worst_ratio_max, why),
    ]
    # A planner without slots publishes no place to be at: no intent said where to be when.
    if r.off_slot_max_m is not None or not r.measured_s:
        checks.append(at_most(f"{where}: off slot, m", r.off_slot_max_m, limits.slot_error_max_m, why))
        checks.append(at_most(f"{where}: early or late, s", r.lag_max_s, limits.slot_lag_max_s, why))
    return checks


def _coverage_checks(where: str, r: RoundResult, limits: ResultLimits) -> list[ResultCheck]:
    """The checks of a planner by which the zone is seen whole once."""
    ratio = r.covered_s / max(r.cover_bound_s, 1.0) if r.covered_s is not None and r.cover_bound_s is not None else None
    why = f"only {seen_pct(r.coverage):.1f} % was seen"
    return [
        at_least(f"{where}: coverage", r.coverage, limits.coverage_min),
        at_most(f"{where}: seen whole after, x bound", ratio, limits.cover_ratio_max, why),
    ]


def _places(rows: list[VehicleRow]) -> NDArray[np.float64]:
    return np.array([row.position_m for row in rows], dtype=float).reshape(-1, 3)


def _rounded(value: float) -> float | None:
    return round(value, 2) if math.isfinite(value) else None


def _no_vetoes(vetoes: dict[str, int]) -> ResultCheck:
    """The check that the guard vetoed nothing; `vetoes` counts by reason, the most frequent comes first."""
    check = at_most("guard vetoes", float(sum(vetoes.values())), 0.0)
    commonest_first = sorted(vetoes.items(), key=lambda reason: (-reason[1], reason[0]))
    check.why = ", ".join(f"{code}: {count}" for code, count in commonest_first if count)
    return check
