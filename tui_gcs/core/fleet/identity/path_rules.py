"""Path rules: whether two paths lead to one vehicle, which is fresher, and when frames may be duplicates."""

import math
from collections.abc import Callable

from tui_gcs.core.fleet.identity.path import GLOBAL_POSITION_INT, Path, PathState
from tui_gcs.core.fleet.identity.path_correlation import DIFFERENT_VEHICLE_M, MIN_MATCHING_POSITIONS, unexplained_gap_m
from tui_gcs.core.fleet.vehicle import HIGH_LATENCY_LOST_AFTER_S, Vehicle
from tui_gcs.core.mavlink.sources import Slot

MIN_SILENCE_TO_REBIND_S = 3.0
"""Another address may take over after this much silence of the vehicle."""
BOOT_CLOCK_TOLERANCE_S = 3.0
"""Boot clocks of one vehicle over two links differ by the delays of the links only: by less than this."""

UID2_BYTES, MIN_SERIAL_BYTES = 18, 6
"""Length of AUTOPILOT_VERSION.uid2, and how many bytes of a real serial number are not zero."""
POSITION_GAP_S = 2.0
"""Positions come at least this often. A path has ceased to bring any when its newest is older than the other path's by
more."""


def lead_s(path: Path, used: Path) -> float:
    """Return by how many seconds `path` is fresher than `used`; NaN if one of them never brought a position."""
    ours, theirs = path.slots.get(GLOBAL_POSITION_INT), used.slots.get(GLOBAL_POSITION_INT)
    if ours is None or theirs is None:
        return math.nan
    later_s = ours.t_s - theirs.t_s
    return later_s if later_s > POSITION_GAP_S else used.boot_offset_s() - path.boot_offset_s()


def shares_link(vehicle: Vehicle, path: Path) -> bool:
    """Return whether `path` is another address on a link over which the vehicle is heard or may be heard again."""
    others = [used for used in vehicle.used_paths() if used is not path and not used.source.gone]
    return any(used.source.link == path.source.link for used in others)


def duplicates_possible(vehicle: Vehicle) -> bool:
    """Return whether one frame of the vehicle can arrive over several paths."""
    # Signed frames may come over any other path, because that may be a relay.
    paths = vehicle.paths
    return len(paths) > 1 and (
        vehicle.identity.keyed
        or len(vehicle.used_paths()) > 1
        or any(path.state is PathState.CANDIDATE and not shares_link(vehicle, path) for path in paths)
    )


def is_serial(uid: str) -> bool:
    """Return whether a hardware id is the serial number of an STM32: 96 bits that no other chip has.

    ArduPilot fills the other six bytes behind it with zeros; PX4 puts the kind of chip and four zeros before it.
    Simulators report something else (tests/data), and so do boards with Linux, where the id is copied with the disk.
    """
    raw = bytes.fromhex(uid)
    if len(raw) != UID2_BYTES:
        return False
    serial = raw[:12] if not any(raw[12:]) else raw[6:] if not any(raw[2:6]) else b""
    return sum(byte != 0 for byte in serial) >= MIN_SERIAL_BYTES


def is_same_vehicle(
    vehicle: Vehicle, path: Path, now: float, *, silent: bool, is_unique: Callable[[str], bool]
) -> bool | None:
    """Return whether `path` leads to the vehicle, by hardware id, boot clock and position; None while undecided.

    With `silent` the vehicle has not been heard for a while, and may have rebooted. `is_unique` returns whether at most
    one vehicle has a hardware id: then a serial number is enough, and the vehicle need not move to prove itself.
    """
    if path.uid and vehicle.identity.uid and path.uid != vehicle.identity.uid:
        return False
    same_board = path.uid == vehicle.identity.uid
    heard_since_s = -math.inf if silent or vehicle.path.high_latency else now - MIN_SILENCE_TO_REBIND_S
    apart_s = abs(path.boot_offset_s(now - MIN_SILENCE_TO_REBIND_S) - vehicle.path.boot_offset_s(heard_since_s))
    # AUTOPILOT_VERSION is not requested over a satellite link, where the answer may take a minute.
    if path.high_latency or vehicle.path.high_latency:
        return True if apart_s < HIGH_LATENCY_LOST_AFTER_S else None
    # The same boot clock: one vehicle, or two behind one power switch.
    if apart_s <= BOOT_CLOCK_TOLERANCE_S:
        if silent:
            far = unexplained_gap_m(vehicle.path.position, path.position) > DIFFERENT_VEHICLE_M
            return False if far else True if same_board else None
        if path.matching_positions >= MIN_MATCHING_POSITIONS:
            return True if same_board else None
        # Positions decide, unless the serial number does: no two STM32 chips share one.
        same = path.correlation.same if path.correlation is not None else None
        if same is None and same_board and is_serial(path.uid) and is_unique(path.uid):
            return True
        return same if same_board or same is False else None
    if silent:
        return True if same_board and path.uid else None
    return None if math.isnan(apart_s) else False


def uid_of(slot: Slot) -> str:
    """Return the hardware id in AUTOPILOT_VERSION as hex: uid2 if the board has one, else uid; "" if neither."""
    fields = slot.fields()
    uid2 = bytes(fields["uid2"])
    if any(uid2):
        return uid2.hex()
    return f"{fields['uid']:016x}" if fields["uid"] else ""
