"""From the ground to the planner and back, with simulated ArduCopters on a virtual clock."""

import itertools
import math
from collections.abc import Callable

import pytest

from sitl.common.missions import Item
from tests.core.rigs.rig import SETPOINT, Rig, scenario
from tui_gcs.core.fleet.fleet import SILENCE_CHECK_S
from tui_gcs.core.flight.flights import TakenOut
from tui_gcs.core.guard.permission import PASS
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Freshness, Intent, Phase, RunPhase
from tui_gcs.rehearsal.lock_step import TICK_S

MakeRig = Callable[..., Rig]
AUTO, GUIDED, LOITER, RTL, LAND, BRAKE = 3, 4, 5, 6, 9, 17
NAV_LAND = 21


def results(reply: m.Reply) -> dict[int, str]:
    """Why not, per refused vehicle."""
    return {r.vehicle: r.text for r in reply.results if not r.ok}


# ---------------------------------------------------------------- start


@pytest.mark.long
def test_nobody_moves_sideways_before_all_are_at_their_layer(rig: MakeRig) -> None:
    flight = rig(4).ready()
    homes = {v: flight.place(v) for v in flight.ids}
    assert flight.ask(m.Start(vehicles=flight.ids)).ok
    while flight.station.flight.executive.run is not RunPhase.RUNNING:
        flight.step()
        for v in flight.ids:
            assert math.dist(flight.place(v)[:2], homes[v][:2]) < 1.0
        assert flight.clock.now() < 90.0
    layers = {v: flight.station.flight.flights.by_id[v].layer_m for v in flight.ids}
    assert len(set(layers.values())) == 4
    for v in flight.ids:
        assert flight.place(v)[2] == pytest.approx(layers[v], abs=1.5)
    flight.run(10.0)
    assert all(math.dist(flight.place(v)[:2], homes[v][:2]) > 20.0 for v in flight.ids), "now the planner flies them"


def test_one_that_cannot_arm_says_why_and_the_others_go(rig: MakeRig) -> None:
    flight = rig(3).ready()
    flight.sim._pilots[1].platform.params.set("ANGLE_MAX", 1.0)
    flight.run(1.0)
    assert flight.ask(m.Start(vehicles=flight.ids)).ok
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.RUNNING, 120.0)
    assert flight.phase(2) is Phase.GROUND
    assert not flight.sim.armed[1]
    assert any("not started" in t and "ANGLE_MAX" in t for t in flight.texts("vehicle 2")), flight.texts("vehicle 2")
    assert flight.phase(1) is flight.phase(3) is Phase.FLYING


def test_start_refuses_unknown_and_twice_named_vehicles(rig: MakeRig) -> None:
    flight = rig(2).ready()
    reply = flight.ask(m.Start(vehicles=(1, 99)))
    assert not reply.ok
    assert results(reply) == {99: "never heard"}
    assert not flight.ask(m.Start(vehicles=(1, 1))).ok
    assert not flight.ask(m.Start(vehicles=())).ok
    assert flight.phases() == {Phase.GROUND}


def test_start_refuses_the_lost_and_the_armed(rig: MakeRig) -> None:
    flight = rig(3).ready()
    flight.sim.silence(0)
    flight.sim._pilots[1].arming.arm()
    flight.run(4.0)
    reply = flight.ask(m.Start(vehicles=flight.ids))
    assert results(reply) == {1: "lost: last heard 4 s ago", 2: "already armed"}


def test_start_refuses_without_position_and_outside_the_area(rig: MakeRig) -> None:
    flight = rig(2).run(1.5)
    assert "stale" in results(flight.ask(m.Start(vehicles=(1,))))[1]
    flight.ready()
    flight.station.picture.fleet.vehicles[1].telemetry.gps_fix = 2
    assert results(flight.ask(m.Start(vehicles=(1,)))) == {1: "no 3-D position fix (fix type 2)"}
    flight.station.picture.fleet.vehicles[1].telemetry.gps_fix = 3
    flight.station.picture.fleet.vehicles[2].telemetry.position_m = (-50.0, 100.0, 0.0)
    assert results(flight.ask(m.Start(vehicles=(1, 2)))) == {2: "50 m outside the operating area of round 1"}


