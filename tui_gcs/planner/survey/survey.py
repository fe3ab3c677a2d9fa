"""The survey planner: the zone is seen once, shared among the vehicles so that all end at about the same time.

What is not seen yet is cut into lanes, the lanes into one part for each vehicle. A small zone of which hardly anything
was seen yet may also be seen along a patrol's tour, of which each vehicle flies a part: whichever takes less. It is
divided anew when a vehicle joins or is lost, and when all have ended and something is left: ways around a no-fly zone
miss some cells behind it, which are seen in a second, short turn. A vehicle begins its part from a stop.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.api import (
    Annotation,
    Context,
    Fleet,
    Intent,
    KeepOut,
    Metric,
    Output,
    Param,
    ParamValue,
    Planner,
    PlannerTask,
    at_heights,
)
from tui_gcs.planner.lazy_scipy import min_cost_pairs, warm_up
from tui_gcs.planner.patrol.flyable_region import RegionOfTask
from tui_gcs.planner.patrol.patrol_state import array_of, encode_exactly
from tui_gcs.planner.patrol.tour import PATH_STEP_M, Tour, drawing, resampled, standing, timed
from tui_gcs.planner.patrol.tour_search import begin_search
from tui_gcs.planner.patrol.tour_site import LARGE_CELLS, site_of
from tui_gcs.planner.patrol.tour_smoothing import TourLimits
from tui_gcs.planner.survey.lanes import best_passes, path_of

Floats = NDArray[np.floating[Any]]

HORIZON_S, SAMPLE_S = 3.0, 0.25
"""Length and spacing of the trajectories that are sent."""
ACCEL_SHARE = 0.9
"""Share of the acceleration limit that is planned with; the rest is the autopilot's for tracking."""
LOST_TRACK_M = 8.0
"""A vehicle farther from its way than this begins anew from where it is."""
PATIENCE_S = 3.0
"""Shortest time between two divisions of what is left."""
DRAWN_POINTS = 100
SEEN_SHARE = 0.1
"""When more than this share of the zone was seen, only what is left is flown over, not a tour of the whole zone."""
CUTS = 8
"""So many places are tried where the first part of a tour may begin."""
INSIDE_M = 0.1
"""Ways are planned this far inside of where a vehicle may fly, against rounding."""


