"""The guardian planner: a moving ring of vehicles around a zone, from which intruders are met before they reach it.

Where vehicles wait matters more than which vehicle goes where (docs/planning.md C3): nearly every intruder that a ring
with the best assignment lets through is detected too late, because the vehicles that left opened a gap. So the planner
keeps a map of what no sensor has looked at. It weighs what each vehicle would meet against what may come unseen
(`interception_choice`). While no intruder is known, vehicles on the ring keep equal distances in time. A target is met
when a vehicle has been near it; then the vehicle is free again.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from tui_gcs.planner.api import (
    Annotation,
    Context,
    Intent,
    Metric,
    Output,
    Param,
    ParamValue,
    Planner,
    PlannerTask,
    Tracks,
    polygon_of,
)
from tui_gcs.planner.guardian.intercept import TargetBoundaries, target_courses
from tui_gcs.planner.guardian.interception_choice import (
    CircuitDirection,
    Engagement,
    InterceptTask,
    ThreatOutlook,
    VehicleOption,
    choose_options,
    intercept_tasks,
)
from tui_gcs.planner.guardian.path_steering import SAMPLE_S, SAMPLES, SteeringTargets, paths
from tui_gcs.planner.guardian.ring import nearest_phase_s, ring, spacing_rates
from tui_gcs.planner.guardian.unseen_threats import BIN_M, GROUP, LINES, Threats, UnseenThreatMap
from tui_gcs.planner.lazy_scipy import warm_up
from tui_gcs.planner.patrol.flyable_region import FlyableRegion
from tui_gcs.planner.patrol.speed_adaptation import SpeedAdaptation, from_inherited
from tui_gcs.planner.patrol.tour import Tour, drawing
from tui_gcs.planner.patrol.tour_search import design_tour
from tui_gcs.planner.patrol.tour_smoothing import TourLimits
from tui_gcs.planner.patrol.transit import Mobility

Floats = NDArray[np.floating[Any]]
Pairs = list[tuple[float, float]]

SPEED_SHARE, ACCEL_SHARE = 0.98, 0.9
"""Shares of the limits; the rest is the autopilot's for tracking."""
TOUR_SHARE = 0.9
"""Share of the speed limit for the tour inside the zone."""
MIN_RATE = -0.5
"""Smallest rate of a place on a circuit; it is negative because some places move back to spread."""
JOINED_M, LEFT_M = 5.0, 15.0
"""A vehicle has joined its place when nearer than the first distance, and has left it when farther than the second."""
# Measured: in 3 m/s of wind real ArduCopters could not turn as fast as planned. From 2 s on the guard takes the path
# for a jump.
LOST_TRACK_M, LOST_TRACK_S = 8.0, 1.7
"""A vehicle this far from its path, or this long from its velocity at full acceleration, gets a new path from where it
is."""
OLD_POSITION_S = 1.0
"""Older positions are not extrapolated further."""
ALLOWED_CROSS_TRACK_M, SETTLED_M = 1.5, 0.5
"""Cross-track error up to which a vehicle need not slow down, and up to which it counts as settled on its circuit. The
first is generous: a vehicle this far beside its way meets an intruder all the same, and speed is worth more."""
SLOW_M_S = 0.5
"""Below this speed a position error is not divided into along-track and cross-track."""
CONTACT_SHARE = 0.9
"""Share of the contact distance that meetings are planned with."""
INSIDE_M = 1.0
"""A vehicle outside the flyable region first flies back this far inside it."""
INNER_M, OUTER_M = -10.0, 15.0
"""Distances of two more rings from the first one, outwards: vehicles may fly there while there are intruders."""
ON_RING: CircuitDirection = (0, 1)
INSIDE: CircuitDirection = (3, 1)
ALERT: tuple[CircuitDirection, ...] = (ON_RING, (0, -1), (1, 1), (1, -1), (2, 1), (2, -1))
"""Circuits and directions that vehicles may choose while there are intruders."""
CALM_AFTER_S = 15.0
"""Time after the last intruder until the ring closes again."""
CHOOSE_EVERY_S = 0.6
"""Period of choosing anew, unless a target or a vehicle comes or goes."""
MAX_ON_ALERT = 16
"""With more vehicles there are no gaps to mind: vehicles leave the ring only to meet a target."""
DRAW_EVERY_S = 1.0
DRAWN_POINTS = 80


