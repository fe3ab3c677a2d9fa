"""Lock-step runs: simulator, station and planners on one virtual clock, in one process or with planners in their own.

This is the only module that imports both `tui_gcs` and `sitl`; only MAVLink bytes pass between them. The same seed
gives the same run, byte for byte.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from sitl.launch.fleet import IntruderSpec, SensorSpec, SimFleet, VehicleSpec, WeatherSpec, WorldSpec
from sitl.links.faults import FaultCounter, FaultyLink, Lane, parse
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol.bus import BusSession, MemoryBus
from tui_gcs.core.protocol.common import RunPhase
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.requests.frontend import attach_frontend
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.core.scenario.takeoff_places import AUTOPILOTS, simulated_places
from tui_gcs.core.station.parts import StationConfig
from tui_gcs.core.station.station import Station
from tui_gcs.planner.runtime.bus_adapter import attach
from tui_gcs.planner.runtime.host import PlannerHost
from tui_gcs.planner.runtime.planner_file import PlannerFile
from tui_gcs.planner.runtime.planner_subprocess import PlannerSubprocesses
from tui_gcs.planner.runtime.registry import infos

TICK_S = 0.05
"""Step of the virtual clock."""
TOKEN = "5eed5eed5eed5eed"  # noqa: S105 - separates our simulator from others in one process; not a secret
LINK = "memory"


def simulated_vehicles(scenario: Scenario) -> list[VehicleSpec]:
    """Return one vehicle per take-off place that a team needs."""
    ground = scenario.origin.ground_amsl_m
    return [VehicleSpec(system, lat, lon, ground) for system, lat, lon in simulated_places(scenario)]


def with_autopilots(specs: list[VehicleSpec], autopilots: str) -> list[VehicleSpec]:
    """Return the same vehicles with the autopilots of a key of `AUTOPILOTS`."""
    kinds = AUTOPILOTS[autopilots]
    return [replace(spec, autopilot=kinds[i % len(kinds)]) for i, spec in enumerate(specs)]


def world_of_spec(spec: dict[str, Any]) -> WorldSpec | None:
    """Return the world of a simulator's spec (`intruders`, `sensor`); None without one."""
    if "sensor" not in spec:
        return None
    return WorldSpec(tuple(IntruderSpec(**one) for one in spec.get("intruders", ())), SensorSpec(**spec["sensor"]))


def weather_of_spec(spec: dict[str, Any]) -> WeatherSpec | None:
    """Return the weather of a simulator's spec (`wind_m_s`, `gps_noise_m`); None without one."""
    if "wind_m_s" not in spec and "gps_noise_m" not in spec:
        return None
    east_m_s, north_m_s = spec.get("wind_m_s", (0.0, 0.0))
    return WeatherSpec((east_m_s, north_m_s), spec.get("gps_noise_m", 0.0))


class FaultyLinks:
    """Link faults between the vehicles of a lock-step run and its station, drawn for each vehicle separately."""

    def __init__(self, fault: str, seed: int) -> None:
        """`fault` is a text as in `sitl.links.faults`. Raises its `FaultError`, a ValueError, for a mistake in it."""
        self._faults = parse(fault)
        self._seed = seed
        self._links: dict[int, FaultyLink] = {}

    def down(self, now_s: float, datagrams: list[tuple[int, bytes]]) -> list[tuple[int, bytes]]:
        """Take (vehicle, datagram) of vehicles; return what reaches the station by now."""
        return self._through(now_s, datagrams, lambda link: link.down)

    def up(self, now_s: float, datagrams: list[tuple[int, bytes]]) -> list[tuple[int, bytes]]:
        """Take (vehicle, datagram) of the station; return what reaches vehicles by now."""
        return self._through(now_s, datagrams, lambda link: link.up)

    def text(self) -> str:
        """Return counts of lost, late and repeated datagrams for people."""
        down, up = FaultCounter(), FaultCounter()
        for link in self._links.values():
            down.add(link.down.tally)
            up.add(link.up.tally)
        return f"vehicles to station: {down.text()}\nstation to vehicles: {up.text()}\n"

    def _through(
        self, now_s: float, datagrams: list[tuple[int, bytes]], lane: Callable[[FaultyLink], Lane]
    ) -> list[tuple[int, bytes]]:
        out: list[tuple[int, bytes]] = []
        for index, datagram in datagrams:
            if index not in self._links:
                self._links[index] = FaultyLink(self._faults, seed=self._seed, vehicle=index)
            out += [(index, data) for data in lane(self._links[index]).step(now_s, datagram)]
        for index, link in self._links.items():
            out += [(index, data) for data in lane(link).step(now_s)]
        return out


@dataclass(frozen=True)
class FlightConditions:
    """What a rehearsed fleet is made of and what it flies in."""

    autopilots: str = "ardupilot"
    """The autopilots of the fleet: a key of `AUTOPILOTS`."""
    bad_links: FaultyLinks | None = None
    """Faults between vehicles and station."""
    weather: WeatherSpec | None = None
    world: WorldSpec | None = None
    """The intruders of the flight, and the sensors that detect them."""


