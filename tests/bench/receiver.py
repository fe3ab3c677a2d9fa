"""Receiving alone, as a process of its own: one link, intake, fleet columns, read every 5 ms. No bus, no recorder.

    python -m tests.bench.receiver PORT

Writes "ready"; ends when its input ends and then tells what it has counted.
"""

import json
import select
import sys
import time

from tests.bench.stream import ORIGIN_DEG
from tui_gcs.core.base.clock import MonotonicClock
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.links import open_link
from tui_gcs.core.records.event_log import EventLog

RECEIVE_S, LOOK_S = 0.005, 0.05
"""As a station under load does."""


def main(argv: list[str]) -> int:
    clock = MonotonicClock()
    link = open_link(f"udpin:127.0.0.1:{argv[0]}", clock)
    origin = Origin(lat_deg=ORIGIN_DEG[0], lon_deg=ORIGIN_DEG[1], ground_amsl_m=110.0)
    fleet = VehicleRegistry(clock, EventLog(clock), LocalFrame(origin), 255)
    intake = fleet.intakes[""]
    frames, next_look_s, next_end_s = 0, 0.0, 0.0
    print("ready", flush=True)
    while True:
        now_s = clock.now()
        frames += len(intake.datagrams(link.name, link.receive(), now_s))
        if now_s >= next_look_s:
            next_look_s = now_s + LOOK_S
            fleet.tick()
        if now_s >= next_end_s:
            next_end_s = now_s + 0.5
            if select.select([sys.stdin], [], [], 0)[0]:
                break
        time.sleep(max(0.0, RECEIVE_S - (clock.now() - now_s)))
    counts = intake.counts(link.name)
    print(json.dumps({"datagrams": counts["datagrams"], "frames": frames, "vehicles": len(fleet.vehicles)}), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