def test_start_refuses_other_autopilots(rig: MakeRig) -> None:
    """A Paparazzi with the id of a team's vehicle: shown, named, not flown."""
    flight = rig(3)
    flight.sim.silence(2)
    for k in range(10):
        flight.say("HEARTBEAT", 3, type=2, autopilot=9, base_mode=81, custom_mode=0, system_status=3, mavlink_version=3)
        flight.say("GLOBAL_POSITION_INT", 3, **position(flight, 45.0, 210.0, boot_ms=60_000 + 700 * k))
        flight.run(0.7)
    why = "only ArduCopter and PX4 multicopters can be flown so far"
    assert results(flight.ask(m.Start(vehicles=(1, 2, 3)))) == {3: why}
    assert flight.frame is not None and flight.frame.autopilot == ("ArduCopter", "ArduCopter", "Paparazzi")


def position(flight: Rig, x: float, y: float, z: float = 0.0, boot_ms: int = 60_000) -> dict[str, int]:
    """Fields of GLOBAL_POSITION_INT at an ENU place."""
    lat, lon = flight.station.picture.fleet.frame.to_geodetic(x, y)
    still = {"vx": 0, "vy": 0, "vz": 0, "hdg": 0}
    alt = round(z * 1e3)
    return {
        "time_boot_ms": boot_ms,
        "lat": round(lat * 1e7),
        "lon": round(lon * 1e7),
        "relative_alt": alt,
        "alt": alt,
    } | still


def test_in_sim_only_our_own_simulated_vehicles_start(rig: MakeRig) -> None:
    """Without this run's token it is somebody else's, perhaps a real one: nothing but questions is sent to it."""
    flight = rig(2)
    flight.station.comms.uplink._token = "0123456789abcdef"
    flight.ready()
    assert set(results(flight.ask(m.Start(vehicles=(1, 2)))).values()) == {
        "not one of our simulated vehicles: this station is SIM"
    }
    flight.station.comms.command_encoder.position(1, PASS, (50.0, 200.0, 30.0))
    flight.run(1.0)
    questions = {("COMMAND_LONG", 511), ("COMMAND_LONG", 512), ("TIMESYNC", None)}
    assert {(name, f.get("command")) for _, _, name, f in flight.sent} == questions
    assert flight.station.comms.uplink.refused["not one of our simulated vehicles"] == 1


def test_start_refuses_vehicles_that_stand_too_close(rig: MakeRig) -> None:
    flight = rig(2).ready()
    x, y, z = flight.station.picture.fleet.vehicles[1].telemetry.position_m
    flight.station.picture.fleet.vehicles[2].telemetry.position_m = (x + 4.0, y, z)
    assert results(flight.ask(m.Start(vehicles=(1, 2)))) == {
        1: "stands closer than 10 m to vehicle 2",
        2: "stands closer than 10 m to vehicle 1",
    }


def test_a_start_lost_on_the_way_is_never_carried_out_later(rig: MakeRig) -> None:
    flight = rig(1).ready()
    flight.loses = lambda way, index: way == "down"
    assert flight.ask(m.Start(vehicles=(1,))).ok
    flight.run(30.0)
    assert flight.phase(1) is Phase.GROUND
    flight.loses = lambda way, index: False
    flight.run(60.0)
    assert not flight.sim.armed[0]
    assert flight.place(1)[2] < 0.1


