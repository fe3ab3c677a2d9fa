"""A flight without a person: what it does when things go wrong (that it goes right: tests/rehearsal)."""

from collections.abc import Callable

import msgspec
import pytest

from tests.core.flight.test_start_safety import standing_on
from tests.core.rigs.rig import TICK_S, Rig, scenario
from tui_gcs.core.geometry.zones import Rectangle
from tui_gcs.core.judging.mission_script import MANOEUVRES_LIMIT_S, Script, Step, refusal_words, return_limit_s
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import BusError
from tui_gcs.core.protocol.common import Phase, RunPhase
from tui_gcs.core.protocol.flight import Land

MakeRig = Callable[..., Rig]


def fly(flight: Rig, script: Script, limit_s: float, until: Step = Step.DONE) -> None:
    """Let time pass until the script is at `until`."""
    begin_s = flight.clock.now()
    while script.step is not until:
        flight.step()
        script.tick()
        assert flight.clock.now() - begin_s < limit_s, script.headline


def wait(flight: Rig, script: Script, seconds: float) -> None:
    """Let this time pass, whatever the script does."""
    for _ in range(round(seconds / TICK_S)):
        flight.step()
        script.tick()


def script_for(flight: Rig, whole_duration: bool = False) -> Script:
    return Script(flight.scenario, flight.bus, principal="script", whole_duration=whole_duration)


def test_before_the_station_speaks_nothing_happens(rig: MakeRig) -> None:
    script = script_for(rig(1))
    script.tick()
    assert (script.step, script.headline, script.progress) == (Step.WAIT, "waiting for the station", 0.0)


def test_a_vehicle_that_is_never_heard_is_named_and_nobody_starts(rig: MakeRig) -> None:
    flight = rig(2)
    flight.sim.silence(1)
    script = script_for(flight)
    fly(flight, script, 100.0)
    assert script.problem == "not ready after 90 s: 1 of 2 vehicles (missing: 2)"
    assert not flight.sim.armed.any()
    assert not script.referee.result().ok


def test_a_reason_of_many_vehicles_is_written_once() -> None:
    results = tuple(m.VehicleResult(vehicle=v, ok=False, text="no fix") for v in (1, 2, 3))
    results += (m.VehicleResult(vehicle=4, ok=False, text="battery 12 %"), m.VehicleResult(vehicle=5, ok=True, text=""))
    reply = m.Reply(ok=False, text="not started: vehicles 1-4 not ready", results=results)
    assert refusal_words(reply) == (
        "not started: vehicles 1-4 not ready (vehicles 1-3: no fix; vehicle 4: battery 12 %)"
    )


def test_who_waits_sees_why_the_start_is_refused(rig: MakeRig, monkeypatch: pytest.MonkeyPatch) -> None:
    standing_on(monkeypatch, 117.0, 110.0)
    flight = rig(2)
    script = script_for(flight)
    with pytest.raises(AssertionError, match=r"waiting for vehicles: .*\b7(\.0)? m\b"):
        fly(flight, script, 20.0, Step.TAKE_OFF)
    assert script.progress == 0.0


@pytest.mark.long
def test_each_round_lasts_its_duration_then_hold_return_and_land(rig: MakeRig) -> None:
    whole = scenario(1)
    lasting_s = (60.0, 30.0, 45.0)
    rounds = [msgspec.structs.replace(r, duration_s=s) for r, s in zip(whole.rounds, lasting_s, strict=True)]
    flight = rig(mission=msgspec.structs.replace(whole, rounds=tuple(rounds)))
    script = script_for(flight, whole_duration=True)
    fly(flight, script, 100.0, Step.ROUND)
    begun, at_first = flight.clock.now(), script.progress
    flight.run(20.0)
    script.tick()
    assert 0.0 < script.progress - at_first < 0.5 / 3, "it goes on within a round"
    for number in (1, 2):
        while flight.station.active.round_index < number:
            wait(flight, script, TICK_S)
        assert flight.clock.now() - begun == pytest.approx(sum(lasting_s[:number]), abs=1.0)
    fly(flight, script, 100.0, Step.HOLD)
    assert flight.clock.now() - begun == pytest.approx(sum(lasting_s), abs=1.0)
    assert flight.station.active.round_index == 2
    fly(flight, script, 10.0, Step.RETURN)
    fly(flight, script, 150.0)
    assert script.problem == "" and script.progress == 1.0
    assert flight.station.flight.executive.run is RunPhase.IDLE and not flight.sim.armed.any()


