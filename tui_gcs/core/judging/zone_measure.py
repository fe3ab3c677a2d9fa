"""How one team serves its zone in one round: idleness of the cells, distances from the slots, time to full coverage.

A team is measured from the time when every vehicle is on its slot. Warm-up lasts until every cell was seen once and
two slot periods (2 T / n) have passed, whichever is later; after it comes the measured time. Cells that stay unseen do
not hold it up: they count as seen when the vehicles were on their slots, and are reported.

Idleness is the time since a cell was last inside a footprint, over the cells that can be seen (docs/planning.md A1).
Worst idleness is compared with the ideal A / (n v 2r) of the n vehicles on slots; those in reserve serve no zone yet.
Slots are kept when in the measured time no vehicle is far from where its plan has it.
"""

import copy
import math
from collections.abc import Sequence

import shapely

from tui_gcs.core.geometry.idleness_bounds import Sweep
from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, PositionInterpolator
from tui_gcs.core.geometry.zones import Zone, polygon_of
from tui_gcs.core.judging.flight_result import RoundResult
from tui_gcs.core.judging.slot_keeping import SlotKeeping
from tui_gcs.core.protocol.common import FleetFrame, Phase, TeamStatus, Vec3, VehicleRow
from tui_gcs.core.protocol.metric_names import seen_pct
from tui_gcs.core.protocol.planning import JudgedBy
from tui_gcs.core.scenario.model import Round, Scenario, team_sweep, zone_cells

