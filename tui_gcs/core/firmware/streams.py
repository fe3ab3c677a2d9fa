"""Which telemetry each autopilot refuses to send, or has no use for: it is not requested."""

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4

ARDUPILOT_ONLY = frozenset({65, 168, 193})
"""RC_CHANNELS: only there an absent pilot's stick is flown (and PX4 sends none without RC). WIND and EKF_STATUS_REPORT:
PX4 refuses to send them."""
PX4_ONLY = frozenset({230, 231})
"""ESTIMATOR_STATUS and WIND_COV: ArduPilot refuses to send them."""
_ANY_OTHER = ARDUPILOT_ONLY | PX4_ONLY
_NOT_FOR = {AUTOPILOT_ARDUPILOT: PX4_ONLY, AUTOPILOT_PX4: ARDUPILOT_ONLY}


def unwanted_messages(vehicle: Vehicle) -> frozenset[int]:
    """Ids of messages that are not requested from this vehicle."""
    return _NOT_FOR.get(vehicle.autopilot, _ANY_OTHER)