@dataclass
class _VehiclePost:
    """The state of one vehicle. Field names are stored in snapshots."""

    inside: bool
    """On the tour inside the zone; else on a ring."""
    phase_s: float
    """Phase of its place on its circuit."""
    rate: float = 1.0
    way: CircuitDirection = ON_RING
    joined: bool = False
    settled: bool = False
    """It has been right on its circuit since it joined."""
    targets: tuple[int, ...] = ()
    """Ids of the tracks that it is sent to, in order."""
    passes: tuple[int, ...] = ()
    """Ids of the tracks that it passes near enough on its way round."""
    path_m: Pairs = field(default_factory=list)
    """Path and velocities of the step before."""
    path_m_s: Pairs = field(default_factory=list)


@dataclass
class _GuardianState:
    """What a step leaves for the next one. Field names are stored in snapshots."""

    posts: dict[int, _VehiclePost] = field(default_factory=dict)
    met: tuple[int, ...] = ()
    """Ids of present tracks that a vehicle has been near."""
    unseen: bytes = b""
    """Cells of the `UnseenThreatMap`, and how far they have moved towards the next bin."""
    crept_m: float = 0.0
    alert_until_s: float = -math.inf
    chosen_s: float = -math.inf
    chosen_for: tuple[tuple[int, ...], tuple[int, ...]] = ((), ())
    """The tracks and vehicles of the last choice."""
    t_s: float = -math.inf
    drawn_s: float = -math.inf
    tempo: SpeedAdaptation = field(default_factory=SpeedAdaptation)


