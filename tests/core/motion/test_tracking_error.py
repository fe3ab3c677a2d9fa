"""How late and how far beside its course a vehicle is, and the lead that takes it away."""

import math

import numpy as np
import pytest

from tests.core.rigs.vehicles import a_vehicle
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.motion.course import PositionTarget, Trajectory
from tui_gcs.core.motion.lead_compensation import MAX_SHIFT_M, LeadCompensatedCourse, LeadCompensation
from tui_gcs.core.motion.tracking_error import TrackingMonitor

RADIUS_M, SPEED_M_S = 60.0, 8.0
TURN_M_S2 = SPEED_M_S**2 / RADIUS_M


def circle(duration_s: float = 300.0, dt_s: float = 0.25) -> Trajectory:
    """Counter-clockwise about the origin from (60, 0)."""
    t = np.arange(0.0, duration_s, dt_s) * SPEED_M_S / RADIUS_M
    places = np.stack([RADIUS_M * np.cos(t), RADIUS_M * np.sin(t), np.full_like(t, 30.0)], axis=1)
    velocities = np.stack([-SPEED_M_S * np.sin(t), SPEED_M_S * np.cos(t), np.zeros_like(t)], axis=1)
    return Trajectory(0.0, dt_s, places, velocities)


class Autopilot:
    """Is where it was told to be `late_s` before, and outside by `outward_s2` times the centripetal acceleration."""

    def __init__(self, course: Trajectory, lead: LeadCompensation, *, late_s: float, outward_s2: float) -> None:
        self.vehicle: Vehicle = a_vehicle(1)
        self.course, self.tracking = course, TrackingMonitor(lead)
        self.late_s, self.outward_s2 = late_s, outward_s2

    def fly(self, until_s: float) -> "Autopilot":
        for now in np.arange(1.0, until_s, 0.1):
            (x, y, z), _ = LeadCompensatedCourse(self.course, self.tracking.lead).at(now - self.late_s)
            wider = 1.0 + self.outward_s2 * TURN_M_S2 / math.hypot(x, y)
            self.vehicle.telemetry.position_m, self.vehicle.telemetry.position_s = (x * wider, y * wider, z), float(now)
            self.tracking.update(self.course, self.vehicle)
        return self

    @property
    def error_m(self) -> float:
        return math.dist(self.course.at(self.vehicle.telemetry.position_s)[0], self.vehicle.telemetry.position_m)


class Px4:
    """PX4's position control against the air: PI of velocity, P of position, and the accelerations it is told."""

    def __init__(self, course: Trajectory, lead: LeadCompensation, *, drag_hz: float) -> None:
        self.vehicle: Vehicle = a_vehicle(1)
        self.course, self.tracking, self.drag_hz = course, TrackingMonitor(lead), drag_hz
        self.place, self.speed, self.integral = (np.array(start[:2]) for start in (*course.at(0.0), (0.0, 0.0)))

    def fly(self, begin_s: float, until_s: float) -> list[float]:
        """Distances from the course."""
        errors = []
        for now in np.arange(begin_s, until_s, 0.1):
            led = LeadCompensatedCourse(self.course, self.tracking.lead)
            (goal, feed), push = (np.array(led.at(now))[:, :2]), np.array(led.feed_forward(now)[:2])
            for _ in range(5):
                error = feed + 0.95 * (goal - self.place) - self.speed
                lean = push + 1.8 * error + self.integral - self.drag_hz * self.speed
                self.integral, self.speed = self.integral + 0.4 * error * 0.02, self.speed + lean / 1.2 * 0.02
                self.place = self.place + self.speed * 0.02
            x, y = self.place.tolist()
            self.vehicle.telemetry.position_m, self.vehicle.telemetry.position_s = (x, y, 30.0), float(now + 0.1)
            self.tracking.update(self.course, self.vehicle)
            errors.append(math.dist(self.course.at(now + 0.1)[0][:2], (x, y)))
        return errors


