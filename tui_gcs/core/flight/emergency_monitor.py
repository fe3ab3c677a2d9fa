"""Emergency monitor: vehicles that fall, lie over, have hit the ground, or stand armed where no landing was ordered.

It reads telemetry alone, because an autopilot may report nothing: a real ArduCopter whose motor failed at 34 m stayed
in GUIDED, armed and "in the air", and was on the ground at 12.9 m/s after 4 s.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from tui_gcs.core.firmware.foreign_command_policy import comes_down_by
from tui_gcs.core.fleet.telemetry import struct_reader
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flights import Flight, FlightTable, HoldStep
from tui_gcs.core.protocol.common import Freshness, Phase

MAX_SINK_M_S, SINK_BAND_M_S = 6.0, 4.0
"""No vehicle descends faster than this on purpose: WPNAV_SPEED_DN is 5 m/s at most, MPC_Z_VEL_MAX_DN 4 m/s. A fall is
over when the vehicle is slower by the second number."""
MAX_TILT_DEG = 60.0
"""PX4's FD_FAIL_R and FD_FAIL_P; ArduCopter leans by 30 degrees at most (ANGLE_MAX)."""
BEYOND_S = 0.35
"""Descent or attitude must be beyond its limit for this long: one wrong message is no emergency (PX4's FD_FAIL_R_TTRI
is 0.3 s)."""
RECOVERED_S = 3.0
"""A vehicle that keeps its height again for this long has recovered."""
STILL_M_S = 1.0
"""A vehicle slower than this does not fall any more."""
IMPACT_M = 5.0
"""Where its fall ends below this height above home it has hit the ground."""
GROUND_M, GROUND_STILL_M_S, GROUND_S = 1.0, 0.5, 2.0
"""So low, so slow and for so long: it stands on the ground. No course leads below `steering.MIN_HOVER_M`."""
OWN_LANDING_S = 10.0
"""One that came down in a mode that lands it, by its own failsafe perhaps, disarms by itself: PX4 2 s after it has
detected the ground (COM_DISARM_LAND), ArduPilot when its motors have been at their least for some seconds."""
# Message id. On slow links ATTITUDE is seldom sent: an old one must not be taken for the attitude of now.
ATTITUDE, MAX_ATTITUDE_AGE_S = 30, 1.0
_ANGLES = struct_reader("4xff")
"""Roll and pitch of ATTITUDE, radians."""
_ALOFT = frozenset({Phase.FLYING, Phase.HOLDING, Phase.BY_HAND, Phase.RETURNING})
"""Phases in which a vehicle is in the air, and no landing has been ordered."""

EmergencyKind = Literal["falling", "attitude", "impact", "grounded"]
"""Also the ids of their alarms (`alarms.causes`)."""


@dataclass(frozen=True)
class Emergency:
    """What is wrong with one vehicle."""

    kind: EmergencyKind
    text: str


@dataclass
class _ArmedWatch:
    """What was seen of one armed vehicle."""

    sinks_since_s: float = math.nan
    tilts_since_s: float = math.nan
    stands_since_s: float = math.nan
    calm_since_s: float = math.nan
    worst_sink_m_s: float = 0.0
    """Its fastest descent since it began to fall."""


class EmergencyMonitor:
    """Looks at all armed vehicles; `found` holds the emergencies that last."""

    def __init__(self, flights: FlightTable, give_up: Callable[[Vehicle, str], None]) -> None:
        """`give_up` is called when an emergency begins, with its vehicle and text."""
        self._flights, self._give_up = flights, give_up
        self._watches: dict[int, _ArmedWatch] = {}
        self.found: dict[int, Emergency] = {}
        """By vehicle."""

    def look(self, vehicles: Mapping[int, Vehicle], now: float) -> dict[int, Emergency]:
        """Bring `found` up to date and return it; to be called some times a second."""
        for vehicle in vehicles.values():
            if not vehicle.telemetry.armed:
                self._watches.pop(vehicle.id, None)
                self.found.pop(vehicle.id, None)
            elif vehicle.freshness(now) is Freshness.OK:
                self._look(vehicle, now)
        return self.found

    def _look(self, vehicle: Vehicle, now: float) -> None:
        watch = self._watches.setdefault(vehicle.id, _ArmedWatch())
        flight, before = self._flights.get(vehicle.id), self.found.get(vehicle.id)
        found = _falls(vehicle, watch, now) or _tilts(vehicle, watch, now) or _stands(vehicle, flight, watch, now)
        if found is None and before is not None:
            found = _goes_on(vehicle, before, watch, now)
        if found is None:
            self.found.pop(vehicle.id, None)
            return
        watch.calm_since_s = watch.calm_since_s if found is before else math.nan
        self.found[vehicle.id] = found
        if before is None or before.kind != found.kind:
            if found.kind == "impact":
                vehicle.reboot_first = found.text
            self._give_up(vehicle, found.text)


