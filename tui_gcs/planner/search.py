"""The search planner: vehicles visit points of interest, shared among them by an auction of bids.

A bid is the priority of a point over the time that the way to it takes. The highest bid of all wins, then the highest
of the rest with the winner's way beginning at its point, and so on. Every vehicle flies to the first point that it has
won. The auction needs nothing but places and points, so it also runs once on each vehicle: instances then tell each
other what they fly to, and the higher bid keeps it.
"""

import math
from collections.abc import Mapping
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
)
from tui_gcs.planner.patrol.flyable_region import FlyableRegion

Floats = NDArray[np.floating[Any]]

TIME_SCALE_S = 10.0
"""A bid is halved by a way of this time: near points come first where priorities are equal."""
KEEP_SHARE = 1.25
"""A vehicle's bid for the point that it flies to counts so much more, so that it does not turn back and forth."""
MAX_BUNDLE = 3
"""How many points a vehicle wins in one auction: what comes after them is decided later anyway."""
CLAIM_S = 3.0
"""What another vehicle's instance claimed is forgotten after this time."""
RESERVE_S = 60.0
"""A vehicle bids for no point after which it would come home with less flight time than this left in its battery."""
INSIDE_M = 0.2
"""Places are chosen this far inside of where a vehicle may fly, against rounding."""


class Claim(msgspec.Struct, frozen=True):
    """The message of one vehicle's instance to the others: the point that it flies to, and its bid."""

    point: str
    bid: float


