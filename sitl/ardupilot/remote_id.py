"""ArduPilot's Remote ID (AP_OpenDroneID): what a station must send before the vehicle arms, and its transmitter.

As in ArduPilot's source, with its texts. With DID_OPTIONS 1 it requires BASIC_ID, an operator location in SYSTEM, an
ARM_STATUS of a transmitter, and a SYSTEM younger than 3 s. DID_ENABLE counts from the boot on. A transmitter exists if
DID_MAVPORT names a port; it permits arming once it knows the operator location, as ArduPilot's own firmware for
transmitters does.
"""

from sitl.common.autopilot import Handler
from sitl.common.outbox import Fields
from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity
from sitl.links.wire import ReceivedFrame

OLD_US = 3_000_000
"""A SYSTEM older than this does not permit arming."""
LOST_US = 5_000_000
"""Silence after which the missing operator location is reported, and the time between two reports."""
ARM_STATUS_US = 1_000_000
ENFORCE_ARMING = 1
"""Bit of DID_OPTIONS: without a working Remote ID the vehicle does not arm."""


class RemoteId(Part):
    """What stations have sent since the boot, and the transmitter's reports."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self._on = platform.params["DID_ENABLE"] > 0
        self._id_type = 0
        self._operator_place = (0, 0)
        self._system_us: int | None = None
        self._complained_us = 0
        self._status_us = 0
        """When the transmitter sends its next ARM_STATUS."""

    def handlers(self) -> dict[str, Handler]:
        """Return the handlers of this service."""
        names = ("OPEN_DRONE_ID_BASIC_ID", "OPEN_DRONE_ID_SYSTEM", "OPEN_DRONE_ID_SYSTEM_UPDATE")
        return dict.fromkeys(names, self._hear)

    def _hear(self, frame: ReceivedFrame) -> None:
        if not self._on:
            return
        if frame.name == "OPEN_DRONE_ID_BASIC_ID":
            self._id_type = frame.fields["id_type"]
            return
        self._operator_place = frame.fields["operator_latitude"], frame.fields["operator_longitude"]
        if frame.name == "OPEN_DRONE_ID_SYSTEM" or self._system_us is not None:
            self._system_us = self._clock.now_us

    def watch(self) -> None:
        """Complain about a missing operator location, and let the transmitter report."""
        if not self._on:
            return
        now_us = self._clock.now_us
        silent_since_us = self._clock.power_on_us if self._system_us is None else self._system_us
        if min(now_us - silent_since_us, now_us - self._complained_us) > LOST_US:
            self._complained_us = now_us
            self._outbox.text(MavSeverity.WARNING, "ODID: lost operator location")
        if self._has_transmitter and now_us >= self._status_us:
            self._status_us = now_us + ARM_STATUS_US
            self._streams.send_once("OPEN_DRONE_ID_ARM_STATUS")

    def arm_status(self) -> Fields | None:
        """Return the transmitter's OPEN_DRONE_ID_ARM_STATUS, which ArduPilot passes on."""
        if not self._has_transmitter:
            return None
        why = "" if any(self._operator_place) else "missing operator location"
        return {"status": int(bool(why)), "error": why.encode()}

    def problem(self) -> str:
        """Return why the vehicle must not be armed, or ""."""
        if not int(self._params["DID_OPTIONS"]) & ENFORCE_ARMING:
            return ""
        problems = {
            "DID_ENABLE must be 1": not self._params["DID_ENABLE"],
            "UA_TYPE required in BasicID": not self._id_type,
            "operator location must be set": not any(self._operator_place),
            "ARM_STATUS not available": not self._has_transmitter,
            "SYSTEM not available": self._system_us is None or self._clock.now_us - self._system_us > OLD_US,
        }
        return next((f"OpenDroneID: {why}" for why, present in problems.items() if present), "")

    @property
    def _has_transmitter(self) -> bool:
        return self._on and self._params["DID_MAVPORT"] >= 0
