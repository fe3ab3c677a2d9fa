"""`tui-gcs planner watch`: flies a planner on simulated vehicles, and each version of its file as it is saved."""

import argparse

import tomlkit

from tui_gcs.cli.common import check_seed, need_terminal, read_planners, read_scenario, report_planners, running
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol.planning import PlannerInfo
from tui_gcs.core.scenario.load import ScenarioError, parse


def run(arguments: argparse.Namespace) -> int:
    """Start a station and attach a console."""
    need_terminal()
    from tui_gcs.cli.console import attach, preferences

    options = preferences(arguments)
    start(arguments)
    return attach(RunKind.SIM, options)


def start(arguments: argparse.Namespace) -> None:
    """Launch a station with simulated vehicles. Raises `CommandError`."""
    if running(RunKind.SIM):
        raise CommandError("a SIM station runs already: `tui-gcs stop` ends it, then watch")
    from tui_gcs.cli.sim_fleet import spec_of_scenario
    from tui_gcs.client.launcher import LaunchOptions, launch

    check_seed(arguments.seed)
    planners = read_planners([arguments.file])
    (info,) = planners.values()
    _, toml, path = read_scenario(arguments.scenario, None)  # this one flies for all its teams
    toml = flown_by(toml, info, arguments.instances)
    try:
        scenario = parse(toml, path, {info.name})
    except ScenarioError as error:
        raise CommandError(str(error)) from None
    vehicles = spec_of_scenario(scenario, arguments)
    report_planners(planners, scenario)
    launch(RunKind.SIM, path, toml, [], LaunchOptions(vehicles, planners=[info], watch=True))


def flown_by(toml: str, info: PlannerInfo, instances: str | None = None) -> str:
    """Return the scenario with this planner in every team; a team that names it already keeps its parameters.

    `instances` replaces that of the scenario; with None a team keeps its own.
    """
    document = tomlkit.parse(toml)
    for team in document["team"]:
        if team["planner"] != info.name:
            team["planner"] = info.name
            team.pop("parameters", None)
        if instances is not None:
            team["instances"] = instances
    return tomlkit.dumps(document)
