"""How long a console sees nothing after a `kill -9` of the station, which its supervisor starts again."""

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

from tests.bench.live import cpu_s
from tests.bench.load import sender
from tests.bench.row import NotMeasured, Row
from tests.bench.station import STATION, LiveStation, live_station, processes
from tui_gcs.core.base.directories import socket_path
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol.bus import FLEET
from tui_gcs.core.protocol.common import FleetFrame, decode
from tui_gcs.core.protocol.zenoh_bus import connect_later

KILLS, FLOWN = 5, 8
SETTLED_S, TIMEOUT_S = 4.0, 30.0


def restart(_: Path) -> Iterator[Row]:
    """About a minute: seconds between the last fleet frame of the killed station and the first of the next one."""
    with live_station() as station, sender(station.port, 300.0, 1, last=FLOWN) as played:
        station.until(lambda status: status.heard == FLOWN, 15, f"{FLOWN} vehicles heard")
        taken = [_blind(station) for _ in range(KILLS)]
        played.end()
    blind_s, heard_s, used_s = zip(*taken, strict=True)
    yield Row(f"console blind after kill -9 of the station, worst of {KILLS}", max(blind_s), "s", 1.5)
    yield Row(f"console blind after kill -9 of the station, best of {KILLS}", min(blind_s), "s")
    yield Row("until every vehicle is in its frames again, worst", max(heard_s), "s")
    yield Row("CPU time of the new station until then, worst", max(used_s), "s")


def _blind(station: LiveStation) -> tuple[float, float, float]:
    """Kill the station once. Seconds until a frame, until a frame with the whole fleet, and of CPU time until then."""
    came: list[tuple[float, bytes]] = []
    bus = connect_later(socket_path(RunKind.LIVE))
    try:
        bus.subscribe(FLEET, lambda _, data: came.append((time.monotonic(), data)))
        time.sleep(SETTLED_S)
        pid = processes(STATION)[-1]
        os.kill(pid, signal.SIGKILL)
        killed_s = time.monotonic()
        time.sleep(0.05)  # what the killed one had sent has arrived
        before = len(came)
        while not _whole(came[before:]):
            if time.monotonic() - killed_s > TIMEOUT_S:
                raise NotMeasured(f"no frame with the fleet within {TIMEOUT_S:.0f} s")
            time.sleep(0.02)
        new = next(number for number in processes(STATION) if number != pid)
        last_s = came[before - 1][0] if before else killed_s
        return came[before][0] - last_s, _whole(came[before:])[0][0] - last_s, cpu_s(new)
    finally:
        bus.close()


def _whole(came: list[tuple[float, bytes]]) -> list[tuple[float, bytes]]:
    """The frames that have the whole fleet."""
    return [entry for entry in came if len(decode(entry[1], FleetFrame).rows()) >= FLOWN]
