"""A station under the load of 250 vehicles, and of 1000 vehicles' rate: processor time, and that nothing is lost."""

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.bench.latency import latencies
from tests.bench.row import NotMeasured, Row
from tests.bench.station import cpu_pct, free_port, kernel_drops, live_station
from tests.bench.stream import RATE_HZ

VEHICLES = 250
WARM_S, MEASURED_S, REST_S = 8.0, 15.0, 2.0
"""The station finds and asks all vehicles first; then it is measured; the sender goes on a little longer."""
LATEST_S = 0.5
"""A sender later than this did not play in real time."""


def load(_: Path) -> Iterator[Row]:
    """About 90 s: receiving alone, then a whole station at both rates."""
    yield from receive_only()
    yield from whole_station(1, 25)
    yield from whole_station(4, 45)


def latency(_: Path) -> Iterator[Row]:
    """About 150 s: how fast a loaded station sends what is asked, and answers vehicles."""
    with live_station() as station, sender(station.port, 160.0, 1, first=2) as played:
        yield from latencies(station, VEHICLES)
        played.end()


def receive_only() -> Iterator[Row]:
    port = free_port()
    command = [sys.executable, "-m", "tests.bench.receiver", str(port)]
    receiver = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        if receiver.stdout is None or receiver.stdout.readline() != "ready\n":
            raise NotMeasured("the receiver did not start")
        with sender(port, WARM_S + MEASURED_S + REST_S, 1) as played:
            time.sleep(WARM_S)
            share = cpu_pct(receiver.pid, MEASURED_S)
            sent = played.result()
        time.sleep(0.2)
        drops = kernel_drops(port)
        got = json.loads(receiver.communicate("\n", timeout=10)[0])
    finally:
        receiver.kill()
        receiver.wait()
    if got["vehicles"] != VEHICLES:
        raise NotMeasured(f"{got['vehicles']} of {VEHICLES} vehicles were found")
    yield Row(f"receive, decode, columns at {VEHICLES} vehicles: CPU", share, "%", 10)
    yield Row("receive, decode, columns: datagrams lost", sent["datagrams"] - got["datagrams"] + (drops or 0), "", 0)


def whole_station(times: int, limit_pct: float) -> Iterator[Row]:
    name = f"station at {VEHICLES * times} vehicles' rate"
    with live_station() as station, sender(station.port, WARM_S + MEASURED_S + REST_S, times) as played:
        time.sleep(WARM_S)
        station.until(lambda status: status.heard == VEHICLES, 5, f"{VEHICLES} vehicles heard")
        share = cpu_pct(station.pid, MEASURED_S)
        sent = played.result()
        time.sleep(1.5)  # for the station's next status
        lost = sent["datagrams"] - station.datagrams
        drops = kernel_drops(station.port)
    yield Row(f"{name}: CPU", share, "%", limit_pct)
    yield Row(f"{name}: frames sent", sent["frames"] / sent["took_s"], "/s")
    yield Row(f"{name}: datagrams not counted by it", lost, "", 0)
    if drops is not None:
        yield Row(f"{name}: dropped by the system", drops, "", 0)


@dataclass
class Played:
    """A sender at work."""

    process: subprocess.Popen[str]
    frames_per_s: float

    def result(self) -> dict[str, Any]:
        """What it sent; it has come to its end. Raises NotMeasured if it was too slow."""
        sent: dict[str, Any] = json.loads(self.process.communicate(timeout=120)[0])
        if sent["late_s"] > LATEST_S:
            raise NotMeasured(f"the sender was up to {sent['late_s']:.1f} s late: this machine has too much to do")
        if sent["frames"] < 0.95 * self.frames_per_s * sent["took_s"]:
            raise NotMeasured(f"the sender sent only {sent['frames'] / sent['took_s']:.0f} frames/s")
        return sent

    def end(self) -> None:
        """It is not needed any more."""
        self.process.kill()


@contextmanager
def sender(port: int, seconds: float, times: int, *, first: int = 1, last: int = VEHICLES) -> Iterator[Played]:
    """A fleet that begins to send now."""
    wanted = {"port": port, "first": first, "vehicles": last, "seconds": seconds, "times": times}
    command = [sys.executable, "-m", "tests.bench.sender", json.dumps(wanted)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        if process.stdin is None or process.stdout is None or process.stdout.readline() != "ready\n":
            raise NotMeasured("the sender did not start")
        process.stdin.write("\n")
        process.stdin.flush()
        yield Played(process, (last - first + 1) * RATE_HZ * times)
    finally:
        process.kill()
        process.wait()
