"""How each autopilot transports parameters: how values are encoded, and how all of them can be read at once."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4, sends_integers_bytewise

if TYPE_CHECKING:
    from tui_gcs.core.fleet.vehicle import Vehicle  # readers of parameter files need none, nor the links behind it

CAPABILITY_ENCODE_BYTEWISE, CAPABILITY_FTP, CAPABILITY_ENCODE_C_CAST = 16, 32, 131072
"""MAV_PROTOCOL_CAPABILITY."""


class Encoding(StrEnum):
    """How a whole number is put into the float of PARAM_VALUE."""

    BYTEWISE = "bytewise"
    """The float holds its bytes."""
    C_CAST = "C cast"
    """The float has its value."""


@dataclass(frozen=True)
class DownloadWays:
    """How all parameters of a vehicle can be read; PARAM_REQUEST_LIST always works."""

    packed: tuple[str, ...]
    """Files that hold them all, in order of preference."""
    hash_name: str
    """A parameter that is a checksum of all others; "" if there is none."""


def hash_name(vehicle: "Vehicle") -> str:
    """The parameter that is a checksum of all others; "" if the autopilot has none."""
    return "_HASH_CHECK" if vehicle.autopilot == AUTOPILOT_PX4 else ""


def describes_parameters(vehicle: "Vehicle") -> bool:
    """Whether the autopilot serves meaning and range of its parameters; no ArduPilot does."""
    return vehicle.autopilot == AUTOPILOT_PX4


def encoding(vehicle: "Vehicle", capabilities: Callable[[], int]) -> Encoding:
    """The encoding, by autopilot; by capability for all others."""
    # Neither autopilot always sets the capability bit (docs/autopilots.md C4).
    if sends_integers_bytewise(vehicle.autopilot):
        return Encoding.BYTEWISE
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT:
        return Encoding.C_CAST
    bits = capabilities()
    bytewise = bits & CAPABILITY_ENCODE_BYTEWISE and not bits & CAPABILITY_ENCODE_C_CAST
    return Encoding.BYTEWISE if bytewise else Encoding.C_CAST


def download_ways(vehicle: "Vehicle", capabilities: int) -> DownloadWays:
    """The ways to read all parameters of this vehicle."""
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT:
        return DownloadWays(("@PARAM/param.pck?withdefaults=1", "@PARAM/param.pck"), "")
    packed = ("@PARAM/param.pck",) if capabilities & CAPABILITY_FTP else ()
    return DownloadWays(packed, hash_name(vehicle))
