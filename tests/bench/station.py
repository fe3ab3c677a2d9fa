"""A real station in processes of its own, for the parts that load it from outside."""

import os
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tests.bench.live import cpu_s
from tests.bench.row import NotMeasured
from tui_gcs.client.launcher import launch, start_error
from tui_gcs.core.base.directories import runtime_dir, socket_path
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import EVENT, STATUS, BusError
from tui_gcs.core.protocol.zenoh_bus import ZenohBus, connect

SCENARIO = Path(__file__).parents[2] / "tui_gcs/scenarios/swarm-challenge.toml"
SUPERVISOR, STATION = "tui_gcs.client.launcher", "tui_gcs.core.process.station_process"


@dataclass
class LiveStation:
    """A LIVE station that listens on one UDP port, and what it says."""

    port: int
    bus: ZenohBus
    pid: int
    status: list[m.StationStatus] = field(default_factory=list)
    events: list[m.JournalEvent] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.bus.subscribe(STATUS, lambda _, data: self.status.append(m.decode(data, m.StationStatus)))
        self.bus.subscribe(EVENT, lambda _, data: self.events.append(m.decode(data, m.JournalEvent)))

    def ask(self, request: m.AnyRequest) -> m.Reply:
        """Ask as a console does."""
        return m.decode(self.bus.ask("gcs/req/bench", m.encode(request)), m.Reply)

    def until(self, what: Callable[[m.StationStatus], bool], seconds: float, why: str) -> None:
        """Wait until the station says so."""
        end_s = time.monotonic() + seconds
        while not (self.status and what(self.status[-1])):
            if time.monotonic() > end_s:
                raise NotMeasured(f"not within {seconds:g} s: {why}")
            time.sleep(0.02)

    @property
    def datagrams(self) -> int:
        """How many it has received, by its own count."""
        return self.status[-1].links[0].datagrams


@contextmanager
def live_station() -> Iterator[LiveStation]:
    """Start one with the shipped scenario, end it and all its processes."""
    port = free_port()
    launch(RunKind.LIVE, str(SCENARIO), SCENARIO.read_text(), [f"udpin:127.0.0.1:{port}"])
    try:
        bus = join(20.0)
        try:
            yield LiveStation(port, bus, processes(STATION)[0])
        finally:
            bus.close()
    finally:
        for part, number in ((SUPERVISOR, signal.SIGTERM), (SUPERVISOR, signal.SIGKILL), (STATION, signal.SIGKILL)):
            for pid in processes(part):
                os.kill(pid, number)
            wait_gone(3.0)


def wait_gone(seconds: float) -> None:
    """Give them time to end."""
    end_s = time.monotonic() + seconds
    while processes(SUPERVISOR) + processes(STATION) and time.monotonic() < end_s:
        time.sleep(0.1)


def processes(part: str) -> list[int]:
    """Ids of this run's processes with `part` in their command line: it names our runtime directory."""
    listing = subprocess.run(["ps", "-ww", "-eo", "pid=,args="], capture_output=True, text=True, check=True).stdout
    ours = str(runtime_dir(RunKind.LIVE))
    return [int(line.split()[0]) for line in listing.splitlines() if part in line and ours in line]


def join(seconds: float) -> ZenohBus:
    """The station's bus, as soon as there is one."""
    end_s = time.monotonic() + seconds
    while True:
        try:
            return connect(socket_path(RunKind.LIVE))
        except BusError:
            if time.monotonic() > end_s:
                raise NotMeasured(f"no station within {seconds:g} s: {start_error(RunKind.LIVE)}") from None
            time.sleep(0.1)


def cpu_pct(pid: int, seconds: float) -> float:
    """Share of one core that a process takes from now on."""
    before_s, began_s = cpu_s(pid), time.monotonic()
    time.sleep(seconds)
    return 100 * (cpu_s(pid) - before_s) / (time.monotonic() - began_s)


def free_port() -> int:
    """A UDP port nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def kernel_drops(port: int) -> int | None:
    """Datagrams the system dropped at a port because nobody read in time; None where it does not tell."""
    try:
        lines = Path("/proc/net/udp").read_text().splitlines()[1:]
    except OSError:
        return None
    return sum(int(line.split()[-1]) for line in lines if int(line.split()[1].split(":")[1], 16) == port)
