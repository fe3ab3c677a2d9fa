"""The station as a process: opens links and bus, runs the tick loop, keeps one planner worker per team.

The supervisor starts it with a run file (JSON, mode 0600). Exit code 0: it was ended on request; 2: it cannot start,
and the run directory's `error` file holds the reason in one line; any other: it died and is to be started again.
"""

import contextlib
import gc
import json
import logging
import math
import os
import select
import signal
import socket
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from tui_gcs.core.base.clock import MonotonicClock
from tui_gcs.core.base.descendants import adopt_orphans
from tui_gcs.core.base.directories import EARLIER_STATE_FILE, STATE_FILE, STATION_LOCK, socket_path, state_dir, try_lock
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.base.text import clean
from tui_gcs.core.formats.content import FormatError
from tui_gcs.core.formats.elevation_files import read_elevation
from tui_gcs.core.forward.forwarder import Endpoint
from tui_gcs.core.geometry.elevation import Elevation
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.links import Link, LinkError, open_link
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.signing import SigningError
from tui_gcs.core.process.planner_workers import Declarations, PlannerWorkers
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol.bus import BusError
from tui_gcs.core.protocol.common import EventClass, JournalEvent, PlannerInfo
from tui_gcs.core.protocol.planner_log import PlannerLogLevel
from tui_gcs.core.protocol.zenoh_bus import QueuedBus, serve
from tui_gcs.core.records import link_store
from tui_gcs.core.records import rehearsal_store as rehearsals
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.link_store import LinkStore
from tui_gcs.core.records.planner_log import PlannerLog, log_files
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.requests.frontend import Frontend, attach_frontend
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import OperatorId, Scenario
from tui_gcs.core.signing.keystore import KeyStore, KeyStoreError, open_store
from tui_gcs.core.signing.timestamp_store import TimestampStore
from tui_gcs.core.station.parts import StationConfig
from tui_gcs.core.station.station import Station

# Set-points leave every 100 ms: two ticks, so that none is late by a whole period.
TICK_S = 0.05
CPU_GAP_S = 0.2
"""How often the waiting of planner workers for CPU time is read: some files of /proc each."""
REMEMBER_GAP_S = 0.1
"""How often the state that a restart needs is compared with what was written."""
RECEIVE_S = 0.005
"""Under load links are read this often: one wake-up serves many datagrams."""
MAX_RECEIVE_S = 0.005
"""After this much time no further link is read, and none again within one tick: under any flood the tick ends."""
PART_S = 0.001
"""After this much of a tick requests are answered; the whole tick of a small fleet is shorter."""
BUSY_DATAGRAMS_PER_S = 400.0
"""From this load on reading by the clock is cheaper than waking up for each datagram."""
# Exit code for a mistake in the command line or its surroundings: the supervisor does not try again.
CANNOT_START = 2

log = logging.getLogger("tui_gcs.station")


class StartError(Exception):
    """Why the station cannot start, in one line."""


def run(run_file: Path) -> None:
    """Be a station until asked to end. Raises `StartError`."""
    run_dir = run_file.parent
    setting = json.loads(run_file.read_text())
    kind = RunKind(setting["kind"])
    # The offset is that of the whole run, not of this process: the log goes on, even if the wall clock was set.
    clock = MonotonicClock(setting.get("wall_offset_s"))
    store = StateStore(run_dir / STATE_FILE)
    store.take_over(run_dir / EARLIER_STATE_FILE, setting["toml"])
    toml, scenario = _scenario(store, setting)
    _add_dialects(setting.get("dialects", []))
    links = _open_links(setting["links"])
    forward = _open_endpoints(setting.get("forward", []))
    keys, stamps = _open_keys(kind)
    bus, reader = _serve(socket_path(kind, run_dir))
    name = setting["run_name"]
    logs = state_dir(kind)
    recorder, journal = TlogWriter(logs / f"{name}.tlog"), Journal(logs / f"{name}.jsonl")
    planner_log = PlannerLog(log_files(recorder.path)[0], clock.wall)
    files = msgspec.convert(setting.get("planners", []), list[PlannerInfo])
    _write_start(journal, kind, setting, files, scenario.name)
    config = StationConfig(
        kind,
        scenario,
        toml,
        setting["scenario_path"],
        setting.get("token", ""),
        forward=forward,
        keys=keys,
        stamps=stamps,
        folder=logs,
        rehearsals=state_dir(RunKind.SIM) / rehearsals.FILE,
        planners={info.name: info for info in files},
        planner_log=planner_log,
        link_store=LinkStore(logs / link_store.FILE, name, keeps_added=kind is RunKind.LIVE),
        elevation=_elevation(setting.get("terrain", ""), scenario.origin),
        operator_at=OperatorId(**setting["operator_at"]) if setting.get("operator_at") else None,
    )
    try:
        station = Station(config, clock, bus, links, recorder, journal)
    except (LinkError, KeyStoreError, SigningError) as error:
        raise StartError(str(error)) from None
    workers = _planner_workers(run_dir, kind, _worker_arguments(kind, setting, files), planner_log, station)
    frontend = attach_frontend(station)
    frontend.requests.links.recall()
    loop = StationLoop(station, frontend, bus, workers, store, reader, clock)
    try:
        loop.run()
    finally:
        workers.end()
        station.close()
        recorder.close()
        journal.close()
        planner_log.close()
        for link in (*station.comms.links.values(), *(port.link for port in station.comms.forwarder.ports)):
            link.close()
        bus.close()  # Zenoh may take its time; the process ends anyway


