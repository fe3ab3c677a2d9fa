"""Remote ID (OPEN_DRONE_ID_*): what a vehicle's transmitter sends, whether it may arm, and other aircraft.

A transmitter is a component of the vehicle (236-238) or part of its autopilot. Its own messages carry a zero
`id_or_mac`; a message with another value is about an aircraft that a receiver has received. The operator's messages are
sent by `operator_id`. Message packs are not read.
"""

from collections import Counter, OrderedDict
from dataclasses import dataclass

from tui_gcs.core.base.text import SafeText, clean
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import NAN, Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.services.context import ServiceContext

MAX_OTHERS = 256
OLD_S = 15.0
"""How long another aircraft is listed: Remote ID is repeated every 1 to 3 s."""
ID_BYTES = 20
GOOD_TO_ARM = 0
"""A value of MAV_ODID_ARM_STATUS."""
UNKNOWN_ALT_M = -1000.0
"""MAVLink's value for an unknown altitude."""


@dataclass
class RemoteId:
    """What one aircraft broadcasts by Remote ID; empty or NaN where it does not."""

    uas_id: str = ""
    operator_id: str = ""
    description: str = ""
    lat_deg: float = NAN
    lon_deg: float = NAN
    alt_m: float = NAN
    """Above the ellipsoid (WGS-84)."""
    operator_lat_deg: float = NAN
    operator_lon_deg: float = NAN
    component: int = 0
    """The component that sent it."""
    heard_by: int = 0
    """The vehicle whose receiver received it, for other aircraft."""
    seen_s: float = 0.0
    may_arm: bool | None = None
    """Whether its transmitter allows arming; None if it has not reported that."""
    arm_error: str = ""


class RemoteIdService:
    """Keeps the newest Remote ID of each vehicle, and of other aircraft."""

    def __init__(self, context: ServiceContext) -> None:
        """Take Remote ID messages of autopilots and transmitters."""
        self._context = context
        self._own_ids: dict[int, RemoteId] = {}
        self._others: OrderedDict[bytes, RemoteId] = OrderedDict()
        self.dropped: Counter[str] = Counter()
        handlers = {
            "OPEN_DRONE_ID_BASIC_ID": self._basic,
            "OPEN_DRONE_ID_LOCATION": self._location,
            "OPEN_DRONE_ID_SYSTEM": self._system,
            "OPEN_DRONE_ID_OPERATOR_ID": self._operator,
            "OPEN_DRONE_ID_SELF_ID": self._self_id,
            "OPEN_DRONE_ID_ARM_STATUS": self._arm_status,
        }
        for name, handler in handlers.items():
            context.fleet.on_message_of_any_component(name, handler)
        context.forget_with(self._forget, reboot=False)

    def of(self, vehicle: Vehicle) -> RemoteId | None:
        """The Remote ID of a vehicle's own transmitter, None if it has none."""
        return self._own_ids.get(vehicle.id)

    def why_not_arm(self, vehicle: Vehicle) -> str:
        """Return why its transmitter does not allow arming, or ""."""
        own = self._own_ids.get(vehicle.id)
        if own is None or own.may_arm is not False:
            return ""
        return f"Remote ID: {own.arm_error or 'not ready'}"

    def others(self) -> tuple[RemoteId, ...]:
        """Other aircraft that were received lately, newest last."""
        oldest_s = self._context.clock.now() - OLD_S
        return tuple(other for other in self._others.values() if other.seen_s >= oldest_s)

    def _basic(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        self._entry(vehicle, component, fields).uas_id = _id_text(fields["uas_id"])

    def _location(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        entry = self._entry(vehicle, component, fields)
        entry.lat_deg, entry.lon_deg = _place(fields["latitude"], fields["longitude"])
        entry.alt_m = _known(fields["altitude_geodetic"], UNKNOWN_ALT_M)

    def _system(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        entry = self._entry(vehicle, component, fields)
        place = _place(fields["operator_latitude"], fields["operator_longitude"])
        entry.operator_lat_deg, entry.operator_lon_deg = place

    def _operator(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        self._entry(vehicle, component, fields).operator_id = fields["operator_id"]

    def _self_id(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        self._entry(vehicle, component, fields).description = fields["description"]

    def _arm_status(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        entry = self._own(vehicle, component)
        before, entry.may_arm = entry.may_arm, fields["status"] == GOOD_TO_ARM
        error_before, entry.arm_error = entry.arm_error, clean(fields["error"], 60)
        if entry.may_arm == before and entry.arm_error == error_before:
            return
        if not entry.may_arm:
            self._report(vehicle, self.why_not_arm(vehicle), WARNING)
        elif before is False:
            self._report(vehicle, "Remote ID: ready", NOTICE)

    def _own(self, vehicle: Vehicle, component: int) -> RemoteId:
        entry = self._own_ids.setdefault(vehicle.id, RemoteId())
        entry.component, entry.seen_s = component, self._context.clock.now()
        return entry

    def _entry(self, vehicle: Vehicle, component: int, fields: Fields) -> RemoteId:
        """Return the entry that a message belongs to: the vehicle's own, or that of another aircraft."""
        address = bytes(fields["id_or_mac"])
        # A zero address marks the vehicle's own transmitter.
        if not any(address):
            return self._own(vehicle, component)
        others = self._others
        entry = others.setdefault(address, RemoteId())
        others.move_to_end(address)
        entry.component, entry.heard_by, entry.seen_s = component, vehicle.id, self._context.clock.now()
        # Anybody can broadcast any number of ids.
        while len(others) > MAX_OTHERS:
            others.popitem(last=False)
            self.dropped["Remote ID table full"] += 1
        return entry

    def _forget(self, vehicle: Vehicle) -> None:
        self._own_ids.pop(vehicle.id, None)

    def _report(self, vehicle: Vehicle, text: str, severity: int) -> None:
        self._context.events.report(EventClass.SENSOR, f"vehicle {vehicle.id}", text, severity, every_s=30)


def _id_text(raw: tuple[int, ...]) -> SafeText:
    """Decode an id: a serial number is text, other kinds of id are bytes and shown as hex digits."""
    data = bytes(raw).rstrip(b"\0")
    return clean(data, ID_BYTES) if data.isascii() and data.decode().isprintable() else SafeText(data.hex())


def _place(lat: int, lon: int) -> tuple[float, float]:
    """Latitude and longitude in degrees; NaN if unknown (0, 0) or impossible."""
    if (lat == 0 and lon == 0) or abs(lat) > 900_000_000 or abs(lon) > 1_800_000_000:
        return NAN, NAN
    return lat / 1e7, lon / 1e7


def _known(value: float, unknown: float) -> float:
    return value if value == value and value > unknown and abs(value) < 1e5 else NAN