@pytest.mark.parametrize("drag_hz", [0.0, 0.2, 1.0])
def test_drag_is_learnt_in_flight_and_pushed_against(drag_hz: float) -> None:
    """PX4's own simulator has 1.0; others have another one, which is learnt."""
    flown = Px4(circle(), LeadCompensation(0.05, drag_hz=0.5), drag_hz=drag_hz)
    first, last = max(flown.fly(0.0, 20.0)), max(flown.fly(90.0, 120.0) if flown.fly(20.0, 90.0) else [])
    assert flown.tracking.lead.drag_hz == pytest.approx(drag_hz, abs=0.1)
    assert first > 0.5 and last < 0.3


def test_who_is_told_no_push_is_metres_outside() -> None:
    """What the push is for: this is how far the real one is off without it."""
    flown = Px4(circle(), LeadCompensation(), drag_hz=1.0)
    flown.tracking.update = lambda course, vehicle: None  # type: ignore[method-assign]
    assert min(flown.fly(0.0, 60.0)[400:]) > 2.0


def test_a_push_is_the_acceleration_of_the_course_and_of_the_air() -> None:
    x, y, z = LeadCompensatedCourse(circle(), LeadCompensation(drag_hz=0.5)).feed_forward(0.0)
    assert (x, y, z) == pytest.approx((-1.2 * TURN_M_S2, 0.5 * SPEED_M_S, 0.0), abs=0.1)
    assert LeadCompensatedCourse(circle(), LeadCompensation(0.0, 1.0)).feed_forward(0.0) == (0.0, 0.0, 0.0), (
        "no drag known: nothing is pushed"
    )


def test_the_acceleration_of_a_circle_points_to_its_centre() -> None:
    x, y, z = circle().acceleration(0.0)
    assert (x, y, z) == pytest.approx((-TURN_M_S2, 0.0, 0.0), abs=0.05)
    x, y, z = circle().acceleration(RADIUS_M / SPEED_M_S * math.pi / 2)
    assert (x, y, z) == pytest.approx((0.0, -TURN_M_S2, 0.0), abs=0.05)


def test_a_led_course_is_ahead_in_time_and_inside_in_curves() -> None:
    (x, y, _), velocity = LeadCompensatedCourse(circle(), LeadCompensation(0.25, 2.0)).at(10.0)
    assert math.hypot(x, y) == pytest.approx(RADIUS_M - 2.0 * TURN_M_S2, abs=0.1)
    assert math.hypot(*velocity) == pytest.approx(SPEED_M_S, abs=0.05)
    assert math.atan2(y, x) == pytest.approx(10.25 * SPEED_M_S / RADIUS_M, abs=0.01)


def test_without_a_lead_it_is_the_course_itself() -> None:
    assert LeadCompensatedCourse(circle(), LeadCompensation()).at(7.3) == circle().at(7.3)


def test_who_speeds_up_is_sent_farther_ahead_and_who_brakes_less_far() -> None:
    """Seen on the real ArduCopter: 0.8 m behind where it speeds up, 0.8 m ahead where it brakes."""
    speeds = np.concatenate([np.arange(2.0, 8.0, 0.5), np.arange(8.0, 2.0, -0.5)])
    ways = np.concatenate([[0.0], np.cumsum(speeds[:-1] * 0.25 + np.diff(speeds) * 0.125)])
    none = np.zeros_like(ways)
    course = Trajectory(0.0, 0.25, np.stack([ways, none, none], axis=1), np.stack([speeds, none, none], axis=1))
    for t, ahead_m in ((1.5, 2.0), (4.5, -2.0)):
        assert LeadCompensatedCourse(course, LeadCompensation(0.0, 1.0)).at(t)[0][0] - course.at(t)[0][
            0
        ] == pytest.approx(ahead_m)


