"""The guardian in closed loop: its ring, the assignment of targets, losses, and what it may never do."""

import itertools
import math

import msgspec
import numpy as np
import pytest

from tests.planner.rigs.flights import (
    SMALL,
    Fleet,
    are_sendable,
    fleet,
    fly,
    host_of,
    no_fly,
    region_of,
    task_of,
    zone_of,
)
from tui_gcs.core.geometry.zones import Circle, Rectangle, Zone, polygon_of
from tui_gcs.core.guard.guard import BRAKES_BELOW_M_S, CATCH_UP_M, CATCH_UP_S
from tui_gcs.core.protocol.common import FleetFrame, Freshness, Intent, TeamPlan, Track
from tui_gcs.planner.guardian.guardian import Guardian, _VehiclePost
from tui_gcs.planner.guardian.intercept import TargetBoundaries, intercept, target_courses
from tui_gcs.planner.patrol.transit import Mobility
from tui_gcs.planner.runtime.host import PlannerHost

ZONE = zone_of(Circle((250.0, 200.0), 80.0))
ON_RING = ((350.0, 200.0), (250.0, 300.0), (150.0, 200.0), (250.0, 100.0))


def guardian(members: tuple[int, ...] = (1, 2, 3, 4), zone: Zone = ZONE, **parameters: float) -> PlannerHost:
    return host_of(task_of(zone, members, planner="guardian", **parameters))


class Intruders(Fleet):
    """Vehicles, and targets that are known as tracks while they are in sight."""

    def with_targets(self, *targets: tuple[float, float, float, float], confirmed: bool = True) -> "Intruders":
        self.targets = np.array(targets, dtype=float).reshape(-1, 4)
        self.confirmed, self.began_s = confirmed, self.t_s
        return self

    def places(self) -> np.ndarray:
        return self.targets[:, :2] + self.targets[:, 2:] * (self.t_s - self.began_s)

    def frame(self) -> FleetFrame:
        tracks = tuple(
            Track(k + 1, (x, y, 40.0), (vx, vy, 0.0), (1.0, 0.0, 1.0), 0.0, self.t_s, (1,), self.confirmed)
            for k, ((x, y), (vx, vy)) in enumerate(
                zip(self.places().tolist(), self.targets[:, 2:].tolist(), strict=True)
            )
        )
        return msgspec.structs.replace(super().frame(), tracks=tracks)


def guards(count: int = 4, *targets: tuple[float, float, float, float], confirmed: bool = True) -> Intruders:
    plain = fleet(count, places=ON_RING)
    made = Intruders(plain.ids, plain.position_m, plain.velocity_m_s)
    return made.with_targets(*targets, confirmed=confirmed)


def inwards(bearing_deg: float, far_m: float = 160.0, speed_m_s: float = 5.0) -> tuple[float, float, float, float]:
    x, y = math.cos(math.radians(bearing_deg)), math.sin(math.radians(bearing_deg))
    return 250.0 + far_m * x, 200.0 + far_m * y, -speed_m_s * x, -speed_m_s * y


def limits_kept(plan: TeamPlan, zone: Zone = ZONE, closed: tuple[Zone, ...] = ()) -> None:
    """What the guard would look at, for every sample of every track."""
    region = region_of(zone, closed=closed)
    for intent in plan.intents:
        assert intent.kind == "trajectory"
        places, speeds = np.array(intent.positions_m), np.array(intent.velocities_m_s)
        assert np.hypot(speeds[:, 0], speeds[:, 1]).max() <= 8.0
        assert np.hypot(*(np.diff(speeds, axis=0)[:, :2] / intent.dt_s).T).max() <= 2.5
        assert (places[:, 2] == 20.0 + 7.0 * intent.vehicle).all()
        assert are_sendable(region, places, speeds, intent.dt_s)


