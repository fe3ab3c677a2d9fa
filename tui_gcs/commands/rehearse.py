"""`tui-gcs rehearse`: a scenario flown in lock-step as it would be for real, with what may go wrong, and judged."""

import argparse
import sys
import time
from typing import TYPE_CHECKING

from tui_gcs.commands.common import (
    bound_folders,
    check_seed,
    check_writable,
    login_name,
    new_folder,
    planner_files,
    read_planners,
    read_scenario,
    say_planners,
    simulable,
)
from tui_gcs.commands.headless import ProgressBar, report, written
from tui_gcs.core.config import ConfigError, state_dir
from tui_gcs.core.kinds import Kind
from tui_gcs.exits import CANNOT, CommandError

if TYPE_CHECKING:
    from tui_gcs.core.results import Result
    from tui_gcs.happenings import Happening
    from tui_gcs.report.recording import FlightRecord


def run(arguments: argparse.Namespace) -> int:
    """Fly, print the table, write the report; 0 only if every gate holds."""
    import msgspec

    from tui_gcs.commands.sim_fleet import weather_of, world_of
    from tui_gcs.core.bus import Bus
    from tui_gcs.core.rehearsals import plan_digest
    from tui_gcs.core.results import Referee
    from tui_gcs.happenings import HappeningError
    from tui_gcs.launcher import LaunchError, check_fault
    from tui_gcs.rehearsal import BadLinks, rehearse, weather_of_spec, world_of_spec
    from tui_gcs.report.recording import FlightRecord

    check_seed(arguments.seed)
    for file in (arguments.json, arguments.report):
        check_writable(file)
    planners = read_planners(arguments.planner)
    scenario, toml, _ = read_scenario(arguments.scenario, planners)
    simulable(scenario)
    if arguments.seed is not None:
        scenario = msgspec.structs.replace(scenario, seed=arguments.seed)
    if arguments.rounds is not None and not 1 <= arguments.rounds <= len(scenario.rounds):
        raise CommandError(f"--rounds {arguments.rounds}: the scenario has {len(scenario.rounds)}")
    try:
        check_fault(arguments.fault)
        planned = _happenings(arguments)
        folder = new_folder(state_dir(Kind.SIM), time.strftime("rehearsal-%Y%m%d-%H%M%S"))
    except (ConfigError, OSError, LaunchError, HappeningError) as error:
        raise CommandError(str(error)) from None
    say_planners(planners, scenario)
    plan = plan_digest(scenario, planners)
    bar, begin_s = ProgressBar(), time.monotonic()
    records: list[FlightRecord] = []

    def watch(bus: Bus, _referee: Referee) -> None:
        records.append(FlightRecord(scenario, bus))

    bad_links = BadLinks(arguments.fault, scenario.seed) if arguments.fault else None
    try:
        result, problem = rehearse(
            scenario,
            toml,
            folder,
            bar.show,
            rounds=arguments.rounds,
            autopilots=arguments.autopilot or "ardupilot",
            bad_links=bad_links,
            files=planner_files(planners),
            weather=weather_of_spec(weather_of(arguments)),
            world=world_of_spec(world_of(scenario, arguments.intruders, arguments.sensor, scenario.seed)),
            happenings=planned,
            watch=watch,
        )
    except HappeningError as error:
        raise CommandError(str(error)) from None
    bar.end()
    code = report(result, problem, arguments.json)
    if bad_links is not None:
        sys.stdout.write(bad_links.text())
    if arguments.rounds in (None, len(scenario.rounds)):
        _remember(scenario.name, plan, result, problem, arguments)
    _tell_pace(records[0], time.monotonic() - begin_s)
    if arguments.report and not _reported(arguments, records[0], result, problem, planned):
        code = CANNOT
    sys.stdout.write(bound_folders(folder.parent, "rehearsal"))
    return code


def _reported(
    arguments: argparse.Namespace, record: "FlightRecord", result: "Result", problem: str, planned: "list[Happening]"
) -> bool:
    """Write the report; whether it could be written."""
    from tui_gcs.report.page import page

    happened = [(h.t_s, str(h)) for h in planned]
    text = page(record, result, problem, conditions=_conditions(arguments), happened=happened)
    if not written(arguments.report, text.encode()):
        return False
    sys.stdout.write(f"report: {arguments.report}\n")
    return True


def _remember(
    scenario: str,
    plan: str,
    result: "Result",
    problem: str,
    arguments: argparse.Namespace,
) -> None:
    """Leave a record for the check before a LIVE start: exactly this plan was rehearsed, and what came of it.

    `plan` is its digest as it was when the rehearsal began.
    """
    from tui_gcs.core.rehearsals import FILE, Rehearsal, remember

    wrong = {"lose": arguments.lose, "drain": arguments.drain, "restart": [f"{t_s:g}" for t_s in arguments.restart]}
    conditions = [f"--{name} {value}" for name, values in wrong.items() for value in values]
    conditions += [
        f"{name} {value}" for name, value in _conditions(arguments) if value and name not in ("scenario", "autopilots")
    ]
    rehearsal = Rehearsal(
        plan=plan,
        passed=result.ok and not problem,
        wall_s=time.time(),
        scenario=scenario,
        checks_good=sum(check.ok for check in result.checks),
        checks=len(result.checks),
        autopilots=arguments.autopilot or "ardupilot",
        conditions=", ".join(conditions),
        problem=problem,
        by=login_name(),
    )
    try:
        remember(state_dir(Kind.SIM) / FILE, rehearsal)
    except (ConfigError, OSError) as error:
        sys.stderr.write(f"tui-gcs: this rehearsal is not on record, a LIVE start will not know of it: {error}\n")


def _tell_pace(record: "FlightRecord", took_s: float) -> None:
    simulated_s = record.simulated_s if record.rounds else 0.0
    pace = simulated_s / max(took_s, 1e-9)
    sys.stdout.write(f"{simulated_s:.0f} s simulated in {took_s:.0f} s ({pace:.0f} x real time)\n")


def _happenings(arguments: argparse.Namespace) -> "list[Happening]":
    from tui_gcs.happenings import drains, losses, restart

    planned = losses(arguments.lose) + drains(arguments.drain)
    for t_s in arguments.restart:
        planned += restart(t_s)
    return planned


def _conditions(arguments: argparse.Namespace) -> list[tuple[str, str]]:
    noise = "" if arguments.gps_noise is None else f"{arguments.gps_noise:g} m"
    return [
        ("scenario", arguments.scenario or "the shipped one"),
        ("autopilots", arguments.autopilot or "ardupilot"),
        ("wind, m/s east,north", arguments.wind or ""),
        ("GPS noise", noise),
        ("links", arguments.fault),
        ("intruders in a wave", str(arguments.intruders or "")),
        ("sensor", arguments.sensor or ""),
    ]