@pytest.mark.long
def test_an_abort_brings_everybody_home(rig: MakeRig) -> None:
    flight = rig(2)
    script = script_for(flight, whole_duration=True)
    fly(flight, script, 100.0, Step.ROUND)
    script.abort("interrupted")
    assert script.step is Step.RETURN
    fly(flight, script, 150.0)
    assert script.problem == "interrupted" and not flight.sim.armed.any()


@pytest.mark.parametrize("ends", ["flown on", "interrupted"])
def test_a_start_whose_answer_is_lost_leaves_nobody_in_the_air(
    rig: MakeRig, monkeypatch: pytest.MonkeyPatch, ends: str
) -> None:
    """The station carried the start out, and died or was busy before it could answer."""
    flight = rig(2)
    ask = flight.bus.ask

    def ask_in_vain(key: str, data: bytes) -> bytes:
        ask(key, data)
        raise BusError("nobody answers")

    monkeypatch.setattr(flight.bus, "ask", ask_in_vain)
    script = script_for(flight)
    while not script._unanswered:
        wait(flight, script, TICK_S)
    monkeypatch.setattr(flight.bus, "ask", ask)
    if ends == "interrupted":
        script.abort("interrupted")
        assert script.step is Step.RETURN
        fly(flight, script, 150.0)
        assert script.problem == "interrupted"
    else:
        fly(flight, script, 100.0, Step.ROUND)
        script.abort("seen enough")
        fly(flight, script, 150.0)
    assert script.referee.started == (1, 2) and not flight.sim.armed.any()


def test_an_abort_before_the_start_is_the_end(rig: MakeRig) -> None:
    script = script_for(rig(1))
    script.abort("interrupted")
    assert script.done and script.problem == "interrupted"


def test_a_fleet_that_cannot_arm_ends_the_flight_early(rig: MakeRig) -> None:
    flight = rig(1)
    script = script_for(flight)
    flight.run(4.0)
    flight.sim._pilots[0].platform.params.set("ANGLE_MAX", 1.0)
    fly(flight, script, 200.0)
    assert script.problem in ("take-off ended in hold", "take-off ended in idle")  # on the ground both, a second apart
    assert any("ANGLE_MAX" in text for text in flight.texts("vehicle 1"))


def test_a_round_without_vehicles_is_over(rig: MakeRig) -> None:
    flight = rig(1)
    script = script_for(flight, whole_duration=True)
    fly(flight, script, 100.0, Step.ROUND)
    flight.sim._pilots[0].arming.disarm()
    fly(flight, script, 60.0)
    assert script.problem == "no vehicle is flying any more"


@pytest.mark.long
def test_vehicles_that_a_silent_planner_left_holding_go_on_when_it_is_back(rig: MakeRig) -> None:
    flight = rig(2)
    script = script_for(flight, whole_duration=True)
    fly(flight, script, 100.0, Step.ROUND)
    flight.run(5.0)
    flight.planning = False
    flight.run(25.0)
    assert flight.phases() == {Phase.HOLDING}
    flight.planning = True
    begin_s = flight.clock.now()
    while flight.phases() != {Phase.FLYING}:
        flight.step()
        script.tick()
        assert flight.clock.now() - begin_s < 40.0


@pytest.mark.long
def test_a_person_who_holds_is_not_overruled(rig: MakeRig) -> None:
    flight = rig(2)
    script = script_for(flight, whole_duration=True)
    fly(flight, script, 100.0, Step.ROUND)
    flight.ask(m.Hold(vehicles=(1,)))
    for _ in range(600):
        flight.step()
        script.tick()
    assert flight.phase(1) is Phase.HOLDING


