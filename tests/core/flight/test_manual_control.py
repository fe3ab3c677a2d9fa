"""Vehicles that an operator flies by hand, beside their planner."""

import math
from collections.abc import Callable

import pytest

from tests.core.rigs.rig import Rig
from tests.core.rigs.service_asking import ended
from tui_gcs.core.motion.course import STILL
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol import flight as f
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol.bus import REQUEST
from tui_gcs.core.protocol.common import Phase, RunPhase
from tui_gcs.core.services.plans.plan_table import MissionState

pytestmark = pytest.mark.long  # nearly each is a flight

MakeRig = Callable[..., Rig]
NAN = math.nan
LOITER = 5
"""Of ArduCopter: its own pilot flies it."""


def ask(rig: Rig, request: m.Request) -> s.ServiceReply:
    return m.decode(rig.bus.ask(REQUEST.format(principal="console-1"), m.encode(request)), s.ServiceReply)


def why_not(rig: Rig, request: m.Request) -> str:
    """Why nothing is done for the one vehicle that is named."""
    reply = ask(rig, request)
    assert not reply.ok and not reply.tasks
    return reply.results[0].text if reply.results else reply.text


def near(rig: Rig, vehicle: int, place: tuple[float, float, float]) -> bool:
    return math.dist(rig.place(vehicle), place) < 1.5 and rig.speed(vehicle) < 0.5


def done(rig: Rig, request: m.Request) -> str:
    """What is said of the success of a request for one vehicle."""
    task, _ = ended(rig, request)  # type: ignore[arg-type]
    assert task.state == "done", task.text
    return task.text


def test_take_off_go_to_a_place_circle_land(rig: MakeRig) -> None:
    """From the ground and back, without any planner; a hold is a hold, and resume is offered."""
    flight = rig(2).ready()
    flight.until(lambda: not flight.station.frontend.readiness.why_not_start(1), 60.0)
    x, y, _ = flight.place(1)
    assert why_not(flight, f.GoTo((1,), ((x, y, 20.0),))) == "is not in the air: take off first"
    assert "are allowed" in why_not(flight, f.TakeOff((1,), 500.0))
    assert done(flight, f.TakeOff((1,), 28.0)) == "climbs to 28 m"
    flight.until(lambda: flight.phase(1) is Phase.BY_HAND, 40.0)
    flight.until(lambda: near(flight, 1, (x, y, 28.0)), 10.0)
    assert flight.station.flight.executive.run is RunPhase.HOLD, "no start brought it there: resume or return"
    assert flight.phase(2) is Phase.GROUND

    assert done(flight, f.GoTo((1,), ((x + 60.0, y + 20.0, NAN),), speed_m_s=4.0)) == "on its way"
    flight.run(8.0)
    assert flight.speed(1) == pytest.approx(4.0, abs=0.6)
    flight.until(lambda: near(flight, 1, (x + 60.0, y + 20.0, 28.0)), 40.0)

    done(flight, f.CircleFlight((1,), (x + 60.0, y + 20.0, NAN), radius_m=15.0, speed_m_s=5.0))
    flight.run(20.0)
    away_m = math.dist(flight.place(1)[:2], (x + 60.0, y + 20.0))
    assert away_m == pytest.approx(15.0, abs=1.5) and flight.speed(1) > 4.0

    assert ask(flight, m.Hold(vehicles=(1,))).ok
    flight.until(lambda: flight.speed(1) < 0.3, 10.0)
    assert flight.phase(1) is Phase.HOLDING
    assert ask(flight, f.Land(vehicles=(1,))).ok
    flight.until(lambda: flight.phase(1) is Phase.GROUND, 60.0)
    assert "landed and disarmed" in flight.texts("vehicle 1")


def test_one_is_taken_out_of_the_planners_hands_and_given_back(rig: MakeRig) -> None:
    flight = rig(3).flying()
    x, y, z = 240.0, 200.0, flight.station.flight.flights.by_id[2].layer_m  # where `stay` wants it
    flight.until(lambda: near(flight, 2, (x, y, z)), 60.0)
    done(flight, f.GoTo((2,), ((x, y + 40.0, NAN),)))
    flight.until(lambda: near(flight, 2, (x, y + 40.0, z)), 30.0)
    assert [flight.phase(v) for v in flight.ids] == [Phase.FLYING, Phase.BY_HAND, Phase.FLYING]
    assert why_not(flight, m.Resume(vehicles=(1,))) == "neither holds nor is flown by hand"
    assert ask(flight, m.Resume(vehicles=(2,))).ok
    flight.until(lambda: flight.phase(2) is Phase.FLYING, 20.0)
    flight.until(lambda: near(flight, 2, (x, y, z)), 30.0)


