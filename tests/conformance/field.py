"""The place where vehicles are judged: a station, its clock, and vehicles that the station reaches over a link.

The same checks run on a live endpoint in real time and on our simulator in lock-step: they only say what to wait for.
"""

import select
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from sitl.launch.fleet import SimFleet, VehicleSpec
from tests.conformance.air import Air
from tests.conformance.turns import Turns
from tui_gcs.core.base.clock import Clock, MonotonicClock, VirtualClock
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.links import Link, open_link
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.links.spec import parse_link
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import EventClass, Freshness
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.requests.frontend import attach_frontend
from tui_gcs.core.scenario.load import parse
from tui_gcs.core.station.parts import StationConfig
from tui_gcs.core.station.station import Station

TICK_S = 0.05
RECEIVE_S = 0.002
LISTEN_S = 10.0
"""Without ids: whoever is heard in this time."""
TELL_S = 10.0
MAX_AT_ONCE = 8
"""Vehicles that fly at the same time; more are judged in groups."""
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
vehicles = [{nobody}]
"""
PLACE = """
[[place]]
vehicle = {vehicle}
place_m = [0.0, 0.0]
layer_m = 10.0
"""
LAYER_GAP_M = 3.0


def scenario_toml(lat: float, lon: float, amsl: float, ids: tuple[int, ...]) -> str:
    """A scenario about (lat, lon): the station wants one. Those who are judged are in no team: checks fly them."""
    nobody = max(set(range(1, 250)) - set(ids))
    place = PLACE.format(vehicle=nobody)
    return SCENARIO.format(lat=lat, lon=lon, amsl=amsl, nobody=nobody) + place


class Failed(Exception):
    """What the vehicle (or the station) did not do."""


class NotApplicable(Exception):
    """Why a check says nothing about this vehicle."""


@dataclass
class Field:
    """A station and the vehicles to be judged. `pump` lets a moment pass, for everybody."""

    station: Station
    clock: Clock
    ids: tuple[int, ...]
    air: Air
    turns: Turns
    close: Callable[[], None]
    borrowed: dict[tuple[int, str], float] = field(default_factory=dict)
    """What parameters were before a check changed them, by vehicle and name: all of it is given back."""

    def vehicle(self, system: int) -> Vehicle:
        """The station's picture of a vehicle.

        Raises:
            Failed: It was never heard.
        """
        vehicle = self.station.picture.fleet.vehicles.get(system)
        if vehicle is None:
            raise Failed(f"vehicle {system} was never heard")
        return vehicle

    def run(self, seconds: float) -> None:
        """Let time pass."""
        end_s = self.clock.now() + seconds
        while self.clock.now() < end_s - 1e-9:
            self.turns.wait()

    def until(self, reached: Callable[[], bool], limit_s: float, what: str | Callable[[], str]) -> float:
        """Let time pass until `reached`; how long it took.

        Raises:
            Failed: Not within `limit_s`; `what` names what was waited for.
        """
        begin_s = self.clock.now()
        while not reached():
            if self.clock.now() - begin_s > limit_s:
                raise Failed(f"{what() if callable(what) else what}: not within {limit_s:g} s")
            self.turns.wait()
        return self.clock.now() - begin_s

    @contextmanager
    def unheard(self, system: int) -> Iterator[None]:
        """One vehicle hears nothing of the station, which hears it: for the vehicle the station is dead."""
        with self.air.muted(self.vehicle(system).address):
            yield

    def layer_m(self, system: int) -> float:
        """How much higher than the first one a vehicle flies: they fly at the same time."""
        return LAYER_GAP_M * (self.ids.index(system) % MAX_AT_ONCE)

    def said(self, system: int, since: int = 0) -> list[str]:
        """What a vehicle said itself (STATUSTEXT, EVENT) after event number `since`, each once."""
        own = (EventClass.VEHICLE, EventClass.SENSOR)
        events = self.station.records.events.since(since, 2000)
        return list(dict.fromkeys(e.text for e in events if e.source == f"vehicle {system}" and e.cls in own))

    @property
    def last_event(self) -> int:
        """The number of the newest event."""
        events = self.station.records.events.since(0, 1)
        return events[-1].seq if events else 0

    def alone(self) -> bool:
        """Whether several vehicles are behind one address, so that none of them can be cut off by itself."""
        known = [self.vehicle(i).address for i in self.ids if i in self.station.picture.fleet.vehicles]
        return len(set(map(str, known))) < len(known)

    def discover(self, limit_s: float, wait_more: Callable[[str], None]) -> tuple[int, ...]:
        """Wait for all vehicles to be heard with a position, then put the scenario's origin where the first one is.

        Without ids they are those heard. Gives those that did not come; `wait_more` is told now and then who is
        missing.

        Raises:
            Failed: Nobody came.
        """
        vehicles, told_s = self.station.picture.fleet.vehicles, self.clock.now()
        if not self.ids:
            self.run(LISTEN_S)
            self.ids = tuple(sorted(i for i, v in vehicles.items() if v.identity.confirmed))

        def missing() -> tuple[int, ...]:
            now = self.clock.now()
            return tuple(i for i in self.ids if i not in vehicles or vehicles[i].freshness(now) is not Freshness.OK)

        end_s = self.clock.now() + limit_s
        while missing() and self.clock.now() < end_s:
            self.turns.wait()
            if self.clock.now() - told_s > TELL_S:
                told_s = self.clock.now()
                silent = [i for i in missing() if i not in vehicles]
                others = [i for i in missing() if i in vehicles]
                reported = [f"{_named(silent)} not heard"] if silent else []
                wait_more("; ".join(reported + ([f"{_named(others)} without a position"] if others else [])))
        absent = missing()
        self.ids = tuple(i for i in self.ids if i not in absent)
        if not self.ids:
            raise Failed(f"no vehicle is heard with a position on {', '.join(self.station.comms.links)}")
        first = vehicles[self.ids[0]]
        toml = scenario_toml(
            first.telemetry.lat_deg,
            first.telemetry.lon_deg,
            first.telemetry.alt_amsl_m - first.telemetry.alt_rel_m,
            self.ids,
        )
        self.station.active.set_scenario(parse(toml, where="conformance"), toml)
        self.run(1.0)  # positions in the new origin's frame
        return absent


def _named(ids: list[int]) -> str:
    return f"vehicle{'s'[: len(ids) - 1]} {', '.join(map(str, ids))}"


def live_field(link: str, ids: tuple[int, ...], log_dir: Path) -> Field:
    """A field on a real link, in real time. What answers there is live; without ids, whoever is heard."""
    clock = MonotonicClock()
    opened: Link = open_link(parse_link(link))
    air = Air(opened, clock.now)
    station, end = _station(clock, [air], ids, log_dir)
    ticked_s = [0.0]

    def move() -> None:
        select.select(opened.filenos(), [], [], RECEIVE_S)
        station.receive()
        if time.monotonic() - ticked_s[0] >= TICK_S:
            ticked_s[0] = time.monotonic()
            station.tick()

    def close() -> None:
        end()
        opened.close()

    return Field(station, clock, ids, air, Turns(move, clock.now), close)


def simulated_field(autopilots: tuple[str, ...], log_dir: Path, *, seed: int = 1) -> Field:
    """A field with our simulator in lock-step: one vehicle per entry of `autopilots`, ids from 1."""
    lat, lon, amsl = SIM_HOME
    specs = [
        VehicleSpec(i, lat, lon + 2e-4 * i, amsl, autopilot=autopilot) for i, autopilot in enumerate(autopilots, 1)
    ]
    clock, link = VirtualClock(), MemoryLink("memory")
    sim = SimFleet(specs, seed=seed)
    air = Air(link, clock.now)
    station, end = _station(clock, [air], tuple(range(1, len(specs) + 1)), log_dir)

    def move() -> None:
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
        station.tick()
        _carry(link, sim)

    return Field(station, clock, tuple(range(1, len(specs) + 1)), air, Turns(move, clock.now), end)


def _carry(link: MemoryLink, sim: SimFleet) -> None:
    while link.sent:
        data, address = link.sent.popleft()
        sim.receive(int(address[1]), data)


def _station(clock: Clock, links: list[Air], ids: tuple[int, ...], log_dir: Path) -> tuple[Station, Callable[[], None]]:
    toml = scenario_toml(0.0, 0.0, 0.0, ids or (1,))
    recorder, journal = TlogWriter(log_dir / "conformance.tlog"), Journal(log_dir / "conformance.jsonl")
    config = StationConfig(RunKind.LIVE, parse(toml, where="conformance"), toml, "", judge_steps=False, folder=log_dir)
    station = Station(config, clock, MemoryBus(), list[Link](links), recorder, journal)
    attach_frontend(station)

    def close() -> None:
        station.close()
        recorder.close()
        journal.close()

    return station, close