def test_the_tempo_is_not_changed_while_there_are_intruders() -> None:
    planner = guardian()._present().planner
    assert isinstance(planner, Guardian)
    planner._state.alert_until_s = 30.0
    notes = {t_s: planner._adapt_speed(float(t_s), 9.0) for t_s in range(60)}
    assert [t_s for t_s, told in notes.items() if told] == [32, 40, 48, 56]


def test_a_vehicle_off_the_ring_counts_as_off_though_its_path_begins_where_it_is() -> None:
    """Four real ones in 6 m/s of wind got new paths again and again, and were slowed half a minute too late."""
    planner = guardian()._present().planner
    assert isinstance(planner, Guardian)
    there = planner._circuits[0].at(np.array([3.0]))[0][0]
    outwards = (there - (250.0, 200.0)) / math.dist(there, (250.0, 200.0))
    coming, settled = _VehiclePost(False, 2.8, joined=True), _VehiclePost(False, 2.8, joined=True)
    assert planner._circuit_offset_m(coming, there + 4.0 * outwards, 0.2) == 0.0, "on its way to the ring"
    assert planner._circuit_offset_m(settled, there, 0.2) == pytest.approx(0.0, abs=1e-6)
    assert planner._circuit_offset_m(settled, there + 4.0 * outwards, 0.2) == pytest.approx(4.0, abs=0.01)


def reasons(plan: TeamPlan) -> list[str]:
    return [intent.reason for intent in plan.intents]


def test_a_team_spreads_equally_over_its_ring() -> None:
    vehicles = fleet(4, places=((360.0, 190.0), (365.0, 200.0), (355.0, 210.0), (150.0, 200.0)))
    plan = fly(guardian(), vehicles, 75.0, limits_kept)
    around = vehicles.position_m[:, :2] - (250.0, 200.0)
    assert np.hypot(*around.T) == pytest.approx(100.0, abs=1.5)
    gaps = np.diff(np.sort(np.degrees(np.arctan2(around[:, 1], around[:, 0]))))
    assert gaps == pytest.approx(90.0, abs=6.0)
    assert all(intent.joined for intent in plan.intents)
    assert plan.metrics["on_ring"] == plan.metrics["joined"] == 4


def test_some_patrol_inside_and_one_always_is_on_the_ring() -> None:
    vehicles = fleet(3, places=ON_RING)
    plan = fly(guardian((1, 2, 3), zone_of(SMALL), inside=5), vehicles, 30.0, lambda p: limits_kept(p, zone_of(SMALL)))
    assert [intent.slot for intent in plan.intents].count("inside") == 2
    far = np.hypot(*(vehicles.position_m[:, :2] - (150.0, 200.0)).T)
    assert ((far < 45.0).sum(), (far > 55.0).sum()) == (2, 1)


def test_intruders_are_met_outside_the_zone_and_the_ring_is_whole_again() -> None:
    vehicles, nearest = guards(4, inwards(40.0), inwards(170.0, 175.0)), [math.inf, math.inf]
    host = guardian()

    def watch(plan: TeamPlan) -> None:
        limits_kept(plan)
        for k, place in enumerate(vehicles.places()):
            if math.dist(place, (250.0, 200.0)) > 80.0:
                away = np.hypot(*(vehicles.position_m[:, :2] - place).T)
                nearest[k] = min(nearest[k], float(away.min()))

    plan = fly(host, vehicles, 0.2, watch)
    assert plan.metrics["tracks"] == plan.metrics["assigned"] == 2
    assert plan.metrics["margin_s"] > 0.0
    assert sorted(filter(None, reasons(plan))) == ["comes by track 1", "meets track 2"]
    assert sum(drawn.text.endswith(" s") for drawn in plan.annotations or ()) == 1
    plan = fly(host, vehicles, 18.0, watch)
    assert max(nearest) <= 20.0
    assert plan.metrics["countered"] == 2
    assert plan.metrics["on_ring"] == 4


