"""PARAM_*: how both autopilots list, read and set parameters (docs/autopilots.md "Parameters of ArduCopter")."""

from collections.abc import Callable

from sitl.common.autopilot import Handler
from sitl.common.parameters import HASH_NAME, REAL32, UINT32, ParameterEntry
from sitl.common.platform import Part, Platform
from sitl.common.tasks import Task
from sitl.links.wire import HEADER_V1_BYTES, HEADER_V2_BYTES, MAGIC_V2, ReceivedFrame

BY_NAME = 65535
"""param_index of ArduPilot's answers by name and to PARAM_SET, and of PX4's `_HASH_CHECK`."""
ARDUPILOT_INTERVAL_US = 700
"""ArduPilot sent 1327 parameters in 0.93 s."""
PX4_BATCH = 20
PX4_BATCH_US = 19_600
"""PX4 sends up to 20 parameters at once: 886 came in 0.87 s."""
PX4_AGAIN_US = 10_000
"""PX4 sends a changed value a second time without a request (5 to 20 ms later)."""
# PARAM_ERROR, which only PX4 sends (common.xml).
ERROR_DOES_NOT_EXIST, ERROR_READ_ONLY, ERROR_TYPE_MISMATCH = 1, 5, 7
GARBAGE_INDEX = -28848
"""param_index of PX4's PARAM_ERROR as recorded: PX4 leaves it uninitialised."""

_LIST = "parameter list"


def name_of(raw: bytes) -> str:
    """Return the name in a param_id."""
    return bytes(raw).split(b"\0", 1)[0].decode("ascii", "replace")


class ParameterServer(Part):
    """What both autopilots' parameter servers have in common."""

    _read: Handler
    _list: Handler
    _set: Handler
    """Handlers that each autopilot has of its own."""

    def handlers(self) -> dict[str, Handler]:
        """Return the handlers of this service."""
        return {"PARAM_REQUEST_READ": self._read, "PARAM_REQUEST_LIST": self._list, "PARAM_SET": self._set}

    def _send_value(self, message: str, name: str, value: float, kind: int, index: int) -> None:
        head = {"param_id": name.encode("ascii"), "param_count": len(self._params), "param_index": index}
        self._outbox.send(message, **head, param_value=value, param_type=kind)


class ArduPilotParameterServer(ParameterServer):
    """ArduPilot's parameters: values are floats, and a request for an unknown parameter is not answered."""

    def __init__(self, platform: Platform, banner: Callable[[], None]) -> None:
        """`banner` sends the texts that come before a list."""
        super().__init__(platform)
        self._banner = banner

    def _read(self, frame: ReceivedFrame) -> None:
        index, params = frame.fields["param_index"], self._params
        entry = params.by_index(index) if index >= 0 else params.by_name(name_of(frame.fields["param_id"]))
        if entry is not None:
            self._send(entry, index if index >= 0 else BY_NAME)

    def _list(self, _: ReceivedFrame) -> None:
        self._banner()
        self._tasks.start(_LIST, self._send_all(), self._clock.now_us)

    def _set(self, frame: ReceivedFrame) -> None:
        # ArduPilot looks neither at param_type nor at the range of a value.
        entry = self._params.set(name_of(frame.fields["param_id"]), frame.fields["param_value"])
        if entry is not None:
            self._send(entry, BY_NAME)

    def _send_all(self) -> Task:
        for entry in self._params:
            self._send(entry, entry.position)
            yield ARDUPILOT_INTERVAL_US

    def _send(self, entry: ParameterEntry, index: int) -> None:
        self._send_value("PARAM_VALUE", entry.name, entry.value, entry.kind, index)


class Px4ParameterServer(ParameterServer):
    """PX4's parameters: the bytes of a value in the float field, a hash before the list, PARAM_ERROR."""

    def _read(self, frame: ReceivedFrame) -> None:
        index, name = frame.fields["param_index"], name_of(frame.fields["param_id"])
        self._lengthen()
        if index < 0 and name == HASH_NAME:
            self._send_hash()
            return
        entry = self._params.by_index(index) if index >= 0 else self._params.by_name(name)
        if entry is None:
            self._send_error(frame, ERROR_DOES_NOT_EXIST)
        else:
            self._send(entry)

    def _list(self, _: ReceivedFrame) -> None:
        """Send the hash, then all parameters in use. A request during a list starts it again, without the hash."""
        self._lengthen()
        if _LIST not in self._tasks:
            self._send_hash()
        self._tasks.start(_LIST, self._send_all(), self._clock.now_us)

    def _set(self, frame: ReceivedFrame) -> None:
        """Set a parameter from the bytes of the value and the type. Setting `_HASH_CHECK` only ends a list."""
        name = name_of(frame.fields["param_id"])
        if name == HASH_NAME:
            self._tasks.stop(_LIST)
            self._send_error(frame, ERROR_READ_ONLY)
            return
        before = self._params.by_name(name)
        if before is None:
            self._send_error(frame, ERROR_DOES_NOT_EXIST)
            return
        if frame.fields["param_type"] != before.kind:
            self._send_error(frame, ERROR_TYPE_MISMATCH)
            return
        real = before.kind == REAL32
        # An integer's bytes are read from the frame: as a float some of them are NaNs that do not survive.
        value = frame.fields["param_value"] if real else int.from_bytes(_payload(frame)[:4], "little", signed=True)
        after = self._params.set(name, value) or before
        self._send(after)
        if after.value != before.value:
            self._tasks.after(f"parameter {name}", PX4_AGAIN_US, lambda: self._send(after), self._clock.now_us)

    def _lengthen(self) -> None:
        """Let the list grow once the vehicle is armed; a real PX4's grows while it runs."""
        if self._state.armed:
            self._params.use_all()

    def _send_all(self) -> Task:
        for count, entry in enumerate(self._params, start=1):
            self._send(entry)
            yield 0 if count % PX4_BATCH else PX4_BATCH_US

    def _send(self, entry: ParameterEntry) -> None:
        bits = self._params.value_bits(entry.name)
        self._send_value("PARAM_VALUE_BYTES", entry.name, bits, entry.kind, entry.position)

    def _send_hash(self) -> None:
        self._send_value("PARAM_VALUE_BYTES", HASH_NAME, self._params.hash(), UINT32, BY_NAME)

    def _send_error(self, frame: ReceivedFrame, error: int) -> None:
        name = bytes(frame.fields["param_id"])
        self._outbox.reply(frame, "PARAM_ERROR", param_id=name, param_index=GARBAGE_INDEX, error=error)


def _payload(frame: ReceivedFrame) -> bytes:
    start = HEADER_V2_BYTES if frame.raw[0] == MAGIC_V2 else HEADER_V1_BYTES
    return frame.raw[start : start + frame.raw[1]].ljust(4, b"\0")