@dataclass
class LockStep:
    """A station with its simulator and planners, advanced by `step`."""

    scenario: Scenario
    toml: str
    log_dir: Path
    autopilots: str = field(default="ardupilot", kw_only=True)
    """The autopilots of the fleet: a key of `AUTOPILOTS`."""
    bad_links: FaultyLinks | None = field(default=None, kw_only=True)
    weather: WeatherSpec | None = field(default=None, kw_only=True)
    world: WorldSpec | None = field(default=None, kw_only=True)
    files: Mapping[str, PlannerFile] = field(default_factory=dict, kw_only=True)
    """Planners in files of their own, by name."""
    hosts: Callable[[str], PlannerHost] | None = field(default=None, kw_only=True)
    """Makes a team's planner host; None makes an ordinary one."""
    beside: bool = field(default=False, kw_only=True)
    """Run ordinary hosts in processes of their own, on other cores: the same flight, finished sooner."""

    def __post_init__(self) -> None:
        """Build everything at time 0."""
        self.clock = VirtualClock()
        self.bus = MemoryBus()
        self.link = MemoryLink(LINK)
        self.sim = SimFleet(
            with_autopilots(simulated_vehicles(self.scenario), self.autopilots),
            seed=self.scenario.seed,
            token=TOKEN,
            weather=self.weather,
            world=self.world,
        )
        teams = [team.name for team in self.scenario.teams]
        self._subprocesses = PlannerSubprocesses(teams, self.files, self.bus) if self.beside else None
        for team in teams if self._subprocesses is None else ():
            attach(self.hosts(team) if self.hosts else PlannerHost(team, self.files), self.bus)
        self.recorder = TlogWriter(self.log_dir / "run.tlog")
        self.journal = Journal(self.log_dir / "run.jsonl")
        # A planner that cannot be loaded is left out: the referee then fails its flight.
        declared = infos({team.planner for team in self.scenario.teams}, self.files)
        config = StationConfig(RunKind.SIM, self.scenario, self.toml, "", TOKEN, judge_steps=False, planners=declared)
        self._on_bus = BusSession(self.bus)
        self.station = Station(config, self.clock, self._on_bus, [self.link], self.recorder, self.journal)
        self.frontend = attach_frontend(self.station)
        self.station_runs = True
        self._foreseen = 0
        """The round that planner subprocesses prepare."""

    @property
    def systems(self) -> tuple[int, ...]:
        """System ids, in the simulator's order."""
        return tuple(spec.system_id for spec in self.sim.specs)

    def kill_station(self) -> None:
        """Stop the station as `kill -9` does: it sends nothing more; what it has stored stays."""
        StateStore(self.log_dir / "memory.json").remember(self.station.parts, self.frontend)
        self._on_bus.close()
        self.station_runs = False

    def start_station(self) -> None:
        """Start a new station on the same vehicles, links, logs and stored state."""
        # What was on the wire when the station died belongs to no station.
        self.link.receive()
        self.link.sent.clear()
        self._on_bus = BusSession(self.bus)
        config = self.station.config
        self.station = Station(config, self.clock, self._on_bus, [self.link], self.recorder, self.journal)
        self.frontend = attach_frontend(self.station)
        StateStore(self.log_dir / "memory.json").recall(self.station.parts, self.frontend)
        self._foreseen = 0
        self.station_runs = True

    def step(self) -> None:
        """Advance everything by one tick."""
        if self._subprocesses is not None:
            self._subprocesses.begin()
        self.clock.advance(TICK_S)
        self.sim.step(TICK_S)
        links, now, received = self.bad_links, self.clock.now(), self.sim.drain()
        for index, data in received if links is None else links.down(now, received):
            self.link.inject(data, ("sim", index))
        if not self.station_runs:
            self.link.receive()  # the station is dead: what vehicles send is lost
            return
        self.station.tick()
        if self._subprocesses is not None:
            self._look_ahead(self._subprocesses)
        sent = [(int(address[1]), data) for data, address in self.link.sent]
        self.link.sent.clear()
        for index, data in sent if links is None else links.up(now, sent):
            self.sim.receive(index, data)

    def _look_ahead(self, subprocesses: PlannerSubprocesses) -> None:
        """While a round is flown, let planners prepare the next one."""
        station, active = self.station, self.station.active
        rounds = active.scenario.rounds
        coming = active.round_index + 1
        if coming == self._foreseen or coming == len(rounds) or station.flight.executive.run is not RunPhase.RUNNING:
            return
        self._foreseen = coming
        controllers, revision = active.team_controllers.values(), active.task_revision + 1
        subprocesses.foresee(
            controller.task_for(active.scenario, rounds[coming], controller.team, revision)
            for controller in controllers
        )

    def close(self) -> None:
        """Close the logs and end planner subprocesses."""
        if self._subprocesses is not None:
            self._subprocesses.close()
        self.recorder.close()
        self.journal.close()
