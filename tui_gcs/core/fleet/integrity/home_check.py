"""Home check: whether a reported home can be the vehicle's home (docs/threats.md B.6-64).

The autopilot's own return flies there and its heights are counted from there, so a change in flight is always reported.
"""

import math

from tui_gcs.core.fleet.vehicle import Vehicle

MAX_DISTANCE_M = 50_000.0
"""No vehicle is farther from its home; the first home that is reported must be nearer."""
MAX_MOVE_IN_FLIGHT_M = 1_000.0
"""A home that moves farther in flight, and not to about where the vehicle is, is a mistake or a forgery."""
MIN_REPORTED_MOVE_M, MIN_REPORTED_CLIMB_M = 5.0, 2.0
"""Smaller changes (metres horizontally, vertically) are not reported: homes are set from GPS."""


def refusal(vehicle: Vehicle, x_m: float, y_m: float) -> str:
    """Return why a home at this ENU place is not believed, for the operator; "" if it is.

    The home that was believed before stays while the vehicle is armed: it is where it took off.
    """
    away_m = math.dist((x_m, y_m), vehicle.telemetry.position_m[:2]) if vehicle.telemetry.has_position() else 0.0
    moved_m = _moved_m(vehicle, x_m, y_m)
    if away_m > MAX_DISTANCE_M or (
        vehicle.telemetry.armed and moved_m > MAX_MOVE_IN_FLIGHT_M and away_m > MAX_MOVE_IN_FLIGHT_M
    ):
        return f"reports a home {away_m / 1e3:.0f} km away: not used; its own return would fly there"
    return ""


def change(vehicle: Vehicle, x_m: float, y_m: float, amsl_m: float) -> str:
    """Return what the operator must know when the home of a flying vehicle moves to this place; "" if nothing."""
    moved_m, up_m = _moved_m(vehicle, x_m, y_m), amsl_m - vehicle.telemetry.home_amsl_m
    if not vehicle.telemetry.airborne or not (moved_m > MIN_REPORTED_MOVE_M or abs(up_m) > MIN_REPORTED_CLIMB_M):
        return ""
    return f"its home moved {moved_m:.0f} m, {up_m:+.0f} m in height: its return and its heights count from there"


def _moved_m(vehicle: Vehicle, x_m: float, y_m: float) -> float:
    return math.dist((x_m, y_m), vehicle.telemetry.home_m[:2]) if vehicle.telemetry.home_m is not None else 0.0
