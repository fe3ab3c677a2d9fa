"""`tui-gcs rehearse`: a scenario flown in lock-step as it would be for real, with faults, and judged."""

import argparse
import sys
import time
from pathlib import Path

import msgspec

from tui_gcs.cli.command_report import CommandReport, check_output, finish
from tui_gcs.cli.common import check_writable, login_name
from tui_gcs.cli.exit_codes import CANNOT, CommandError, ReportCode
from tui_gcs.cli.flights import metric_files
from tui_gcs.cli.lock_step_run import read_request
from tui_gcs.cli.result_table import document, show, written
from tui_gcs.core.base.directories import ConfigError, state_dir
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.base.text import clean
from tui_gcs.core.judging.flight_result import FlightResult
from tui_gcs.core.judging.referee import Referee
from tui_gcs.core.protocol.bus import FLEET, Bus
from tui_gcs.core.protocol.common import decode
from tui_gcs.core.records.rehearsal_files import REPORT_NAME, RESULT_NAME, SCENARIO_NAME
from tui_gcs.core.records.rehearsal_store import FILE, RECORDING, RehearsalRecord, plan_digest, remember
from tui_gcs.planner.runtime.planner_subprocess import FrameTime
from tui_gcs.rehearsal.fault_schedule import FaultScheduleError, ScheduledFault, drains, losses, restart
from tui_gcs.rehearsal.report.flight_recording import FlightRecord
from tui_gcs.rehearsal.report.page import page

IN_THE_FOLDER = ""
"""The value of `--report` without a file: the report goes beside the recording."""
IN_THE_PLAN = ("scenario", "autopilots", "planner", "set", "vehicles")
"""Conditions that are part of the plan itself, or noted apart from the others."""


def run(arguments: argparse.Namespace) -> int:
    """Fly, print the table and write the report. The exit code is 0 only if every gate holds."""
    check_output(arguments)
    if (arguments.report or "").endswith(".toml"):
        raise CommandError(f"--report {clean(arguments.report, 400)}: a scenario would be overwritten; name it first")
    for file in (arguments.report or None, arguments.metrics):
        check_writable(file)
    records: list[FlightRecord] = []
    flown = SimulatedTime()

    def watch(bus: Bus, _referee: Referee) -> None:
        bus.subscribe(FLEET, flown.on_frame)
        # Recording measures the idleness of every zone a second time, so it is done for a report only.
        if arguments.report is not None:
            records.append(FlightRecord(scenario, bus))

    try:
        planned = _faults(arguments)
        flight = read_request(arguments, "rehearsal")
        scenario, begin_s = flight.scenario, time.monotonic()
        if arguments.report == IN_THE_FOLDER:
            arguments.report = str(flight.folder / REPORT_NAME)
        # At once: a console that cancels this flight removes what was recorded of it.
        sys.stdout.write(f"{RECORDING}{flight.folder}\n")
        sys.stdout.flush()
        flight.tell_limits()
        plan = plan_digest(scenario, flight.planners)
        result, problem = flight.fly(planned, watch)
    except FaultScheduleError as error:
        raise CommandError(str(error)) from None
    show(arguments, result, problem)
    unwritten = []
    if arguments.metrics and not metric_files.write(arguments.metrics, result):
        unwritten.append(arguments.metrics)
    report = document(result, problem)
    _keep(flight.folder, flight.toml, report)
    flight.tell_links()
    if arguments.rounds in (None, len(scenario.rounds)):
        _remember(scenario.name, plan, result, problem, arguments, flight.folder.name)
    _tell_pace(flown.passed_s, time.monotonic() - begin_s)
    if arguments.report and not _reported(arguments, records[0], result, problem, planned):
        unwritten.append(arguments.report)
    flight.bound_folders()
    return _finish(arguments, report, unwritten)


def _keep(folder: Path, toml: str, report: CommandReport) -> None:
    """Write scenario and result beside the recording, for the console; a failure is one line on stderr."""
    if written(str(folder / SCENARIO_NAME), toml.encode()):
        written(str(folder / RESULT_NAME), msgspec.json.encode(report))