def test_two_targets_side_by_side_are_one_vehicles_business() -> None:
    plan = fly(guardian(), guards(4, inwards(20.0, 150.0), inwards(28.0, 165.0)), 0.2)
    assert plan.metrics["assigned"] == 2
    plan = fly(guardian((1,)), guards(1, inwards(10.0, 140.0), inwards(14.0, 200.0)), 0.2)
    assert reasons(plan) == ["meets track 2, comes by track 1"]
    plan = fly(guardian((1,)), guards(1, inwards(10.0, 150.0), inwards(44.0, 200.0)), 0.2)
    assert reasons(plan) == ["comes by track 1, track 2"]


@pytest.mark.parametrize(
    ("target", "confirmed"),
    [(inwards(40.0), False), (inwards(40.0, speed_m_s=0.0), True), (inwards(40.0, speed_m_s=-5.0), True)],
    ids=["tentative", "standing", "leaving"],
)
def test_what_is_no_threat_is_left_alone(target: tuple[float, float, float, float], confirmed: bool) -> None:
    plan = fly(guardian(), guards(4, target, confirmed=confirmed), 2.0)
    assert plan.metrics["assigned"] == 0
    assert plan.metrics["on_ring"] == 4


def test_one_vehicle_stays_when_others_can_do_as_much() -> None:
    """Four targets for four, two of them one behind the other."""
    targets = (inwards(0.0), inwards(90.0), inwards(180.0), inwards(182.0, 170.0))
    plan = fly(guardian(), guards(4, *targets), 0.2)
    assert plan.metrics["assigned"] == 4
    assert plan.metrics["on_ring"] == 1


def test_a_target_missed_by_all_is_pursued_once_it_is_inside_and_not_before() -> None:
    """To follow it before would open the ring for the next; then one of two does, the other stays."""
    host, vehicles = guardian((1, 2)), guards(2, inwards(180.0, 105.0))  # they are east and north of the zone
    assert fly(host, vehicles, 0.2).metrics["assigned"] == 0
    vehicles.with_targets(inwards(180.0, 60.0))
    plan = fly(host, vehicles, vehicles.t_s + 1.0)
    assert sorted(reason.startswith("meets") for reason in reasons(plan)) == [False, True]


def test_losses_and_joins_with_intruders_at_any_step() -> None:
    rng, host = np.random.default_rng(3), guardian(tuple(range(1, 6)))
    vehicles = guards(5, *(inwards(float(b), 170.0) for b in (0, 50, 130, 200, 300, 310)))
    for _ in range(60):
        gone = rng.random(5) < 0.3
        vehicles.freshness = {i + 1: Freshness.LOST for i in np.flatnonzero(gone).tolist()}
        plan = fly(host, vehicles, vehicles.t_s + 0.4, limits_kept)
        assert sorted(intent.vehicle for intent in plan.intents) == [i + 1 for i in np.flatnonzero(~gone).tolist()]
        if rng.random() < 0.1:
            vehicles.with_targets(*(inwards(float(b), 170.0) for b in rng.uniform(0, 360, 3)))


def test_no_vehicles_and_one() -> None:
    assert fly(guardian(()), guards(0, inwards(0.0)), 1.0).intents == ()
    assert fly(guardian((1,)), guards(1, inwards(0.0)), 1.0, limits_kept).metrics["assigned"] == 1


def test_targets_beyond_the_fence_are_awaited_inside() -> None:
    zone, target = zone_of(Circle((120.0, 200.0), 80.0)), (-45.0, 200.0, 5.0, 0.0)
    vehicles = guards(2, target)
    vehicles.position_m[:, 0] = (60.0, 220.0)
    host, met = guardian((1, 2), zone), 0.0

    def watch(plan: TeamPlan) -> None:
        limits_kept(plan, zone)

    while vehicles.t_s < 15.0 and not met:
        met = fly(host, vehicles, vehicles.t_s + 0.4, watch).metrics["countered"]
    assert vehicles.places()[0][0] < 40.0