def test_who_is_nudged_stands_a_second_after_the_last_key(rig: MakeRig) -> None:
    flight = rig(2).flying().run(15.0)
    before = flight.place(1)
    assert ask(flight, f.Nudge((1,), STILL)).ok
    for _ in range(10):
        assert ask(flight, f.Nudge((1,), (0.0, 100.0, 0.0))).ok
        flight.run(0.2)
    limit = flight.station.active.scenario.limits.speed_m_s
    assert 2.0 < flight.speed(1) < limit + 0.5, "faster than the limit is cut to it"
    flight.run(1.0 + limit / flight.station.active.scenario.limits.accel_m_s2 + 2.0)
    assert flight.speed(1) < 0.5
    assert flight.place(1)[1] > before[1] + 5.0
    assert flight.phase(1) is Phase.BY_HAND


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_arrows_turn_who_is_nudged_also_while_it_still_brakes(rig: MakeRig, autopilots: str) -> None:
    flight = rig(2, autopilots=autopilots).flying().run(15.0)
    x, y, _ = flight.place(1)
    done(flight, f.GoTo((1,), ((x + 60.0, y, NAN),)))
    flight.until(lambda: flight.speed(1) > 5.0, 10.0)
    assert ask(flight, f.Nudge((1,), STILL)).ok
    flight.run(0.3)
    assert flight.speed(1) > 3.0, "it still brakes"
    before = flight.place(1)
    for press in range(25):
        assert ask(flight, f.Nudge((1,), (0.0, 2.0, 0.0))).ok
        flight.run(0.2)
        if press == 10:
            assert flight.speed(1) > 2.5 and flight.place(1)[1] > before[1] + 0.5, "it turns while it brakes"
    assert flight.speed(1) == pytest.approx(2.0, abs=0.5)


@pytest.mark.parametrize("stop", [m.Hold(vehicles=(1,)), m.Hold(), m.Return(vehicles=(1,)), f.Land(vehicles=(1,))])
def test_an_arrow_that_is_still_held_down_undoes_no_stop(rig: MakeRig, stop: m.Request) -> None:
    """The stop may be another console's; only who begins anew, and is asked, takes the vehicle out of it."""
    flight = rig(2).flying().run(15.0)
    north = f.Nudge((1,), (0.0, 2.0, 0.0))
    assert "begin the nudge anew" in why_not(flight, north), "an arrow alone takes nobody from its planner either"
    assert ask(flight, f.Nudge((1,), STILL)).ok
    assert ask(flight, north).ok
    flight.run(0.5)
    assert ask(flight, stop).ok
    assert "begin the nudge anew" in why_not(flight, north)
    flight.run(1.0)
    assert flight.phase(1) in (Phase.HOLDING, Phase.RETURNING, Phase.LANDING)
    assert ask(flight, f.Nudge((1,), STILL)).ok
    assert ask(flight, north).ok


def test_an_arrow_takes_nobody_out_of_a_pilots_hands(rig: MakeRig) -> None:
    flight = rig(2).flying().run(15.0)
    assert ask(flight, f.Nudge((1,), STILL)).ok
    flight.run(0.5)
    flight.pilot(1, LOITER)
    flight.until(lambda: flight.phase(1) is Phase.TAKEN_OUT, 5.0)
    assert "begin the nudge anew" in why_not(flight, f.Nudge((1,), (0.0, 2.0, 0.0)))


def test_the_guard_judges_what_is_asked_by_hand(rig: MakeRig) -> None:
    """Out of the area it brakes and holds; the reason is told. Into another vehicle, too."""
    flight = rig(2).flying().run(15.0)
    done(flight, f.GoTo((1,), ((-500.0, 200.0, 30.0),)))
    flight.run(5.0)
    assert flight.speed(1) < 0.5
    assert any("guard veto, holding" in text and "outside the operating area" in text for text in flight.texts())
    x, y, z = flight.place(2)
    done(flight, f.GoTo((1,), ((x, y, z),)))
    flight.run(25.0)
    assert math.dist(flight.place(1)[:2], flight.place(2)[:2]) > 5.0