def test_the_shift_is_bounded() -> None:
    (x, y, _), _ = LeadCompensatedCourse(circle(), LeadCompensation(0.0, 100.0)).at(10.0)
    assert math.hypot(x, y) == pytest.approx(RADIUS_M - MAX_SHIFT_M, abs=0.1)


def test_lag_is_measured_before_anything_is_led_away() -> None:
    """Six seconds: shown already, hardly learnt yet."""
    flown = Autopilot(circle(), LeadCompensation(), late_s=0.3, outward_s2=0.0).fly(5.0)
    assert flown.tracking.lag_s == pytest.approx(0.3, abs=0.03)
    assert flown.tracking.lead.time_s < 0.1


@pytest.mark.parametrize(("late_s", "outward_s2"), [(0.25, 1.9), (0.05, 0.8), (0.6, 3.0), (0.0, 0.0)])
def test_the_lead_is_learnt_in_a_minute_or_two(late_s: float, outward_s2: float) -> None:
    flown = Autopilot(circle(), LeadCompensation(), late_s=late_s, outward_s2=outward_s2).fly(120.0)
    assert flown.error_m < 0.2
    assert flown.tracking.lead.time_s == pytest.approx(late_s, abs=0.03)
    assert flown.tracking.lead.accel_s2 == pytest.approx(outward_s2, abs=0.2)
    assert abs(flown.tracking.lag_s) < 0.03


def test_what_a_link_that_loses_frames_does_in_curves_is_not_led_away() -> None:
    """Straight on until the next set-point comes: not the autopilot's, and led away it made it worse (flown)."""
    autopilot = Autopilot(circle(), LeadCompensation(0.1, 1.0), late_s=0.3, outward_s2=2.0)
    autopilot.vehicle.loss_pct = 10.0
    lead = autopilot.fly(120.0).tracking.lead
    assert lead.accel_s2 == 1.0 and lead.time_s == pytest.approx(0.3, abs=0.05), "when it comes by is learnt"


def test_who_is_far_away_teaches_nothing() -> None:
    """It is catching up, or something is wrong."""
    flown = Autopilot(circle(), LeadCompensation(0.25, 1.9), late_s=3.0, outward_s2=0.0).fly(60.0)
    assert flown.tracking.lead == LeadCompensation(0.25, 1.9)
    assert flown.tracking.lag_s == pytest.approx(2.75, abs=0.2), "but it is shown"


def test_a_place_to_stand_at_has_no_lag() -> None:
    vehicle, tracking = a_vehicle(1), TrackingMonitor()
    vehicle.telemetry.position_m, vehicle.telemetry.position_s = (1.0, 0.0, 20.0), 5.0
    tracking.update(PositionTarget((0.0, 0.0, 20.0), 5.0), vehicle)
    assert math.isnan(tracking.lag_s)


def test_who_stands_still_although_asked_to_move_is_noticed_after_six_seconds() -> None:
    vehicle, tracking, goal = a_vehicle(1), TrackingMonitor(), PositionTarget((50.0, 0.0, 20.0), 5.0)
    vehicle.telemetry.position_m, vehicle.telemetry.fix = (0.0, 0.0, 20.0), (0, 0, 0, 0, 20_000, 0, 0, 0, 0)
    reported = [now for now in range(20) if tracking.ignores(goal, vehicle, float(now))]
    assert reported and reported[0] == 7
    vehicle.telemetry.fix = (0, 0, 0, 0, 20_000, 300, 0, 0, 0)
    assert not tracking.ignores(goal, vehicle, 20.0)
    vehicle.telemetry.position_m, vehicle.telemetry.fix = (49.0, 0.0, 20.0), (0, 0, 0, 0, 20_000, 0, 0, 0, 0)
    assert not any(tracking.ignores(goal, vehicle, 21.0 + now) for now in range(20)), "it is there"