def test_ways_go_around_what_is_closed() -> None:
    closed = (no_fly(Rectangle((400.0, 200.0), 40.0, 60.0)),)
    host = host_of(task_of(ZONE, closed=closed, planner="guardian"))
    vehicles = guards(4, (480.0, 215.0, -6.0, 0.0))
    fly(host, vehicles, 20.0, lambda plan: limits_kept(plan, ZONE, closed))


def test_a_vehicle_outside_flies_back_before_anything_else() -> None:
    closed = (no_fly(Rectangle((350.0, 200.0), 40.0, 60.0)),)
    host, vehicles = host_of(task_of(ZONE, closed=closed, planner="guardian")), guards(4, (470.0, 200.0, -5.0, 0.0))
    region = region_of(ZONE, closed=closed)
    out_m = [float(np.hypot(*region.ways_inside_m(vehicles.position_m[:1, :2])[0]))]
    while out_m[-1] > 0.1 and vehicles.t_s < 10.0:
        fly(host, vehicles, vehicles.t_s + 0.2)
        out_m.append(float(np.hypot(*region.ways_inside_m(vehicles.position_m[:1, :2])[0])))
    assert out_m[0] > 20.0
    assert out_m[-1] <= 0.1
    assert (np.diff(out_m) <= 0.01).all()


class InWind(Intruders):
    """Vehicles that have this much acceleration left: the wind takes the rest of their lean."""

    accel_m_s2 = 1.0

    def follow(self, plan: TeamPlan, dt_s: float) -> None:
        self.t_s += dt_s
        for intent in plan.intents:
            i = self.ids.index(intent.vehicle)
            place, speed = at(intent, self.t_s)
            change = speed + (place - self.position_m[i, :2]) - self.velocity_m_s[i, :2]
            most = self.accel_m_s2 * dt_s
            self.velocity_m_s[i, :2] += change * min(1.0, most / max(float(np.hypot(*change)), 1e-9))
            self.position_m[i] += dt_s * self.velocity_m_s[i]


