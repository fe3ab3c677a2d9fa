"""PARAM_*: how both autopilots list, read and set parameters. Handlers get the vehicle and the frame."""

from sitl.common.autopilot import Autopilot
from sitl.common.parameters import HASH_NAME, REAL32, UINT32, Entry
from sitl.common.tasks import Task
from sitl.links.wire import HEADER_V1_BYTES, HEADER_V2_BYTES, MAGIC_V2, Received

BY_NAME = 65535
"""ArduPilot: param_index of answers by name and to PARAM_SET. PX4: of `_HASH_CHECK`."""
ARDUPILOT_INTERVAL_US = 700
"""1327 in 0.93 s."""
PX4_BATCH = 20
PX4_BATCH_US = 19_600
"""PX4 sends up to 20 at once: 886 in 0.87 s."""
PX4_AGAIN_US = 10_000
"""A changed value is sent a second time, unasked (measured 5 to 20 ms later)."""
ERROR_DOES_NOT_EXIST, ERROR_READ_ONLY, ERROR_TYPE_MISMATCH = 1, 5, 7
GARBAGE_INDEX = -28848
"""param_index of PX4's PARAM_ERROR, as recorded: it was never set."""

_LIST = "parameter list"


def name_of(raw: bytes) -> str:
    """A param_id."""
    return bytes(raw).split(b"\0", 1)[0].decode("ascii", "replace")


# ArduPilot


def ardupilot_read(ap: Autopilot, frame: Received) -> None:
    """By index or name. What does not exist is not answered."""
    index = frame.fields["param_index"]
    entry = ap.params.by_index(index) if index >= 0 else ap.params.by_name(name_of(frame.fields["param_id"]))
    if entry is not None:
        _send_float(ap, entry, index if index >= 0 else BY_NAME)


def ardupilot_list(ap: Autopilot, _: Received) -> None:
    """All, in order, after three texts."""
    ap.banner()
    ap.tasks.start(_LIST, _ardupilot_all(ap), ap.now_us)


def ardupilot_set(ap: Autopilot, frame: Received) -> None:
    """The type is not looked at. Unknown names and NaN are not answered."""
    entry = ap.params.set(name_of(frame.fields["param_id"]), frame.fields["param_value"])
    if entry is not None:
        _send_float(ap, entry, BY_NAME)


def _ardupilot_all(ap: Autopilot) -> Task:
    for entry in ap.params:
        _send_float(ap, entry, entry.position)
        yield ARDUPILOT_INTERVAL_US


def _send_float(ap: Autopilot, entry: Entry, index: int) -> None:
    ap.send(
        "PARAM_VALUE",
        param_id=entry.name.encode("ascii"),
        param_value=entry.value,
        param_type=entry.kind,
        param_count=len(ap.params),
        param_index=index,
    )


# PX4


def px4_read(ap: Autopilot, frame: Received) -> None:
    """By index or name, or the hash of all."""
    index, name = frame.fields["param_index"], name_of(frame.fields["param_id"])
    _grow(ap)
    if index < 0 and name == HASH_NAME:
        _send_hash(ap)
        return
    entry = ap.params.by_index(index) if index >= 0 else ap.params.by_name(name)
    if entry is None:
        _send_error(ap, frame, ERROR_DOES_NOT_EXIST)
    else:
        _send_bytes(ap, entry)


def px4_list(ap: Autopilot, _: Received) -> None:
    """The hash, then all that is in use. Asked again meanwhile it starts anew, without the hash."""
    _grow(ap)
    if _LIST not in ap.tasks:
        _send_hash(ap)
    ap.tasks.start(_LIST, _px4_all(ap), ap.now_us)


def px4_set(ap: Autopilot, frame: Received) -> None:
    """The value's four bytes and the type count; `_HASH_CHECK` only ends a list."""
    name = name_of(frame.fields["param_id"])
    if name == HASH_NAME:
        ap.tasks.stop(_LIST)
        _send_error(ap, frame, ERROR_READ_ONLY)
        return
    before = ap.params.by_name(name)
    if before is None:
        _send_error(ap, frame, ERROR_DOES_NOT_EXIST)
        return
    if frame.fields["param_type"] != before.kind:
        _send_error(ap, frame, ERROR_TYPE_MISMATCH)
        return
    real = before.kind == REAL32
    value = frame.fields["param_value"] if real else int.from_bytes(_payload(frame)[:4], "little", signed=True)
    after = ap.params.set(name, value) or before
    _send_bytes(ap, after)
    if after.value != before.value:
        ap.tasks.after(f"parameter {name}", PX4_AGAIN_US, lambda: _send_bytes(ap, after), ap.now_us)


def _payload(frame: Received) -> bytes:
    start = HEADER_V2_BYTES if frame.raw[0] == MAGIC_V2 else HEADER_V1_BYTES
    return frame.raw[start : start + frame.raw[1]].ljust(4, b"\0")


def _grow(ap: Autopilot) -> None:
    """The list grows while PX4 runs: here once it was armed."""
    if ap.armed:
        ap.params.use_all()


def _px4_all(ap: Autopilot) -> Task:
    for count, entry in enumerate(ap.params, start=1):
        _send_bytes(ap, entry)
        yield 0 if count % PX4_BATCH else PX4_BATCH_US


def _send_bytes(ap: Autopilot, entry: Entry) -> None:
    _send_raw(ap, entry.name, ap.params.value_bits(entry.name), entry.kind, entry.position)


def _send_hash(ap: Autopilot) -> None:
    _send_raw(ap, HASH_NAME, ap.params.hash(), UINT32, BY_NAME)


def _send_raw(ap: Autopilot, name: str, bits: int, kind: int, index: int) -> None:
    ap.send(
        "PARAM_VALUE_BYTES",
        param_id=name.encode("ascii"),
        param_value=bits,
        param_type=kind,
        param_count=len(ap.params),
        param_index=index,
    )


def _send_error(ap: Autopilot, frame: Received, error: int) -> None:
    ap.send(
        "PARAM_ERROR",
        target_system=frame.system,
        target_component=frame.component,
        param_id=bytes(frame.fields["param_id"]),
        param_index=GARBAGE_INDEX,
        error=error,
    )
