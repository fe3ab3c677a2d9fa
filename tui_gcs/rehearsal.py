"""Lock-step runs: simulator, station core and planners in one process on one virtual clock.

The one module that knows both `tui_gcs` and `sitl`; between them only MAVLink bytes pass. The same seed gives the
same run, byte for byte.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from sitl.fleet import SimFleet, VehicleSpec
from tui_gcs.core.bus import MemoryBus
from tui_gcs.core.clock import VirtualClock
from tui_gcs.core.journal import Journal
from tui_gcs.core.kinds import Kind
from tui_gcs.core.links.memory import MemoryLink
from tui_gcs.core.places import simulated_places
from tui_gcs.core.recorder import TlogWriter
from tui_gcs.core.results import Result
from tui_gcs.core.scenario import Scenario
from tui_gcs.core.script import Script
from tui_gcs.core.station import Station, StationConfig
from tui_gcs.planner.host import PlannerHost, attach

TICK_S = 0.05
TOKEN = "5eed5eed5eed5eed"  # noqa: S105 - tells our simulator from others in one process; not a secret
LINK = "memory"


def simulated_vehicles(scenario: Scenario) -> list[VehicleSpec]:
    """One vehicle per take-off place that a team needs."""
    ground = scenario.origin.ground_amsl_m
    return [VehicleSpec(system, lat, lon, ground) for system, lat, lon in simulated_places(scenario)]


@dataclass
class LockStep:
    """A station with its simulator and planners, moved on by `step`."""

    scenario: Scenario
    toml: str
    log_dir: Path

    def __post_init__(self) -> None:
        """Build everything; nothing has happened yet."""
        self.clock = VirtualClock()
        self.bus = MemoryBus()
        self.link = MemoryLink(LINK)
        self.sim = SimFleet(simulated_vehicles(self.scenario), seed=self.scenario.seed, token=TOKEN)
        for team in self.scenario.teams:
            attach(PlannerHost(team.name), self.bus)
        self.recorder = TlogWriter(self.log_dir / "run.tlog")
        self.journal = Journal(self.log_dir / "run.jsonl")
        config = StationConfig(Kind.SIM, self.scenario, self.toml, "", TOKEN, judge_steps=False)
        self.station = Station(config, self.clock, self.bus, [self.link], self.recorder, self.journal)

    def step(self) -> None:
        """Move everything on by one tick."""
        self.clock.advance(TICK_S)
        self.sim.step(TICK_S)
        for index, data in self.sim.drain():
            self.link.inject(data, ("sim", index))
        self.station.tick()
        while self.link.sent:
            data, address = self.link.sent.popleft()
            self.sim.receive(int(address[1]), data)

    def close(self) -> None:
        """Close the logs."""
        self.recorder.close()
        self.journal.close()


def rehearse(
    scenario: Scenario,
    toml: str,
    log_dir: Path,
    on_progress: Callable[[float, str], None],
    *,
    rounds: int | None = None,
) -> tuple[Result, str]:
    """Fly the whole scenario as fast as it goes; (result, why it ended early or "").

    `rounds` flies only the first so many rounds.
    """
    if rounds is not None:
        scenario = _first_rounds(scenario, rounds)
    flight = LockStep(scenario, toml, log_dir)
    script = Script(scenario, flight.bus, principal="rehearsal", whole_duration=False)
    while not script.done:
        flight.step()
        script.tick()
        on_progress(script.progress, script.headline)
    flight.close()
    return script.referee.result(), script.problem


def _first_rounds(scenario: Scenario, rounds: int) -> Scenario:
    return msgspec.structs.replace(scenario, rounds=scenario.rounds[:rounds])
