"""Make a small excerpt of a telemetry log: python tests/thin_tlog.py IN.tlog OUT.tlog

The whole time is kept, from boot to landing. What is rare and says what happened (heartbeats of vehicles, texts,
commands, missions) is kept completely, the rest at a low rate per system and message. Every message name stays.
Sequence numbers therefore have gaps that are no losses.
"""

import sys
from pathlib import Path

from tui_gcs.core.mavlink.dialect import label
from tui_gcs.core.records.tlog_reader import TlogError, read_tlog
from tui_gcs.core.records.tlog_writer import TlogWriter

ALWAYS = {"STATUSTEXT", "COMMAND_LONG", "COMMAND_INT", "COMMAND_ACK", "HOME_POSITION", "AUTOPILOT_VERSION"}
ALWAYS_PREFIX = ("MISSION_COUNT", "MISSION_ITEM", "MISSION_REQUEST", "MISSION_ACK", "MISSION_CLEAR")
RATE_HZ = {
    "HEARTBEAT": 1.0,
    "GLOBAL_POSITION_INT": 2.0,
    "GPS_RAW_INT": 0.5,
    "SYS_STATUS": 0.5,
    "BATTERY_STATUS": 0.2,
    "EXTENDED_SYS_STATE": 1.0,
    "EKF_STATUS_REPORT": 0.2,
    "ATTITUDE": 0.5,
    "SET_POSITION_TARGET_LOCAL_NED": 0.5,
}
"""A heartbeat is kept as well when it differs from the one before, so that no mode change is missed."""
OTHERS_HZ = 0.05
EARLY = 0.9
"""Messages come a little irregularly: one that comes at 90 % of the interval is on time."""


def main(argv: list[str]) -> int:
    """Copy a part of argv[0] to argv[1]."""
    if len(argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    source, target = Path(argv[0]), Path(argv[1])
    if target.exists():
        target.unlink()
    writer = TlogWriter(target)
    last_s: dict[tuple[int, int], float] = {}
    last_heartbeat: dict[int, bytes] = {}
    try:
        for wall_s, frame in read_tlog(source):
            name = label(frame.msgid)
            key = (frame.system, frame.msgid)
            due = wall_s - last_s.get(key, 0.0) >= EARLY / RATE_HZ.get(name, OTHERS_HZ)
            changed = name == "HEARTBEAT" and last_heartbeat.get(frame.system) != frame.payload
            if due or changed or name in ALWAYS or name.startswith(ALWAYS_PREFIX):
                last_s[key] = wall_s
                writer.write(wall_s, frame.raw)
            if name == "HEARTBEAT":
                last_heartbeat[frame.system] = frame.payload
    except TlogError as error:
        print(f"thin_tlog: {error}", file=sys.stderr)
        return 1
    writer.close()
    if writer.error:
        print(f"thin_tlog: {writer.error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
