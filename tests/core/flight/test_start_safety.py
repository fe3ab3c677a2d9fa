"""Starts that must not happen, and starts that go wrong half way: nobody is disarmed in the air."""

import dataclasses
import random
import re
from collections.abc import Callable

import msgspec
import pytest

from sitl.launch.fleet import VehicleSpec
from tests.core.rigs.rig import Rig, scenario
from tui_gcs.core.flight.flights import ArmingStep
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import FleetFrame, Intent, Phase, PlannerTask, Reply, RunPhase
from tui_gcs.core.scenario.model import Limits, Scenario
from tui_gcs.rehearsal.lock_step import simulated_vehicles

MakeRig = Callable[..., Rig]


def standing_on(monkeypatch: pytest.MonkeyPatch, *ground_amsl_m: float) -> None:
    """The ground below the vehicles is so high, one number each."""
    specs = simulated_vehicles(scenario(len(ground_amsl_m)))
    hilly = [dataclasses.replace(s, ground_amsl_m=h) for s, h in zip(specs, ground_amsl_m, strict=True)]
    monkeypatch.setattr("tui_gcs.rehearsal.lock_step.simulated_vehicles", lambda scenario: hilly)


def why(reply: Reply) -> str:
    """Everything the reply says."""
    return "; ".join([reply.text, *(r.text for r in reply.results if not r.ok)])


# ---------------------------------------------------------------- homes at different heights


def test_start_is_refused_when_homes_lie_at_different_heights(rig: MakeRig, monkeypatch: pytest.MonkeyPatch) -> None:
    """Layers count from each vehicle's own home: 7 m of slope, and two layers are one."""
    standing_on(monkeypatch, 117.0, 110.0, 110.0)
    flight = rig(3).ready()
    reply = flight.ask(m.Start(vehicles=flight.ids))
    assert not reply.ok
    assert re.search(r"\b7(\.0)? m\b", why(reply)), why(reply)
    flight.run(5.0)
    assert not flight.sim.armed.any()


def test_start_is_refused_when_the_others_flew_from_another_height(
    rig: MakeRig, monkeypatch: pytest.MonkeyPatch
) -> None:
    standing_on(monkeypatch, 117.0, 110.0)
    flight = rig(2).ready()
    assert flight.ask(m.Start(vehicles=(1,))).ok
    flight.until(lambda: flight.phase(1) is Phase.FLYING, 60.0)
    reply = flight.ask(m.Start(vehicles=(2,)))
    assert not reply.ok
    assert re.search(r"\b7(\.\d)? m\b", why(reply)), why(reply)


def test_a_small_difference_is_no_reason(rig: MakeRig, monkeypatch: pytest.MonkeyPatch) -> None:
    standing_on(monkeypatch, 112.5, 110.0, 110.0)
    flight = rig(3).flying()
    assert flight.phases() == {Phase.FLYING}


def test_the_scenario_may_allow_a_larger_difference(rig: MakeRig, monkeypatch: pytest.MonkeyPatch) -> None:
    standing_on(monkeypatch, 117.0, 110.0, 110.0)
    flight = rig(mission=allowing(scenario(3), 10.0)).flying()
    assert flight.phases() == {Phase.FLYING}


def allowing(whole: Scenario, home_spread_m: float) -> Scenario:
    """The scenario with another limit for the difference of homes."""
    assert Limits().home_spread_m == 3.0
    return msgspec.structs.replace(whole, limits=msgspec.structs.replace(whole.limits, home_spread_m=home_spread_m))


# ---------------------------------------------------------------- places too close to somebody flying


def test_start_is_refused_on_the_home_of_one_that_flies(rig: MakeRig, monkeypatch: pytest.MonkeyPatch) -> None:
    """It will come down there."""
    first, *others = simulated_vehicles(scenario(3))
    beside = VehicleSpec(2, first.lat_deg + 2e-5, first.lon_deg, first.ground_amsl_m)
    monkeypatch.setattr("tui_gcs.rehearsal.lock_step.simulated_vehicles", lambda scenario: [first, beside, others[1]])
    flight = rig(3).ready()
    assert flight.ask(m.Start(vehicles=(1,))).ok
    flight.until(lambda: flight.phase(1) is Phase.FLYING, 60.0)
    flight.run(20.0)
    assert flight.place(1)[0] > 150.0, "it is far from its home"
    reply = flight.ask(m.Start(vehicles=(2,)))
    assert not reply.ok
    assert [(r.vehicle, "vehicle 1" in r.text) for r in reply.results if not r.ok] == [(2, True)]


