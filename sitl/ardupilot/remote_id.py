"""ArduPilot's Remote ID (AP_OpenDroneID): what its station must have told before it arms, and its transmitter.

As in ArduPilot's source, with its texts: with DID_OPTIONS 1 it wants BASIC_ID, a place in SYSTEM, ARM_STATUS of a
transmitter and a SYSTEM younger than 3 s. DID_ENABLE counts from the boot on. A transmitter is there if DID_MAVPORT
names a port; it lets arm who told where the operator stands, as ArduPilot's own transmitter firmware does.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sitl.common.states import Severity

if TYPE_CHECKING:
    from sitl.ardupilot.copter import ArduCopter
    from sitl.links.wire import Received

Fields = dict[str, Any]

OLD_US = 3_000_000
LOST_US = 5_000_000
"""After so long without SYSTEM it complains, every so long."""
ARM_STATUS_US = 1_000_000
ENFORCE_ARMING = 1
"""DID_OPTIONS, bit 0."""


@dataclass
class RemoteId:
    """What was heard since the boot."""

    on: bool = False
    id_type: int = 0
    place: tuple[int, int] = (0, 0)
    system_us: int | None = None
    complained_us: int = 0
    status_us: int = 0
    """When the transmitter says its next ARM_STATUS."""


def heard(ap: "ArduCopter", frame: "Received") -> None:
    """OPEN_DRONE_ID_BASIC_ID, …_SYSTEM or …_SYSTEM_UPDATE of a station."""
    store = ap.stores.remote_id
    if not store.on:
        return
    if frame.name == "OPEN_DRONE_ID_BASIC_ID":
        store.id_type = frame.fields["id_type"]
        return
    store.place = frame.fields["operator_latitude"], frame.fields["operator_longitude"]
    if frame.name == "OPEN_DRONE_ID_SYSTEM" or store.system_us is not None:
        store.system_us = ap.now_us


def watch(ap: "ArduCopter") -> None:
    """What it says of it unasked."""
    store = ap.stores.remote_id
    if not store.on:
        return
    silent_since_us = ap.power_on_us if store.system_us is None else store.system_us
    if min(ap.now_us - silent_since_us, ap.now_us - store.complained_us) > LOST_US:
        store.complained_us = ap.now_us
        ap.text(Severity.WARNING, "ODID: lost operator location")
    if _has_transmitter(ap) and ap.now_us >= store.status_us:
        store.status_us = ap.now_us + ARM_STATUS_US
        ap.once.append("OPEN_DRONE_ID_ARM_STATUS")


def arm_status(ap: "ArduCopter") -> Fields | None:
    """OPEN_DRONE_ID_ARM_STATUS, as it passes its transmitter's on."""
    if not _has_transmitter(ap):
        return None
    why = "" if any(ap.stores.remote_id.place) else "missing operator location"
    return {"status": int(bool(why)), "error": why.encode()}


def problem(ap: "ArduCopter") -> str:
    """Why it does not arm, or ""."""
    if not int(ap.params["DID_OPTIONS"]) & ENFORCE_ARMING:
        return ""
    store = ap.stores.remote_id
    if not ap.params["DID_ENABLE"]:
        why = "DID_ENABLE must be 1"
    elif not store.id_type:
        why = "UA_TYPE required in BasicID"
    elif not any(store.place):
        why = "operator location must be set"
    elif not _has_transmitter(ap):
        why = "ARM_STATUS not available"
    elif store.system_us is None or ap.now_us - store.system_us > OLD_US:
        why = "SYSTEM not available"
    else:
        return ""
    return f"OpenDroneID: {why}"


def _has_transmitter(ap: "ArduCopter") -> bool:
    return ap.stores.remote_id.on and ap.params["DID_MAVPORT"] >= 0
