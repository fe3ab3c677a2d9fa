"""Checks whether a planner copes with any team size, losses and joins, odd telemetry, targets, and odd zones."""

import random
from collections.abc import Callable, Iterator

import msgspec
import numpy as np
import shapely
import shapely.ops

from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Shape, polygon_of
from tui_gcs.core.protocol.common import Freshness, Phase
from tui_gcs.core.scenario.model import OperatingArea
from tui_gcs.planner.check.plan_form import active_ids, faults, rows_outside
from tui_gcs.planner.check.subject import (
    CheckedPlanner,
    Finding,
    PlannerFailure,
    PlannerRefusal,
    advising,
    failed,
    noted,
    passed,
)
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.kinematic_fleet import AREA, ZONE, Floats, KinematicFleet, middle_m, scattered, task_for

STEP_S = 0.2
TEAM_SIZES, QUICK_TEAM_SIZES = (*range(9), 32), (0, 1, 2, 32)
OUTSIDE = "outside the operating area"
"""Part of the text of `faults` by which it is recognised."""
MANY_POINTS = 60
LURED_S, LURE_M_S = 45.0, 6.0
"""Duration and speed of luring targets: from the middle of the zone a target leaves the area after 34 s, and it is slow
enough to be followed."""
STATES = ("taken out", "held", "lost", "not in the frame", "returning", "blind")
"""Ways in which a vehicle can be out of a plan."""

COUNT = 3
FLIGHT_S = 12.0
NEAR_EDGE_M = 25.0
"""Vehicles begin this far inside the area, those in front a few metres less."""
SMALL_AREA = OperatingArea(Rectangle((60.0, 60.0), 110.0, 110.0), 20.0, 90.0)
CASES: tuple[tuple[str, Shape, OperatingArea], ...] = (
    ("a zone of 1 m", Circle((250.0, 200.0), 0.5), AREA),
    ("a zone 100 m long and 1 m wide", Rectangle((250.0, 200.0), 100.0, 1.0, 30.0), AREA),
    ("a zone outside the area", Circle((1500.0, 200.0), 60.0), AREA),
    ("a zone half outside the area", Circle((20.0, 200.0), 60.0), AREA),
    ("a zone larger than the area", Rectangle((60.0, 60.0), 300.0, 300.0), SMALL_AREA),
    (
        "a zone with a bay",
        Polygon(((200.0, 150.0), (330.0, 150.0), (330.0, 280.0), (265.0, 165.0), (200.0, 280.0))),
        AREA,
    ),
)


class _CheckedFlight:
    """A flight in which every plan is checked."""

    def __init__(
        self, subject: CheckedPlanner, count: int, place: Callable[[KinematicFleet], None] = lambda _: None
    ) -> None:
        self._subject = subject
        self.task = task_for(range(1, count + 1), subject.name, seed=subject.seed)
        self.world = KinematicFleet(self.task, scattered(count))
        place(self.world)
        self.host: PlannerHost = subject.host(self.task)
        self.steps = 0
        self._serves_all = True
        """Every active vehicle has had an intent in every plan so far."""

    def go(self, duration_s: float, what: str) -> None:
        """Fly on. Raises `PlannerFailure` with what is wrong."""
        try:
            for frame, plan in self._subject.fly(self.host, self.world, duration_s):
                self.steps += 1
                if wrong := faults(plan, frame, self.task):
                    raise PlannerFailure(wrong[0])
                forgotten = sorted(active_ids(frame) - {intent.vehicle for intent in plan.intents})
                # A planner may leave a vehicle without an intent on purpose, but not all of a sudden.
                if forgotten and self._serves_all and self.steps > 5:
                    raise PlannerFailure(f"no intents for {forgotten}, which fly on and had one with every plan before")
                self._serves_all = self._serves_all and not forgotten
        except PlannerFailure as why:
            raise PlannerFailure(f"{what} (step {self.steps}): {why}") from None


def sizes(subject: CheckedPlanner) -> Iterator[Finding]:
    """Fly teams of none, of one and of more vehicles."""
    counts = QUICK_TEAM_SIZES if subject.quick else TEAM_SIZES
    for count in counts:
        with advising("teams have any number of vehicles, none included"):
            _CheckedFlight(subject, count).go(6.0, f"{count} vehicles")
    yield passed(f"teams of {', '.join(map(str, counts))} vehicles")


def losses(subject: CheckedPlanner) -> Iterator[Finding]:
    """Let every vehicle leave and come back in every way, at the first and at later steps, alone and together."""
    with advising("look at ctx.fleet.active in every step: intents for exactly those, a plan for who is left at once"):
        steps = _at_the_start(subject) + _one_by_one(subject) + _at_random(subject)
    yield passed(f"any vehicle, in {len(STATES)} ways, at any of {steps} steps; all at once, too")


