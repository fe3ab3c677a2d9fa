"""The place where vehicles are judged: a station, its clock, and vehicles that the station reaches over a link.

The same checks run on a live endpoint in real time and on our simulator in lock-step: they only say what to wait for.
"""

import select
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from sitl.fleet import SimFleet, VehicleSpec
from tui_gcs.core.bus import MemoryBus
from tui_gcs.core.clock import Clock, MonotonicClock, VirtualClock
from tui_gcs.core.journal import Journal
from tui_gcs.core.kinds import Kind
from tui_gcs.core.links import Link, open_link
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.links.spec import parse_link
from tui_gcs.core.messages import Freshness
from tui_gcs.core.recorder import TlogWriter
from tui_gcs.core.scenario_load import parse
from tui_gcs.core.station import Station, StationConfig
from tui_gcs.core.vehicle import Vehicle

TICK_S = 0.05
RECEIVE_S = 0.002
SIM_HOME = (-35.363262, 149.165237, 584.0)

SCENARIO = """
format = 1
name = "conformance"
seed = 1
footprint_radius_m = 15.0
[origin]
lat_deg = {lat:.7f}
lon_deg = {lon:.7f}
ground_amsl_m = {amsl:.2f}
[limits]
speed_m_s = 8.0
accel_m_s2 = 2.5
separation_horizontal_m = 5.0
separation_vertical_m = 3.0
geofence_margin_m = 5.0
home_spread_m = 50.0
[[round]]
name = "one"
duration_s = 600.0
[round.area]
shape = "circle"
centre_m = [0.0, 0.0]
radius_m = 2000.0
alt_min_m = 5.0
alt_max_m = 900.0
[[round.zone]]
name = "zone"
role = "defend"
shape = "circle"
centre_m = [0.0, 0.0]
radius_m = 100.0
[[team]]
name = "judged"
zone = "zone"
planner = "patrol"
vehicles = {ids}
"""
PLACE = """
[[place]]
vehicle = {vehicle}
place_m = [{east:.1f}, 0.0]
layer_m = {layer:.1f}
"""
LAYERS_FROM_M, LAYER_GAP_M = 10.0, 4.0


def scenario_toml(lat: float, lon: float, amsl: float, ids: tuple[int, ...]) -> str:
    """A scenario with everybody in one team about (lat, lon): the station wants one."""
    places = "".join(
        PLACE.format(vehicle=v, east=10.0 * i, layer=LAYERS_FROM_M + LAYER_GAP_M * i) for i, v in enumerate(ids)
    )
    return SCENARIO.format(lat=lat, lon=lon, amsl=amsl, ids=list(ids)) + places


class Failed(Exception):
    """What the vehicle (or the station) did not do."""


class NotApplicable(Exception):
    """Why a check says nothing about this vehicle."""


@dataclass
class Field:
    """A station and the vehicles to be judged. `pump` moves both on by a moment; `listen` lets us only hear."""

    station: Station
    clock: Clock
    ids: tuple[int, ...]
    pump: Callable[[bool], None]
    close: Callable[[], None]
    notes: list[str] = field(default_factory=list)

    def vehicle(self, system: int) -> Vehicle:
        """The station's picture of a vehicle.

        Raises:
            Failed: It was never heard.
        """
        vehicle = self.station.fleet.vehicles.get(system)
        if vehicle is None:
            raise Failed(f"vehicle {system} was never heard")
        return vehicle

    def run(self, seconds: float, *, muted: bool = False) -> None:
        """Let time pass; `muted`: we say nothing meanwhile, not even that we are there."""
        end_s = self.clock.now() + seconds
        while self.clock.now() < end_s - 1e-9:
            self.pump(muted)

    def until(
        self, reached: Callable[[], bool], limit_s: float, what: str | Callable[[], str], *, muted: bool = False
    ) -> float:
        """Let time pass until `reached`; how long it took, s.

        Raises:
            Failed: Not within `limit_s`; `what` names what was waited for.
        """
        begin_s = self.clock.now()
        while not reached():
            if self.clock.now() - begin_s > limit_s:
                raise Failed(f"{what() if callable(what) else what}: not within {limit_s:g} s")
            self.pump(muted)
        return self.clock.now() - begin_s

    def texts(self, system: int, since: int = 0) -> list[str]:
        """What was told about a vehicle (its own words included) after event number `since`."""
        return [e.text for e in self.station.events.since(since, 2000) if e.source == f"vehicle {system}"]

    @property
    def last_event(self) -> int:
        """The number of the newest event."""
        events = self.station.events.since(0, 2000)
        return events[-1].seq if events else 0

    def discover(self, limit_s: float = 60.0) -> None:
        """Wait for all vehicles to be heard with a position, then put the scenario's origin where the first one is.

        Raises:
            Failed: Some do not come.
        """
        vehicles = self.station.fleet.vehicles

        def here() -> bool:
            now = self.clock.now()
            return all(i in vehicles and vehicles[i].freshness(now) is Freshness.OK for i in self.ids)

        self.until(here, limit_s, f"vehicles {', '.join(map(str, self.ids))} heard with a position")
        first = vehicles[self.ids[0]]
        toml = scenario_toml(first.lat_deg, first.lon_deg, first.alt_amsl_m - first.alt_rel_m, self.ids)
        self.station.set_scenario(parse(toml, where="conformance"), toml)


