"""How each autopilot says parameters: as which bits, and which ways there are to get all of them at once."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4

if TYPE_CHECKING:
    from tui_gcs.core.fleet.vehicle import Vehicle  # readers of parameter files need none, nor the links behind it

CAPABILITY_ENCODE_BYTEWISE, CAPABILITY_FTP, CAPABILITY_ENCODE_C_CAST = 16, 32, 131072
"""MAV_PROTOCOL_CAPABILITY."""


class Encoding(StrEnum):
    """What a whole number looks like in the float of PARAM_VALUE."""

    BYTEWISE = "bytewise"
    """Its bytes are put there."""
    C_CAST = "C cast"
    """The float has its value."""


@dataclass(frozen=True)
class Ways:
    """How all parameters of a vehicle can be had; PARAM_REQUEST_LIST always works."""

    packed: tuple[str, ...]
    """Files that hold them all, in order of preference."""
    hash_name: str
    """A parameter that is a checksum of all others; "" if there is none."""


def hash_name(vehicle: "Vehicle") -> str:
    """The parameter that is a checksum of all others; "" if the autopilot has none."""
    return "_HASH_CHECK" if vehicle.autopilot == AUTOPILOT_PX4 else ""


def encoding(vehicle: "Vehicle", capabilities: Callable[[], int]) -> Encoding:
    """By autopilot, for neither always sets the bit (docs/autopilots.md C4); by capability for all others."""
    if vehicle.autopilot == AUTOPILOT_PX4:
        return Encoding.BYTEWISE
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT:
        return Encoding.C_CAST
    bits = capabilities()
    bytewise = bits & CAPABILITY_ENCODE_BYTEWISE and not bits & CAPABILITY_ENCODE_C_CAST
    return Encoding.BYTEWISE if bytewise else Encoding.C_CAST


def ways(vehicle: "Vehicle", capabilities: int) -> Ways:
    """ArduPilot packs them with their defaults (0.4 s for 1350); PX4 tells a checksum, and may pack them since 2026."""
    if vehicle.autopilot == AUTOPILOT_ARDUPILOT:
        return Ways(("@PARAM/param.pck?withdefaults=1", "@PARAM/param.pck"), "")
    packed = ("@PARAM/param.pck",) if capabilities & CAPABILITY_FTP else ()
    return Ways(packed, hash_name(vehicle))