def _finish(arguments: argparse.Namespace, report: CommandReport, unwritten: list[str]) -> int:
    """Write the document, and return the exit code: 2 where a file of the flight could not be written."""
    if not unwritten:
        return finish(arguments, report)
    text = f"{report.text}; {' and '.join(unwritten)} could not be written"
    report = msgspec.structs.replace(report, ok=False, code=ReportCode.CANNOT_RUN, text=text)
    return finish(arguments, report, CANNOT)


def _reported(
    arguments: argparse.Namespace,
    record: FlightRecord,
    result: FlightResult,
    problem: str,
    planned: list[ScheduledFault],
) -> bool:
    """Write the report, and return whether it could be written."""
    happened = [(h.t_s, str(h)) for h in planned]
    text = page(record, result, problem, conditions=_conditions(arguments), happened=happened)
    if not written(arguments.report, text.encode()):
        return False
    sys.stdout.write(f"report: {arguments.report}\n")
    return True


def _remember(
    scenario: str,
    plan: str,
    result: FlightResult,
    problem: str,
    arguments: argparse.Namespace,
    folder: str,
) -> None:
    """Record for the check before a LIVE start that exactly this plan was rehearsed, and with which result.

    `plan` is its digest as it was when the rehearsal began.
    """
    wrong = {"lose": arguments.lose, "drain": arguments.drain, "restart": [f"{t_s:g}" for t_s in arguments.restart]}
    conditions = [f"--{name} {value}" for name, values in wrong.items() for value in values]
    conditions += [f"{name} {value}" for name, value in _conditions(arguments) if value and name not in IN_THE_PLAN]
    rehearsal = RehearsalRecord(
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
        folder=folder,
        report=str(Path(arguments.report).absolute()) if arguments.report else "",
    )
    try:
        remember(state_dir(RunKind.SIM) / FILE, rehearsal)
    except (ConfigError, OSError) as error:
        sys.stderr.write(
            f"tui-gcs: this rehearsal is not on record, a LIVE start will not know of it: {_words(error)}\n"
        )


def _words(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else "") or str(error)


class SimulatedTime:
    """The time from the first fleet frame of a flight to its last."""

    def __init__(self) -> None:
        """Begin before the first frame."""
        self._first_s: float | None = None
        self.passed_s = 0.0
        """0 before the first frame."""

    def on_frame(self, _key: str, payload: bytes) -> None:
        """Take a fleet frame."""
        t_s = decode(payload, FrameTime).t_s
        self._first_s = t_s if self._first_s is None else self._first_s
        self.passed_s = t_s - self._first_s


def _tell_pace(simulated_s: float, took_s: float) -> None:
    pace = simulated_s / max(took_s, 1e-9)
    sys.stdout.write(f"{simulated_s:.0f} s simulated in {took_s:.0f} s ({pace:.1f} x real time)\n")


def _faults(arguments: argparse.Namespace) -> list[ScheduledFault]:
    planned = losses(arguments.lose) + drains(arguments.drain)
    for t_s in arguments.restart:
        planned += restart(t_s)
    return planned


def _conditions(arguments: argparse.Namespace) -> list[tuple[str, str]]:
    noise = "" if arguments.gps_noise is None else f"{arguments.gps_noise:g} m"
    return [
        ("scenario", arguments.scenario or "the shipped one"),
        ("autopilots", arguments.autopilot or "ardupilot"),
        ("planner", ", ".join(arguments.planner)),
        ("set", ", ".join(arguments.set)),
        ("planners run", (arguments.instances or "").replace("_", " ")),
        ("vehicles", str(arguments.vehicles or "")),
        ("wind, m/s east,north", arguments.wind or ""),
        ("GPS noise", noise),
        ("links", arguments.fault),
        ("intruders in a wave", str(arguments.intruders or "")),
        ("sensor", arguments.sensor or ""),
    ]
