"""Detections: targets that a vehicle's own sensors found, from MAVLink.

One CAMERA_TRACKING_GEO_STATUS (276, common.xml) is one detection, from the vehicle's autopilot or from any other of its
components (a companion computer, MAV_COMP_ID_CAMERA…):

    tracking_status   1 (ACTIVE); anything else is no detection
    lat, lon          the target, degrees * 1e7
    alt               above mean sea level, metres; NaN: on the scenario's ground
    h_acc, v_acc      standard deviation of the place, metres; NaN or 0: `DEFAULT_SIGMA_M`
    vel_n, vel_e, vel_d, vel_acc   velocity and its standard deviation; NaN: not measured

The message does not identify its target: `core/fleet/tracks.py` associates detections with targets. A detection counts
as made when it arrives, because a vehicle's clock is never compared with the station's.
"""

import math
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.fleet import Fields, VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import Vec3

MESSAGE = "CAMERA_TRACKING_GEO_STATUS"
TRACKING_ACTIVE = 1
"""CAMERA_TRACKING_STATUS_FLAGS_ACTIVE."""
# Taken where a detector reports no accuracy: that of an ordinary GPS, by which it knows its own place.
DEFAULT_SIGMA_M = 5.0
# Reported values are kept within these: a forged one must not outweigh all other detections.
MIN_SIGMA_M, MAX_SIGMA_M = 0.5, 100.0
DEFAULT_SPEED_SIGMA_M_S = 3.0
# Faster than any aircraft at the heights of a small fleet: a damaged or forged message.
MAX_SPEED_M_S = 300.0
MAX_RANGE_M = 10_000.0
"""A detection farther from its vehicle is implausible."""
MAX_HEIGHT_M = 20_000.0
MAX_DETECTIONS_PER_S = 100
"""Detections taken of one vehicle in a second."""


@dataclass(frozen=True)
class Detection:
    """A target as one vehicle detects it now."""

    t_s: float
    vehicle: int
    position_m: Vec3
    """ENU about the origin, z above the scenario's ground."""
    sigma_m: float
    """Standard deviation of the place, metres, east and north alike."""
    sigma_z_m: float
    velocity_m_s: Vec3 | None
    sigma_m_s: float


class DetectionDecoder:
    """Decodes messages to detections; refused ones are counted in `dropped`."""

    def __init__(self, fleet: VehicleRegistry, clock: Clock, take: Callable[[Detection], None]) -> None:
        """`take` is called with every good detection, in order of arrival."""
        self.dropped: Counter[str] = Counter()
        self._fleet = fleet
        self._clock = clock
        self._take = take
        self._recent: dict[int, deque[float]] = {}
        fleet.on_message_of_any_component(MESSAGE, self._heard)

    def _heard(self, vehicle: Vehicle, _component: int, fields: Fields) -> None:
        if fields["tracking_status"] != TRACKING_ACTIVE:
            return
        now = self._clock.now()
        problem = self._problem(vehicle, now)
        detection = None if problem else self._detection(vehicle, fields, now)
        if detection is None:
            self.dropped[problem or "detection that makes no sense"] += 1
        else:
            self._take(detection)

    def _problem(self, vehicle: Vehicle, now: float) -> str:
        if vehicle.why_not_commanded:
            return "detection of a vehicle that is not trusted"
        if not vehicle.telemetry.has_position():
            return "detection of a vehicle without a position"
        recent = self._recent.setdefault(vehicle.id, deque(maxlen=MAX_DETECTIONS_PER_S))
        if len(recent) == MAX_DETECTIONS_PER_S and now - recent[0] < 1.0:
            return "detections too fast"
        recent.append(now)
        return ""

    def _detection(self, vehicle: Vehicle, fields: Fields, now: float) -> Detection | None:
        lat_deg, lon_deg = fields["lat"] / 1e7, fields["lon"] / 1e7
        if abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0 or (lat_deg == 0.0 and lon_deg == 0.0):
            return None
        east_m, north_m = self._fleet.frame.to_enu(lat_deg, lon_deg)
        up_m = fields["alt"] - self._fleet.frame.origin.ground_amsl_m if math.isfinite(fields["alt"]) else 0.0
        range_m = math.hypot(east_m - vehicle.telemetry.position_m[0], north_m - vehicle.telemetry.position_m[1])
        if range_m > MAX_RANGE_M or abs(up_m) > MAX_HEIGHT_M:
            return None
        velocity = (fields["vel_e"], fields["vel_n"], -fields["vel_d"])
        if math.hypot(*velocity) > MAX_SPEED_M_S:  # False for NaN
            return None
        return Detection(
            now,
            vehicle.id,
            (east_m, north_m, up_m),
            _sigma(fields["h_acc"], DEFAULT_SIGMA_M),
            _sigma(fields["v_acc"], DEFAULT_SIGMA_M),
            velocity if all(map(math.isfinite, velocity)) else None,
            _sigma(fields["vel_acc"], DEFAULT_SPEED_SIGMA_M_S),
        )


def _sigma(reported: float, default: float) -> float:
    return min(max(reported, MIN_SIGMA_M), MAX_SIGMA_M) if math.isfinite(reported) and reported > 0.0 else default