class Search(Planner):
    """Visits points of interest by priority and nearness, shared by an auction."""

    name = "search"
    judged_by = "tasks"
    message_type = Claim
    metrics = (Metric("open", "", "lower", help="points of interest that are not done yet"),)
    params = (Param("speed_fraction", float, 0.95, 0.1, 0.97, "", "speed as a share of the speed limit"),)

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        """Find out where vehicles may fly. Raises ValueError where they may not fly at all."""
        super().configure(task, params, rng)
        self._region = FlyableRegion(task.area, task.no_fly, task.limits, task.zone)
        self._share = float(params["speed_fraction"])
        self._targets: dict[int, str] = {}
        """By vehicle: the point that it flies to."""
        self._claims: dict[str, tuple[int, float, float]] = {}
        """By point: the vehicle whose instance claimed it, its bid, and when that was received."""

    def step(self, ctx: Context) -> Output:
        """Hold the auction anew, and send every vehicle towards the first point that it has won."""
        for message in ctx.messages:
            self._claims[message.payload.point] = (message.sender, message.payload.bid, ctx.t_s)
        self._claims = {name: claim for name, claim in self._claims.items() if ctx.t_s - claim[2] <= CLAIM_S}
        places_m, near = self._places(ctx)
        bundles, bids = self._auction(ctx, places_m, near)
        out = Output(annotations=[])
        for i in np.flatnonzero(ctx.fleet.active & ctx.fleet.own):
            vehicle, here = int(ctx.fleet.id[i]), ctx.fleet.position_m[i, :2]
            layer = ctx.fleet.layer_m[i]
            z = float(layer if np.isfinite(layer) else ctx.fleet.position_m[i, 2])
            if not (won := bundles.get(vehicle)):
                self._targets.pop(vehicle, None)
                out.intents.append(Intent(vehicle, "hold", joined=True, reason="no task"))
                continue
            name = ctx.points.name[won[0]]
            self._targets[vehicle] = name
            ctx.broadcast(Claim(name, bids[vehicle]))
            leg, _ = self._region.next_leg(self._inside(here), places_m[won[0]])
            speed_m_s = float(ctx.fleet.speed_m_s[i]) * self._share
            goal = (float(leg[0]), float(leg[1]), z)
            out.intents.append(Intent(vehicle, "goto", position_m=goal, speed_m_s=speed_m_s, joined=True, reason=name))
            way = tuple((round(float(x), 1), round(float(y), 1)) for x, y in (here, *(places_m[k] for k in won)))
            assert out.annotations is not None  # noqa: S101 - set above
            out.annotations.append(Annotation("polyline", way, f"{vehicle}>{name}"))
        unreachable = [name for k, name in enumerate(ctx.points.name) if not near[k]]
        if unreachable:
            out.notes.append(f"no vehicle may fly near enough to see {', '.join(unreachable[:5])}")
        out.metrics = {
            "open": float(len(ctx.points.name)),
            "assigned": float(sum(len(won) for won in bundles.values())),
            "unreachable": float(len(unreachable)),
        }
        return out

    def snapshot(self) -> bytes:
        """Return what vehicles fly to, and what others have claimed."""
        return msgspec.msgpack.encode((self._targets, self._claims))

    def restore(self, data: bytes) -> None:
        """Take over what `snapshot` gave."""
        kind = tuple[dict[int, str], dict[str, tuple[int, float, float]]]
        self._targets, self._claims = msgspec.msgpack.decode(data, type=kind)

    def _places(self, ctx: Context) -> tuple[Floats, NDArray[np.bool_]]:
        """Return (k, 2) the place from which each point is seen best, and whether it is near enough."""
        points_m = ctx.points.position_m
        if not len(points_m):
            return points_m, np.zeros(0, dtype=bool)
        places_m = np.array([self._inside(point) for point in points_m])
        reach_m = float(ctx.fleet.footprint_radius_m.min(initial=self.task.footprint_radius_m))
        return places_m, np.hypot(*(places_m - points_m).T) < reach_m - self.task.off_course_m

    def _inside(self, xy_m: Floats) -> Floats:
        """Return the nearest place where a vehicle may fly."""
        moved = self._region.ways_inside_m(xy_m[None])[0]
        far_m = float(np.hypot(*moved))
        return np.asarray(xy_m + moved * (1.0 + INSIDE_M / far_m) if far_m > 0.0 else xy_m)

    def _auction(
        self, ctx: Context, places_m: Floats, near: NDArray[np.bool_]
    ) -> tuple[dict[int, list[int]], dict[int, float]]:
        """Return by vehicle the points that it has won, in the order of its way, and its bid for the first."""
        rows = np.flatnonzero(ctx.fleet.active).tolist()
        ids = [int(ctx.fleet.id[i]) for i in rows]
        left = [k for k in range(len(places_m)) if near[k] and not self._is_claimed(ctx, k, ids)]
        here = {vehicle: ctx.fleet.position_m[i, :2] for vehicle, i in zip(ids, rows, strict=True)}
        speed = {v: float(ctx.fleet.speed_m_s[i]) * self._share for v, i in zip(ids, rows, strict=True)}
        spent_s = dict.fromkeys(ids, 0.0)
        bundles: dict[int, list[int]] = {vehicle: [] for vehicle in ids}
        first: dict[int, float] = {}
        while left:
            bidders = [vehicle for vehicle in ids if len(bundles[vehicle]) < MAX_BUNDLE]
            offers = [
                (self._bid(ctx, vehicle, k, spent_s[vehicle], here[vehicle], places_m[k], speed[vehicle]), vehicle, k)
                for vehicle in bidders
                for k in left
            ]
            # Of equal bids the one for the point that came first wins, by the westernmost vehicle: ids mean nothing.
            best = max(offers, key=lambda o: (o[0], -o[2], *(-here[o[1]]).tolist()), default=(0.0, 0, 0))
            bid, vehicle, k = best
            if bid <= 0.0:
                break
            first.setdefault(vehicle, bid)
            spent_s[vehicle] += float(np.hypot(*(places_m[k] - here[vehicle]))) / speed[vehicle]
            here[vehicle] = places_m[k]
            bundles[vehicle].append(k)
            left.remove(k)
        return {vehicle: won for vehicle, won in bundles.items() if won}, first

    def _bid(
        self, ctx: Context, vehicle: int, k: int, spent_s: float, here_m: Floats, place_m: Floats, speed_m_s: float
    ) -> float:
        """Return a vehicle's bid for a point after `spent_s` on its way; 0 where it comes too late or not home."""
        after_s = spent_s + max(float(np.hypot(*(place_m - here_m))), 0.0) / speed_m_s
        if after_s > ctx.points.left_s[k] or not self._can_come_back(ctx, vehicle, after_s):
            return 0.0
        kept = KEEP_SHARE if self._targets.get(vehicle) == ctx.points.name[k] and spent_s == 0.0 else 1.0
        return kept * float(ctx.points.priority[k]) / (1.0 + after_s / TIME_SCALE_S)

    @staticmethod
    def _can_come_back(ctx: Context, vehicle: int, away_s: float) -> bool:
        """Whether the battery lasts, as far as is known, to fly for so long, back again, home, and for the reserve."""
        row = int(np.flatnonzero(ctx.fleet.id == vehicle)[0])
        needed_s = 2.0 * away_s + float(np.nan_to_num(ctx.fleet.home_s[row])) + RESERVE_S
        return not ctx.fleet.battery_left_s[row] < needed_s

    def _is_claimed(self, ctx: Context, k: int, known: list[int]) -> bool:
        """Whether an instance on a vehicle that this one does not see here flies to the point, with a higher bid."""
        claim = self._claims.get(ctx.points.name[k])
        if claim is None or claim[0] in known:
            return False
        own = [
            self._bid(ctx, int(ctx.fleet.id[i]), k, 0.0, ctx.fleet.position_m[i, :2], ctx.points.position_m[k],
                      float(ctx.fleet.speed_m_s[i]) * self._share)
            for i in np.flatnonzero(ctx.fleet.active & ctx.fleet.own)
        ]  # fmt: skip
        return claim[1] >= max(own, default=-math.inf)