@pytest.mark.long
def test_with_a_bad_link_everything_still_works(rig: MakeRig) -> None:
    """20 % loss each way: up, round, home."""
    import random

    chance = random.Random(3)
    flight = rig(3, loses=lambda way, index: chance.random() < 0.2).flying()
    flight.run(5.0)
    assert flight.ask(m.Return()).ok
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.IDLE, 200.0)
    assert not flight.sim.armed.any()
    starts = ("arm", "take-off")  # three copies in 2 s and never later: one in sixty is lost, told, and begun anew
    unanswered = [what for what in flight.station.comms.commands.unanswered if not what.endswith(starts)]
    assert unanswered == [], "everything else is repeated until telemetry confirms it"


# ---------------------------------------------------------------- hold


def begin(flight: Rig, phase: Phase) -> None:
    """Bring vehicle 1 into `phase`."""
    if phase in (Phase.ARMING, Phase.TAKEOFF):
        flight.ready()
        assert flight.ask(m.Start(vehicles=flight.ids)).ok
        flight.until(lambda: flight.phase(1) is phase, 60.0)
        flight.run(0.0 if phase is Phase.ARMING else 4.0)
        return
    flight.flying().run(8.0)
    if phase is not Phase.FLYING:
        assert flight.ask(m.Return()).ok
        flight.until(lambda: flight.phase(1) is phase, 120.0)
        flight.run(4.0)


@pytest.mark.long
@pytest.mark.parametrize("phase", [Phase.ARMING, Phase.TAKEOFF, Phase.FLYING, Phase.RETURNING, Phase.LANDING])
def test_hold_at_once_stops_motion_in_every_phase(rig: MakeRig, phase: Phase) -> None:
    flight = rig(2)
    begin(flight, phase)
    vetoes, sent = flight.station.flight.guard.vetoes.copy(), len(flight.sent)
    reply = flight.ask(m.Hold())
    assert reply.ok and results(reply) == {}
    flight.tick()
    assert {v for _, v, _, _ in flight.sent[sent:]} >= {1}, "said at once, not at the next step"
    flight.run(6.0)
    places = {v: flight.place(v) for v in flight.ids}
    assert all(flight.speed(v) < 0.3 for v in flight.ids)
    flight.run(5.0)
    assert all(math.dist(places[v], flight.place(v)) < 0.5 for v in flight.ids), "and stays"
    assert flight.station.flight.guard.vetoes == vetoes
    if phase is Phase.ARMING:
        assert flight.station.flight.executive.run is RunPhase.IDLE
        assert not flight.sim.armed.any()
    else:
        assert flight.phase(1) is Phase.HOLDING
        assert flight.station.flight.executive.run is RunPhase.HOLD


def test_a_hold_needs_no_more_than_the_stopping_distance(rig: MakeRig) -> None:
    flight = rig(1).flying()
    flight.until(lambda: flight.speed(1) > 7.0, 20.0)
    before = flight.place(1)
    assert flight.ask(m.Hold()).ok
    flight.run(8.0)
    assert math.dist(before, flight.place(1)) < 8.0**2 / (2 * 2.5) + 4.0


@pytest.mark.long
def test_resume_gives_the_fleet_back_to_the_planner(rig: MakeRig) -> None:
    flight = rig(2).flying().run(3.0)
    flight.ask(m.Hold())
    flight.run(10.0)
    assert not flight.sent_to(1, since_s=flight.clock.now() - 2.0), "a confirmed hold is not repeated"
    reply = flight.ask(m.Resume())
    assert reply.ok and [r.vehicle for r in reply.results] == [1, 2]
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.RUNNING, 30.0)
    flight.run(40.0)
    assert flight.place(1)[:2] == pytest.approx((220.0, 200.0), abs=1.0)


def test_resume_with_nobody_holding_is_refused(rig: MakeRig) -> None:
    assert rig(1).ready().ask(m.Resume()).text == "no vehicle is holding"


def test_hold_one_and_the_others_go_on(rig: MakeRig) -> None:
    flight = rig(3).flying().run(2.0)
    assert flight.ask(m.Hold(vehicles=(2,))).ok
    flight.run(6.0)
    assert [flight.phase(v) for v in flight.ids] == [Phase.FLYING, Phase.HOLDING, Phase.FLYING]
    assert flight.station.flight.executive.run is RunPhase.RUNNING


