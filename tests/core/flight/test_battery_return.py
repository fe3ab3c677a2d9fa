"""How long batteries last is known, and vehicles that fly for their planner go home while theirs bring them there."""

import math

import msgspec
import pytest

from tests.core.rigs.rig import Rig, scenario
from tui_gcs.core.flight.energy_use import BatteryUse
from tui_gcs.core.motion.power import most_use_pct_s, use_pct_s
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import BatteryLimits, PowerModel, VehicleClass

HOUR = PowerModel(capacity_wh=200.0, hover_w=200.0, cruise_w=160.0)
"""Hovers for an hour."""


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


def kind(power: PowerModel | None) -> VehicleClass:
    return VehicleClass("quad", (1,), 8.0, 2.5, 15.0, power)


def left_s(flight: Rig, vehicle: int) -> float:
    return flight.station.publisher.frame().row(vehicle).battery_left_s


def classed(rig, power: PowerModel | None, battery: BatteryLimits | None = None) -> Rig:
    mission = msgspec.structs.replace(scenario(2), classes=(kind(power),), battery=battery or BatteryLimits())
    return rig(2, mission=mission).flying()


def test_power_changes_with_the_square_of_the_speed_between_hover_and_the_limit() -> None:
    assert use_pct_s(kind(HOUR), 0.0) == pytest.approx(100.0 / 3600.0)
    assert use_pct_s(kind(HOUR), 8.0) == pytest.approx(80.0 / 3600.0)
    assert use_pct_s(kind(HOUR), 4.0) == pytest.approx(95.0 / 3600.0)
    assert use_pct_s(kind(HOUR), 30.0) == use_pct_s(kind(HOUR), 8.0), "faster than it can fly"
    assert most_use_pct_s(kind(HOUR)) == use_pct_s(kind(HOUR), 0.0)
    assert use_pct_s(kind(None), 3.0) == use_pct_s(kind(None), 0.0)


def used(seconds: int, pct_s: float, modelled_pct_s: float, begin_pct: float = 90.0) -> BatteryUse:
    """A battery that reports whole percent, once a second."""
    use = BatteryUse()
    for t_s in range(seconds + 1):
        use.add(float(t_s), math.ceil(begin_pct - pct_s * t_s), modelled_pct_s)
    return use


def test_the_measured_use_is_known_after_three_percent() -> None:
    assert math.isnan(used(25, 0.1, 0.05).ratio()), "too little used"
    assert math.isnan(used(10, 1.0, 0.5).ratio()), "too short a time"
    assert used(110, 0.1, 0.05).ratio() == pytest.approx(2.0, rel=0.1)
    assert used(600, 0.1, 0.05).ratio() == pytest.approx(2.0, rel=0.1)


def test_a_battery_that_lasts_for_hours_is_measured_over_a_longer_time() -> None:
    assert used(1200, 0.01, 0.01).ratio() == pytest.approx(1.0, rel=0.1)


def test_another_battery_and_a_gauge_that_jumps_begin_anew() -> None:
    for charge_pct in (99.0, 40.0):
        use = used(100, 0.1, 0.1)
        use.add(101.0, charge_pct, 0.1)
        assert math.isnan(use.ratio())


def test_the_model_counts_until_the_use_is_measured_and_a_wrong_model_is_corrected(rig) -> None:
    """The simulated battery lasts 20 minutes, whatever the scenario says."""
    flight = classed(rig, HOUR).run(1.0)
    assert left_s(flight, 1) == pytest.approx(3600.0, rel=0.1)
    assert math.isnan(left_s(flight, 2)), "of no class: nothing is known yet"
    flight.run(90.0)
    charge = flight.station.picture.fleet.vehicles[1].telemetry.battery_pct / 100.0
    assert left_s(flight, 1) == pytest.approx(1200.0 * charge, rel=0.2)
    assert left_s(flight, 2) == pytest.approx(1200.0 * charge, rel=0.2)


def test_a_small_battery_brings_its_vehicle_home_before_its_charge_is_low(rig) -> None:
    """By its model it lasts for 100 s: the way home and the reserve take more than half of that."""
    small = PowerModel(capacity_wh=5.0, hover_w=180.0, cruise_w=180.0)
    flight = classed(rig, small, BatteryLimits(return_pct=5.0, reserve_s=90.0))
    flight.until(lambda: flight.phase(1) is Phase.RETURNING, 20.0, "returns")
    assert flight.station.picture.fleet.vehicles[1].telemetry.battery_pct > 50.0
    assert flight.phase(2) is Phase.FLYING


def test_frames_tell_the_way_home_of_vehicles_in_the_air_only(rig) -> None:
    flight = classed(rig, HOUR).run(5.0)
    row = flight.station.publisher.frame().row(1)
    assert 20.0 < row.home_s < 120.0
    assert math.isnan(rig(1).ready().station.publisher.frame().row(1).home_s)