def _falls(vehicle: Vehicle, watch: _ArmedWatch, now: float) -> Emergency | None:
    sinks_m_s, fell = -vehicle.telemetry.velocity_m_s[2], watch.worst_sink_m_s > 0.0
    # `not >` also covers NaN: a vehicle that does not report its velocity.
    if not sinks_m_s > MAX_SINK_M_S - SINK_BAND_M_S * fell:
        watch.sinks_since_s = math.nan
        return None
    watch.sinks_since_s = now if math.isnan(watch.sinks_since_s) else watch.sinks_since_s
    if now - watch.sinks_since_s < BEYOND_S and not fell:
        return None
    watch.worst_sink_m_s = max(watch.worst_sink_m_s, sinks_m_s)
    return Emergency("falling", f"{sinks_m_s:.0f} m/s down at {vehicle.telemetry.alt_rel_m:.0f} m")


def _goes_on(vehicle: Vehicle, before: Emergency, watch: _ArmedWatch, now: float) -> Emergency | None:
    """What is left of an emergency of which nothing new is seen; None once the vehicle flies as it should."""
    if before.kind in ("impact", "grounded"):
        # Until it is disarmed, or flies again.
        return None if vehicle.telemetry.alt_rel_m > IMPACT_M else before
    watch.calm_since_s = now if math.isnan(watch.calm_since_s) else watch.calm_since_s
    speed_m_s, still = watch.worst_sink_m_s, abs(vehicle.telemetry.velocity_m_s[2]) < STILL_M_S
    if speed_m_s > 0.0 and still and vehicle.telemetry.alt_rel_m < IMPACT_M:
        watch.worst_sink_m_s = 0.0
        return Emergency("impact", f"hit the ground at {speed_m_s:.0f} m/s")
    if now - watch.calm_since_s < RECOVERED_S:
        return before
    watch.worst_sink_m_s = 0.0
    return None


def _tilts(vehicle: Vehicle, watch: _ArmedWatch, now: float) -> Emergency | None:
    slot = vehicle.path.slots.get(ATTITUDE)
    # Poor links have no room for ATTITUDE.
    if slot is None or not slot.raw or now - slot.t_s > MAX_ATTITUDE_AGE_S:
        watch.tilts_since_s = math.nan
        return None
    roll_rad, pitch_rad = _ANGLES(slot)
    upright = math.cos(roll_rad) * math.cos(pitch_rad) if math.isfinite(roll_rad + pitch_rad) else 1.0
    tilt_deg = math.degrees(math.acos(upright))
    if tilt_deg <= MAX_TILT_DEG:
        watch.tilts_since_s = math.nan
        return None
    watch.tilts_since_s = slot.t_s if math.isnan(watch.tilts_since_s) else watch.tilts_since_s
    # Counted by its own messages, so that one wrong message is not taken for a state that lasts.
    if slot.t_s - watch.tilts_since_s < BEYOND_S:
        return None
    return Emergency("attitude", f"{tilt_deg:.0f} degrees off level")


def _stands(vehicle: Vehicle, flight: Flight | None, watch: _ArmedWatch, now: float) -> Emergency | None:
    """A vehicle on the ground that this station has in the air."""
    # One that was found in the air was brought there by another station, perhaps from a higher home.
    ends = (HoldStep.START_CANCELLED, HoldStep.TOUCHED_DOWN, HoldStep.FOUND)
    aloft = flight is not None and flight.phase in _ALOFT and flight.step not in ends
    low = vehicle.telemetry.on_ground or vehicle.telemetry.alt_rel_m < GROUND_M
    if not (aloft and low and math.hypot(*vehicle.telemetry.velocity_m_s) < GROUND_STILL_M_S):
        watch.stands_since_s = math.nan
        return None
    watch.stands_since_s = now if math.isnan(watch.stands_since_s) else watch.stands_since_s
    lands_itself = bool(comes_down_by(vehicle))
    if now - watch.stands_since_s < (OWN_LANDING_S if lands_itself else GROUND_S):
        return None
    mode = vehicle.mode_name
    return Emergency("grounded", f"it came down in {mode}" if lands_itself else "no landing was ordered")