@pytest.mark.parametrize("request_", [m.Hold(), m.Return()])
def test_nobody_in_the_air_is_told_so(rig: MakeRig, request_: m.AnyRequest) -> None:
    reply = rig(1).ready().ask(request_)
    assert not reply.ok and reply.text == "no vehicle is in the air"


def test_a_hold_lost_on_the_way_is_repeated(rig: MakeRig) -> None:
    """The link down is dead for 3 s when the hold is asked."""
    flight = rig(1).flying().run(4.0)
    flight.loses = lambda way, index: way == "down"
    flight.ask(m.Hold())
    flight.run(3.0)
    flight.loses = lambda way, index: False
    flight.run(15.0)
    assert flight.speed(1) < 0.3
    assert len(flight.sent_to(1, since_s=flight.clock.now() - 18.0)) >= 8
    assert not flight.station.comms.commands.pending(1, "hold")


def test_a_hold_to_a_vehicle_that_stands_just_now_gets_through_too(rig: MakeRig) -> None:
    """On its layer, just sent off by its planner: its telemetry looks like a hold before the hold has arrived."""
    flight = rig(1, planning=False).flying().run(5.0)
    flight.plan(Intent(1, "goto", position_m=(250.0, 200.0, 27.0)))
    flight.run(0.1)
    assert flight.speed(1) < 0.5
    flight.loses = lambda way, index: way == "down"
    flight.ask(m.Hold())
    flight.run(0.3)
    flight.loses = lambda way, index: False
    flight.run(10.0)
    assert flight.speed(1) < 0.3
    assert math.dist(flight.place(1)[:2], (45.0, 170.0)) < 3.0


# ---------------------------------------------------------------- return, land


@pytest.mark.long
def test_return_is_staggered_and_ends_where_it_began(rig: MakeRig) -> None:
    flight = rig(4).ready()
    homes = {v: flight.place(v) for v in flight.ids}
    flight.flying().run(15.0)
    vetoes = flight.station.flight.guard.vetoes.total()
    assert flight.ask(m.Return()).ok
    landing: dict[int, float] = {}
    while flight.station.flight.executive.run is not RunPhase.IDLE:
        flight.step()
        for v in flight.ids:
            above_home = math.dist(flight.place(v)[:2], homes[v][:2]) < 2.0
            assert above_home or flight.place(v)[2] > 20.0, "nobody descends on the way"
            if flight.phase(v) is Phase.LANDING:
                landing.setdefault(v, flight.clock.now())
        assert flight.clock.now() < 300.0
    starts = sorted(landing.values())
    assert list(landing) == [1, 2, 3, 4], "lowest layer first"
    assert all(b - a >= 2.0 - TICK_S for a, b in itertools.pairwise(starts))
    assert not flight.sim.armed.any()
    assert all(math.dist(flight.place(v)[:2], homes[v][:2]) <= 1.0 for v in flight.ids)
    assert flight.station.flight.guard.vetoes.total() == vetoes
    assert "all landed and disarmed" in flight.texts("station")


@pytest.mark.long
def test_hold_return_and_land_are_never_vetoed(rig: MakeRig) -> None:
    """With an area of a garden elsewhere every set-point is forbidden; what brings vehicles down is not."""
    from tui_gcs.core.geometry.zones import Rectangle
    from tui_gcs.core.scenario.model import OperatingArea

    flight = rig(2).flying().run(5.0)
    garden = OperatingArea(Rectangle(centre_m=(900.0, 900.0), width_m=20.0, height_m=20.0), 20.0, 25.0)
    flight.station.flight.guard.set_round(flight.scenario.limits, garden, ())
    flight.planning = False
    assert flight.ask(m.Hold()).ok
    flight.run(6.0)
    assert all(flight.speed(v) < 0.3 for v in flight.ids)
    assert flight.ask(m.Return()).ok
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.IDLE, 150.0)
    assert math.dist(flight.place(1)[:2], (45.0, 170.0)) < 1.0


