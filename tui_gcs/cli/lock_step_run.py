"""Prepares the lock-step flights of `demo --headless` and `rehearse` from their arguments."""

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from tui_gcs.cli.common import (
    bound_folders,
    check_seed,
    new_folder,
    planner_files,
    read_planners,
    read_scenario,
    report_planners,
    simulable,
)
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.files.check_lines import AUTOPILOTS
from tui_gcs.cli.flights.scenario_options import ScenarioChanges
from tui_gcs.cli.progress_bar import ProgressBar
from tui_gcs.cli.sim_fleet import weather_of, world_of
from tui_gcs.client.launcher import StationLaunchError, check_fault
from tui_gcs.core.base.directories import ConfigError, state_dir
from tui_gcs.core.base.open_files import require_open_files
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.firmware.own_limits import shipped_problems
from tui_gcs.core.judging.flight_result import FlightResult
from tui_gcs.core.judging.referee import Referee
from tui_gcs.core.protocol.bus import Bus
from tui_gcs.core.protocol.common import PlannerInfo
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.planner.runtime import registry
from tui_gcs.rehearsal.fault_schedule import ScheduledFault
from tui_gcs.rehearsal.lock_step import FaultyLinks, FlightConditions, weather_of_spec, world_of_spec
from tui_gcs.rehearsal.rehearse import rehearse


@dataclass(frozen=True)
class LockStepRequest:
    """A lock-step flight as its arguments describe it. Only its log folder exists before `fly`."""

    arguments: argparse.Namespace
    name: str
    """The name of its log folders."""
    scenario: Scenario
    toml: str
    planners: dict[str, PlannerInfo]
    folder: Path
    conditions: FlightConditions

    def fly(
        self,
        faults: list[ScheduledFault] | None = None,
        watch: Callable[[Bus, Referee], None] = lambda _bus, _referee: None,
    ) -> tuple[FlightResult, str]:
        """Fly it; return (result, why it ended early or ""). Raises `FaultScheduleError`."""
        bar = ProgressBar()
        found = rehearse(
            self.scenario,
            self.toml,
            self.folder,
            bar.show,
            self.conditions,
            rounds=self.arguments.rounds,
            files=planner_files(self.planners),
            faults=faults,
            watch=watch,
        )
        bar.end()
        return found

    def tell_limits(self) -> None:
        """Report which limits of the scenario the simulated vehicles do not fly: planners plan with less."""
        flown = self.conditions.autopilots
        numbers = tuple(AUTOPILOTS[name] for name in AUTOPILOTS if flown in (name, "mixed"))
        asked = self.scenario.limits
        for problem in shipped_problems(asked.speed_m_s, asked.accel_m_s2, numbers):
            sys.stdout.write(f"{problem}; planned with that\n")

    def tell_links(self) -> None:
        """Report what bad links did, if any were asked for."""
        if self.conditions.bad_links is not None:
            sys.stdout.write(self.conditions.bad_links.text())

    def bound_folders(self) -> None:
        """Remove the oldest log folders of this name, and report how many."""
        sys.stdout.write(bound_folders(self.folder.parent, self.name))


def read_request(arguments: argparse.Namespace, name: str) -> LockStepRequest:
    """Read the arguments of a flight. Raises `CommandError`."""
    check_seed(arguments.seed)
    require_open_files()
    named = tuple(name for name in arguments.planner if name in registry.names())
    planners = read_planners([file for file in arguments.planner if file not in named])
    _, toml, path = read_scenario(arguments.scenario, None)
    where = Path(path).name if arguments.scenario is None else arguments.scenario
    settings, vehicles = tuple(getattr(arguments, "set", ())), getattr(arguments, "vehicles", None)
    changes = ScenarioChanges(planners, named, settings, vehicles, getattr(arguments, "instances", None))
    scenario, toml = changes.made(toml, where)
    simulable(scenario)
    if arguments.seed is not None:
        scenario = msgspec.structs.replace(scenario, seed=arguments.seed)
    world = world_of(scenario, arguments.intruders, arguments.sensor, scenario.seed)
    weather = weather_of(arguments)
    if arguments.rounds is not None and not 1 <= arguments.rounds <= len(scenario.rounds):
        raise CommandError(f"--rounds {arguments.rounds}: the scenario has {len(scenario.rounds)}")
    try:
        check_fault(arguments.fault)
        folder = new_folder(state_dir(RunKind.SIM), time.strftime(f"{name}-%Y%m%d-%H%M%S"))
    except (ConfigError, OSError, StationLaunchError) as error:
        raise CommandError(str(error)) from None
    report_planners(planners, scenario)
    bad_links = FaultyLinks(arguments.fault, scenario.seed) if arguments.fault else None
    conditions = FlightConditions(
        arguments.autopilot or "ardupilot", bad_links, weather_of_spec(weather), world_of_spec(world)
    )
    return LockStepRequest(arguments, name, scenario, toml, planners, folder, conditions)
