"""What the fleet did, judged from telemetry."""

import math

import pytest

from tests.core.rigs.rig import scenario
from tests.core.rigs.vehicles import a_vehicle
from tui_gcs.core.flight.fleet_monitor import FleetMonitor
from tui_gcs.core.flight.flights import FlightTable
from tui_gcs.core.guard.guard import Guard

FIX = (0, 0, 0, 0, 0, 0, 0, 100, 0)


@pytest.mark.parametrize(
    ("error_m", "seen"), [(math.nan, 0), (9.0, 0), (35.0, 1), (math.inf, 1)], ids=["unknown", "good", "bad", "no fix"]
)
@pytest.mark.parametrize("east", [True, False], ids=["east", "north"])
def test_a_degraded_position_is_taken_for_as_near_as_it_may_be(error_m: float, seen: int, *, east: bool) -> None:
    """40 m beside another, at one height; a third is so far away that its own error does not matter."""
    monitor = FleetMonitor(Guard(scenario(2).limits, scenario(2).rounds[0].area, ()), FlightTable({}))
    places = [(100.0, 180.0, 20.0), (140.0, 180.0, 20.0) if east else (100.0, 220.0, 20.0), (1000.0, 1000.0, 20.0)]
    flying = [
        a_vehicle(number, fix=FIX, armed=True, landed_state=2, position_m=place)
        for number, place in enumerate(places, 1)
    ]
    flying[1].integrity.position_error_m = error_m
    flying[2].integrity.position_error_m = 12.0
    monitor.look(flying)
    assert monitor.violations == seen
    assert monitor.min_separation_m == pytest.approx(40.0), "as the positions were told"