def test_who_is_stopped_on_an_orbit_goes_on_when_the_way_is_free(rig: MakeRig) -> None:
    """The circle waits for the vehicle instead of going round without it; why it stands is told now and then."""
    flight = rig(2).flying().run(15.0)
    x, y, z = flight.place(1)
    done(flight, f.GoTo((2,), ((x + 20.0, y + 20.0, z),)))
    flight.until(lambda: near(flight, 2, (x + 20.0, y + 20.0, z)), 40.0)
    done(flight, f.CircleFlight((1,), (x + 20.0, y, NAN), radius_m=20.0, speed_m_s=5.0))
    flight.run(40.0)
    vetoes = [text for text in flight.texts("vehicle 1") if "guard veto, holding: too close" in text]
    assert 1 <= len(vetoes) <= 10, "its numbers change with every look; it is the same story"
    assert flight.speed(1) < 0.5
    done(flight, f.GoTo((2,), ((x + 100.0, y + 20.0, z),)))
    flight.until(lambda: flight.place(2)[0] > x + 90.0, 40.0)
    flight.run(15.0)
    assert flight.speed(1) > 4.0
    assert math.dist(flight.place(1)[:2], (x + 20.0, y)) == pytest.approx(20.0, abs=1.5)


def test_what_is_asked_is_told_in_words_with_whom(rig: MakeRig) -> None:
    flight = rig(3).flying().run(15.0)
    done(flight, f.GoTo((1,), ((50.0, 0.0, NAN),), from_home=True))
    assert "go to (50, 0) from its home: vehicle 1" in flight.texts()
    done(flight, f.GoTo((2,), ((NAN, NAN, 37.0),)))
    assert "go to 37 m above home: vehicle 2" in flight.texts()
    assert ask(flight, f.Land(vehicles=(3,))).text == "land: vehicle 3"
    assert ask(flight, m.Hold(vehicles=(1, 2, 9))).text == "hold: 2 of 3: vehicles 1-2"
    assert ask(flight, m.Resume(vehicles=(1, 2))).text == "resume: vehicles 1-2"


def test_motors_are_stopped_one_at_a_time_and_with_a_reason(rig: MakeRig) -> None:
    flight = rig(2).flying().run(5.0)
    assert "in the air" in why_not(flight, f.Disarm((1,)))
    assert why_not(flight, f.KillMotors((1, 2), "fire")) == "the motors of one vehicle at a time"
    assert why_not(flight, f.KillMotors((1,), "  ")) == "say why"
    assert done(flight, f.KillMotors((1,), "burns")) == "motors stopped"
    assert flight.phase(2) is Phase.FLYING


def test_arming_alone_and_disarming(rig: MakeRig) -> None:
    flight = rig(2).ready()
    flight.until(lambda: not flight.station.frontend.readiness.why_not_start(1), 60.0)
    assert done(flight, f.Arm((1,))) == "armed"
    assert done(flight, f.Disarm((1,))) == "disarmed"
    assert why_not(flight, f.Disarm((1,))) == "it is not armed"


def test_who_took_off_by_hand_and_was_lost_flies_for_nobody_when_it_is_back(rig: MakeRig) -> None:
    flight = rig(2).ready()
    flight.until(lambda: not any(map(flight.station.frontend.readiness.why_not_start, flight.ids)), 60.0)
    assert ask(flight, m.Start((1,))).ok
    done(flight, f.TakeOff((2,), flight.station.flight.flights.by_id[2].layer_m))
    flight.until(lambda: (flight.phase(1), flight.phase(2)) == (Phase.FLYING, Phase.BY_HAND), 60.0)
    flight.sim.silence(1)
    flight.until(lambda: flight.phase(2) is Phase.TAKEN_OUT, 10.0)
    flight.sim.unsilence(1)
    flight.until(lambda: flight.phase(2) is not Phase.TAKEN_OUT, 10.0)
    assert flight.phase(2) is Phase.HOLDING


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_one_follows_another_at_its_distance_and_height_until_that_one_is_lost(rig: MakeRig, autopilots: str) -> None:
    flight = rig(2, autopilots=autopilots).flying().run(15.0)
    assert why_not(flight, f.Follow((1,), 1)) == "it would follow itself"
    assert why_not(flight, f.Follow((1,), 9)) == "vehicle 9 was never heard"
    assert "too near" in why_not(flight, f.Follow((1,), 2, (3.0, 0.0, NAN)))
    height = flight.place(1)[2]
    assert done(flight, f.Follow((1,), 2, (0.0, -30.0, NAN))) == "follows vehicle 2"
    assert why_not(flight, f.Follow((2,), 1)) == "it would follow itself"
    done(flight, f.GoTo((2,), ((350.0, 260.0, NAN),), speed_m_s=5.0))
    flight.run(12.0)
    (x, y, z), (to_x, to_y, _) = flight.place(1), flight.place(2)
    assert flight.speed(1) == pytest.approx(flight.speed(2), abs=0.5) and flight.speed(2) > 4.5
    assert (x - to_x, y - to_y, z) == pytest.approx((0.0, -30.0, height), abs=3.0)
    flight.run(20.0)
    (x, y, z), (to_x, to_y, _) = flight.place(1), flight.place(2)
    assert (x - to_x, y - to_y, z) == pytest.approx((0.0, -30.0, height), abs=1.0)
    assert flight.station.flight.guard.vetoes == {}
    flight.sim.silence(1)
    flight.run(8.0)
    assert flight.speed(1) < 0.3
    assert any("follows vehicle 2 no longer and stands" in text for text in flight.texts("vehicle 1"))