def test_return_cancels_what_is_only_starting(rig: MakeRig) -> None:
    """Vehicle 1 is up, vehicle 2 still waits for its checks: it must not take off after the fleet was called home."""
    flight = rig(2).ready()
    flight.sim._pilots[1].platform.params.set("ANGLE_MAX", 1.0)
    flight.run(1.0)
    flight.ask(m.Start(vehicles=flight.ids))
    flight.run(11.0)
    assert [flight.phase(v) for v in flight.ids] == [Phase.TAKEOFF, Phase.ARMING]
    assert flight.ask(m.Return()).ok
    flight.sim._pilots[1].platform.params.set("ANGLE_MAX", 3000.0)
    while flight.station.flight.executive.run is not RunPhase.IDLE:
        flight.step()
        assert not flight.sim.armed[1]
        assert flight.clock.now() < 200.0


def test_a_landing_whose_command_is_lost_for_a_while_still_lands(rig: MakeRig) -> None:
    """3.4 s without a way down is neither LOST nor somebody else's mode: the stop is repeated."""
    flight = rig(1).flying().run(5.0)
    flight.ask(m.Return())
    home = flight.station.flight.flights.by_id[1].home_m
    flight.until(lambda: math.dist(flight.place(1)[:2], home[:2]) < 4.0, 90.0)
    flight.loses = lambda way, index: way == "down"
    flight.until(lambda: flight.phase(1) is Phase.LANDING, 20.0)
    flight.run(4.0)
    flight.loses = lambda way, index: False
    flight.run(3.0)
    assert int(flight.sim.mode[0]) == LAND
    assert flight.phase(1) is Phase.LANDING


# ---------------------------------------------------------------- lost, found, taken over


@pytest.mark.long
def test_a_lost_vehicle_is_taken_out_and_its_team_respaces_within_five_seconds(rig: MakeRig) -> None:
    """With the real patrol planner: three vehicles have slots n/4, then the fourth is heard no more: n/3."""
    flight = rig(4, wants=None).flying()
    flight.until(lambda: slots(flight) == {"1/4", "2/4", "3/4", "4/4"}, 10.0)
    flight.run(5.0)
    flight.sim.silence(3)
    took = flight.until(lambda: slots(flight) == {"1/3", "2/3", "3/3"}, 5.0, "re-spaced")
    assert 3.0 < took <= 5.0
    assert flight.phase(4) is Phase.TAKEN_OUT
    flight.run(SILENCE_CHECK_S)  # who fell silent is looked for that often
    assert any("LOST" in text for text in flight.texts("vehicle 4"))
    flight.run(1.0)
    assert not flight.sent_to(4, since_s=flight.clock.now() - 1.0), "nothing is streamed into the void"
    flight.sim.unsilence(3)
    flight.until(lambda: slots(flight) == {"1/4", "2/4", "3/4", "4/4"}, 6.0, "rejoined")
    assert flight.phase(4) is Phase.FLYING
    assert flight.station.flight.guard.vetoes == {}


@pytest.mark.long
def test_a_vehicle_that_goes_home_and_one_that_lands_by_itself_are_replaced_within_five_seconds(rig: MakeRig) -> None:
    flight = rig(4, wants=None).flying()
    flight.until(lambda: slots(flight) == {"1/4", "2/4", "3/4", "4/4"}, 10.0)
    assert flight.ask(m.Return(vehicles=(4,))).ok
    flight.until(lambda: slots(flight) == {"1/3", "2/3", "3/3"}, 5.0, "re-spaced for three")
    flight.run(5.0)
    flight.pilot(3, LAND)
    flight.until(lambda: slots(flight) == {"1/2", "2/2"}, 5.0, "re-spaced for two")
    assert flight.phase(3) is Phase.TAKEN_OUT
    flight.until(lambda: not flight.sim.armed[2], 90.0, "vehicle 3 is down")
    assert slots(flight) == {"1/2", "2/2"}


