"""The vehicles that missions are planned for: start, battery, altitude layer, autopilot."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from tui_gcs.core.missions.timed_path import HomePosition
from tui_gcs.core.protocol.common import Freshness, Phase, VehicleRow
from tui_gcs.core.scenario.model import Scenario

MOVED_M = 2.0
"""A vehicle on the ground that is reported elsewhere by less than this has not moved: GPS noise makes no new plan."""
BATTERY_STEP_PCT = 1.0
DEFAULT_HEIGHT_M = 30.0


@dataclass(frozen=True)
class PlannedVehicle:
    """One vehicle, as far as planning needs it."""

    home: HomePosition
    layer_m: float = DEFAULT_HEIGHT_M
    battery_pct: float = 100.0
    autopilot: str = ""


def planned_vehicles(
    scenario: Scenario, rows: Iterable[VehicleRow], before: Mapping[int, PlannedVehicle] | None = None
) -> dict[int, PlannedVehicle]:
    """Return the vehicles of the scenario and those that are received, by id.

    One that stands on the ground starts there. One that flies, or is not received, starts where the scenario has it.
    What has hardly changed since `before` stays as it was.
    """
    before = before or {}
    ground_m = scenario.origin.ground_amsl_m
    named = {place.vehicle: place for place in scenario.places if place.vehicle is not None}
    heard = {row.id: row for row in rows}
    ids = sorted({*named, *heard, *(vehicle for team in scenario.teams for vehicle in team.vehicles)})
    waiting = [place for place in scenario.places if place.vehicle is None]
    found = {}
    for vehicle in ids:
        place = named.get(vehicle) or (waiting.pop(0) if waiting else None)
        home = HomePosition(place.place_m, ground_m) if place is not None else HomePosition((0.0, 0.0), ground_m)
        layer_m = place.layer_m if place is not None else DEFAULT_HEIGHT_M
        member = PlannedVehicle(home, layer_m)
        row = heard.get(vehicle)
        found[vehicle] = member if row is None else _heard(member, row, before.get(vehicle, member))
    return found


def _heard(planned: PlannedVehicle, row: VehicleRow, before: PlannedVehicle) -> PlannedVehicle:
    home = planned.home
    x, y, _ = row.position_m
    stands = row.phase is Phase.GROUND and not row.armed and row.freshness is not Freshness.LOST
    if stands and math.isfinite(x) and math.isfinite(y):
        amsl_m = row.alt_amsl_m if math.isfinite(row.alt_amsl_m) else home.amsl_m
        # Rounded: a home that changes with every report would make a new forecast each time.
        home = HomePosition((round(x, 1), round(y, 1)), round(amsl_m, 1))
    # A home that moves with GPS noise would make a new forecast every second.
    still = math.dist(home.place_m, before.home.place_m) < MOVED_M
    if still and abs(home.amsl_m - before.home.amsl_m) < MOVED_M:
        home = before.home
    battery_pct = row.battery_pct if math.isfinite(row.battery_pct) else 100.0
    if abs(battery_pct - before.battery_pct) < BATTERY_STEP_PCT:
        battery_pct = before.battery_pct
    return PlannedVehicle(home, planned.layer_m, battery_pct, row.autopilot)
