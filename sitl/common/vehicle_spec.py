"""The description of one simulated vehicle, from which everything else about it is made."""

from dataclasses import dataclass, field
from typing import Literal

from sitl.links.signing import SigningSpec

AutopilotName = Literal["ardupilot", "px4"]


@dataclass(frozen=True)
class VehicleSpec:
    """One simulated vehicle: its system id, its start place, its autopilot."""

    system_id: int
    lat_deg: float
    lon_deg: float
    ground_amsl_m: float
    heading_deg: float = 0.0
    signing: SigningSpec = field(default_factory=SigningSpec)
    autopilot: AutopilotName = "ardupilot"
    unix_epoch_us: int = 1_700_000_000_000_000
    """GPS time at the start of the run, microseconds since 1970."""
    sitl_rates: bool = False
    """PX4: send at the rates of its SITL start script (368 frames/s) instead of those of a telemetry radio."""