def _elevation(path: str, origin: Origin) -> Elevation | None:
    """Read the operator's terrain file, if one was named. Raises `StartError`."""
    if not path:
        return None
    try:
        elevation = read_elevation(Path(path))
    except FormatError as error:
        raise StartError(f"--terrain {clean(path, 300)}: {error}") from None
    # A tile of a folder is read when a height in it is first asked for; in flight that would hold up the station.
    elevation.place_amsl_m(origin.lat_deg, origin.lon_deg)
    return elevation


def _serve(path: Path) -> tuple[QueuedBus, socket.socket]:
    """Return the bus, served at `path`, and the socket that is readable when it has something to do.

    Raises:
        StartError: the bus cannot be served there.
    """
    # Zenoh calls back on its own threads; a byte in this pair wakes the `select` of the loop.
    reader, writer = socket.socketpair()
    reader.setblocking(False)
    writer.setblocking(False)
    try:
        return QueuedBus(serve(path), lambda: _wake(writer)), reader
    except BusError as error:
        raise StartError(str(error)) from None


def _write_start(
    journal: Journal, kind: RunKind, setting: dict[str, Any], files: list[PlannerInfo], scenario: str
) -> None:
    """Write the first line of the journal: what the station was started with."""
    opened = {"links": setting["links"], "forward": setting.get("forward", []), "dialects": setting.get("dialects", [])}
    opened["planner_files"] = [{"name": info.name, "path": info.file, "sha256": info.sha256} for info in files]
    opened["watch"] = setting.get("watch", False)
    opened["scenario"] = scenario
    journal.write({"station": kind, "forced_kind": setting.get("forced_kind", False)} | opened)


def _planner_workers(
    run_dir: Path, kind: RunKind, arguments: list[str], planner_log: PlannerLog, station: Station
) -> PlannerWorkers:
    """Return the keeper of the planner workers; what they print, and events about planners, go into `planner_log`."""
    station.parts.records.events.listen(partial(_write_planner_event, planner_log, station))
    return PlannerWorkers(socket_path(kind, run_dir), planner_log, arguments, adopts=adopt_orphans())


def _write_planner_event(planner_log: PlannerLog, station: Station, event: JournalEvent) -> None:
    """Write what is reported of a planner, its notes among it, between the lines that it prints."""
    team = event.source.removeprefix("planner ")
    controller = station.active.team_controllers.get(team)
    if event.cls is EventClass.PLANNER and controller is not None:
        planner_log.write(team, controller.team.planner, PlannerLogLevel.EVENT, event.text)


def _worker_arguments(kind: RunKind, setting: dict[str, Any], files: list[PlannerInfo]) -> list[str]:
    arguments = [argument for info in files for argument in ("--file", info.name, info.sha256, info.file)]
    return arguments + (["--watch"] if kind is RunKind.SIM and setting.get("watch", False) else [])


