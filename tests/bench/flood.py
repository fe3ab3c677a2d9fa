"""50,000 junk datagrams a second on the port of a station that flies a vehicle. Takes about 45 s."""

import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.bench.latency import hold_delays_ms, percentile, probing
from tests.bench.live import cpu_s
from tests.bench.row import NotMeasured, Row
from tests.bench.station import SCENARIO, LiveStation, kernel_drops, live_station
from tui_gcs.cli.sim_fleet import spec_of
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.preflight import OVERRIDABLE
from tui_gcs.core.scenario.load import load

PER_S, SECONDS = 50_000, 10.0
FLOWN = 2
"""System id of the simulated vehicle; vehicle 1 is the one that latencies are measured at."""
REQUESTS = 60


def flood(folder: Path) -> Iterator[Row]:
    """The vehicle is started in the midst of it, and held."""
    with live_station() as station, simulated(station.port, folder), probing(station.port, 90.0) as probe:
        station.until(lambda status: status.heard == 2, 20, "two vehicles heard")
        station.until(lambda status: FLOWN not in status.not_ready, 40, f"vehicle {FLOWN} ready to start")
        with flooding(station.port) as process:
            first_status, began_s, used_s = len(station.status), time.monotonic(), cpu_s(station.pid)
            armed = Armed(station)
            holds = list(hold_delays_ms(station, probe, REQUESTS))
            held = station.ask(m.Hold(vehicles=(FLOWN,)))
            sent = int(process.communicate(timeout=30)[0])
            share = 100 * (cpu_s(station.pid) - used_s) / (time.monotonic() - began_s)
        heard = [status.heard for status in station.status[first_status:]]
        drops = kernel_drops(station.port)
        lost = [event.text for event in station.events if "LOST" in event.text]
    if sent < 0.95 * PER_S * SECONDS:
        raise NotMeasured(f"only {sent / SECONDS:.0f} junk datagrams/s could be sent")
    yield Row(f"flood, {sent / SECONDS:.0f} junk datagrams/s: station CPU", share, "%", 100)
    yield Row("flood: vehicles heard, at least", min(heard), "", 2, at_least=True)
    yield Row("flood: told LOST", len(lost), "", 0)
    yield Row("flood: start of a vehicle to armed", armed.took_s(), "s", 10)
    yield Row("flood: hold of that vehicle accepted", held.ok, "", 1, at_least=True)
    yield Row("flood: bus request to frame on the wire: p50", percentile(holds, 50), "ms")
    yield Row("flood: bus request to frame on the wire: p99", percentile(holds, 99), "ms")
    if drops is not None:
        yield Row("flood: dropped by the system", 100 * drops / sent, "%")


class Armed:
    """Starts the vehicle and watches for it to be armed, beside other requests."""

    def __init__(self, station: LiveStation) -> None:
        self._station = station
        self._began_s, self._armed_s = time.monotonic(), float("inf")
        self._reply = station.ask(m.Start(vehicles=(FLOWN,), overrides=OVERRIDABLE, operator="bench"))
        self._thread = threading.Thread(target=self._watch)
        self._thread.start()

    def _watch(self) -> None:
        """The probe is armed from the beginning."""
        while time.monotonic() < self._began_s + SECONDS:
            if self._station.status[-1].armed == 2:
                self._armed_s = time.monotonic()
                return
            time.sleep(0.02)

    def took_s(self) -> float:
        self._thread.join()
        if not self._reply.ok:
            raise NotMeasured(f"not started: {self._reply.text} {self._reply.results}")
        return self._armed_s - self._began_s


@contextmanager
def simulated(port: int, folder: Path) -> Iterator[None]:
    """One simulated ArduCopter."""
    spec = spec_of(load(SCENARIO))
    vehicles = [vehicle for vehicle in spec["vehicles"] if vehicle["system_id"] == FLOWN]
    path = folder / "sim.json"
    path.write_text(json.dumps(spec | {"vehicles": vehicles}))
    command = [sys.executable, "-m", "sitl.launch.simulated", "--spec", str(path), "--target", f"127.0.0.1:{port}"]
    process = subprocess.Popen(command)
    try:
        yield
    finally:
        process.terminate()
        process.wait()


@contextmanager
def flooding(port: int) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "tests.bench.flooder", str(port), str(PER_S), str(SECONDS)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        if process.stdin is None or process.stdout is None or process.stdout.readline() != "ready\n":
            raise NotMeasured("the flood did not start")
        process.stdin.write("\n")
        process.stdin.flush()
        yield process
    finally:
        process.kill()
        process.wait()