def live_field(link: str, ids: tuple[int, ...], log_dir: Path) -> Field:
    """A field on a real link, in real time. What answers there is live."""
    clock = MonotonicClock()
    opened: Link = open_link(parse_link(link))
    station, end = _station(clock, [opened], ids, log_dir)
    ticked_s = [0.0]

    def pump(muted: bool) -> None:
        select.select(opened.filenos(), [], [], RECEIVE_S)
        station.receive()
        if time.monotonic() - ticked_s[0] >= TICK_S:
            ticked_s[0] = time.monotonic()
            if muted:
                station.fleet.tick()
            else:
                station.tick()

    def close() -> None:
        end()
        opened.close()

    return Field(station, clock, ids, pump, close)


def simulated_field(autopilots: tuple[str, ...], log_dir: Path, *, seed: int = 1) -> Field:
    """A field with our simulator in lock-step: one vehicle per entry of `autopilots`, ids from 1."""
    lat, lon, amsl = SIM_HOME
    specs = [
        VehicleSpec(i, lat, lon + 2e-4 * i, amsl, autopilot=autopilot) for i, autopilot in enumerate(autopilots, 1)
    ]
    clock, link = VirtualClock(), MemoryLink("memory")
    sim = SimFleet(specs, seed=seed)
    station, end = _station(clock, [link], tuple(range(1, len(specs) + 1)), log_dir)

    def pump(muted: bool) -> None:
        clock.advance(TICK_S)
        sim.step(TICK_S)
        for index, data in sim.drain():
            link.inject(data, ("sim", index))
        for _ in range(4):  # an answer goes back and forth a few times within 50 ms, as it does on a real link
            station.receive()
            if not link.sent:
                break
            _carry(link, sim)
            for index, data in sim.drain():
                link.inject(data, ("sim", index))
        if muted:
            station.receive()
            station.fleet.tick()
            link.sent.clear()
        else:
            station.tick()
            _carry(link, sim)

    return Field(station, clock, tuple(range(1, len(specs) + 1)), pump, end)


def _carry(link: MemoryLink, sim: SimFleet) -> None:
    while link.sent:
        data, address = link.sent.popleft()
        sim.receive(int(address[1]), data)


def _station(
    clock: Clock, links: list[Link], ids: tuple[int, ...], log_dir: Path
) -> tuple[Station, Callable[[], None]]:
    toml = scenario_toml(0.0, 0.0, 0.0, ids)
    recorder, journal = TlogWriter(log_dir / "conformance.tlog"), Journal(log_dir / "conformance.jsonl")
    config = StationConfig(Kind.LIVE, parse(toml, where="conformance"), toml, "", judge_steps=False)
    station = Station(config, clock, MemoryBus(), links, recorder, journal)

    def close() -> None:
        station.close()
        recorder.close()
        journal.close()

    return station, close
