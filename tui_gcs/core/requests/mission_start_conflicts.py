"""Missions that would meet: checked before the station lets vehicles fly what they hold.

Two real ArduCopters on one mission met at 0 m, and nothing had warned at the start. Missions that begin together are
compared in space and time. One that begins while another is flown is compared in space only, because it is not known to
the second how far the other one is. Only missions that were read or put on board are known; in flight
`flight.mission_separation` watches all.
"""

import math

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flights import TakenOut
from tui_gcs.core.missions.mission_conflicts import ComparablePath, comparable, conflict_between
from tui_gcs.core.missions.performance import Performance
from tui_gcs.core.missions.timed_path import HomePosition, timed_path
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.requests.views import home_amsl_m
from tui_gcs.core.station.assembly import StationParts


def mission_conflict(parts: StationParts, vehicle: Vehicle, starts: tuple[int, ...]) -> str:
    """Why this vehicle's mission must not begin with those of `starts`, or beside those that are flown now; or ""."""
    own = _path(parts, vehicle)
    if own is None:
        return ""
    limits = parts.flight.guard.limits
    flown = {f.vehicle for f in parts.flight.flights.in_phase(Phase.TAKEN_OUT) if f.step is TakenOut.ON_BOARD}
    for number in sorted({*starts, *flown} - {vehicle.id}):
        other = parts.picture.fleet.vehicles.get(number)
        path = _path(parts, other) if other is not None else None
        if path is None:
            continue
        met = conflict_between(
            vehicle.id, number, own, path, limits.separation_horizontal_m, limits.separation_vertical_m
        )
        if met is not None and met.together and number in starts:
            return f"it would come within {met.horizontal_m:.0f} m of vehicle {number} after {met.first_s:.0f} s"
        if met is not None and number in flown:
            return f"its way meets that of vehicle {number}, which is on its mission, at {met.horizontal_m:.0f} m"
    return ""


def _path(parts: StationParts, vehicle: Vehicle) -> ComparablePath | None:
    """The mission that it holds, from where it is now; None if that is not known, or the vehicle has no position."""
    held = parts.services.missions.state(vehicle.id).held[PlanKind.MISSION]
    if not held.known or held.plan is None or not vehicle.telemetry.has_position():
        return None
    amsl_m = home_amsl_m(parts, vehicle)
    if not math.isfinite(amsl_m):
        return None
    east_m, north_m, _ = vehicle.telemetry.position_m
    limits = parts.flight.guard.limits
    performance = Performance(speed_m_s=limits.speed_m_s, accel_m_s2=limits.accel_m_s2)
    path = timed_path(
        held.plan.items,
        HomePosition((east_m, north_m), amsl_m, vehicle.telemetry.alt_rel_m),
        parts.picture.fleet.frame,
        performance,
    )
    return None if path.is_empty else comparable(path)
