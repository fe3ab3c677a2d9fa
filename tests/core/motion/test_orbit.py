"""A circle flown again and again: as a course, and by both autopilots."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from tests.core.rigs.rig import Rig
from tui_gcs.core.motion.orbit import Orbit
from tui_gcs.core.protocol.common import FleetFrame, Intent, PlannerTask

CENTRE = (200.0, 200.0, 30.0)


def orbit(clockwise: bool = True, speed_m_s: float = 6.0) -> Orbit:
    return Orbit.about(10.0, (320.0, 200.0, 30.0), CENTRE, 40.0, speed_m_s, 2.5, clockwise=clockwise)


def test_it_goes_to_the_nearest_point_stops_and_turns() -> None:
    course = orbit()
    assert course.at(10.0) == ((320.0, 200.0, 30.0), (0.0, 0.0, 0.0))
    place, velocity = course.at(course.circle_s)
    assert place == pytest.approx((240.0, 200.0, 30.0)) and velocity == pytest.approx((0.0, 0.0, 0.0))
    lap_s = 2 * math.pi * 40.0 / 6.0
    later = course.circle_s + 10.0
    assert math.dist(course.at(later)[0], CENTRE) == pytest.approx(40.0)
    assert course.at(later + lap_s)[0] == pytest.approx(course.at(later)[0])
    assert math.hypot(*course.at(later)[1]) == pytest.approx(6.0)


@pytest.mark.parametrize(("clockwise", "north"), [(True, -1.0), (False, 1.0)])
def test_clockwise_is_as_seen_from_above(clockwise: bool, north: float) -> None:
    course = orbit(clockwise)
    assert course.at(course.circle_s + 2.0)[1][1] * north > 0.0, "from the east side"


@pytest.mark.parametrize("clockwise", [True, False])
def test_velocity_and_acceleration_are_those_of_its_places(clockwise: bool) -> None:
    course = orbit(clockwise)
    for t in np.arange(10.5, course.circle_s + 30.0, 0.7):
        before, after = (np.array(course.at(t + dt)) for dt in (-0.01, 0.01))
        slope = (after - before) / 0.02
        assert slope[0] == pytest.approx(np.array(course.at(t)[1]), abs=0.1)
        assert slope[1] == pytest.approx(np.array(course.acceleration(t)), abs=0.3) or np.abs(slope[1]).max() > 2.0


def test_it_is_no_faster_than_the_acceleration_allows() -> None:
    course = Orbit.about(0.0, CENTRE, CENTRE, 10.0, 8.0, 2.5)
    assert course.speed_m_s == pytest.approx(math.sqrt(0.9 * 2.5 * 10.0))
    assert course.entry_m == (200.0, 210.0, 30.0), "from its centre: to the north"
    speeds = [math.hypot(*course.at(t)[1]) for t in np.arange(0.0, 60.0, 0.2)]
    assert max(speeds) <= course.speed_m_s + 1e-9


@pytest.mark.parametrize(("radius_m", "speed_m_s"), [(0.0, 5.0), (-20.0, 5.0), (20.0, 0.0), (math.nan, 5.0)])
def test_what_is_no_circle_is_refused(radius_m: float, speed_m_s: float) -> None:
    with pytest.raises(ValueError, match="orbit"):
        Orbit.about(0.0, CENTRE, CENTRE, radius_m, speed_m_s, 2.5)


def silent(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
    """A planner without a wish."""
    return []


@pytest.mark.long
def test_both_autopilots_fly_it_and_learn_to_keep_to_it(rig: Callable[..., Rig]) -> None:
    flight = rig(2, wants=silent, autopilots="mixed").flying()
    limits = flight.station.flight.guard.limits
    courses = {}
    for vehicle, x in zip(flight.ids, (150.0, 300.0), strict=True):
        place = flight.station.picture.fleet.vehicles[vehicle].telemetry.position_m
        centre = (x, 200.0, place[2])
        courses[vehicle] = Orbit.about(flight.clock.now(), place, centre, 40.0, 7.0, limits.accel_m_s2)
        flight.station.flight.flights.by_id[vehicle].course = courses[vehicle]
    flight.until(lambda: flight.clock.now() > max(c.circle_s for c in courses.values()) + 40.0, 120.0)
    errors: dict[int, list[float]] = {vehicle: [] for vehicle in flight.ids}
    for _ in range(40):
        flight.run(1.0)
        for vehicle, course in courses.items():
            errors[vehicle].append(math.dist(flight.place(vehicle), course.at(flight.clock.now())[0]))
    assert max(max(e) for e in errors.values()) < 1.0, errors
    assert flight.station.flight.guard.vetoes == {}
