"""Vehicles that fly for their planner go home while their batteries still bring them there."""

import math

import msgspec
import pytest

from tests.core.rigs.rig import Rig, scenario
from tui_gcs.core.flight.battery_return import _Drain
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import BatteryLimits


def flying(rig, battery: BatteryLimits | None = None, vehicles: int = 2) -> Rig:
    mission = scenario(vehicles)
    if battery is not None:
        mission = msgspec.structs.replace(mission, battery=battery)
    return rig(vehicles, mission=mission).flying().run(5.0)


def drain(flight: Rig, vehicle: int, left: float) -> None:
    flight.sim._pilots[flight.sim_index[vehicle]].discharge(left)


def test_at_the_charge_of_the_scenario_it_returns_and_lands_and_the_others_fly_on(rig) -> None:
    flight = flying(rig)
    drain(flight, 1, 0.15)
    flight.until(lambda: flight.phase(1) is Phase.RETURNING, 10.0, "returns")
    assert "battery at 15 %: returns and lands" in flight.texts("vehicle 1")
    flight.until(lambda: flight.phase(1) is Phase.GROUND, 150.0, "landed")
    assert flight.phase(2) is Phase.FLYING


def test_above_it_nothing_happens_and_one_message_sends_nobody_home(rig) -> None:
    flight = flying(rig)
    drain(flight, 1, 0.17)
    flight.run(20.0)
    assert flight.phase(1) is Phase.FLYING
    flight.station.picture.fleet.vehicles[2].telemetry.battery_pct = 0.0  # until the next message
    flight.run(10.0)
    assert flight.phase(2) is Phase.FLYING


def test_zero_turns_it_off(rig) -> None:
    flight = flying(rig, BatteryLimits(return_pct=0.0))
    drain(flight, 1, 0.01)
    flight.run(15.0)
    assert flight.phase(1) is Phase.FLYING


def test_one_that_an_operator_holds_stays_and_one_that_the_station_holds_returns(rig) -> None:
    flight = flying(rig)
    assert flight.ask(m.Hold(vehicles=(1,))).ok
    flight.station.flight.executive.hold((2,), ordered=False)
    drain(flight, 1, 0.1), drain(flight, 2, 0.1)
    flight.until(lambda: flight.phase(2) is Phase.RETURNING, 10.0, "returns")
    flight.run(10.0)
    assert flight.phase(1) is Phase.HOLDING


def test_far_from_home_it_leaves_earlier(rig) -> None:
    """A battery that lasts 1200 s: at 30 %, 360 s are left, and a reserve of 300 s does not include the way home."""
    flight = flying(rig, BatteryLimits(return_pct=5.0, reserve_s=300.0), vehicles=1)
    drain(flight, 1, 0.35)
    flight.run(20.0)
    assert flight.phase(1) is Phase.FLYING
    flight.until(lambda: flight.phase(1) is Phase.RETURNING, 90.0, "returns")
    assert flight.station.picture.fleet.vehicles[1].telemetry.battery_pct > 25.0
    assert any("the way home and landing take" in text for text in flight.texts("vehicle 1"))


def test_a_drain_is_known_after_a_while_and_below_half_a_charge_only() -> None:
    drain = _Drain()
    for t_s in range(100):
        drain.add(float(t_s), 49.0 - t_s // 10)
    assert drain.left_s(99.0, 40.0) == pytest.approx(40.0 * 99.0 / 9.0)
    fresh = _Drain()
    fresh.add(0.0, 49.0), fresh.add(5.0, 40.0)
    assert fresh.left_s(5.0, 40.0) == math.inf, "a jump"
    drain.add(100.0, 90.0)
    assert drain.left_s(130.0, 89.0) == math.inf, "another battery"


def test_a_new_charge_is_asked_for_before_a_start(rig) -> None:
    ground = rig(1, mission=msgspec.structs.replace(scenario(1), battery=BatteryLimits(return_pct=40.0))).ready()
    ground.station.picture.fleet.vehicles[1].telemetry.battery_pct = 42.0
    reasons = str(ground.station.frontend.readiness.why_not_start(1))
    assert "battery 42 %, at least 45 % to start" in reasons


def test_the_table_of_a_scenario_is_read_and_checked() -> None:
    from tests.core.rigs.rig import toml

    assert parse(toml()).battery == BatteryLimits()
    with pytest.raises(ScenarioError, match=r"battery.return_pct"):
        parse(toml().replace("return_pct = 15.0", "return_pct = 101"))
    assert "nothing is done" in BatteryLimits(return_pct=0.0).words
