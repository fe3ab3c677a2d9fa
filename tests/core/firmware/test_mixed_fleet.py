"""A mixed fleet, one ArduCopter and one PX4, through a whole mission: the same station, nothing told apart above."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from tests.core.rigs.rig import Rig
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase, RunPhase

MakeRig = Callable[..., Rig]
HOLD, OFFBOARD, GUIDED = 0x03040000, 0x060000, 4


@pytest.mark.long
def test_a_mixed_fleet_keeps_its_slots_holds_goes_on_and_comes_home(rig: MakeRig) -> None:
    flight = rig(2, wants=None, autopilots="mixed").flying()
    assert flight.frame is not None and flight.frame.autopilot == ("ArduCopter", "PX4")
    flights = flight.station.flight.flights.by_id
    flight.until(lambda: all(f.joined for f in flight.station.flight.flights), 40.0, "on slot")
    flight.run(12.0)
    errors: list[tuple[float, ...]] = []
    lags: list[tuple[float, ...]] = []
    for _ in range(25):
        flight.run(1.0)
        errors.append(flight.frame.slot_error_m)
        lags.append(flight.frame.lag_s)
    assert (np.percentile(np.array(errors), 90, axis=0) < 2.0).all(), np.round(errors, 1)
    assert np.nanmax(np.abs(np.array(lags))) < 0.5
    assert [v.telemetry.custom_mode for v in flight.station.picture.fleet.in_order()] == [GUIDED, OFFBOARD]

    assert flight.ask(m.Hold()).ok
    flight.run(8.0)
    assert all(flight.speed(v) < 0.5 for v in flight.ids)
    assert flight.station.picture.fleet.vehicles[2].telemetry.custom_mode == HOLD
    said = len(flight.sent_to(2))
    flight.run(3.0)
    assert len(flight.sent_to(2)) == said, "no stream is left running beside Hold"

    assert flight.ask(m.Resume()).ok
    flight.until(lambda: {f.phase for f in flights.values()} == {Phase.FLYING}, 40.0)
    homes = {v: flights[v].home_m for v in flight.ids}
    assert flight.ask(m.Return()).ok
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.IDLE, 200.0)
    assert all(math.dist(flight.place(v)[:2], homes[v][:2]) < 2.0 for v in flight.ids)
    assert flight.station.flight.guard.vetoes == {} and flight.station.comms.commands.unanswered == []


def test_a_vehicle_that_drops_its_goals_without_a_word_is_told(rig: MakeRig) -> None:
    """ArduCopter answers nothing to a place beyond its fence, and stays where it is (measured)."""
    flight = rig(1).ready()
    home = flight.station.picture.fleet.vehicles[1]
    around = PlanItem(
        5003, 0, (40.0, 0.0, 0.0, 0.0), round(home.telemetry.lat_deg * 1e7), round(home.telemetry.lon_deg * 1e7)
    )
    flight.station.services.missions.upload(1, Plan(PlanKind.FENCE, (around,)))
    flight.station.services.params.set(1, "FENCE_ENABLE", 1)
    flight.run(5.0)
    flight.flying().run(15.0)
    reported = "stands still although it is ordered to move: outside of its fence"
    assert any(reported in text for text in flight.texts("vehicle 1"))