def test_any_other_order_ends_following(rig: MakeRig) -> None:
    flight = rig(2).flying().run(15.0)
    done(flight, f.Follow((1,), 2, (0.0, -20.0, NAN)))
    flight.run(1.0)
    assert ask(flight, m.Hold(vehicles=(1,))).ok
    flight.run(1.0)
    done(flight, f.GoTo((2,), ((260.0, 240.0, NAN),)))
    flight.run(10.0)
    assert flight.phase(1) is Phase.HOLDING and flight.speed(1) < 0.3
    assert not any("no longer" in text for text in flight.texts("vehicle 1"))


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_who_holds_no_mission_goes_on_with_what_it_does(rig: MakeRig, autopilots: str) -> None:
    flight = rig(2, autopilots=autopilots).flying().run(15.0)
    for act in ("start", "continue"):
        assert why_not(flight, f.OnBoardMission((1,), act)) == "holds no mission: upload one first"
        flight.run(5.0)
        assert flight.phase(1) is Phase.FLYING


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
@pytest.mark.parametrize("act", ["start", "continue"])
def test_who_refuses_its_mission_is_held_and_never_left_to_its_failsafe(
    rig: MakeRig, autopilots: str, act: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A PX4 in OFFBOARD that was told nothing more flew home across the layers of others; an ArduPilot flew on."""
    flight = rig(2, autopilots=autopilots).flying().run(15.0)
    monkeypatch.setattr(flight.station.services.missions, "state", lambda vehicle: MissionState())
    modes = set()
    task = ask(flight, f.OnBoardMission((1,), act)).tasks[0].number

    def is_over() -> bool:
        modes.add(flight.station.publisher.frame().mode[0])
        (info,) = ask(flight, s.GetTasks((task,))).tasks
        return info.state == "failed" and info.text.startswith("it is held: refused")

    flight.until(is_over, 10.0)
    flight.until(lambda: flight.phase(1) is Phase.HOLDING and flight.speed(1) < 0.3, 15.0)
    modes.add(flight.station.publisher.frame().mode[0])
    assert not modes & {"RTL", "LAND", "AUTO", "MISSION"}
    assert flight.phase(2) is Phase.FLYING
    assert ask(flight, m.Resume((1,))).ok, "its planner may have it back"


@pytest.mark.parametrize("autopilots", ["ardupilot", "px4"])
def test_a_mission_is_begun_paused_and_continued_out_of_a_planners_hands(rig: MakeRig, autopilots: str) -> None:
    """A PX4 changes from OFFBOARD without its failsafe; of two the second is not concerned."""
    flight = rig(2, autopilots=autopilots).flying().run(15.0)
    x, y, z = flight.place(1)
    places = [flight.station.picture.fleet.frame.to_geodetic(x + 10.0 * way, y) for way in (1, 2, 3, 4)]
    rows = tuple(s.PlanRow(16, 3, (0, 0, 0, 0), round(lat * 1e7), round(lon * 1e7), z) for lat, lon in places)
    info, _ = ended(flight, s.UploadPlan((1,), "mission", rows))  # type: ignore[arg-type]
    assert info.state == "done", info.text
    modes: set[str] = set()

    def watched(seconds: float) -> str:
        for _ in range(int(seconds * 10)):
            flight.run(0.1)
            modes.add(flight.station.publisher.frame().mode[0])
        return flight.station.publisher.frame().mode[0]

    begun = ask(flight, f.OnBoardMission((1,), "start"))
    assert begun.ok and watched(3.0) in ("AUTO", "MISSION")
    assert flight.phase(1) is Phase.TAKEN_OUT
    assert ask(flight, m.Hold(vehicles=(1,))).ok
    flight.until(lambda: flight.phase(1) is Phase.HOLDING and flight.speed(1) < 0.3, 15.0)
    assert ask(flight, f.OnBoardMission((1,), "continue")).ok and watched(3.0) in ("AUTO", "MISSION")
    assert flight.speed(1) > 1.0
    assert not modes & {"RTL", "LAND"}
    assert flight.phase(2) is Phase.FLYING