def slots(flight: Rig) -> set[str]:
    return {f.slot for f in flight.station.flight.flights if f.phase is Phase.FLYING and f.slot}


@pytest.mark.long
def test_one_held_by_the_operator_does_not_rejoin_by_itself_after_a_loss(rig: MakeRig) -> None:
    flight = rig(2).flying().run(8.0)
    flight.ask(m.Hold(vehicles=(2,)))
    flight.run(5.0)
    flight.sim.silence(1)
    flight.run(5.0)
    assert flight.phase(2) is Phase.TAKEN_OUT
    flight.sim.unsilence(1)
    flight.run(5.0)
    assert flight.phase(2) is Phase.HOLDING
    assert flight.speed(2) < 0.3


def test_hold_all_reaches_a_lost_vehicle_as_soon_as_it_hears_again(rig: MakeRig) -> None:
    """Its telemetry is gone, perhaps only that: the stop is repeated all the same, with an alarm after 10 s."""
    flight = rig(2).flying().run(3.0)
    flight.loses = lambda way, index: index == 1 and way == "up"
    flight.run(4.0)
    assert flight.phase(2) is Phase.TAKEN_OUT
    flight.ask(m.Hold())
    flight.run(20.0)
    assert len(flight.sent_to(2, since_s=flight.clock.now() - 20.0)) > 25
    assert flight.speed(2) < 0.3
    assert any("not confirmed after 10 s" in text for text in flight.texts("vehicle 2"))
    flight.loses = lambda way, index: False
    flight.run(4.0)
    assert flight.phase(2) is Phase.HOLDING
    assert not flight.station.comms.commands.pending(2, "hold")


@pytest.mark.long
def test_a_vehicle_in_its_own_pilots_hands_is_not_steered(rig: MakeRig) -> None:
    flight = rig(2).flying().run(5.0)
    flight.pilot(2, LOITER)
    flight.run(5.0)
    assert flight.phase(2) is Phase.TAKEN_OUT
    flight.run(10.0)
    assert [n for t, v, n, f in flight.sent if v == 2 and t > flight.clock.now() - 9.0 and n == SETPOINT] == []
    assert int(flight.sim.mode[1]) == LOITER, "and not pulled back either"
    assert flight.phase(1) is Phase.FLYING
    assert "left the mission" in m_status(flight).alarm
    reply = flight.ask(m.Return())
    assert results(reply) == {2: "is flown by its pilot (LOITER): left to the pilot, name it to take it over"}


def m_status(flight: Rig) -> m.StationStatus:

    return flight.station.publisher.status()


def test_its_own_pilot_may_take_a_holding_vehicle_too(rig: MakeRig) -> None:
    """Resume must not pull a vehicle out of its pilot's hands."""
    flight = rig(2).flying().run(5.0)
    flight.ask(m.Hold())
    flight.run(6.0)
    flight.pilot(2, LOITER)
    flight.run(5.0)
    assert flight.phase(2) is Phase.TAKEN_OUT
    assert [r.vehicle for r in flight.ask(m.Resume()).results] == [1]
    flight.run(5.0)
    assert int(flight.sim.mode[1]) == LOITER


@pytest.mark.long
def test_rtl_of_one_vehicle_is_let_alone_until_it_is_down(rig: MakeRig) -> None:
    flight = rig(2).flying().run(8.0)
    flight.pilot(1, RTL)
    flight.until(lambda: not flight.sim.armed[0], 200.0)
    flight.run(3.0)
    assert flight.phase(1) is Phase.GROUND
    assert "landed and disarmed by itself, or by its pilot" in flight.texts("vehicle 1")
    assert flight.phase(2) is Phase.FLYING