class SurveyPlanner(Planner):
    """Sees the zone once, in about the least time that the vehicles need together."""

    name = "survey"
    judged_by = "coverage"
    metrics = (
        Metric("covered_pct", "%", "higher", help="share of what can be seen that was seen"),
        Metric("predicted_cover_s", "s", "lower", help="time from the start of the plan to its end"),
    )
    params = (
        Param("speed_fraction", float, 0.95, 0.1, 0.97, "", "speed as a share of the speed limit"),
        Param("margin_m", float, 0.0, 0.0, 20.0, "m", "planned footprint is smaller by this than autopilots need"),
    )

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        """Find the cells that are to be seen. Raises ValueError where none can be."""
        super().configure(task, params, rng)
        warm_up()
        limits, classes = task.limits, [task.class_of(vehicle) for vehicle in task.members]
        self._radius_m = min([each.footprint_radius_m for each in classes], default=task.footprint_radius_m)
        self._speed_m_s = min([each.speed_m_s for each in classes], default=limits.speed_m_s)
        self._speed_m_s *= float(params["speed_fraction"])
        self._accel_m_s2 = min([each.accel_m_s2 for each in classes], default=limits.accel_m_s2) * ACCEL_SHARE
        self._regions = RegionOfTask(task)
        self._region = self._regions.whole
        cells = self._region.cells_of(task.zone.shape, self._radius_m)
        self._cells_m, self._cell_m = cells.centres_m(), cells.cell_m
        if not len(self._cells_m):
            raise ValueError(f"zone {task.zone.name!r}: nothing of it can be seen from where vehicles may fly")
        self._planned_m = self._radius_m - task.off_course_m - float(params["margin_m"])
        if self._planned_m < self._cell_m:
            less_m = self._radius_m - self._planned_m
            why = f"{less_m:g} m of it are margin (margin_m, and how well vehicles keep to their way)"
            raise ValueError(f"a footprint of {self._radius_m:g} m is too small: {why}")
        self._state = _SurveyState(seen=np.zeros(len(self._cells_m)))
        self._tours: dict[int, Tour] = {}
        self._whole = self._tour_of_zone(task, int(rng.integers(2**32)))

    def _tour_of_zone(self, task: PlannerTask, seed: int) -> Tour | None:
        """Return a patrol's tour on which all is seen, if there is one; large zones get lanes."""
        if len(self._cells_m) > LARGE_CELLS:
            return None
        motion = TourLimits(self._speed_m_s, self._accel_m_s2, self._planned_m)
        site = site_of(task.zone.shape, self._region, motion, self._radius_m)
        best = begin_search(site, seed, max(1, len(task.members))).best
        if best is None or best.crawls or best.real.coverage < 1.0 or best.margin < 1.0:
            return None
        return best.tour

    def step(self, ctx: Context) -> Output:
        """Return trajectories along the lanes for all active vehicles."""
        state, fleet = self._state, ctx.fleet
        rows = {int(fleet.id[i]): int(i) for i in np.flatnonzero(fleet.active & np.isfinite(fleet.position_m[:, 0]))}
        self._look(fleet, list(rows.values()))
        out = Output()
        keep_out = at_heights(ctx.keep_out, fleet.layer_m[list(rows.values())].tolist())
        changed, state.keep_out = keep_out != state.keep_out, keep_out
        self._region = self._regions.clear_of(keep_out)
        if rows and (changed or self._must_divide(ctx, rows)):
            self._divide(ctx, rows)
            ways = [drawing(np.array(state.ways[v].path_m), DRAWN_POINTS, f"survey {v}") for v in sorted(state.ways)]
            # A way leads out and back along one line; half of it is what is drawn.
            out.annotations = [Annotation("polyline", way.points_m[:-1], way.text) for way in ways]
        out.intents = [self._intent(ctx, vehicle, i) for vehicle, i in rows.items()]
        ends_s = [way.begin_s + self._tour(v).period_s / 2.0 for v, way in state.ways.items()]
        out.metrics = {
            "covered_pct": 100.0 * float(state.seen.mean()),
            "predicted_cover_s": max(ends_s, default=math.nan) - state.started_s,
            "left_s": max([0.0, *(end_s - ctx.t_s for end_s in ends_s)]),
        }
        return out

    def snapshot(self) -> bytes:
        """Return what was seen and where each vehicle is on its way; b"" if that is too long."""
        return encode_exactly(self._state)

    def restore(self, data: bytes) -> None:
        """Take over what `snapshot` gave."""
        self._state = msgspec.msgpack.decode(data, type=_SurveyState, dec_hook=array_of)
        self._tours = {}

    def _look(self, fleet: Fleet, rows: list[int]) -> None:
        """Mark the cells that vehicles see now."""
        for i in rows:
            away_m = self._cells_m - fleet.position_m[i, :2]
            self._state.seen[(away_m**2).sum(axis=1) <= self._radius_m**2] = 1.0

    def _must_divide(self, ctx: Context, rows: Mapping[int, int]) -> bool:
        state = self._state
        if state.ways.keys() != rows.keys():
            return True
        if ctx.t_s - state.divided_s < PATIENCE_S:
            return False
        if self._have_ended(ctx.t_s):
            return bool(self._left().any()) and ctx.t_s - state.divided_s > 2.0 * PATIENCE_S
        return any(self._off_m(ctx, v, i) > LOST_TRACK_M for v, i in rows.items())

    def _have_ended(self, t_s: float) -> bool:
        """Return whether all vehicles have come to the ends of their ways."""
        return all(t_s >= way.begin_s + self._tour(v).period_s / 2.0 for v, way in self._state.ways.items())

    def _off_m(self, ctx: Context, vehicle: int, i: int) -> float:
        place = self._places(vehicle, np.array([ctx.t_s - float(np.nan_to_num(ctx.fleet.age_s[i]))]))[0][0]
        return float(np.hypot(*(place - ctx.fleet.position_m[i, :2])))

    def _divide(self, ctx: Context, rows: Mapping[int, int]) -> None:
        """Share what is not seen yet among the vehicles, each of which begins where it stops."""
        state, fleet = self._state, ctx.fleet
        if not math.isfinite(state.started_s):
            state.started_s = ctx.t_s
        left = self._cells_m[self._left()]
        # Lanes over cells behind a no-fly zone lead round it, and may miss them again and again.
        missed = bool(state.ways) and state.left == len(left) and self._have_ended(ctx.t_s)
        state.divided_s, state.ways, self._tours, state.left = ctx.t_s, {}, {}, len(left)
        vehicles = sorted(rows, key=lambda v: tuple(fleet.position_m[rows[v], :2].tolist()))  # ids mean nothing
        stops = {v: self._stop(fleet, rows[v]) for v in vehicles}
        divisions = [_single_cells(left, len(rows)) if missed else self._lanes(left, len(rows))]
        if self._whole is not None and not state.keep_out and state.seen.mean() <= SEEN_SHARE:
            divisions.append(_parts(self._whole, np.array([stop_m for stop_m, _ in stops.values()])))
        found = [self._ways(ctx.t_s, stops, paths) for paths in divisions]
        state.ways = min(found, key=self._latest_end_s)

    def _ways(self, t_s: float, stops: Mapping[int, tuple[Floats, float]], paths: list[Floats]) -> dict[int, "_Way"]:
        """Return the vehicles' ways from where they stop along these paths, each as near as may be."""
        cost = np.array([[_away_m(stop_m, path) for path in paths] for stop_m, _ in stops.values()])
        chosen = dict(min_cost_pairs(cost.reshape(len(stops), -1) ** 2)) if paths else {}
        ways = {}
        for k, (vehicle, (stop_m, wait_s)) in enumerate(stops.items()):
            path = paths[chosen[k]] if k in chosen else stop_m[None]
            if np.hypot(*(path[-1] - stop_m)) < np.hypot(*(path[0] - stop_m)):
                path = path[::-1]
            way = self._region.pulled_inside(np.vstack([stop_m, path]), INSIDE_M)
            way = self._region.open_inside(way, PATH_STEP_M * 4.0)
            if np.hypot(*(way[0] - stop_m)) > PATH_STEP_M:  # it stops where a lost vehicle may come
                way = np.vstack([stop_m, way])
            ways[vehicle] = _Way(t_s + wait_s, way.astype(np.float64))
        return ways

    def _latest_end_s(self, ways: Mapping[int, "_Way"]) -> float:
        """Return when the last vehicle is at the end of its way."""
        return max(way.begin_s + self._timed(way).period_s / 2.0 for way in ways.values())

    def _left(self) -> NDArray[np.bool_]:
        """Return which cells are still to be seen, and can be: some only once a lost vehicle cannot be near them."""
        left = np.asarray(self._state.seen == 0.0)
        if self._state.keep_out:
            left[left] = self._region.within(self._cells_m[left], self._planned_m)
        return left

    def _lanes(self, left_m: Floats, vehicles: int) -> list[Floats]:
        """Return a path over its share of what is left for each vehicle; fewer where there is little."""
        if not len(left_m):
            return []
        parts = best_passes(left_m, self._cell_m, self._planned_m, vehicles, self._speed_m_s)
        return [path for part in parts if len(path := path_of(part))]

    def _stop(self, fleet: Fleet, i: int) -> tuple[Floats, float]:
        """Return where a vehicle stops if it brakes now, and after how long."""
        velocity = np.nan_to_num(fleet.velocity_m_s[i, :2])
        speed = float(np.hypot(*velocity))
        position = fleet.position_m[i, :2] + velocity * min(max(float(np.nan_to_num(fleet.age_s[i])), 0.0), 1.0)
        return position + velocity * speed / (2.0 * self._accel_m_s2), speed / self._accel_m_s2

    def _tour(self, vehicle: int) -> Tour:
        """Return a vehicle's way out and back as a function of time; it flies the first half."""
        if vehicle not in self._tours:
            self._tours[vehicle] = self._timed(self._state.ways[vehicle])
        return self._tours[vehicle]

    def _timed(self, way: "_Way") -> Tour:
        path = way.path_m
        closed = np.vstack([path, path[-2:0:-1]]) if len(path) > 2 else path
        if len(path) < 2 or float(np.hypot(*np.ptp(path, axis=0))) < 1.0:
            return standing(path[-1])
        return timed(resampled(closed, PATH_STEP_M), self._speed_m_s, self._accel_m_s2)

    def _places(self, vehicle: int, times_s: Floats) -> tuple[Floats, Floats]:
        """Return (k, 2) positions and velocities: at the begin of the way before it, at its end after it."""
        way, tour = self._state.ways[vehicle], self._tour(vehicle)
        phase = times_s - way.begin_s
        under_way = (phase > 0.0) & (phase < tour.period_s / 2.0)
        xy, velocity = tour.at(np.clip(phase, 0.0, tour.period_s / 2.0))
        return xy, velocity * under_way[:, None]

    def _intent(self, ctx: Context, vehicle: int, i: int) -> Intent:
        times = ctx.t_s + SAMPLE_S * np.arange(round(HORIZON_S / SAMPLE_S) + 1)
        xy, velocity = self._places(vehicle, times)
        layer = ctx.fleet.layer_m[i]
        z = float(layer if np.isfinite(layer) else ctx.fleet.position_m[i, 2])
        ended = ctx.t_s >= self._state.ways[vehicle].begin_s + self._tour(vehicle).period_s / 2.0
        if ended:
            return Intent(vehicle, "goto", position_m=(*xy[-1].tolist(), z), joined=True, reason="has seen its part")
        return Intent(
            vehicle,
            "trajectory",
            t0_s=ctx.t_s,
            dt_s=SAMPLE_S,
            positions_m=tuple([(x, y, z) for x, y in xy.tolist()]),
            velocities_m_s=tuple([(vx, vy, 0.0) for vx, vy in velocity.tolist()]),
            slot="lanes",
            joined=True,
        )