def test_what_a_wind_takes_teaches_no_lead_that_is_wrong_elsewhere() -> None:
    """Into a strong wind it falls metres behind, for it cannot lean harder; elsewhere it is on its slot."""
    course = circle()
    flown, leads = Autopilot(course, LeadCompensation(0.2, 1.0), late_s=0.2, outward_s2=1.0), []
    for begin_s in range(1, 240, 20):
        for now in np.arange(begin_s, begin_s + 20, 0.1):
            into_wind = now - begin_s < 6
            (x, y, z), _ = LeadCompensatedCourse(course, flown.tracking.lead).at(now - 0.2 - 0.6 * into_wind)
            wider = 1.0 + flown.outward_s2 * TURN_M_S2 / math.hypot(x, y)
            flown.vehicle.telemetry.position_m, flown.vehicle.telemetry.position_s = (
                (x * wider, y * wider, z),
                float(now),
            )
            flown.tracking.update(course, flown.vehicle)
            leads.append(flown.tracking.lead.time_s)
    assert max(leads) - 0.2 < 0.15, "early by no more, where there is no wind"


def test_positions_that_are_older_than_the_newest_plan_are_compared_all_the_same() -> None:
    """Five plans a second and positions that come late or not at all: as flown with a tenth of all datagrams lost."""
    whole, vehicle, tracking = circle(), a_vehicle(1), TrackingMonitor(LeadCompensation(0.0, 0.0))
    for now in np.arange(1.0, 60.0, 0.2):
        ahead = [whole.at(now + 0.25 * i) for i in range(12)]
        plan = Trajectory(float(now), 0.25, np.array([p for p, _ in ahead]), np.array([v for _, v in ahead]))
        vehicle.telemetry.position_m, vehicle.telemetry.position_s = whole.at(now - 0.35)[0], float(now - 0.05)
        tracking.update(plan, vehicle)
    assert tracking.lag_s == pytest.approx(0.3, abs=0.02) and tracking.lead.time_s > 0.3


def flown_at(share: float, until_s: float) -> TrackingMonitor:
    """A circle, led anew from where the vehicle is every second; it makes this share of the speed."""
    vehicle, tracking, angle = a_vehicle(1), TrackingMonitor(), 0.0
    for now in np.arange(1.0, until_s, 0.2):
        angle += share * 0.2 * SPEED_M_S / RADIUS_M
        x, y = RADIUS_M * math.cos(angle), RADIUS_M * math.sin(angle)
        course = circle(60.0)
        begun = Trajectory(float(now) - angle * RADIUS_M / SPEED_M_S, 0.25, course.positions_m, course.velocities_m_s)
        vehicle.telemetry.position_m, vehicle.telemetry.position_s = (x, y, 30.0), float(now)
        vx, vy = (round(100 * share * SPEED_M_S * v) for v in (-math.sin(angle), math.cos(angle)))
        vehicle.telemetry.fix = (int(1000 * now), 520_000_000, 0, 0, 0, vy, vx, 0, 0)
        tracking.update(begun, vehicle)
    return tracking


@pytest.mark.parametrize(("share", "crawls"), [(0.25, True), (0.0, True), (0.6, False), (1.0, False)])
def test_who_makes_too_little_of_its_speed_crawls_however_often_it_is_led_anew(share: float, crawls: bool) -> None:
    """A real ArduCopter with a motor at 75 %: never late, never beside its way, 1 m/s instead of 4."""
    tracking = flown_at(share, 30.0)
    assert tracking.crawls(30.0) is crawls
    assert tracking.made_m_s == pytest.approx(share * tracking.asked_m_s, abs=0.2)
    assert not flown_at(share, 6.0).crawls(6.0), "not at once"


def test_who_waits_at_a_place_does_not_crawl() -> None:
    tracking = flown_at(0.25, 30.0)
    vehicle = a_vehicle(1)
    vehicle.telemetry.position_m, vehicle.telemetry.position_s = (60.0, 0.0, 30.0), 30.2
    tracking.update(PositionTarget((60.0, 0.0, 30.0), 8.0), vehicle)
    assert not tracking.crawls(40.0)
