"""`tui-gcs fly`: a station on real links or on another program's simulator, and a console on it."""

import argparse
import os
from pathlib import Path

from tui_gcs.cli.common import (
    check_dialects,
    check_forward,
    check_links,
    loopback_only,
    need_terminal,
    read_planners,
    read_scenario,
    report_planners,
    running,
)
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.client.launcher import LaunchOptions, launch, running_scenario
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.core.scenario.remote_id import MAX_ALT_M, MIN_ALT_M, place_problem

DEFAULT_LINK = "udpin:127.0.0.1:14550"


def run(arguments: argparse.Namespace) -> int:
    """Start a station if none of this kind runs, then attach a console."""
    need_terminal()
    from tui_gcs.cli.console import attach, preferences

    wanted = preferences(arguments)  # what is wrong with it is told before anything starts
    kind = RunKind(arguments.kind.upper())
    starts_station = not running(kind)
    if not starts_station:
        _same_scenario(kind, arguments)
    else:
        start(kind, arguments)
    return attach(kind, wanted, starts_station=starts_station)


def start(kind: RunKind, arguments: argparse.Namespace) -> None:
    """Check everything that can be checked before the start, then launch the station. Raises `CommandError`."""
    planners = read_planners(arguments.planner)
    scenario, toml, path = read_scenario(arguments.scenario, planners)
    links = arguments.link or [DEFAULT_LINK]
    if kind is RunKind.SIM:
        loopback_only(links)
    forward = [(link, False) for link in arguments.forward] + [(link, True) for link in arguments.forward_commands]
    if kind is RunKind.SIM:
        loopback_only([link for link, _ in forward])
    check_forward(links, [link for link, _ in forward])
    check_links(links + [link for link, _ in forward])
    check_dialects(arguments.dialect)
    operator_at = _operator_at(arguments, scenario)
    dialects = [str(Path(file).resolve()) for file in arguments.dialect]
    report_planners(planners, scenario)
    launch(
        kind,
        path,
        toml,
        links,
        LaunchOptions(
            forced_kind=kind is RunKind.SIM,
            forward=forward,
            dialects=dialects,
            planners=list(planners.values()),
            terrain=str(Path(terrain).resolve()) if (terrain := os.environ.get("TUI_GCS_TERRAIN")) else "",
            operator_at=operator_at,
        ),
    )


def _operator_at(arguments: argparse.Namespace, scenario: Scenario) -> dict[str, float] | None:
    """Return the operator's place from the command line as fields of `OperatorId`. Raises `CommandError`."""
    alt_m = arguments.operator_alt
    if arguments.operator_at is None:
        if alt_m is not None:
            raise CommandError("--operator-alt: needs --operator-at LAT LON")
        return None
    lat_deg, lon_deg = arguments.operator_at
    if why := place_problem((lat_deg, lon_deg), LocalFrame(scenario.origin)):
        raise CommandError(f"--operator-at: {why}")
    if alt_m is None:
        return {"lat_deg": lat_deg, "lon_deg": lon_deg}
    if not MIN_ALT_M < alt_m <= MAX_ALT_M:
        raise CommandError(f"--operator-alt: a height of {alt_m:g} m cannot be")
    return {"lat_deg": lat_deg, "lon_deg": lon_deg, "alt_m": alt_m}


def _same_scenario(kind: RunKind, arguments: argparse.Namespace) -> None:
    there = running_scenario(kind)
    if there and there != str(Path(arguments.scenario).resolve()):
        raise CommandError(
            f"a {kind} station already flies {there}: `tui-gcs attach` joins it, `tui-gcs stop` ends it first"
        )
    if arguments.planner:
        raise CommandError(
            f"a {kind} station already runs: --planner is for a new one; end it with `tui-gcs stop` first"
        )
    if arguments.link:
        raise CommandError(f"a {kind} station already runs with its own links: `tui-gcs attach` joins it")
    if arguments.operator_at:
        raise CommandError(
            f"a {kind} station already runs: --operator-at is for a new one; change [remote_id] and apply it instead"
        )