def _at_the_start(subject: CheckedPlanner) -> int:
    def all_held(world: KinematicFleet) -> None:
        _set_states(world, dict.fromkeys(world.task.members, "held"))

    flight = _CheckedFlight(subject, 3, all_held)
    flight.go(1.0, "no vehicle is active at the first step")
    _set_states(flight.world, {1: "held", 2: "not in the frame"})
    flight.go(1.0, "the first joins")
    _set_states(flight.world, {})
    flight.go(3.0, "all join")
    return flight.steps


def _one_by_one(subject: CheckedPlanner) -> int:
    flight = _CheckedFlight(subject, 4)
    members = flight.task.members
    for state in STATES[:: 2 if subject.quick else 1]:
        for vehicle in members:
            _set_states(flight.world, {vehicle: state})
            flight.go(3 * STEP_S, f"vehicle {vehicle} {state}")
            _set_states(flight.world, {})
            flight.go(3 * STEP_S, f"vehicle {vehicle} joins after it was {state}")
        _set_states(flight.world, dict.fromkeys(members, state))
        flight.go(3 * STEP_S, f"all are {state}")
        _set_states(flight.world, {})
        flight.go(3 * STEP_S, f"all join after they were {state}")
    return flight.steps


def _at_random(subject: CheckedPlanner) -> int:
    """Fly with another random set of vehicles in every step."""
    flight, chance = _CheckedFlight(subject, 5), random.Random(subject.seed)
    for _ in range(25 if subject.quick else 100):
        _set_states(flight.world, {v: chance.choice(STATES) for v in flight.task.members if chance.random() < 0.3})
        flight.go(STEP_S, "vehicles come and go at every step")
    return flight.steps


def _set_states(world: KinematicFleet, states: dict[int, str]) -> None:
    """Set these vehicles' states; all others fly."""
    phases = {"taken out": Phase.TAKEN_OUT, "held": Phase.HOLDING, "returning": Phase.RETURNING}
    world.phase = {vehicle: phases[state] for vehicle, state in states.items() if state in phases}
    world.freshness = {vehicle: Freshness.LOST for vehicle, state in states.items() if state == "lost"}
    world.gone = {vehicle for vehicle, state in states.items() if state == "not in the frame"}
    world.blind = {vehicle for vehicle, state in states.items() if state == "blind"}


def telemetry(subject: CheckedPlanner) -> Iterator[Finding]:
    """Fly with numbers that are missing, old or jump."""
    flight = _CheckedFlight(subject, 4, lambda world: world.numb.update({1, 2, 3, 4}))
    world = flight.world
    with advising("numbers may be NaN, old or wrong: np.isfinite, np.nan_to_num, fleet.age_s"):
        flight.go(2.0, "only positions are known from the beginning")
        world.numb = {1, 4}
        flight.go(2.0, "velocity, heading and battery of two are NaN")
        world.numb, world.blind = set(), {2}
        flight.go(2.0, "every number of vehicle 2 is NaN")
        world.blind, world.age_s = set(), {1: 60.0, 3: 2.5}
        world.freshness = {1: Freshness.STALE}
        flight.go(3.0, "positions are 60 s and 2.5 s old")
        world.age_s, world.freshness = {}, {}
        # As after a laptop that slept: the station goes on with its newest frame.
        world.t_s += 45.0
        flight.go(2.0, "45 s without a frame")
        world.position_m[:, :2] += (60.0, -15.0)
        flight.go(2.0, "all positions jump by 60 m")
        world.velocity_m_s[:] = 60.0
        flight.go(STEP_S, "velocities of 100 m/s")
    yield passed("NaN, positions 60 s old, a gap of 45 s, a jump of 60 m, 100 m/s")


def tracks(subject: CheckedPlanner) -> Iterator[Finding]:
    """Fly with targets that are uncertain, near, many, below a vehicle, or suddenly gone."""
    flight = _CheckedFlight(subject, 4)
    world = flight.world
    try:
        flight.go(2.0, "nothing is seen")
        world.tracks = (world.target(1, (350.0, 280.0), confirmed=False),)
        flight.go(2.0, "a target that is not confirmed")
        for _ in range(20):
            east_m = 350.0 - 5.0 * flight.steps
            world.tracks = (world.target(1, (east_m, 260.0)), world.target(4, (250.0, 500.0), age_s=8.0))
            flight.go(STEP_S, "one target comes nearer, one outside the area was seen 8 s ago")
        x, y = world.position_m[0, :2].tolist()
        world.tracks = tuple(world.target(10 + k, (x + 40.0 * k, y)) for k in range(8))
        flight.go(3.0, "eight targets, the first right below a vehicle")
        _set_states(world, dict.fromkeys(flight.task.members, "held"))
        flight.go(1.0, "targets, but no vehicle is active")
        _set_states(world, {})
        world.tracks = ()
        flight.go(3.0, "all targets are gone")
        _lured_out(subject)
    except PlannerFailure as why:
        advice = "ctx.tracks may have any number of targets in any place, none included"
        if OUTSIDE in str(why):
            advice = "tracks may leave the area, and must not be followed there: keep every place inside task.area"
        yield failed(str(why), advice)
        return
    yield passed("none, one, two, eight; unsure, near, below a vehicle, gone at once; five leave the area")


