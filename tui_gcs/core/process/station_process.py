"""The station as a process: opens links and bus, runs the tick loop, keeps one planner worker per team.

Started by the supervisor with a run file (JSON, 0600). Exit code 0: ended on request; 2: cannot start (the reason is
one line in the run directory's `error` file); anything else: it died and is to be started again.
"""

import contextlib
import gc
import json
import logging
import os
import select
import signal
import socket
import sys
import time
from pathlib import Path
from typing import Any

import msgspec

from tui_gcs.core.base.clock import MonotonicClock
from tui_gcs.core.base.directories import STATION_LOCK, socket_path, state_dir, try_lock
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.forward.forwarder import Endpoint
from tui_gcs.core.links import Link, LinkError, open_link
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.signing import SigningError
from tui_gcs.core.process.planner_workers import Declarations, PlannerWorkers
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol.bus import BusError
from tui_gcs.core.protocol.common import PlannerInfo
from tui_gcs.core.protocol.zenoh_bus import QueuedBus, ZenohBus, serve
from tui_gcs.core.records import rehearsal_store as rehearsals
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import OperatorId, Scenario
from tui_gcs.core.signing.keystore import KeyStore, KeyStoreError, open_store
from tui_gcs.core.signing.timestamp_store import TimestampStore
from tui_gcs.core.station.station import Station, StationConfig

TICK_S = 0.05
RECEIVE_S = 0.005
"""Under load links are read this often: one wake-up for many datagrams (performance.md 4a)."""
MOST_RECEIVE_S = 0.005
"""After so long no further link is read, and within one tick none again: whatever comes in, the tick ends."""
PART_S = 0.001
"""After so much of a tick, who waits for an answer is served; a small fleet's tick is shorter."""
BUSY_DATAGRAMS_PER_S = 400.0
"""From here on reading by the clock is cheaper than waking up for each datagram."""
CANNOT_START = 2

log = logging.getLogger("tui_gcs.station")


class StartError(Exception):
    """Why the station cannot start, in one line."""


def run(run_file: Path) -> None:
    """Be a station until asked to end. Raises `StartError`."""
    run_dir = run_file.parent
    setting = json.loads(run_file.read_text())
    kind = RunKind(setting["kind"])
    clock = MonotonicClock(setting.get("wall_offset_s"))  # of the whole run: its log goes on, whoever set the clock
    memory = StateStore(run_dir / "memory.json")
    toml, scenario = _scenario(memory, setting)
    _add_dialects(setting.get("dialects", []))
    links = _open_links(setting["links"])
    others = [(text, commands) for text, commands in setting.get("forward", [])]
    forward = tuple(Endpoint(link, c) for link, (_, c) in zip(_open_links([t for t, _ in others]), others, strict=True))
    keys, stamps = _open_keys(kind)
    reader, writer = socket.socketpair()
    reader.setblocking(False)
    writer.setblocking(False)
    try:
        zenoh_bus = serve(socket_path(kind, run_dir))
    except BusError as error:
        raise StartError(str(error)) from None
    bus = QueuedBus(zenoh_bus, lambda: _wake(writer))
    name = setting["run_name"]
    logs = state_dir(kind)
    recorder, journal = TlogWriter(logs / f"{name}.tlog"), Journal(logs / f"{name}.jsonl")
    opened = {"links": setting["links"], "forward": setting.get("forward", []), "dialects": setting.get("dialects", [])}
    files = msgspec.convert(setting.get("planners", []), list[PlannerInfo])
    opened["planner_files"] = [{"name": info.name, "path": info.file, "sha256": info.sha256} for info in files]
    opened["watch"] = setting.get("watch", False)
    journal.write({"station": kind, "forced_kind": setting.get("forced_kind", False)} | opened)
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
        operator_at=OperatorId(**setting["operator_at"]) if setting.get("operator_at") else None,
    )
    try:
        station = Station(config, clock, bus, links, recorder, journal)
    except (LinkError, KeyStoreError, SigningError) as error:
        raise StartError(str(error)) from None
    memory.recall(station)
    station.requests.tasks.note = lambda: memory.remember(station)  # a hundred parameters take less than a tick
    given = [argument for info in files for argument in ("--file", info.name, info.sha256, info.file)]
    watched = kind is RunKind.SIM and setting.get("watch", False)
    given += ["--watch"] if watched else []
    workers = PlannerWorkers(socket_path(kind, run_dir), logs / f"{name}-planners.log", given)
    try:
        _loop(station, bus, workers, memory, reader, clock)
    finally:
        workers.end()
        station.close()
        recorder.close()
        journal.close()
        for link in (*links, *(endpoint.link for endpoint in forward)):
            link.close()
        _close(zenoh_bus)