def test_who_leaves_its_mode_by_a_failsafe_is_told_with_its_own_words(rig: MakeRig) -> None:
    """A real one: BATT_FS_LOW_ACT 2."""
    flight = rig(1).flying().run(8.0)
    flight.say("STATUSTEXT", 1, severity=4, text="Battery 1 is low 10.80V used 660 mAh")
    flight.say("STATUSTEXT", 1, severity=4, text="Battery Failsafe")
    flight.pilot(1, RTL)
    flight.run(3.0)
    said = "Battery 1 is low 10.80V used 660 mAh; Battery Failsafe"
    assert f"left its mode (now RTL): taken out of the mission; it reported: {said}" in flight.texts("vehicle 1")


def test_a_mission_on_board_may_end_on_the_ground_but_not_above_it(rig: MakeRig) -> None:
    flight = rig(2).flying().run(5.0)
    for vehicle in (1, 2):
        flight.station.flight.manual_control.release(flight.station.picture.fleet.vehicles[vehicle], TakenOut.ON_BOARD)
    flight.sim._pilots[0].platform.plans.put(0, [Item(16), Item(NAV_LAND)])
    flight.pilot(1, AUTO)
    flight.run(2.0)
    flight.sim._pilots[1].arming.disarm()
    flight.until(lambda: not flight.sim.armed[0], 100.0)
    flight.run(2.0)
    reported = {
        e.source: (e.text, e.severity) for e in flight.events() if "isarmed by" in e.text or "DISARMED" in e.text
    }
    assert reported["vehicle 1"] == ("landed and disarmed by its mission on board", 6)
    assert reported["vehicle 2"] == ("DISARMED IN THE AIR, 34 m high: it falls", 1)


def test_a_vehicle_that_disarms_in_flight_is_an_alarm(rig: MakeRig) -> None:
    flight = rig(2).flying().run(5.0)
    flight.sim._pilots[1].arming.disarm()
    flight.run(4.0)
    assert flight.phase(2) is Phase.GROUND
    alert = next(e for e in flight.events() if "DISARMED" in e.text)
    assert alert.severity <= 1 and alert.source == "vehicle 2"
    assert flight.phase(1) is Phase.FLYING


@pytest.mark.long
def test_killed_in_flight_it_is_lost_and_stays_so(rig: MakeRig) -> None:
    flight = rig(2).flying().run(5.0)
    flight.sim.kill(0)
    flight.run(10.0)
    assert flight.phase(1) is Phase.TAKEN_OUT
    assert flight.station.picture.fleet.vehicles[1].freshness(flight.clock.now()) is Freshness.LOST
    flight.ask(m.Return())
    flight.until(lambda: flight.phase(2) is Phase.GROUND, 150.0, "the other one comes home")
    assert "LOST in the air: vehicle 1" in m_status(flight).alarm


def test_scenario_helper_is_the_shipped_one() -> None:
    assert [team.name for team in scenario(8).teams] == ["defend", "attack"]


def test_the_hold_of_one_that_stands_still_and_cannot_hear_is_pending(rig: MakeRig) -> None:
    """To the eye it holds already: only the order that goes on being repeated says that it is not known."""
    flight = rig(2).flying()
    flight.ask(m.Hold())
    flight.run(5.0)
    assert flight.station.publisher.frame().stop_pending == (False, False)
    flight.loses = lambda way, index: index == 1 and way == "up"
    flight.run(6.0)
    # Its own failsafe for a lost station has begun meanwhile, and nobody can end that.
    flight.ask(m.Hold())
    assert flight.phase(2) is Phase.HOLDING and flight.speed(2) < 0.3
    for _ in range(5):
        assert flight.station.publisher.frame().stop_pending[1]
        flight.run(1.0)
    flight.loses = lambda way, index: False
    flight.run(4.0)
    assert flight.station.publisher.frame().stop_pending == (False, False)