def _scenario(store: StateStore, setting: dict[str, Any]) -> tuple[str, Scenario]:
    """The scenario that was flown last, or else the one that the station is started with. Raises `StartError`."""
    try:
        if store.toml:
            return store.toml, parse(store.toml, where=setting["scenario_path"])
    except ScenarioError as error:
        store.forget(f"its scenario: {error}")
    try:
        return setting["toml"], parse(setting["toml"], where=setting["scenario_path"])
    except ScenarioError as error:
        raise StartError(str(error)) from None


class ReceiveGap:
    """How long to wait between looks at the links: until something comes, or a fixed time under load.

    While an answer is expected (a command under way, a transfer) nothing waits, whatever it costs.
    """

    def __init__(self, now: float) -> None:
        self._began_s = now
        self._count = 0
        self._busy = False

    def saw(self, datagrams: int, now: float) -> None:
        """Take the number of datagrams that came since the last look."""
        self._count += datagrams
        took_s = now - self._began_s
        if took_s >= LOAD_WINDOW_S:
            self._busy = self._count > BUSY_DATAGRAMS_PER_S * took_s
            self._began_s, self._count = now, 0

    def waits_for_data(self, *, answer_expected: bool) -> bool:
        """Whether to wake up for every datagram; else every `RECEIVE_S`."""
        return answer_expected or not self._busy


LOAD_WINDOW_S = 0.25


class Receiver:
    """Receives for a bounded real time, whatever the station's clock shows, and reports the load."""

    def __init__(self, station: Station, gap: ReceiveGap, clock: MonotonicClock) -> None:
        self._station, self._gap, self._clock = station, gap, clock
        self.spent_s = 0.0
        """Seconds spent since the loop set it to 0."""

    def receive(self) -> None:
        """Take what has arrived, for `MAX_RECEIVE_S` and one link's share at most."""
        began_s = time.perf_counter()
        count = self._station.receive(lambda: time.perf_counter() - began_s < MAX_RECEIVE_S)
        self._gap.saw(count, self._clock.now())
        self.spent_s += time.perf_counter() - began_s


class StationLoop:
    """The loop of a station process: waits, receives, ticks, serves requests, keeps planner workers."""

    def __init__(
        self,
        station: Station,
        frontend: Frontend,
        bus: QueuedBus,
        workers: PlannerWorkers,
        store: StateStore,
        wake: socket.socket,
        clock: MonotonicClock,
    ) -> None:
        """Put the stored state into the station; `wake` becomes readable when something waits on the bus."""
        self._station, self._frontend, self._bus = station, frontend, bus
        self._workers, self._store, self._wake, self._clock = workers, store, wake, clock
        self._gap = ReceiveGap(clock.now())
        self._receiver = Receiver(station, self._gap, clock)
        self._declarations = Declarations()
        self._cpu_s = self._remember_s = -math.inf
        self._supervisor = os.getppid()
        self._is_asked_to_end = False
        store.recall(station.parts, frontend)
        frontend.requests.tasks.note = self._remember  # a hundred parameters take less than a tick

    def run(self) -> None:
        """Run until an operator ends the station or SIGTERM arrives."""
        signal.signal(signal.SIGTERM, self._on_sigterm)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        next_tick_s = next_receive_s = self._clock.now()
        gc.collect()
        gc.freeze()  # what start-up left is never garbage: looking through it would hold everything up for 40 ms
        # Measured with 250 vehicles: each full collection holds everything up, a HOLD too, for 50 to 80 ms, and there
        # was one every 26 s. The station makes next to no cycles that live long, so they are made rare.
        gc.set_threshold(*gc.get_threshold()[:2], 500)
        while not (self._station.conditions.ending or self._is_asked_to_end):
            by_data = self._gap.waits_for_data(answer_expected=self._station.waiting)
            self._wait(min(next_tick_s, next_tick_s if by_data else next_receive_s), by_data=by_data)
            now = self._clock.now()
            # Under load one wake-up for many datagrams is cheaper than one for each.
            if by_data or now >= min(next_receive_s, next_tick_s):
                next_receive_s = now + RECEIVE_S
                self._receiver.receive()
            if now >= next_tick_s:
                # After a stall ticks are not made up for: they would follow each other without a pause.
                next_tick_s = max(next_tick_s + TICK_S, now)
                self._tick(now)
        self._declarations.end()
        self._station.publisher.publish_last_status()
        time.sleep(0.1)  # the last reply leaves on a thread of Zenoh's

    def _on_sigterm(self, *_: object) -> None:
        self._is_asked_to_end = True

    def _wait(self, until_s: float, *, by_data: bool) -> None:
        """Wait for the bus, another station, and (if `by_data`) the links, then serve the bus and other stations."""
        comms = self._station.comms
        files = [number for link in comms.links.values() for number in link.filenos()] if by_data else []
        foreign = comms.forwarder.filenos()
        wait_s = max(0.0, until_s - self._clock.now())
        ready = select.select([self._wake.fileno(), *files, *foreign], [], [], wait_s)[0]
        if self._wake.fileno() in ready:
            with contextlib.suppress(BlockingIOError):
                self._wake.recv(4096)
        self._bus.run_pending()
        if not set(foreign).isdisjoint(ready):  # another station's hold does not wait for the tick
            comms.forwarder.tick()

    def _tick(self, now: float) -> None:
        served_s, self._receiver.spent_s = self._clock.now(), 0.0
        for _ in self._station.steps():
            if self._clock.now() - served_s >= PART_S:
                if self._receiver.spent_s < MAX_RECEIVE_S:
                    self._receiver.receive()
                self._bus.run_pending()
                served_s = self._clock.now()
        controllers = self._station.active.team_controllers
        self._workers.keep({name: controller.team.planner for name, controller in controllers.items()}, now)
        if now >= self._cpu_s:
            self._cpu_s = now + CPU_GAP_S
            for name, controller in controllers.items():
                controller.planner.on_cpu_wait(self._workers.waited_s(name, now))
        for info in self._declarations.poll():
            self._station.config.planners.setdefault(info.name, info)
        self._workers.end_stuck(team.team.name for team in controllers.values() if team.planner.kill_wanted)
        # When the supervisor dies, this process gets another parent.
        self._station.conditions.orphaned = os.getppid() != self._supervisor
        if now >= self._remember_s - 1e-3:
            self._remember_s = now + REMEMBER_GAP_S
            self._remember()

    def _remember(self) -> None:
        self._store.remember(self._station.parts, self._frontend)