@dataclass
class _Way:
    """A vehicle's way: from `begin_s` on along `path_m` (k, 2), beginning and ending at rest."""

    begin_s: float
    path_m: NDArray[np.float64]


@dataclass
class _SurveyState:
    """What a step leaves for the next one. Field names are stored in snapshots."""

    seen: NDArray[np.float64]
    """(cells,) 1 where a cell was seen, else 0."""
    ways: dict[int, _Way] = field(default_factory=dict)
    started_s: float = math.inf
    divided_s: float = -math.inf
    keep_out: tuple[KeepOut, ...] = ()
    """Where lost vehicles may be: ways lead round it."""
    left: int = -1
    """How many cells were not seen when they were last divided."""


def _single_cells(left_m: Floats, vehicles: int) -> list[Floats]:
    """Return a path to one cell for each vehicle, from all over what is left: it ends as near to it as can be flown."""
    chosen = np.unique(np.linspace(0, len(left_m) - 1, min(vehicles, len(left_m))).astype(int))
    return [left_m[k, None] for k in chosen]


def _parts(tour: Tour, places_m: Floats) -> list[Floats]:
    """Return the tour cut into equally long parts, one for each of the vehicles at `places_m` (n, 2).

    It is cut where the ways to the parts are shortest: the longest of them, to the nearer end of a part.
    """
    part_s = tour.period_s / len(places_m)
    phases = part_s * np.arange(len(places_m))[:, None] + np.linspace(0.0, part_s, max(2, math.ceil(part_s / SAMPLE_S)))
    cuts = [list(tour.at(phases + part_s * cut / CUTS)[0]) for cut in range(CUTS)]

    def farthest_m(parts: list[Floats]) -> float:
        away = np.array([[_away_m(place, part) for part in parts] for place in places_m])
        return max(float(away[row, column]) for row, column in min_cost_pairs(away**2))

    return min(cuts, key=farthest_m)


def _away_m(place_m: Floats, path_m: Floats) -> float:
    """Return the distance from a place to the nearer end of a path."""
    return float(min(np.hypot(*(path_m[0] - place_m)), np.hypot(*(path_m[-1] - place_m))))
