"""ArduPilot's `@MISSION/mission.dat`, `fence.dat` and `rally.dat`: a header, then items as in MISSION_ITEM_INT."""

import struct

from sitl.ardupilot.mission_protocol import ArduPilotMissions
from sitl.common import missions
from sitl.common.missions import FENCE, ITEM_BYTES, MISSION, RALLY, Plans

KINDS = {"mission.dat": MISSION, "fence.dat": FENCE, "rally.dat": RALLY}
# The header of mission.dat, fence.dat and rally.dat: five uint16 of which this is the first.
MAGIC = 0x763D
HEADER = struct.Struct("<HHHHH")
"""Magic, MAV_MISSION_TYPE, options, first item, number of items."""
ANNOUNCED_BYTES = 1 << 20
"""The size that is announced when such a file is opened, whatever its real size."""
NO_CLEAR = 1
"""Option: replace some items and keep the others."""


class MissionFiles:
    """Reads and writes the plans of one vehicle as files."""

    def __init__(self, plans: Plans, protocol: ArduPilotMissions) -> None:
        self._plans, self._protocol = plans, protocol

    def pack(self, kind: int) -> bytes:
        """Return the whole file of a kind of plan."""
        items = list(self._plans.of(kind))
        if kind == MISSION and items:
            items[0] = self._protocol.home_item()
        body = b"".join(item.packed(seq, kind) for seq, item in enumerate(items))
        return HEADER.pack(MAGIC, kind, 0, 0, len(items)) + body

    def store(self, kind: int, data: bytes) -> None:
        """Store an uploaded file. A bad one leaves the old plan in place, which ArduPilot does not report."""
        if len(data) < HEADER.size:
            return
        magic, _, options, first, number = HEADER.unpack_from(data)
        body = data[HEADER.size :]
        if magic != MAGIC or len(body) // ITEM_BYTES != number or (kind == MISSION and self._plans.flying):
            return
        raw = [body[k * ITEM_BYTES : (k + 1) * ITEM_BYTES] for k in range(number)]
        if not all(any(item) for item in raw):
            # A gap: a part of the file was lost on the way.
            return
        items = [missions.unpack_item(item) for item in raw]
        if options & NO_CLEAR:
            old = list(self._plans.of(kind))
            old[first : first + number] = items
            items = old
        self._protocol.replace_all(kind, items)
