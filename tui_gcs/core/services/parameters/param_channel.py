"""What the parameter service and its jobs share: the tables of known values, and the requests to vehicles."""

import math
import struct
from collections.abc import Iterable

from tui_gcs.core.base.safe_files import FileRefused, SafeFolder
from tui_gcs.core.firmware import parameter_transport as firmware
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import Order
from tui_gcs.core.mavlink.frames import MAGIC_V2
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import WARNING
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.parameters.param_cache import CacheKey, ParamCache
from tui_gcs.core.services.parameters.param_values import Number, Parameter, ParamValueError, wire_value

PARAM_VALUE, AUTOPILOT_VERSION = 22, 148
# PARAM_REQUEST_READ.param_index: the name counts (common.xml).
BY_NAME = -1
HEADER_V1, HEADER_V2 = 6, 10
"""Length of a frame's header: the payload begins with `param_value`."""
MAX_NAMES = 4096
"""How many names are kept for one vehicle; real ones have about 900 to 1400 (docs/threats.md B.6-69)."""


class ParamTable:
    """The known parameters of one vehicle, by name: PX4's indices shift while it runs (docs/autopilots.md)."""

    def __init__(self) -> None:
        self.params: dict[str, Parameter] = {}
        self.complete = False
        """Whether all were fetched since the vehicle booted. What changed since then was reported, or set by us."""

    def put(self, param: Parameter) -> bool:
        """Store a reported value; a default that is known stays. False if there is no room."""
        before = self.params.get(param.name)
        if before is None and len(self.params) >= MAX_NAMES:
            return False
        # Only the packed file has defaults; a PARAM_VALUE must not remove a known one.
        if before is not None and before.default is not None and param.default is None and before.type == param.type:
            param = Parameter(param.name, param.value, param.type, before.default)
        self.params[param.name] = param
        return True

    def fill(self, params: Iterable[Parameter]) -> None:
        """Replace the table by a complete set."""
        self.params = {}
        for param in params:
            self.put(param)
        self.complete = True

    def forget(self) -> None:
        """Forget everything after a reboot: names and types may be different, and values the stored ones."""
        self.params, self.complete = {}, False


class ParamChannel:
    """Sends parameter requests to vehicles, and keeps their answers in tables."""

    def __init__(self, context: ServiceContext) -> None:
        self.context = context
        self._tables: dict[int, ParamTable] = {}
        self.cache = _open_cache(context)

    def table(self, vehicle: int) -> ParamTable:
        """The table of a vehicle, made empty when it is first asked for."""
        return self._tables.setdefault(vehicle, ParamTable())

    @property
    def now(self) -> float:
        """The station time in seconds."""
        return self.context.clock.now()

    def ask_name(self, vehicle: int, name: str) -> None:
        """Send PARAM_REQUEST_READ for a name."""
        self.context.uplink.ask(vehicle, "PARAM_REQUEST_READ", param_id=name, param_index=BY_NAME)

    def ask_index(self, vehicle: int, index: int) -> None:
        """Send PARAM_REQUEST_READ for an index."""
        self.context.uplink.ask(vehicle, "PARAM_REQUEST_READ", param_id="", param_index=index)

    def ask_list(self, vehicle: int) -> None:
        """Send PARAM_REQUEST_LIST to a vehicle."""
        self.context.uplink.ask(vehicle, "PARAM_REQUEST_LIST")

    def send_set(self, vehicle: int, param: Parameter, value: Number, *, again: bool) -> str:
        """Send PARAM_SET with the type that the vehicle reported. Returns "", or why it was not sent."""
        known = self.context.fleet.vehicles.get(vehicle)
        if known is None:
            return "unknown vehicle"
        if known.why_not_commanded:
            return known.why_not_commanded
        try:
            # The type must be the one that the vehicle reported: PX4 refuses another one.
            number = wire_value(param.type, value, self.encoding(known))
        except ParamValueError as error:
            return str(error)
        what, fields = f"parameter {param.name}", {"param_id": str(param.name), "param_type": int(param.type)}
        if again:
            sent = self.context.uplink.transfer(vehicle, what, "PARAM_SET", param_value=number, **fields)
            return "" if sent else "not sent"
        self.context.uplink.action(vehicle, Order(what), "PARAM_SET", param_value=number, **fields)
        return ""

    def ways(self, vehicle: Vehicle) -> firmware.DownloadWays:
        """The ways in which all parameters of the vehicle can be fetched."""
        return firmware.download_ways(vehicle, int(self.version(vehicle).get("capabilities", 0)))

    def cache_key(self, vehicle: Vehicle) -> CacheKey | None:
        """The key of its parameters in the cache; None if it has not reported its version and hardware id."""
        version = self.version(vehicle)
        if not vehicle.identity.uid or not version:
            return None
        words = [str(version["flight_sw_version"]), bytes(version["flight_custom_version"]).hex()]
        return CacheKey(vehicle.autopilot, " ".join(words), vehicle.identity.uid)

    def unreachable(self, vehicle: int) -> str:
        """Return why a request to that vehicle makes no sense, or ""."""
        known = self.context.fleet.vehicles.get(vehicle)
        if known is None:
            return "unknown vehicle"
        return "heard over a high-latency link: commands only" if known.path.high_latency else ""

    def encoding(self, vehicle: Vehicle) -> firmware.Encoding:
        """How the vehicle writes whole numbers into the float of PARAM_VALUE."""
        return firmware.encoding(vehicle, lambda: int(self.version(vehicle).get("capabilities", 0)))

    def version(self, vehicle: Vehicle) -> Fields:
        """The fields of its newest AUTOPILOT_VERSION; empty if none has been received."""
        newest = self.context.fleet.newest(vehicle, AUTOPILOT_VERSION)
        return newest.fields if newest is not None else {}

    def is_slow(self, vehicle: int) -> bool:
        """Whether the vehicle is reached over a telemetry radio, or a link as slow."""
        known = self.context.fleet.vehicles.get(vehicle)
        return known is not None and self.context.is_slow(known.link)


def value_bytes(vehicle: Vehicle, fields: Fields) -> bytes | None:
    """Return the 4 bytes of `param_value` in the PARAM_VALUE that is being handled; None if they are gone."""
    if not math.isnan(fields["param_value"]):
        return struct.pack("<f", fields["param_value"])
    # A float does not keep all bits of a NaN, which may be the bytes of a whole number: read them from the frame.
    slots = [path.slots[PARAM_VALUE] for path in vehicle.used_paths() if PARAM_VALUE in path.slots]
    newest = max(slots, key=lambda slot: slot.t_s, default=None)
    if newest is None or newest.fields()["param_id"] != fields["param_id"]:
        return None
    head = HEADER_V2 if newest.raw[0] == MAGIC_V2 else HEADER_V1
    return newest.raw[head : head + 4]


def _open_cache(context: ServiceContext) -> ParamCache | None:
    if context.folder is None:
        return None
    try:
        return ParamCache(SafeFolder(context.folder / "cache"))
    except FileRefused as error:
        context.events.report(EventClass.PROCESSING, "station", f"parameters are not kept: {error}", WARNING)
        return None