WARM_UP_LIMIT_S = 600.0
"""Warm-up without a tour lasts so long at most, or the round's own duration where that is longer."""
WARM_UP_LAPS, WARM_UP_IDEALS = 6, 20
"""Warm-up of a tour lasts so many slot periods: two if all is seen in the first, else `LAPS` after the last new cell. A
period that the planner published wrongly is not waited for: at most so many times the ideal.

One vehicle over a lake of 31 ha needs 1042 s for a round trip; after 600 s it had seen 61 % of it."""
LAPS = 3
"""A cell that is unseen after this many slot periods stays so: in one the vehicles together see the whole tour."""
SAME_PERIOD = 0.01
"""A period that changes by a larger share is that of another tour, or of another speed."""
STALLED_S = 120.0
"""For planners without a tour: after this time without a new cell, those still unseen will stay so."""


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
        self._left_m2 = self._cells.reachable_m2
        """Where coverage is judged: the area that was still to be seen when this began."""
        self._on_slot_s: float | None = None
        self._steady_s: float | None = None
        """Since when they are on the slots of the present tour."""
        self._window_s: float | None = None
        self._last_s = t_s
        self._period_s = math.nan
        self._n = self._reserve = 0
        self._wanted = self._most_on_slot = 0
        self._ways_s: list[float] = []
        """Where coverage is judged: the vehicles' ways to the zone, when the round began."""
        self._slots = SlotKeeping()

    def carry_on(self, before: "ZoneMeasure") -> None:
        """Go on from the measure before this one, which ended with a loss or a hold: what was seen once stays seen.

        Only coverage is of the whole round; what is seen again and again is judged by the vehicles that are left.
        """
        if self.judged_by == "coverage":
            self._grid, self._fill = copy.deepcopy(before._grid), copy.deepcopy(before._fill)
            self._left_m2 = self._cells.reachable_m2 * (1.0 - self._grid.coverage)

    @property
    def begin_s(self) -> float:
        """The time from which it is measured."""
        return self._begin_s

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
            return self._last_s - self._on_slot_s > self._warm_up_limit_s()
        # A planner without slots is not waited for: it is measured from the beginning.
        slots_s = limits.measured_s if self.judged_by != "idleness" else 0.0
        return self._last_s - self._begin_s > limits.on_slot_max_s + slots_s

    def _warm_up_limit_s(self) -> float:
        """After this time on slots nothing more is waited for."""
        asked_s, slot_s = max(WARM_UP_LIMIT_S, self._round.duration_s), self._period_s / max(self._n, 1)
        if math.isnan(slot_s):
            return asked_s
        return max(asked_s, min(WARM_UP_LAPS * slot_s, WARM_UP_IDEALS * self._cells.ideal_s(*self._sweep())))

    def _sweep(self) -> Sweep:
        team = next(team for team in self._scenario.teams if team.name == self.team)
        return team_sweep(self._scenario, team, self._n)

    def on_points(self, open_points: int) -> None:
        """Take how many points of interest the team has still to visit."""
        self.open_points, self._had_points = open_points, self._had_points or open_points > 0

    def on_status(self, status: TeamStatus, wanted: int) -> None:
        """Take the team's status: how many vehicles are on their slots, and the period of the tour."""
        before_s, self._period_s = self._period_s, status.metrics.get("period_s", self._period_s)
        if abs(self._period_s - before_s) > SAME_PERIOD * before_s:
            self._steady_s = None
        self._wanted, self._most_on_slot = wanted, max(self._most_on_slot, status.on_slot)
        if status.slots != wanted or status.on_slot != wanted:
            return
        if self._steady_s is None:
            self._steady_s = self._last_s
        if self._on_slot_s is None:
            self._on_slot_s = self._last_s
            self._reserve = status.reserve
            self._n = wanted - self._reserve

    def on_frame(self, frame: FleetFrame, rows: list[VehicleRow]) -> None:
        """Measure idleness and distances from the vehicles' positions."""
        if self.done:
            if self.judged_by == "idleness" and self._on_slot_s is None:
                self._last_s = frame.t_s  # who is on its slot too late was so at that time, not when the limit was over
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
            self._slots.take(flying)
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
            return "no vehicle was on its slot: does a no-fly zone close its way, or its planner never say `joined`?"
        if self._on_slot_s is None:
            most = f"{self._most_on_slot} of {self._wanted} at most"
            return f"never all on their slots: {most} had `joined` and were within 5 m of where their intents had them"
        if self._grid.full_cover_t is None:
            return f"the zone was never seen whole: {seen_pct(self._grid.coverage):.1f} %"
        slots_s = 2.0 * self._period_s / max(self._n, 1)
        needs = f": that begins {slots_s:.0f} s after all are on their slots" if math.isfinite(slots_s) else ""
        return f"the round ended before it could be measured{needs}"

    def _warmed_up(self, t_s: float) -> bool:
        """Whether each slot was flown twice, where the planner publishes a period, and every cell was seen.

        Another tour begins that anew: on the way to its slots places wait longer than on either.

        A tour that has seen nothing new for `LAPS` slot periods will not see the rest either. Where idleness is not
        judged, slots alone begin the measured time.
        """
        if self.judged_by != "idleness":
            return self._on_slot_s is not None
        if self._steady_s is None:
            return False
        slot_s, whole = self._period_s / max(self._n, 1), self._grid.full_cover_t is not None
        stalled_s = t_s - max(self._steady_s, self._grid.new_cell_t)
        if math.isnan(slot_s):
            return whole or stalled_s >= STALLED_S
        return t_s - self._steady_s >= 2 * slot_s if whole else stalled_s >= LAPS * slot_s

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
            found.covered_s = None if whole_s is None else round(max(0.0, whole_s - self._begin_s), 1)
            found.cover_bound_s = _rounded(
                cover_bound_s(self._left_m2, ways_s, limits.speed_m_s, self._scenario.footprint_radius_m)
            )
        return found

    def _figures(self) -> RoundResult:
        sweep = self._sweep()
        ideal, bound = self._cells.ideal_s(*sweep), self._cells.bound_s(*sweep)
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
            coverage=round(seen_pct(grid.coverage, 2) / 100, 4),  # the whole is what was seen whole
            bound_s=_rounded(bound),
            ratio=_rounded(worst / ideal if ideal else math.nan),
            period_s=_rounded(self._period_s),
            off_slot_p95_m=_rounded(self._slots.off_p95_m),
            off_slot_max_m=_rounded(self._slots.off_max_m),
            lag_max_s=_rounded(self._slots.lag_max_s),
            stands=self._slots.stands,
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


def _rounded(value: float) -> float | None:
    return round(value, 2) if math.isfinite(value) else None