def _scenario(memory: StateStore, setting: dict[str, Any]) -> tuple[str, Scenario]:
    """What was flown last, or what it is started with. Raises `StartError`."""
    try:
        if memory.toml:
            return memory.toml, parse(memory.toml, where=setting["scenario_path"])
    except ScenarioError as error:
        memory.forget(f"its scenario: {error}")
    try:
        return setting["toml"], parse(setting["toml"], where=setting["scenario_path"])
    except ScenarioError as error:
        raise StartError(str(error)) from None


class ReceiveGap:
    """How long to wait between looks at the links: until something comes, or a fixed time under load.

    While an answer is expected (a command under way, a transfer) nothing waits, whatever it costs.
    """

    def __init__(self, now: float) -> None:
        """No load measured yet."""
        self._began_s = now
        self._count = 0
        self._busy = False

    def saw(self, datagrams: int, now: float) -> None:
        """So many came since the last look."""
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
    """Receives within its time, and says so to `ReceiveGap`. Real time: what it costs, not what the clock says."""

    def __init__(self, station: Station, gap: ReceiveGap, clock: MonotonicClock) -> None:
        """Nothing received yet."""
        self._station, self._gap, self._clock = station, gap, clock
        self.spent_s = 0.0
        """Since somebody set it to 0."""

    def receive(self) -> None:
        """Take what has arrived, for `MOST_RECEIVE_S` and one link's share at most."""
        began_s = time.perf_counter()
        count = self._station.receive(lambda: time.perf_counter() - began_s < MOST_RECEIVE_S)
        self._gap.saw(count, self._clock.now())
        self.spent_s += time.perf_counter() - began_s


def _loop(
    station: Station,
    bus: QueuedBus,
    workers: PlannerWorkers,
    memory: StateStore,
    wake: socket.socket,
    clock: MonotonicClock,
) -> None:
    stop, supervisor = {"asked": False}, os.getppid()
    signal.signal(signal.SIGTERM, lambda *_: stop.update(asked=True))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    next_tick_s = next_receive_s = clock.now()
    gap = ReceiveGap(clock.now())
    declarations = Declarations()
    receiver = Receiver(station, gap, clock)
    gc.collect()
    gc.freeze()  # what start-up left is never garbage: looking through it would hold everything up for 40 ms
    while not (station.ending or stop["asked"]):
        by_data = gap.waits_for_data(answer_expected=station.waiting)
        files = [number for link in station.links.values() for number in link.filenos()] if by_data else []
        wait_s = max(0.0, min(next_tick_s, next_tick_s if by_data else next_receive_s) - clock.now())
        foreign = [number for endpoint in station.config.forward for number in endpoint.link.filenos()]
        ready = select.select([wake.fileno(), *files, *foreign], [], [], wait_s)[0]
        if wake.fileno() in ready:
            with contextlib.suppress(BlockingIOError):
                wake.recv(4096)
        bus.run_pending()
        if not set(foreign).isdisjoint(ready):  # another station's hold does not wait for the tick
            station.forwarder.tick()
        now = clock.now()
        if by_data or now >= min(next_receive_s, next_tick_s):
            next_receive_s = now + RECEIVE_S
            receiver.receive()
        if now >= next_tick_s:
            next_tick_s = max(next_tick_s + TICK_S, now)
            served_s, receiver.spent_s = clock.now(), 0.0
            for _ in station.steps():
                if clock.now() - served_s >= PART_S:
                    if receiver.spent_s < MOST_RECEIVE_S:
                        receiver.receive()
                    bus.run_pending()
                    served_s = clock.now()
            workers.keep(list(station.team_controllers), now)
            for info in declarations.poll():
                station.config.planners.setdefault(info.name, info)
            workers.end_stuck(desk.team.name for desk in station.team_controllers.values() if desk.planner.kill_wanted)
            station.orphaned = os.getppid() != supervisor
            memory.remember(station)
    declarations.end()
    time.sleep(0.1)  # let the last answer out


def _add_dialects(files: list[str]) -> None:
    for file in files:
        try:
            dialect.add_xml(Path(file))
        except dialect.DialectError as error:
            raise StartError(str(error)) from None


def _open_keys(kind: RunKind) -> tuple[KeyStore, TimestampStore]:
    """The signing keys of this kind. A store that others can read is not used, and neither is flown without it."""
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


def _wake(writer: socket.socket) -> None:
    with contextlib.suppress(BlockingIOError):
        writer.send(b"!")


def _close(bus: ZenohBus) -> None:
    """Zenoh may take its time; the process ends anyway."""
    bus.close()


def main(argv: list[str] | None = None) -> int:
    """`python -m tui_gcs.core.process.station_process RUN_FILE`."""
    run_file = Path((argv or sys.argv[1:])[0])
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s")
    try:
        with (run_file.parent / STATION_LOCK).open("a") as lock:
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
    os._exit(code)