def test_a_landing_that_an_operator_orders_after_a_hold_is_not_made_a_return(rig: MakeRig) -> None:
    """Seen with a service that was stopped: its last frame still showed vehicles that held, so it ordered a return."""
    flight = rig(2)
    script = script_for(flight)
    fly(flight, script, 60.0, Step.TAKE_OFF)
    wait(flight, script, 8.0)
    script.abort("interrupted")
    wait(flight, script, 7.0)
    flight.ask(m.Hold())
    wait(flight, script, 6.0)
    assert script.held_by and script.step is Step.RETURN
    before = flight.station.publisher.frame()
    flight.ask(Land())
    flight.step()
    script.on_status(flight.station.publisher.status())  # the status comes before the frame
    assert not script.held_by
    script.on_frame(before)
    script.tick()
    wait(flight, script, 1.0)
    assert {flight.phase(1), flight.phase(2)} == {Phase.LANDING}
    assert flight.texts("script").count("return: vehicles 1-2") == 1, "when the flight was interrupted"


@pytest.mark.long
def test_vehicles_that_were_lost_when_the_flight_ended_are_brought_home_when_they_are_heard_again(rig: MakeRig) -> None:
    """The link of the whole fleet fails for 30 s, the flight is aborted meanwhile, and the link comes back."""
    flight = rig(2)
    script = script_for(flight, whole_duration=True)
    fly(flight, script, 100.0, Step.ROUND)
    for index in range(2):
        flight.sim.silence(index)
    wait(flight, script, 25.0)
    assert script.problem == "no vehicle is flying any more" and not script.done
    assert script.headline.startswith("return, NOT HEARD: vehicles 1-2"), script.headline
    for index in range(2):
        flight.sim.unsilence(index)
    fly(flight, script, 200.0)
    assert not flight.sim.armed.any()


@pytest.mark.long
def test_the_flight_does_not_end_while_a_vehicle_is_armed_and_heard(rig: MakeRig) -> None:
    """Vehicle 1 is heard, but hears nothing for six minutes: it is named and waited for, however long that takes."""
    flight = rig(2)
    script = script_for(flight, whole_duration=True)
    fly(flight, script, 100.0, Step.ROUND)
    flight.sim._pilots[0].platform.params.set("FS_GCS_ENABLE", 0.0)
    flight.loses = lambda way, index: (way, index) == ("down", 0)
    script.abort("interrupted")
    wait(flight, script, 360.0)
    assert not script.done and script.headline.startswith("return: waiting for vehicle 1  T"), script.headline
    assert flight.sim.armed.tolist() == [True, False]
    flight.loses = lambda way, index: False
    fly(flight, script, 200.0)
    assert script.problem == "interrupted" and not flight.sim.armed.any()


@pytest.mark.long
def test_a_vehicle_that_stays_lost_is_named_at_the_end(rig: MakeRig) -> None:
    flight = rig(2)
    script = script_for(flight, whole_duration=True)
    fly(flight, script, 100.0, Step.ROUND)
    flight.sim.silence(1)
    wait(flight, script, 10.0)
    script.abort("interrupted")
    fly(flight, script, return_limit_s(flight.scenario) + 20.0)
    assert script.armed == (2,), "which the caller can name"


def test_the_way_home_across_a_large_area_takes_no_time_from_landing(rig: MakeRig) -> None:
    small = rig(1).scenario
    area = msgspec.structs.replace(small.rounds[0].area, shape=Rectangle((0.0, 0.0), 3000.0, 4000.0))
    large = msgspec.structs.replace(small, rounds=(msgspec.structs.replace(small.rounds[0], area=area),))
    assert small.limits.speed_m_s == 8.0
    assert return_limit_s(large) == MANOEUVRES_LIMIT_S + 5000.0 / 8.0