def at(intent: Intent, t_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Where a path is, and how fast."""
    times = intent.t0_s + intent.dt_s * np.arange(len(intent.positions_m))
    both = (intent.positions_m, intent.velocities_m_s)
    place, speed = ([float(np.interp(t_s, times, axis)) for axis in np.array(part).T[:2]] for part in both)
    return np.array(place), np.array(speed)


@pytest.mark.long
def test_a_vehicle_that_turns_too_slowly_gets_a_new_path_before_the_guard_sees_a_jump() -> None:
    """Flown: four real ArduCopters in 3 m/s of wind; one braked, and left its gap in the ring."""
    plain = fleet(4, places=ON_RING)
    vehicles = InWind(plain.ids, plain.position_m, plain.velocity_m_s).with_targets(
        *(inwards(float(b), 240.0) for b in (10, 75, 160, 260, 300))
    )
    host, worst_m_s, worst_m = guardian(), 0.0, 0.0
    while vehicles.t_s < 60.0:
        frame = vehicles.frame()
        if host.due(frame.t_s):
            vehicles.plan = host.step(frame)
        assert vehicles.plan is not None
        for intent in vehicles.plan.intents:
            i = vehicles.ids.index(intent.vehicle)
            place, speed = at(intent, vehicles.t_s)
            if np.hypot(*speed) > BRAKES_BELOW_M_S:
                worst_m_s = max(worst_m_s, float(np.hypot(*(speed - vehicles.velocity_m_s[i, :2]))))
            worst_m = max(worst_m, float(np.hypot(*(place - vehicles.position_m[i, :2]))))
        vehicles.follow(vehicles.plan, 0.1)
    assert worst_m_s < CATCH_UP_S * 2.5
    assert worst_m < CATCH_UP_M


def test_the_numbers_of_vehicles_do_not_matter() -> None:
    targets = [inwards(float(b), 160.0 + b / 20.0) for b in (10, 75, 160, 260, 300)]
    spots = [(360.0, 203.0), (247.0, 310.0), (141.0, 190.0), (258.0, 95.0)]
    paths = []
    for order in ((0, 1, 2, 3), (3, 1, 0, 2)):
        vehicles = guards(4, *targets)
        vehicles.position_m[:, :2] = [spots[k] for k in order]
        fly(guardian(), vehicles, 12.0)
        paths.append({k: vehicles.position_m[i, :2] for i, k in enumerate(order)})
    for k in range(4):
        assert paths[0][k] == pytest.approx(paths[1][k], abs=0.01)


def test_a_snapshot_goes_on_exactly() -> None:
    targets = [inwards(float(b), 165.0) for b in (10, 75, 160, 260, 300)]
    for stop_s in (0.2, 3.1, 9.0):
        host, vehicles = guardian(), guards(4, *targets)
        fly(host, vehicles, stop_s)
        other = PlannerHost("red")
        other.set_task(task_of(ZONE, planner="guardian"), host.snapshot())
        while vehicles.t_s < stop_s + 4.0:
            frame = vehicles.frame()
            if host.due(frame.t_s):
                mine, theirs = host.step(frame), other.step(frame)
                assert mine.intents == theirs.intents
                assert mine.metrics == theirs.metrics or math.isnan(mine.metrics["margin_s"])
                vehicles.plan = mine
            assert vehicles.plan is not None
            vehicles.follow(vehicles.plan, 0.1)


def test_meeting_in_closed_form_is_what_flying_gives() -> None:
    mobility, rng = Mobility(8.0, 2.5), np.random.default_rng(5)
    for _ in range(50):
        xy, target = rng.uniform(-100, 100, (2, 2))
        velocity, target_m_s = rng.uniform(-5, 5, (2, 2))
        found = intercept(xy, velocity, target, target_m_s, mobility, 15.0)
        there = target + target_m_s * found.after_s
        if found.after_s > 5.0:  # nearer ones are over before the turn is
            assert math.dist(found.place_m, there) <= 16.5
        # Who always flies to where the target is now is never much faster.
        assert float(found.after_s) <= _flown_s(xy, velocity, target, target_m_s) + 1.5


def _flown_s(xy: np.ndarray, velocity: np.ndarray, target: np.ndarray, target_m_s: np.ndarray) -> float:
    """Until a point mass that turns to where the target is meets it."""
    xy, velocity = xy.copy(), velocity.copy()
    for step in itertools.count():
        way = target + target_m_s * step * 0.05 - xy
        if np.hypot(*way) <= 15.0:
            return step * 0.05
        change = way / np.hypot(*way) * 8.0 - velocity
        velocity += change * min(1.0, 2.5 * 0.05 / max(float(np.hypot(*change)), 1e-9))
        xy += velocity * 0.05
    raise AssertionError


def test_courses_tell_when_a_target_is_in_the_zone() -> None:
    edges = TargetBoundaries(polygon_of(ZONE.shape), region_of(ZONE).polygon, 17.0)
    places = np.array([(410.0, 200.0), (410.0, 200.0), (250.0, 200.0), (430.0, 285.0), (-60.0, 200.0)])
    speeds = np.array([(-5.0, 0.0), (5.0, 0.0), (1.0, 0.0), (-5.0, 0.0), (5.0, 0.0)])
    found = target_courses(edges, places, speeds)
    assert found[0].enters_s == pytest.approx(16.0, abs=0.1)
    assert math.isinf(found[1].enters_s)
    assert found[2].enters_s == 0.0
    assert 20.0 < found[3].enters_s < 40.0
    assert found[0].reachable_s == 0.0
    assert found[4].reachable_s == pytest.approx(10.0, abs=1.0)
