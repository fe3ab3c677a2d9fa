"""HOLD reaches everybody it is meant for, whatever they did a moment ago, and nobody else."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.rigs.rig import Rig
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.protocol.flight import Land

pytestmark = pytest.mark.long  # nearly each is a flight

MakeRig = Callable[..., Rig]
GUIDED, RTL, BRAKE = 4, 6, 17
HOUSEKEEPING = {511, 512, "TIMESYNC"}
"""Requests for rates and for information."""
HOME_X_M = 45.0


# ---------------------------------------------------------------- just left to its pilot


@pytest.mark.parametrize("everybody", [True, False])
def test_hold_stops_a_vehicle_whose_return_home_was_not_heard_of_yet(rig: MakeRig, everybody: bool) -> None:
    flight = rig(3).flying().run(8.0)
    vehicle = flight.station.picture.fleet.vehicles[2]
    flight.until(lambda: vehicle.telemetry.heartbeat_s == flight.clock.now(), 2.0, "a heartbeat")
    flight.pilot(2, RTL)
    flight.loses = lambda way, index: (way, index) == ("up", 1)
    flight.run(0.1)
    flight.loses = lambda way, index: False
    assert vehicle.telemetry.custom_mode == GUIDED, "the heartbeat that tells is lost, the next one is 0.9 s away"
    assert flight.ask(m.Hold() if everybody else m.Hold(vehicles=(2,))).ok
    flight.run(8.0)
    assert flight.speed(2) < 0.5
    assert int(flight.sim.mode[1]) in (GUIDED, BRAKE)
    assert flight.phase(2) is Phase.HOLDING
    where = flight.place(2)
    flight.run(20.0)
    assert flight.place(2) == pytest.approx(where, abs=1.0)
    assert where[0] > HOME_X_M + 20.0


# ---------------------------------------------------------------- somebody else's aircraft


def live_with_a_stranger(rig: MakeRig, tmp_path: Path, kind: int, autopilot: int) -> Rig:
    """A LIVE station whose two vehicles fly, and system 50, armed and in the air, in no team."""
    flight = rig(2)
    flight.station.config.kind, flight.station.config.token = RunKind.LIVE, ""
    flight.restart_station(StateStore(tmp_path / "none.json"))
    flight.flying().run(5.0)
    for _ in range(10):
        strangers_telemetry(flight, kind, autopilot)
    assert flight.station.picture.fleet.vehicles[50].telemetry.airborne
    return flight


def strangers_telemetry(flight: Rig, kind: int, autopilot: int) -> None:
    heartbeat = {"base_mode": 209, "custom_mode": 10, "system_status": 4, "mavlink_version": 3}
    place = {"lat": 520_740_000, "lon": -6_230_000, "alt": 160_000, "relative_alt": 50_000}
    flight.say("HEARTBEAT", 50, index=50, type=kind, autopilot=autopilot, **heartbeat)
    flight.say("EXTENDED_SYS_STATE", 50, index=50, vtol_state=0, landed_state=2)
    rest = {"time_boot_ms": 1000 + round(flight.clock.now() * 1e3), "vx": 0, "vy": 1500, "vz": 0, "hdg": 9000}
    flight.say("GLOBAL_POSITION_INT", 50, index=50, **place, **rest)
    flight.run(0.1)


@pytest.mark.parametrize(("kind", "autopilot"), [(1, 3), (2, 12), (10, 3)], ids=["ArduPlane", "PX4 quadrotor", "rover"])
def test_hold_all_and_return_send_nothing_to_what_is_in_no_team(
    rig: MakeRig, tmp_path: Path, kind: int, autopilot: int
) -> None:
    flight = live_with_a_stranger(rig, tmp_path, kind, autopilot)
    for request in (m.Hold(), m.Return()):
        reply = flight.ask(request)
        assert {r.vehicle for r in reply.results if r.ok} == {1, 2}, "our own obey"
        for _ in range(30):
            strangers_telemetry(flight, kind, autopilot)
    assert commands_to(flight, 50) <= HOUSEKEEPING


@pytest.mark.parametrize("request_", [m.Hold(vehicles=(50,)), m.Return(vehicles=(50,))], ids=["hold", "return"])
def test_named_it_is_refused(rig: MakeRig, tmp_path: Path, request_: m.AnyRequest) -> None:
    flight = live_with_a_stranger(rig, tmp_path, 1, 3)
    reply = flight.ask(request_)
    assert not reply.ok and [(r.vehicle, r.ok) for r in reply.results] == [(50, False)]
    for _ in range(30):
        strangers_telemetry(flight, 1, 3)
    assert commands_to(flight, 50) <= HOUSEKEEPING


def commands_to(flight: Rig, vehicle: int) -> set[object]:
    """MAV_CMD numbers and names of the other messages that were sent to a vehicle."""
    return {fields.get("command", name) for _, v, name, fields in flight.sent if v == vehicle}


# ---------------------------------------------------------------- left behind


def test_one_that_holds_while_the_others_return_is_named_by_an_alarm(rig: MakeRig) -> None:
    flight = rig(3).flying().run(8.0)
    flight.ask(m.Return())
    flight.run(5.0)
    flight.ask(m.Hold((2,)))
    flight.run(5.0)
    assert (flight.phase(1), flight.phase(2)) == (Phase.RETURNING, Phase.HOLDING)
    assert "vehicle 2" in flight.station.publisher.status().alarm
    assert "resume those that hold by name" in flight.ask(m.Resume()).text
    flight.until(lambda: not flight.sim.armed[[0, 2]].any(), 120.0, "the others landed")
    assert "vehicle 2" in flight.station.publisher.status().alarm
    assert flight.ask(m.Return()).ok
    flight.until(lambda: not flight.sim.armed.any(), 120.0, "it, too")


# ---------------------------------------------------------------- what follows a hold


def test_a_resume_of_all_leaves_alone_who_did_not_fly_for_the_team_before_the_hold(rig: MakeRig) -> None:
    """One lands, one returns, one was stopped by name: HOLD ALL, then Enter, must not take them into flight again."""
    flight = rig(4).flying().run(4.0)
    assert flight.ask(Land(vehicles=(2,))).ok
    assert flight.ask(m.Return(vehicles=(3,))).ok
    assert flight.ask(m.Hold(vehicles=(4,))).ok
    flight.run(1.0)
    assert flight.ask(m.Hold()).ok
    assert flight.phases() == {Phase.HOLDING}
    flight.run(3.0)
    reply = flight.ask(m.Resume())
    assert (reply.ok, reply.text) == (True, "resume: vehicle 1")
    assert {r.vehicle: r.text for r in reply.results if not r.ok} == {
        2: "was landing: resume it by name",
        3: "was returning: resume it by name",
        4: "was held by name: resume it by name",
    }
    flight.until(lambda: flight.phase(1) is Phase.FLYING, 30.0)
    assert [flight.phase(v) for v in (2, 3, 4)] == [Phase.HOLDING] * 3
    assert flight.ask(m.Resume(vehicles=(3,))).ok
    flight.until(lambda: flight.phase(3) is Phase.FLYING, 30.0)


def test_a_hold_in_a_return_of_all_is_followed_by_no_flight_that_nobody_named(rig: MakeRig) -> None:
    flight = rig(2).flying().run(4.0)
    flight.ask(m.Return())
    flight.run(1.0)
    flight.ask(m.Hold())
    flight.run(1.0)
    flight.ask(m.Hold())
    reply = flight.ask(m.Resume())
    assert (reply.ok, reply.text) == (False, "no holding vehicle flew for a planner before")
    assert [r.text for r in reply.results] == ["was returning: resume it by name"] * 2
    flight.sim.silence(0)
    flight.run(6.0)
    flight.sim.unsilence(0)
    flight.until(lambda: flight.phase(1) is Phase.HOLDING, 10.0, "lost meanwhile, and back")
    assert not flight.ask(m.Resume()).ok
    assert flight.ask(m.Return()).ok
    flight.run(2.0)
    assert flight.phases() == {Phase.RETURNING}


def test_b6_112_two_operators_press_opposite_keys_within_50_ms(rig: MakeRig) -> None:
    """One after the other, both in the journal with who it was; everybody sees who gave the last order."""
    flight = rig(2).flying().run(5.0)
    assert flight.ask(m.Hold(), "console-1").ok
    flight.run(0.05)
    assert flight.ask(m.Resume(), "console-2").ok
    assert flight.station.publisher.status().in_control == "console-2"
    reported = [(e.source, e.text.split(":")[0]) for e in flight.events() if e.cls is m.EventClass.OPERATOR]
    assert reported[-2:] == [("console-1", "hold"), ("console-2", "resume")]
    flight.run(3.0)
    assert [flight.phase(v) for v in flight.ids] == [Phase.FLYING] * 2


@pytest.mark.parametrize(
    ("request_", "becomes"), [(m.Hold, Phase.HOLDING), (m.Return, Phase.RETURNING), (Land, Phase.LANDING)]
)
def test_a_stop_of_all_but_one_leaves_that_one_alone(
    rig: MakeRig, request_: type[m.Hold | m.Return | Land], becomes: Phase
) -> None:
    """A console repeats a stop that was not answered; meanwhile vehicle 2 was ordered to land."""
    flight = rig(3).flying().run(2.0)
    assert flight.ask(Land((2,), given_ns=1002)).ok
    flight.run(1.0)
    began_s = flight.station.flight.flights.by_id[2].since_s
    reply = flight.ask(request_(given_ns=1001))
    assert reply.ok and [result.vehicle for result in reply.results] == [1, 3]
    assert [flight.phase(v) for v in flight.ids] == [becomes, Phase.LANDING, becomes]
    assert flight.station.flight.flights.by_id[2].since_s == began_s
    assert [result.vehicle for result in flight.ask(request_((1, 2), given_ns=1001)).results] == [1]
    assert [result.vehicle for result in flight.ask(request_((1, 2))).results] == [1, 2], "one without a time is new"


@pytest.mark.parametrize("first", [m.Hold, Land])
def test_two_stops_that_arrive_the_wrong_way_round_end_in_the_newer(rig: MakeRig, first: type[m.Hold | Land]) -> None:
    """Given within a millisecond, by two consoles: both arrive, and the older one changes nothing."""
    flight = rig(2).flying().run(2.0)
    older, newer = (first(given_ns=5_000_000), m.Return(given_ns=5_400_000))
    assert flight.ask(newer, "console-2").ok
    reply = flight.ask(older, "console-1")
    assert not reply.ok and reply.text == "all obey a newer stop"
    flight.run(0.5)
    assert [flight.phase(v) for v in flight.ids] == [Phase.RETURNING] * 2
