"""A vehicle disarmed: was that a landing, and was it expected? Pure functions."""

from tui_gcs.core.fleet.vehicle import LANDED_ON_GROUND, Vehicle
from tui_gcs.core.flight.flights import Flight, HoldStep, TakenOut
from tui_gcs.core.protocol.common import Phase

FALLING_M_S = 1.0
"""A vehicle that descends faster than this after it disarmed does not stand on the ground."""
LANDED_M = 2.0
"""A vehicle that disarms higher than this above home has not landed, whatever it was doing."""


def is_down(vehicle: Vehicle) -> bool:
    """Whether it is on the ground, or so low that a landing is over."""
    return vehicle.telemetry.on_ground or vehicle.telemetry.alt_rel_m < LANDED_M


def falls(flight: Flight, vehicle: Vehicle) -> bool:
    """Whether a vehicle that has just disarmed did so in the air.

    Its autopilot may report at once that it has landed, as ArduCopter does, but not that it stands.
    """
    telemetry = vehicle.telemetry
    reports_landed = telemetry.landed_state == LANDED_ON_GROUND and telemetry.velocity_m_s[2] > -FALLING_M_S
    return telemetry.alt_rel_m >= LANDED_M and not reports_landed and flight.step is not HoldStep.START_CANCELLED


def landing_words(flight: Flight, vehicle: Vehicle) -> tuple[str, bool]:
    """The event text for a vehicle that has disarmed, and whether that was expected."""
    by_itself = flight.phase is Phase.TAKEN_OUT and vehicle.telemetry.alt_rel_m < LANDED_M
    if flight.step is TakenOut.MOTORS_STOPPED:
        text = "motors stopped, as an operator ordered"
    elif falls(flight, vehicle):
        return f"DISARMED IN THE AIR, {vehicle.telemetry.alt_rel_m:.0f} m high: it falls", False
    elif flight.step is TakenOut.ON_BOARD and vehicle.telemetry.alt_rel_m < LANDED_M:
        text = "landed and disarmed by its mission on board"
    elif flight.step is TakenOut.OWN_MODE and vehicle.telemetry.alt_rel_m < LANDED_M:
        text = "landed and disarmed in the mode that was ordered"
    elif by_itself:
        text = "landed and disarmed by itself, or by its pilot"
    elif flight.step is HoldStep.START_CANCELLED:
        text = "start cancelled, disarmed"
    elif flight.step is HoldStep.TOUCHED_DOWN:
        text = "landed and disarmed, held on the ground"
    elif flight.phase is Phase.LANDING:
        text = "landed and disarmed"
    else:
        text = "DISARMED, no landing was ordered"
    cut_short = flight.step in (HoldStep.START_CANCELLED, HoldStep.TOUCHED_DOWN)
    return text, by_itself or flight.phase is Phase.LANDING or cut_short
