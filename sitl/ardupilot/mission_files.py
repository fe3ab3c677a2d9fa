"""ArduPilot's `@MISSION/mission.dat`, `fence.dat` and `rally.dat`: a header and items as in MISSION_ITEM_INT."""

import struct

from sitl.ardupilot import mission_protocol as plan_ardupilot
from sitl.common import missions
from sitl.common.autopilot import Autopilot
from sitl.common.missions import FENCE, ITEM_BYTES, MISSION, RALLY

KINDS = {"mission.dat": MISSION, "fence.dat": FENCE, "rally.dat": RALLY}
MAGIC = 0x763D
HEADER = struct.Struct("<HHHHH")
"""Magic, MAV_MISSION_TYPE, options, first item, number of items."""
ANNOUNCED_BYTES = 1 << 20
"""What is told when one is opened."""
NO_CLEAR = 1


def pack(ap: Autopilot, kind: int) -> bytes:
    """The whole file."""
    items = list(ap.plans.of(kind))
    if kind == MISSION and items:
        items[0] = plan_ardupilot.home_item(ap)
    body = b"".join(item.packed(seq, kind) for seq, item in enumerate(items))
    return HEADER.pack(MAGIC, kind, 0, 0, len(items)) + body


def store(ap: Autopilot, kind: int, data: bytes) -> bool:
    """Take an uploaded file; False where ArduPilot keeps the old plan (who uploads is not told)."""
    if len(data) < HEADER.size:
        return False
    magic, _, options, first, number = HEADER.unpack_from(data)
    body = data[HEADER.size :]
    if magic != MAGIC or len(body) // ITEM_BYTES != number:
        return False
    raw = [body[k * ITEM_BYTES : (k + 1) * ITEM_BYTES] for k in range(number)]
    if not all(any(item) for item in raw):
        return False  # a gap: not everything arrived
    if kind == MISSION and ap.plans.flying:
        return False
    items = [missions.unpack_item(item) for item in raw]
    if options & NO_CLEAR:
        old = list(ap.plans.of(kind))
        old[first : first + number] = items
        items = old
    return plan_ardupilot.replace_all(ap, kind, items)
