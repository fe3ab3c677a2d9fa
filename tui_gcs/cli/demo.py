"""`tui-gcs demo`: the whole system on simulated vehicles."""

import argparse
import sys

from tui_gcs.cli.common import (
    check_seed,
    need_terminal,
    read_planners,
    read_scenario,
    report_planners,
    running,
)
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.client.launcher import StationLaunchError, check_fault
from tui_gcs.core.base.run_kind import RunKind

NEW_STATION_OPTIONS = ("scenario", "seed", "planner", "fault", "autopilot", "wind", "gps_noise", "intruders", "sensor")
"""Options that only a new station takes; they are refused where one runs already."""


def run(arguments: argparse.Namespace) -> int:
    """Show a console on a simulated fleet; without a terminal fly in lock-step and print a table."""
    # Without a terminal there is nothing to show a console on, so a script gets the result table.
    if arguments.headless or not sys.stdout.isatty():
        return _fly_headless(arguments)
    try:
        check_fault(arguments.fault)
    except StationLaunchError as error:
        raise CommandError(str(error)) from None
    if arguments.json or arguments.output or arguments.rounds:
        raise CommandError("--json, --output and --rounds belong to --headless")
    need_terminal()
    from tui_gcs.cli.console import attach, preferences

    wanted = preferences(arguments)  # what is wrong with it is told before anything starts
    starts_station = not running(RunKind.SIM)
    if starts_station:
        _launch(arguments)
    elif given := [name for name in NEW_STATION_OPTIONS if getattr(arguments, name) not in (None, "", [])]:
        option = given[0].replace("_", "-")
        raise CommandError(f"a SIM station runs already: --{option} is for a new one; end it with `tui-gcs stop` first")
    return attach(RunKind.SIM, wanted, starts_station=starts_station)


def _fly_headless(arguments: argparse.Namespace) -> int:
    """Fly in lock-step, and print the table or the document. The exit code is 0 only if every check holds."""
    from tui_gcs.cli.command_report import check_output, finish
    from tui_gcs.cli.lock_step_run import read_request
    from tui_gcs.cli.result_table import document, show

    check_output(arguments)
    flight = read_request(arguments, "headless")
    result, problem = flight.fly()
    show(arguments, result, problem)
    flight.tell_links()
    flight.bound_folders()
    return finish(arguments, document(result, problem))


def _launch(arguments: argparse.Namespace) -> None:
    from tui_gcs.cli.sim_fleet import spec_of_scenario
    from tui_gcs.client.launcher import LaunchOptions, launch

    check_seed(arguments.seed)
    planners = read_planners(arguments.planner)
    scenario, toml, path = read_scenario(arguments.scenario, planners)
    vehicles = spec_of_scenario(scenario, arguments)
    report_planners(planners, scenario)
    options = LaunchOptions(vehicles, arguments.fault, planners=list(planners.values()))
    launch(RunKind.SIM, path, toml, [], options)