def _add_dialects(files: list[str]) -> None:
    for file in files:
        try:
            dialect.add_xml(Path(file))
        except dialect.DialectError as error:
            raise StartError(str(error)) from None


def _open_keys(kind: RunKind) -> tuple[KeyStore, TimestampStore]:
    """Open the signing keys of this kind. Raises `StartError` for a store that others can read."""
    try:
        store = open_store(kind)
        return store, TimestampStore(store.directory)
    except KeyStoreError as error:
        raise StartError(str(error)) from None


def _open_links(names: list[str]) -> list[Link]:
    links: list[Link] = []
    for name in names:
        try:
            links.append(open_link(name))
        except LinkError as error:
            for link in links:
                link.close()
            raise StartError(str(error)) from None
    return links


def _open_endpoints(given: list[tuple[str, bool]]) -> tuple[Endpoint, ...]:
    """Open links to other stations; `given` holds the name of each and whether it may command our vehicles."""
    links = _open_links([name for name, _ in given])
    return tuple(Endpoint(link, commands) for link, (_, commands) in zip(links, given, strict=True))


def _wake(writer: socket.socket) -> None:
    with contextlib.suppress(BlockingIOError):
        writer.send(b"!")


def main(argv: list[str] | None = None) -> int:
    """`python -m tui_gcs.core.process.station_process RUN_FILE`."""
    run_file = Path((argv or sys.argv[1:])[0])
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s")
    try:
        with (run_file.parent / STATION_LOCK).open("a") as lock:
            # Two stations of one kind would steer the same vehicles with one system id.
            if not try_lock(lock):
                raise StartError("another station of this kind is running: `tui-gcs stop` ends it")
            run(run_file)
    except StartError as error:
        (run_file.parent / "error").write_text(str(error))
        log.error("%s", error)
        return CANNOT_START
    except Exception:
        log.exception("station died")
        return 1
    return 0


if __name__ == "__main__":
    code = main()
    logging.shutdown()
    # Zenoh's threads may keep a normal exit waiting.
    os._exit(code)
