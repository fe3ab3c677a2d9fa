"""What a planner may want of a vehicle, flown by simulated autopilots: velocity, orbit, a slow goto, home."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from tests.core.rigs.rig import Rig
from tui_gcs.core.motion.cruise import Cruise
from tui_gcs.core.protocol.common import Intent, Phase, RunPhase

pytestmark = pytest.mark.long  # nearly each is a flight

MakeRig = Callable[..., Rig]


def velocity(vehicle: int, *velocity_m_s: float, valid_s: float = 1.0) -> Intent:
    return Intent(vehicle, "velocity", velocity_m_s=velocity_m_s, valid_s=valid_s)  # type: ignore[arg-type]


def orbit(vehicle: int, radius_m: float = 30.0, speed_m_s: float | None = 5.0) -> Intent:
    centre = (220.0, 200.0, 27.0)
    return Intent(vehicle, "orbit", position_m=centre, radius_m=radius_m, speed_m_s=speed_m_s)


def keep_saying(flight: Rig, intent: Intent, seconds: float) -> None:
    for _ in range(round(seconds / 0.2)):
        flight.plan(intent)
        flight.run(0.2)


# ---------------------------------------------------------------- velocity


def test_a_velocity_is_flown_as_long_as_it_is_said_and_then_the_vehicle_brakes(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    keep_saying(flight, velocity(1, 6.0, 0.0, 0.0), 10.0)
    assert flight.speed(1) == pytest.approx(6.0, abs=0.3)
    x, y, z = flight.place(1)
    assert x > 45.0 + 30.0 and y == pytest.approx(170.0, abs=0.5) and z == pytest.approx(27.0, abs=1.0)
    keep_saying(flight, velocity(1, 0.0, 6.0, 0.0), 6.0)
    assert flight.place(1)[1] > 190.0, "around the corner"
    assert flight.speed(1) == pytest.approx(6.0, abs=0.5)
    flight.run(1.8)
    assert flight.phase(1) is Phase.FLYING
    flight.run(3.0)
    assert flight.speed(1) < 0.3
    assert flight.station.flight.guard.vetoes == {}


def test_one_velocity_brakes_by_itself_after_its_time(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    flight.plan(velocity(1, 4.0, 0.0, 0.0, valid_s=3.0))
    fastest = 0.0
    for _ in range(14):
        flight.plan()  # it has nothing new to say, and is not silent
        flight.run(0.5)
        fastest = max(fastest, flight.speed(1))
    assert fastest == pytest.approx(4.0, abs=1.0), "it catches up with what it was late at the beginning"
    assert flight.speed(1) < 0.3 and flight.phase(1) is Phase.FLYING
    assert flight.place(1)[0] == pytest.approx(45.0 + 4.0 * 3.0, abs=2.0)


def test_a_velocity_never_leaves_the_area(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    keep_saying(flight, velocity(1, -7.5, 0.0, 0.0), 15.0)
    assert flight.place(1)[0] > 0.0
    assert flight.station.flight.guard.vetoes["area"] > 0
    keep_saying(flight, velocity(1, 6.0, 0.0, 0.0), 8.0)
    assert flight.place(1)[0] > 25.0, "and back"


NOT_TO_BE_FLOWN = [
    velocity(1, math.nan, 0.0, 0.0),
    velocity(1, 9.0, 0.0, 0.0),
    velocity(1, 1.0, 0.0, 0.0, valid_s=0.0),
    velocity(1, 1.0, 0.0, 0.0, valid_s=math.inf),
    Intent(1, "velocity"),
    Intent(1, "goto", position_m=(200.0, 200.0, 27.0), speed_m_s=0.0),
    Intent(1, "goto", position_m=(200.0, 200.0, 27.0), speed_m_s=math.nan),
    Intent(1, "orbit"),
    orbit(1, radius_m=0.0),
    orbit(1, radius_m=math.nan),
    orbit(1, speed_m_s=-2.0),
    orbit(1, speed_m_s=math.nan),
]


def test_what_cannot_be_flown_is_refused_with_a_reason(rig: MakeRig) -> None:
    """One after the other in one flight, each while the vehicle is given to its planner."""
    flight = rig(1, planning=False).flying().run(0.5)
    for number, intent in enumerate(NOT_TO_BE_FLOWN, start=1):
        assert flight.phase(1) is Phase.FLYING, intent
        flight.plan(intent)
        flight.run(1.0)
        assert flight.station.flight.guard.vetoes == {"kind": number}, intent
        assert flight.speed(1) < 0.3, intent
        assert any(intent.kind in text for text in flight.texts("planner defend")), intent


def test_a_cruise_turns_and_brakes_no_harder_than_it_may() -> None:
    course = Cruise(10.0, (0.0, 0.0, 30.0), (0.0, 6.0, 0.0), (6.0, 0.0, 1.0), 14.0, 2.0)
    times = np.arange(9.0, 24.0, 0.02)
    places = np.array([course.at(t)[0] for t in times])
    speeds = np.array([course.at(t)[1] for t in times])
    assert np.allclose(np.diff(places, axis=0) / 0.02, (speeds[1:] + speeds[:-1]) / 2, atol=0.03)
    assert np.linalg.norm(np.diff(speeds, axis=0) / 0.02, axis=1).max() <= 2.0 + 1e-6
    assert np.hypot(*course.acceleration(11.0)[:2]) == pytest.approx(2.0, abs=0.1)
    assert course.at(13.99)[1] == pytest.approx((5.6, 0.4, 0.9), abs=0.1)
    assert course.at(24.0)[1] == (0.0, 0.0, 0.0)


def test_a_cruise_that_is_over_before_it_begins_only_brakes() -> None:
    course = Cruise(10.0, (0.0, 0.0, 30.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0), 9.0, 2.0)
    assert course.at(20.0) == ((4.0, 0.0, 30.0), (0.0, 0.0, 0.0))
    standing = Cruise(10.0, (0.0, 0.0, 30.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 9.0, 2.0)
    assert standing.at(20.0) == ((0.0, 0.0, 30.0), (0.0, 0.0, 0.0))


# ---------------------------------------------------------------- orbit, goto


def test_an_orbit_that_is_said_with_every_plan_is_flown_round_and_round(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    keep_saying(flight, orbit(1), 45.0)
    away, sides = [], set()
    for _ in range(200):
        keep_saying(flight, orbit(1), 0.2)
        x, y, _ = flight.place(1)
        away.append(math.hypot(x - 220.0, y - 200.0))
        sides.add((x > 220.0, y > 200.0))
    assert len(sides) == 4
    assert max(abs(r - 30.0) for r in away) < 2.0
    assert flight.speed(1) == pytest.approx(5.0, abs=0.5)
    assert flight.station.flight.guard.vetoes == {}


def test_an_orbit_begun_at_full_speed_is_not_a_jump(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()
    keep_saying(flight, velocity(1, 7.5, 1.0, 0.0), 12.0)
    keep_saying(flight, orbit(1), 1.0)
    errors = []
    for _ in range(100):
        keep_saying(flight, orbit(1), 0.2)
        vehicle = flight.station.picture.fleet.vehicles[1]
        errors.append(flight.station.flight.steering.slot_error_m(flight.station.flight.flights.by_id[1], vehicle))
    assert max(errors[25:]) < 4.0
    assert flight.station.flight.guard.vetoes == {}


def test_goto_keeps_to_its_speed_also_when_it_changes(rig: MakeRig) -> None:
    flight = rig(1, planning=False).flying()

    def fastest(speed_m_s: float | None, seconds: float) -> float:
        speeds = []
        for _ in range(round(seconds / 0.2)):
            flight.plan(Intent(1, "goto", position_m=(500.0, 170.0, 27.0), speed_m_s=speed_m_s))
            flight.run(0.2)
            speeds.append(flight.speed(1))
        return max(speeds[-10:])

    assert fastest(3.0, 8.0) == pytest.approx(3.0, abs=0.3)
    assert fastest(None, 8.0) == pytest.approx(8.0, abs=0.3)
    assert fastest(4.0, 8.0) == pytest.approx(4.0, abs=0.3)
    assert fastest(50.0, 8.0) == pytest.approx(8.0, abs=0.3), "no faster than the limit"


# ---------------------------------------------------------------- return


def test_a_planner_sends_one_vehicle_home_and_the_others_fly_on(rig: MakeRig) -> None:
    flight = rig(2, planning=False).flying()
    stay = Intent(2, "goto", position_m=(120.0, 200.0, 34.0))
    flight.plan(Intent(1, "return", reason="battery \x1b[31mlow"), stay)
    assert flight.phase(1) is Phase.RETURNING
    for _ in range(600):
        flight.plan(Intent(1, "return"), Intent(1, "goto", position_m=(200.0, 200.0, 27.0)), stay)
        flight.run(0.2)
        if flight.phase(1) is Phase.GROUND:
            break
    assert flight.phase(1) is Phase.GROUND
    assert math.dist(flight.place(1)[:2], (45.0, 170.0)) < 2.0
    assert flight.phase(2) is Phase.FLYING and flight.station.flight.executive.run is RunPhase.RUNNING
    reported = [text for text in flight.texts("planner defend") if "home" in text]
    assert reported == ["sends vehicle 1 home (battery ␛[31mlow)"]
    for _ in range(20):
        flight.plan(Intent(1, "goto", position_m=(200.0, 200.0, 27.0)), stay)
        flight.run(0.2)
    assert flight.phase(1) is Phase.GROUND, "nor does it start it again"


def test_a_planner_sends_home_only_what_flies_for_it(rig: MakeRig) -> None:
    flight = rig(8, planning=False).flying()
    flight.station.flight.executive.hold((2,))
    flight.plan(Intent(2, "return"), Intent(5, "return"), Intent(77, "return"))
    flight.run(0.5)
    assert flight.phase(2) is Phase.HOLDING, "the operator holds it"
    assert flight.phase(5) is Phase.FLYING, "another team's"
    assert flight.station.flight.guard.vetoes == {"unknown vehicle": 2}
    flight.station.picture.fleet.vehicles[1].identity.blocked = "two vehicles with one id"
    assert flight.station.flight.executive.send_home(2, "planner defend") == "is not flying for its planner"
