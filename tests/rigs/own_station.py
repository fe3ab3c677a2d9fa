"""A station of this test run's own, with its simulator and planner workers, as real processes at 1x."""

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from tui_gcs.core.base.directories import socket_path
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import EVENT, FLEET, STATUS, BusError
from tui_gcs.core.protocol.zenoh_bus import ZenohBus, connect


class Watcher:
    """A console without a screen."""

    def __init__(self, bus: ZenohBus) -> None:
        self.bus = bus
        self.frame: m.FleetFrame | None = None
        self.status: m.StationStatus | None = None
        self.events: list[m.JournalEvent] = []
        bus.subscribe(FLEET, lambda _, data: setattr(self, "frame", m.decode(data, m.FleetFrame)))
        bus.subscribe(STATUS, lambda _, data: setattr(self, "status", m.decode(data, m.StationStatus)))
        bus.subscribe(EVENT, lambda _, data: self.events.append(m.decode(data, m.JournalEvent)))

    def ask(self, request: m.AnyRequest) -> m.Reply:
        return m.decode(self.bus.ask("gcs/req/test", m.encode(request)), m.Reply)

    def phases(self) -> set[m.Phase]:
        return set(self.frame.phase) if self.frame else set()

    def modes(self) -> set[str]:
        return set(self.frame.mode) if self.frame else set()

    def told(self, text: str) -> bool:
        return any(text in event.text for event in self.events)

    def team(self, name: str) -> m.TeamStatus:
        assert self.status is not None
        return next(team for team in self.status.teams if team.name == name)


def until(what: Callable[[], bool], seconds: float, why: str) -> None:
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, f"not within {seconds} s: {why}"
        time.sleep(0.05)


def processes(part: str) -> list[int]:
    """Ids of this run's processes whose command line has `part` and our runtime directory."""
    listing = subprocess.run(["ps", "-ww", "-eo", "pid,args"], capture_output=True, text=True, check=True).stdout
    ours = os.environ["TUI_GCS_RUNTIME_DIR"]
    return [int(line.split()[0]) for line in listing.splitlines() if part in line and ours in line]


@contextmanager
def station_in(folder: Path, begin: Callable[[], object]) -> Iterator[Watcher]:
    """What `begin` starts, with everything it writes in `folder`; all of it is killed at the end."""
    before = {name: os.environ.get(name) for name in ("TUI_GCS_RUNTIME_DIR", "TUI_GCS_STATE_DIR")}
    os.environ["TUI_GCS_RUNTIME_DIR"] = str(folder / "run")
    os.environ["TUI_GCS_STATE_DIR"] = str(folder / "state")
    try:
        begin()
        # A process that exits with an open session of Zenoh can hang, so it is closed after a failure, too.
        with closing(join(20.0)) as bus:
            yield Watcher(bus)
    finally:
        for part in ("tui_gcs.client.launcher", "tui_gcs.core.process.station_process", "sitl.launch.simulated"):
            for pid in processes(part):
                os.kill(pid, signal.SIGKILL)
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def join(seconds: float) -> ZenohBus:
    end = time.monotonic() + seconds
    while True:
        try:
            return connect(socket_path(RunKind.SIM))
        except BusError:
            assert time.monotonic() < end, "no station"
            time.sleep(0.1)