class Guardian(Planner):
    """Keeps vehicles on a ring around the zone, from which they meet intruders outside."""

    name = "guardian"
    version = "3"
    judged_by = "intruders"
    metrics = (
        Metric("countered", "", "higher", help="tracks that a vehicle came near enough to, as the planner counts"),
    )
    params = (
        Param("ring_m", float, 20.0, 0.0, 200.0, "m", "the ring is so far outside the zone"),
        Param("ring_speed", float, 0.97, 0.1, 0.97, "", "speed on the ring as a share of the limit"),
        Param("inside", int, 0, 0, 64, "", "vehicles on a tour inside the zone; at least one is on the ring"),
        Param("contact_m", float, 20.0, 2.0, 200.0, "m", "an intruder is met when a vehicle is so near"),
        Param("sees_m", float, 60.0, 5.0, 1000.0, "m", "range of the vehicles' sensors"),
        Param("intruder_m_s", float, 5.0, 0.5, 40.0, "m/s", "speed of intruders that no vehicle has seen yet"),
    )

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        """Compute the rings. Raises ValueError if there is no room for one."""
        super().configure(task, params, rng)
        warm_up()
        limits = task.limits
        self._accel_m_s2 = accel = limits.accel_m_s2 * ACCEL_SHARE
        self._region = FlyableRegion(task.area, task.no_fly, limits, task.zone)
        self._zone = polygon_of(task.zone.shape)
        self._contact_m = float(params["contact_m"])
        self._within_m = CONTACT_SHARE * self._contact_m
        self._boundaries = TargetBoundaries(self._zone, self._region.polygon, self._within_m)
        self._inside = int(params["inside"])
        ring_m_s = limits.speed_m_s * float(params["ring_speed"])
        out_m = [max(0.0, float(params["ring_m"]) + more_m) for more_m in (0.0, INNER_M, OUTER_M)]
        self._laid = [ring(self._zone, each_m, self._region, ring_m_s, accel) for each_m in out_m]
        tour = self._laid[0]
        if self._inside:
            motion = TourLimits(limits.speed_m_s * TOUR_SHARE, accel, task.footprint_radius_m)
            tour = design_tour(task.zone.shape, self._region, motion, task.footprint_radius_m, self._inside, rng).tour
        self._laid.append(tour)
        self._sees_m = float(params["sees_m"])
        self._unseen_map = UnseenThreatMap(self._zone, self._sees_m, float(params["intruder_m_s"]))
        self._state = _GuardianState(unseen=self._unseen_map.none_seen())
        self._apply_speed()

    def learnt(self) -> bytes:
        """Hand on the speed adaptation: the wind does not change with the zone."""
        return self._state.tempo.handed_on()

    def inherit(self, learnt: bytes) -> None:
        """Start with the speed that was right in the zone before."""
        self._state.tempo = from_inherited(learnt)
        self._apply_speed()

    def step(self, ctx: Context) -> Output:
        """Decide anew which vehicle meets which target, and return a trajectory for each vehicle."""
        fleet = ctx.fleet
        active = np.flatnonzero(fleet.active)
        # Sorted by place, so that ids decide nothing.
        rows = active[np.lexsort((fleet.position_m[active, 1], fleet.position_m[active, 0]))]
        xy, velocity, off_m = self._references(ctx, rows)
        notes = self._adapt_speed(ctx.t_s, off_m)
        self._update_posts([int(i) for i in fleet.id[rows]], xy)
        self._update_unseen(ctx.t_s, fleet.position_m[rows, :2])
        chased = self._open_targets(ctx.tracks, fleet.position_m[rows, :2])
        assigned = self._assign_targets(ctx.t_s, ctx.tracks, chased, fleet.id[rows], xy, velocity)
        steering = self._steering_targets(fleet.id[rows], xy, assigned, ctx.t_s)
        places, speeds = paths(xy, velocity, steering, self._mobility, self._region)
        out = Output(metrics=self._metrics(ctx.tracks, assigned), notes=notes)
        for k, i in enumerate(rows.tolist()):
            out.intents.append(self._intent(ctx, i, places[k], speeds[k], assigned.get(k)))
        out.intents.sort(key=lambda intent: intent.vehicle)
        if ctx.t_s - self._state.drawn_s >= DRAW_EVERY_S:
            self._state.drawn_s = ctx.t_s
            out.annotations = [drawing(self._circuits[0].xy_m, DRAWN_POINTS, "ring")]
            for k, task in sorted(assigned.items()):
                vehicle = int(fleet.id[rows[k]])
                out.annotations.append(_task_drawing(xy[k], task, vehicle, self._state.posts[vehicle].targets))
        self._state.t_s = ctx.t_s
        return out

    def snapshot(self) -> bytes:
        """Return the whole state with exact numbers."""
        return msgspec.msgpack.encode(self._state)

    def restore(self, data: bytes) -> None:
        """Take over what `snapshot` gave."""
        self._state = msgspec.msgpack.decode(data, type=_GuardianState)
        self._apply_speed()

    def _apply_speed(self) -> None:
        """Compute limits and circuits for the present speed.

        A vehicle that the wind carries off meets no target in time.
        """
        limits, rate = self.task.limits, self._state.tempo.share
        self._mobility = Mobility(limits.speed_m_s * SPEED_SHARE * rate, self._accel_m_s2 * rate**2)
        self._circuits = [tour.times(rate) for tour in self._laid] if rate < 1.0 else self._laid

    def _adapt_speed(self, t_s: float, off_m: float) -> list[str]:
        """Slow down if a vehicle cannot follow the ring, speed up when all can again. Do neither on alert."""
        tempo, wanted = self._state.tempo, self._state.tempo.wanted
        if t_s < self._state.alert_until_s:
            return []
        gap_s = tempo.judge(t_s, off_m - ALLOWED_CROSS_TRACK_M)
        if tempo.share != tempo.wanted:
            rate = tempo.advance(gap_s)
            for post in self._state.posts.values():
                post.phase_s /= rate  # the same place, on a circuit that takes longer
            self._apply_speed()
        return tempo.news(wanted)

    def _references(self, ctx: Context, rows: NDArray[np.int64]) -> tuple[Floats, Floats, float]:
        """Return (n, 2) places and velocities from which paths continue: the planned ones for vehicles near them.

        The third value is the largest cross-track error of vehicles that had joined their places; NaN without any.
        """
        fleet, since_s = ctx.fleet, ctx.t_s - self._state.t_s
        velocity = np.nan_to_num(fleet.velocity_m_s[rows, :2])
        age_s = np.clip(np.nan_to_num(fleet.age_s[rows]), 0.0, OLD_POSITION_S)
        xy = fleet.position_m[rows, :2] + velocity * age_s[:, None]
        off_m = math.nan
        if not 0.0 <= since_s <= SAMPLE_S * (SAMPLES - 1):
            return xy, velocity, off_m
        at, share = divmod(since_s / SAMPLE_S, 1.0)
        here, there = int(at), min(int(at) + 1, SAMPLES - 1)
        for k, i in enumerate(rows.tolist()):
            post = self._state.posts.get(int(fleet.id[i]))
            if post is None or not post.path_m:
                continue
            place = (1.0 - share) * np.array(post.path_m[here]) + share * np.array(post.path_m[there])
            way = (1.0 - share) * np.array(post.path_m_s[here]) + share * np.array(post.path_m_s[there])
            if post.joined and fleet.age_s[i] <= OLD_POSITION_S:
                beside_m = max(_cross_track_m(xy[k] - place, way), self._circuit_offset_m(post, xy[k], since_s))
                off_m = float(np.fmax(off_m, beside_m))
            change_m_s = math.dist(way, velocity[k])
            near = math.dist(place, xy[k]) <= LOST_TRACK_M and change_m_s <= LOST_TRACK_S * self._accel_m_s2
            if fleet.age_s[i] > OLD_POSITION_S or near:
                xy[k], velocity[k] = place, way
        return xy, velocity, off_m

    def _circuit_offset_m(self, post: _VehiclePost, xy: Floats, since_s: float) -> float:
        """Return how far beside its circuit a vehicle is that was on it; new paths from where it is would hide that."""
        here, velocity = self._circuits[post.way[0]].at(np.array([post.phase_s + post.rate * since_s]))
        aside_m = _cross_track_m(xy - here[0], velocity[0])
        post.settled = post.settled or aside_m <= SETTLED_M
        return aside_m if post.settled else 0.0

    def _update_posts(self, vehicles: list[int], xy: Floats) -> None:
        """Keep posts for exactly these vehicles, on the ring except for as many as are wanted inside."""
        posts = self._state.posts
        posts = {v: posts[v] if v in posts else _VehiclePost(False, math.nan) for v in vehicles}
        wanted = max(0, min(self._inside, len(posts) - 1))
        inner = [v for v in vehicles if posts[v].inside]
        outer = [v for v in vehicles if not posts[v].inside]
        middle = np.array([self._zone.centroid.x, self._zone.centroid.y])
        away = {v: float(np.hypot(*(xy[k] - middle))) for k, v in enumerate(vehicles)}
        for v in sorted(outer, key=away.__getitem__)[: max(0, wanted - len(inner))]:
            posts[v] = _VehiclePost(True, math.nan, way=INSIDE)
        for v in sorted(inner, key=away.__getitem__)[wanted:]:
            posts[v] = _VehiclePost(False, math.nan)
        self._state.posts = posts

    def _update_unseen(self, t_s: float, vehicles_m: Floats) -> None:
        """Move cleared cells inwards with time, and clear the cells that vehicles see now."""
        state, since_s = self._state, t_s - self._state.t_s
        if math.isfinite(since_s):
            state.unseen, state.crept_m = self._unseen_map.moved(state.unseen, state.crept_m, max(0.0, since_s))
        state.unseen = self._unseen_map.looked_at(state.unseen, vehicles_m)

    def _open_targets(self, tracks: Tracks, vehicles_m: Floats) -> NDArray[np.int64]:
        """Return the rows of confirmed tracks that no vehicle has been near."""
        met = set(self._state.met)
        for k in np.flatnonzero(tracks.confirmed).tolist():
            away = np.hypot(*(vehicles_m - tracks.position_m[k, :2]).T)
            # The position may be off by its uncertainty. That counts up to a quarter of the contact distance only, so
            # that a vague track can be met at all.
            if away.min(initial=np.inf) <= self._contact_m - min(float(tracks.sigma_m[k]), self._contact_m / 4.0):
                met.add(int(tracks.id[k]))
        self._state.met = tuple(sorted(met & set(tracks.id.tolist())))
        done = np.isin(tracks.id, np.array(self._state.met, dtype=np.int64))
        known = np.isfinite(tracks.position_m[:, :2]).all(axis=1) & np.isfinite(tracks.velocity_m_s[:, :2]).all(axis=1)
        return np.flatnonzero(tracks.confirmed & ~done & known)

    def _assign_targets(
        self,
        t_s: float,
        tracks: Tracks,
        chased: NDArray[np.int64],
        ids: NDArray[np.int64],
        xy: Floats,
        velocity: Floats,
    ) -> dict[int, InterceptTask]:
        """Return intercept tasks by row of `ids`, and store each post's targets and direction."""
        found = target_courses(self._boundaries, tracks.position_m[chased, :2], tracks.velocity_m_s[chased, :2])
        real = [k for k, course in enumerate(found) if np.isfinite(course.enters_s) and np.isfinite(course.reachable_s)]
        chased = chased[real]
        posts = [self._state.posts[int(v)] for v in ids]
        row_of = {int(track): k for k, track in enumerate(tracks.id[chased])}
        now = Engagement(
            xy,
            velocity,
            tracks.position_m[chased, :2],
            tracks.velocity_m_s[chased, :2],
            [found[k] for k in real],
            [VehicleOption(_rows(row_of, post.targets), post.way, _rows(row_of, post.passes)) for post in posts],
            self._mobility,
            self._within_m,
        )
        if len(chased):
            self._state.alert_until_s = t_s + CALM_AFTER_S
        options = self._options(t_s, now, posts, (tuple(sorted(row_of)), tuple(sorted(ids.tolist()))))
        assigned = intercept_tasks(now, options)
        for k, post in enumerate(posts):
            post.joined = post.joined and post.way == options[k].way
            post.way = options[k].way
            post.targets = tuple(int(tracks.id[chased[t]]) for t in assigned[k].targets) if k in assigned else ()
            post.passes = tuple(int(tracks.id[chased[t]]) for t in options[k].passes)
        return assigned

    def _options(
        self,
        t_s: float,
        now: Engagement,
        posts: list[_VehiclePost],
        about: tuple[tuple[int, ...], tuple[int, ...]],
    ) -> Sequence[VehicleOption]:
        """Return each vehicle's option: new ones if `about` (tracks, vehicles) changed or the last are old."""
        state = self._state
        if not posts or t_s >= state.alert_until_s:
            return [VehicleOption((), INSIDE if post.inside else ON_RING) for post in posts]
        if about == state.chosen_for and t_s - state.chosen_s < CHOOSE_EVERY_S - 1e-6:
            return now.before
        options = choose_options(now, self._outlook(posts))
        state.chosen_s, state.chosen_for = t_s, about
        return options

    def _outlook(self, posts: list[_VehiclePost]) -> ThreatOutlook:
        crowd = len(posts) > MAX_ON_ALERT
        threats = self._unseen_map.threats(self._state.unseen)
        if crowd:
            # In a crowd the ring has no gaps.
            threats = Threats(threats.xy_m[:0], threats.velocity_m_s[:0], threats.enters_s[:0], threats.weight[:0])
        ways = [(INSIDE,) if post.inside else (ON_RING,) if crowd else ALERT for post in posts]
        return ThreatOutlook(threats, self._circuits, ways, self._sees_m, BIN_M * GROUP, LINES)

    def _steering_targets(
        self, ids: NDArray[np.int64], xy: Floats, tasks: dict[int, InterceptTask], t_s: float
    ) -> SteeringTargets:
        """Return meeting places for vehicles with a task, places on their circuits for the others."""
        ahead = SAMPLE_S * np.arange(SAMPLES)
        place, velocity = np.zeros((len(ids), SAMPLES, 2)), np.zeros((len(ids), SAMPLES, 2))
        through = np.zeros(len(ids), dtype=bool)
        outside = self._region.ways_inside_m(xy) if len(xy) else xy
        self._move_places(ids, xy, tasks, t_s)
        for k, vehicle in enumerate(ids.tolist()):
            post, task = self._state.posts[vehicle], tasks.get(k)
            if task is not None:
                place[k] = self._region.pulled_inside(task.place_m[None])[0]
                through[k] = not task.waits and math.dist(place[k, 0], task.place_m) < 0.1
                velocity[k] = task.velocity_m_s if through[k] else 0.0
            else:
                place[k], rate = self._circuits[post.way[0]].at(post.phase_s + post.rate * ahead)
                velocity[k] = rate * post.rate
            leg, corner = self._region.next_leg(xy[k], place[k, 0])
            if outside[k].any():
                leg, corner = xy[k] + outside[k] + INSIDE_M * outside[k] / np.hypot(*outside[k]), True
            if corner:
                place[k], velocity[k], through[k] = leg, 0.0, False
        return SteeringTargets(place, velocity, through)

    def _move_places(self, ids: NDArray[np.int64], xy: Floats, tasks: dict[int, InterceptTask], t_s: float) -> None:
        """Move the places on all circuits on and update which vehicles have joined theirs."""
        since_s = t_s - self._state.t_s
        for number, tour in enumerate(self._circuits):
            rows = [k for k, v in enumerate(ids.tolist()) if self._state.posts[v].way[0] == number]
            if not rows:
                continue
            posts = [self._state.posts[int(ids[k])] for k in rows]
            for k, post, phase_s in zip(rows, posts, nearest_phase_s(tour, xy[rows]).tolist(), strict=True):
                post.phase_s = post.phase_s + post.rate * since_s if math.isfinite(since_s) else math.nan
                away_m = math.dist(tour.at(np.array([post.phase_s]))[0][0], xy[k]) if post.joined else math.inf
                post.joined = k not in tasks and away_m <= LEFT_M
                post.settled = post.settled and post.joined
                if not post.joined:
                    aside_m = math.dist(tour.at(np.array([phase_s]))[0][0], xy[k])
                    post.phase_s = phase_s + post.way[1] * aside_m / self._mobility.speed_m_s
                    post.joined = k not in tasks and aside_m <= JOINED_M
            self._set_rates(tour, posts, np.array([k not in tasks for k in rows], dtype=bool), t_s)

    def _set_rates(self, tour: Tour, posts: list[_VehiclePost], free: NDArray[np.bool_], t_s: float) -> None:
        """Set how fast places on one circuit move on: as timed on alert, else so that distances become equal."""
        if t_s < self._state.alert_until_s and not posts[0].inside:
            for post in posts:
                post.rate = float(post.way[1])
            return
        # Rates are limited by the top speed on the circuit, so that no vehicle must exceed its limit.
        fastest = max(1.0, self._mobility.speed_m_s / _top_speed(tour.velocity_m_s))
        moved = spacing_rates(np.array([post.phase_s for post in posts]), free, tour.period_s, MIN_RATE, fastest)
        for post, rate in zip(posts, moved.tolist(), strict=True):
            post.rate = rate

    def _intent(self, ctx: Context, i: int, places: Floats, speeds: Floats, task: InterceptTask | None) -> Intent:
        fleet = ctx.fleet
        post = self._state.posts[int(fleet.id[i])]
        post.path_m = [(x, y) for x, y in places.tolist()]
        post.path_m_s = [(x, y) for x, y in speeds.tolist()]
        z = float(fleet.layer_m[i]) if np.isfinite(fleet.layer_m[i]) else float(fleet.position_m[i, 2])
        meets = "meets " + ", then ".join(f"track {target}" for target in post.targets) if task is not None else ""
        passes = "comes by " + ", ".join(f"track {target}" for target in post.passes) if post.passes else ""
        going = "" if post.joined else "on its way to its place"
        return Intent(
            int(fleet.id[i]),
            "trajectory",
            t0_s=ctx.t_s,
            dt_s=SAMPLE_S,
            positions_m=tuple([(x, y, z) for x, y in post.path_m]),
            velocities_m_s=tuple([(x, y, 0.0) for x, y in post.path_m_s]),
            slot="" if task is not None else "inside" if post.inside else "ring",
            joined=post.joined,
            reason=", ".join(filter(None, (meets, passes))) or going,
        )

    def _metrics(self, tracks: Tracks, tasks: dict[int, InterceptTask]) -> dict[str, float]:
        posts = list(self._state.posts.values())
        assigned = sum(len(post.targets) + len(post.passes) for post in posts)
        return self._state.tempo.metrics | {
            "tracks": float(np.count_nonzero(tracks.confirmed)),
            "assigned": float(assigned),
            "countered": float(len(self._state.met)),
            "on_ring": float(sum(not post.targets and not post.inside for post in posts)),
            "joined": float(sum(post.joined for post in posts)),
            "margin_s": min((task.margin_s for task in tasks.values()), default=math.nan),
        }


def _rows(row_of: Mapping[int, int], wanted: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(row_of[t] for t in wanted if t in row_of)


def _top_speed(velocity_m_s: Floats) -> float:
    return float(np.hypot(*velocity_m_s.T).max())


def _cross_track_m(off_m: Floats, velocity_m_s: Floats) -> float:
    """Return the cross-track part of an error `off_m` (2,); being early or late does not count."""
    speed = float(np.hypot(*velocity_m_s))
    if speed < SLOW_M_S:
        return float(np.hypot(*off_m))
    return abs(float(off_m[0] * velocity_m_s[1] - off_m[1] * velocity_m_s[0])) / speed


def _task_drawing(xy_m: Floats, task: InterceptTask, vehicle: int, targets: tuple[int, ...]) -> Annotation:
    """Return a line from a vehicle to its meeting place, labelled with the tracks' names on the map."""
    ends = [(round(x, 1), round(y, 1)) for x, y in (xy_m.tolist(), task.place_m.tolist())]
    names = " ".join(f"@{target}" for target in targets)
    return Annotation("polyline", tuple(ends), f"{vehicle}>{names} {task.after_s:.0f} s")