def test_start_is_refused_below_one_that_flies(rig: MakeRig) -> None:
    def over_place_2(frame: FleetFrame, task: PlannerTask) -> list[Intent]:
        return [Intent(vehicle=1, kind="goto", position_m=(45.0, 190.0, task.layers_m[1]))]

    flight = rig(2, wants=over_place_2).ready()
    assert flight.ask(m.Start(vehicles=(1,))).ok
    flight.until(lambda: flight.phase(1) is Phase.FLYING, 60.0)
    flight.run(15.0)
    reply = flight.ask(m.Start(vehicles=(2,)))
    assert not reply.ok
    assert [(r.vehicle, "vehicle 1" in r.text) for r in reply.results if not r.ok] == [(2, True)]


@pytest.mark.long
def test_start_beside_one_that_flies_elsewhere_is_fine(rig: MakeRig) -> None:
    flight = rig(2).ready()
    assert flight.ask(m.Start(vehicles=(1,))).ok
    flight.until(lambda: flight.phase(1) is Phase.FLYING, 60.0)
    flight.run(20.0)
    assert flight.ask(m.Start(vehicles=(2,))).ok
    flight.until(lambda: flight.phases() == {Phase.FLYING}, 60.0)


# ---------------------------------------------------------------- hold while starting


def begun(rig: MakeRig, step: ArmingStep) -> Rig:
    """Vehicle 1 is being started and has just come to this step."""
    flight = rig(2).ready()
    assert flight.ask(m.Start(vehicles=(1,))).ok
    flight.until(lambda: flight.station.flight.flights.by_id[1].step is step, 60.0, step.value)
    return flight


@pytest.mark.long
@pytest.mark.parametrize("after_s", [1.0, 1.5, 2.0])
def test_hold_while_it_lifts_off_ends_the_climb(rig: MakeRig, after_s: float) -> None:
    flight = begun(rig, ArmingStep.TAKE_OFF).run(after_s)
    assert flight.ask(m.Hold()).ok
    assert flight.disarms_in_the_air(20.0) == []
    height_m = flight.place(1)[2]
    assert 0.3 < height_m < 15.0, "its layer is at 27 m"
    assert flight.phase(1) is Phase.HOLDING
    flight.run(10.0)
    assert flight.place(1)[2] == pytest.approx(height_m, abs=0.3)


@pytest.mark.parametrize("after_s", [0.1, 0.5, 1.1, 3.5])
def test_hold_at_any_moment_of_a_start_never_lets_it_climb_on(rig: MakeRig, after_s: float) -> None:
    flight = begun(rig, ArmingStep.TAKE_OFF).run(after_s)
    flight.ask(m.Hold())
    assert flight.disarms_in_the_air(30.0) == []
    assert flight.place(1)[2] < 15.0
    hovers = flight.sim.armed[0] and flight.place(1)[2] > 0.3 and flight.phase(1) is Phase.HOLDING
    assert hovers or (not flight.sim.armed[0] and flight.phase(1) is Phase.GROUND)


@pytest.mark.parametrize("step", [ArmingStep.SET_MODE, ArmingStep.ARM])
def test_hold_before_arming_ended_keeps_it_on_the_ground(rig: MakeRig, step: ArmingStep) -> None:
    flight = rig(2).ready()
    flight.ask(m.Start(vehicles=(1,)))
    flight.until(lambda: flight.station.flight.flights.by_id[1].step is step, 60.0, step.value)
    assert flight.ask(m.Hold()).ok
    flight.run(20.0)
    assert flight.place(1)[2] < 0.1
    assert not flight.sim.armed[0]
    assert flight.phase(1) is Phase.GROUND


# ---------------------------------------------------------------- switched on where the link is bad


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(2, marks=pytest.mark.long),
        *(pytest.param(seed, marks=pytest.mark.endurance) for seed in (8, 9, 15)),
    ],
)
def test_half_of_all_frames_lost_at_boot_is_made_up_for(rig: MakeRig, seed: int) -> None:
    chance = random.Random(seed)
    flight = rig(4)
    flight.loses = lambda way, index: chance.random() < 0.5
    flight.run(20.0)
    flight.loses = lambda way, index: False
    flight.run(60.0)
    reply = flight.ask(m.Start(vehicles=flight.ids))
    assert reply.ok, why(reply)
    flight.until(lambda: flight.phases() == {Phase.FLYING}, 90.0, "all four fly")


def test_what_its_checks_said_of_the_mode_before_does_not_count(rig: MakeRig) -> None:
    """A real ArduCopter says yes in STABILIZE 18 s before it can be armed in GUIDED: then arming was refused."""
    flight = rig(2)
    vehicles = flight.station.picture.fleet.vehicles
    flight.until(
        lambda: len(vehicles) == 2 and all(v.telemetry.prearm_ok for v in vehicles.values()), 10.0, "checks pass"
    )
    assert "EKF" in flight.station.frontend.readiness.why_not_start(1)
    flight.station.flight.executive.start(flight.ids)
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.RUNNING, 60.0, "running")
    assert not [text for text in flight.texts() if text.startswith(("arm: refused", "not started"))]
