"""The search planner: vehicles visit points of interest, shared among them by an auction of bids.

A bid is the priority of a point over the time that the way to it takes. The highest bid of all wins, then the highest
of the rest with the winner's way beginning at its point, and so on. Every vehicle flies to the first point that it has
won. The auction needs nothing but places and points, so it also runs once on each vehicle: instances then tell each
other what they fly to, and the higher bid keeps it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
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
    at_heights,
)
from tui_gcs.planner.patrol.flyable_region import RegionOfTask

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


@dataclass(frozen=True)
class _Bidder:
    """A vehicle in an auction, with what it has won so far."""

    vehicle: int
    here_m: Floats
    """(2,) where the way to the next point begins: its place, or the point that it won last."""
    speed_m_s: float
    battery_left_s: float
    """NaN while unknown."""
    home_s: float
    """How long its way home takes from where it is; 0 while unknown."""
    spent_s: float = 0.0
    """How long the way to the points that it has won takes."""

    def can_come_back(self, away_s: float) -> bool:
        """Whether the battery lasts, as far as is known, to fly for so long, back again, home, and for the reserve."""
        return not self.battery_left_s < 2.0 * away_s + self.home_s + RESERVE_S


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
        self._regions = RegionOfTask(task)
        self._region = self._regions.whole
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
        layers_m = ctx.fleet.layer_m[ctx.fleet.active & ctx.fleet.own]
        self._region = self._regions.clear_of(at_heights(ctx.keep_out, layers_m.tolist()))
        places_m, near = self._places(ctx)
        bundles, bids = self._auction(ctx, places_m, near)
        out = Output(annotations=[])
        for i in np.flatnonzero(ctx.fleet.active & ctx.fleet.own):
            vehicle, here = int(ctx.fleet.id[i]), ctx.fleet.position_m[i, :2]
            layer = ctx.fleet.layer_m[i]
            z = float(layer if np.isfinite(layer) else ctx.fleet.position_m[i, 2])
            inside_m = self._region.pulled_inside(here[None], INSIDE_M)[0]
            if not (won := bundles.get(vehicle)):
                self._targets.pop(vehicle, None)
                out.intents.append(_without_task(vehicle, here, inside_m, z))
                continue
            name = ctx.points.name[won[0]]
            self._targets[vehicle] = name
            ctx.broadcast(Claim(name, bids[vehicle]))
            leg, _ = self._region.next_leg(inside_m, places_m[won[0]])
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
        places_m = self._region.pulled_inside(points_m, INSIDE_M)
        reach_m = float(ctx.fleet.footprint_radius_m.min(initial=self.task.footprint_radius_m))
        return places_m, np.hypot(*(places_m - points_m).T) < reach_m - self.task.off_course_m

    def _auction(
        self, ctx: Context, places_m: Floats, near: NDArray[np.bool_]
    ) -> tuple[dict[int, list[int]], dict[int, float]]:
        """Return by vehicle the points that it has won, in the order of its way, and its bid for the first."""
        bidders = self._bidders(ctx, ctx.fleet.active)
        ids = [bidder.vehicle for bidder in bidders]
        left = [k for k in range(len(places_m)) if near[k] and not self._is_claimed(ctx, k, ids)]
        bundles: dict[int, list[int]] = {vehicle: [] for vehicle in ids}
        first: dict[int, float] = {}
        while left:
            offers = [
                (self._bid(ctx, k, bidder, places_m[k]), bidder, k)
                for bidder in bidders
                if len(bundles[bidder.vehicle]) < MAX_BUNDLE
                for k in left
            ]
            # Of equal bids the one for the point that came first wins, by the westernmost vehicle: ids mean nothing.
            best = max(offers, key=lambda o: (o[0], -o[2], *(-o[1].here_m).tolist()), default=None)
            if best is None or best[0] <= 0.0:
                break
            bid, winner, k = best
            first.setdefault(winner.vehicle, bid)
            bundles[winner.vehicle].append(k)
            left.remove(k)
            way_s = float(np.hypot(*(places_m[k] - winner.here_m))) / winner.speed_m_s
            moved = replace(winner, here_m=places_m[k], spent_s=winner.spent_s + way_s)
            bidders = [moved if bidder is winner else bidder for bidder in bidders]
        return {vehicle: won for vehicle, won in bundles.items() if won}, first

    def _bidders(self, ctx: Context, taking_part: NDArray[np.bool_]) -> list[_Bidder]:
        """Return these rows of the fleet as bidders, before any point was won."""
        fleet = ctx.fleet
        return [
            _Bidder(
                int(fleet.id[i]),
                fleet.position_m[i, :2],
                float(fleet.speed_m_s[i]) * self._share,
                float(fleet.battery_left_s[i]),
                float(np.nan_to_num(fleet.home_s[i])),
            )
            for i in np.flatnonzero(taking_part)
        ]

    def _bid(self, ctx: Context, k: int, bidder: _Bidder, place_m: Floats) -> float:
        """Return a vehicle's bid for a point after what it has won; 0 where it comes too late or not home."""
        after_s = bidder.spent_s + max(float(np.hypot(*(place_m - bidder.here_m))), 0.0) / bidder.speed_m_s
        if after_s > ctx.points.left_s[k] or not bidder.can_come_back(after_s):
            return 0.0
        goes_on = self._targets.get(bidder.vehicle) == ctx.points.name[k] and bidder.spent_s == 0.0
        kept = KEEP_SHARE if goes_on else 1.0
        return kept * float(ctx.points.priority[k]) / (1.0 + after_s / TIME_SCALE_S)

    def _is_claimed(self, ctx: Context, k: int, known: list[int]) -> bool:
        """Whether an instance on a vehicle that this one does not see here flies to the point, with a higher bid."""
        claim = self._claims.get(ctx.points.name[k])
        if claim is None or claim[0] in known:
            return False
        ours = self._bidders(ctx, ctx.fleet.active & ctx.fleet.own)
        own = [self._bid(ctx, k, bidder, ctx.points.position_m[k]) for bidder in ours]
        return claim[1] >= max(own, default=-math.inf)


def _without_task(vehicle: int, here_m: Floats, inside_m: Floats, z: float) -> Intent:
    """Return what a vehicle without a task does: it waits, but not where a lost one may come."""
    if float(np.hypot(*(inside_m - here_m))) <= 2.0 * INSIDE_M:
        return Intent(vehicle, "hold", joined=True, reason="no task")
    goal = (float(inside_m[0]), float(inside_m[1]), z)
    return Intent(vehicle, "goto", position_m=goal, joined=True, reason="to where it may wait")