def points(subject: CheckedPlanner) -> Iterator[Finding]:
    """Fly with tasks from outside: many, late, below a vehicle, outside the area, or suddenly gone."""
    flight = _CheckedFlight(subject, 4)
    world = flight.world
    x, y = world.position_m[0, :2].tolist()
    try:
        flight.go(1.0, "no task")
        world.points = (
            world.point("below", (x, y)),
            world.point("far", (1e5, -1e5), 1e6),
            world.point("late", (x + 40.0, y), due_s=0.0),
        )
        flight.go(3.0, "one task below a vehicle, one 100 km away, one whose time is up")
        world.points = tuple(world.point(f"p{k}", (x + 3.0 * k, y + 2.0 * (k % 9))) for k in range(MANY_POINTS))
        flight.go(3.0, f"{MANY_POINTS} tasks")
        _set_states(world, dict.fromkeys(flight.task.members, "held"))
        flight.go(1.0, "tasks, but nobody is active")
        _set_states(world, {})
        world.points = ()
        flight.go(2.0, "all tasks are gone")
    except PlannerFailure as why:
        yield failed(str(why), "ctx.points may have any number of places, anywhere, and none; they come and go")
        return
    if out := rows_outside(world.position_m, flight.task):
        who = flight.task.members[out[0]]
        yield failed(f"vehicle {who} is {OUTSIDE}", "points may lie anywhere: stay inside task.area")
        return
    yield passed(f"none, three, {MANY_POINTS}; below a vehicle, far outside, late, gone at once")


def _lured_out(subject: CheckedPlanner) -> None:
    """Let targets beside vehicles and in the zone leave the area. Raises `PlannerFailure` if a vehicle follows."""
    flight = _CheckedFlight(subject, 4)
    world = flight.world
    flight.go(1.0, "nothing is seen")
    begin_m = [*world.position_m[:, :2].tolist(), list(middle_m(flight.task.zone.shape))]
    ways_m_s = [(-LURE_M_S, 0.0)] * len(flight.task.members) + [(0.0, -LURE_M_S)]
    what = "targets leave the operating area"
    for step in range(round(LURED_S / STEP_S)):
        gone_s = STEP_S * step
        world.tracks = tuple(
            msgspec.structs.replace(
                world.target(20 + k, (x + east * gone_s, y + north * gone_s)), velocity_m_s=(east, north, 0.0)
            )
            for k, ((x, y), (east, north)) in enumerate(zip(begin_m, ways_m_s, strict=True))
        )
        flight.go(STEP_S, what)
        # The intents may stay inside while the vehicles, which brake late, do not.
        if out := rows_outside(world.position_m, flight.task):
            follower = flight.task.members[out[0]]
            raise PlannerFailure(f"{what} (step {flight.steps}): vehicle {follower} follows one and is {OUTSIDE}")


def zones(subject: CheckedPlanner) -> Iterator[Finding]:
    """Fly over zones that are tiny, thin, elsewhere or too large, and with all vehicles in one place."""
    cases = CASES[:3] if subject.quick else CASES
    for what, shape, area in cases:
        try:
            _fly(subject, shape, area, _near(shape, area))
        # A refusal in words reaches the operator before the flight: for an odd zone that is a right answer.
        except PlannerRefusal as why:
            yield noted(f"{what}: refused, as configure may: {why}")
        except PlannerFailure as why:
            advice = "stay inside task.area, or raise ValueError in configure: the operator reads its text"
            yield failed(f"{what}: {why}", advice)
            return
    try:
        _fly(subject, ZONE.shape, AREA, np.full((COUNT, 2), 60.0))
    except PlannerFailure as why:
        yield failed(f"all vehicles in one place: {why}", "distances may be 0: mind divisions")
        return
    yield passed(f"{', '.join(what for what, _, _ in cases)}; all vehicles in one place")


def _near(shape: Shape, area: OperatingArea) -> Floats:
    """Return (n, 2) places as near to the zone as vehicles may be, where leaving the area for the zone shows soon."""
    inside = polygon_of(area.shape).buffer(-NEAR_EDGE_M)
    nearest, _ = shapely.ops.nearest_points(inside, polygon_of(shape).representative_point())
    places = scattered(COUNT)
    places += np.array(nearest.coords[0]) - places.mean(axis=0)
    return places


def _fly(subject: CheckedPlanner, shape: Shape, area: OperatingArea, xy_m: np.ndarray) -> None:
    task = task_for(range(1, COUNT + 1), subject.name, seed=subject.seed, shape=shape, area=area)
    host = subject.host(task)
    world = KinematicFleet(task, xy_m)
    for frame, plan in subject.fly(host, world, FLIGHT_S):
        if wrong := faults(plan, frame, task):
            raise PlannerFailure(wrong[0])
        if out := rows_outside(world.position_m, task):
            x, y, _ = world.position_m[out[0]]
            raise PlannerFailure(
                f"vehicle {task.members[out[0]]} flies to ({x:.0f}, {y:.0f}), outside the operating area"
            )
