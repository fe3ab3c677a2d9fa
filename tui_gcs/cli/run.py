"""`tui-gcs run`: a whole scenario in real time without a console."""

import argparse
import os
import signal
import sys
import threading
import time

import msgspec

from tui_gcs.cli.command_report import check_output, finish
from tui_gcs.cli.common import join, login_name, read_planners, read_scenario, running
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.flights.alarm_lines import AlarmLines
from tui_gcs.cli.flights.scenario_options import require_fit
from tui_gcs.cli.flights.station_keeper import StationKeeper
from tui_gcs.cli.fly import start
from tui_gcs.cli.progress_bar import ProgressBar
from tui_gcs.cli.result_table import document, show
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.judging.mission_script import Script
from tui_gcs.core.protocol.bus import BusError
from tui_gcs.core.protocol.common import Reply, Shutdown, decode, encode
from tui_gcs.core.protocol.preflight import OVERRIDABLE
from tui_gcs.core.protocol.zenoh_bus import QueuedBus
from tui_gcs.core.scenario.model import Scenario

POLL_S = 0.05
SILENT_S = 10.0
"""The run gives up after this long without a message of the station; vehicles hold by themselves."""


def run(arguments: argparse.Namespace) -> int:
    """Start a station, fly, report the result and end the station."""
    kind = RunKind(arguments.kind.upper())
    if running(kind):
        raise CommandError(f"a {kind} station already runs: `tui-gcs attach` joins it, `tui-gcs stop` ends it first")
    check_output(arguments)
    _check_overrides(arguments.override)
    planners = read_planners(arguments.planner)
    scenario, toml, _ = read_scenario(arguments.scenario, planners)
    require_fit(scenario, toml, arguments.scenario, planners)
    if kind is RunKind.LIVE and sys.stdin.isatty() and not arguments.yes:
        _ask_count(scenario)
    start(kind, arguments)
    sys.stderr.write(f"tui-gcs: a vehicle with a low battery: {scenario.battery.words}\n")
    return _fly(scenario, kind, arguments)


def _check_overrides(names: list[str]) -> None:

    if wrong := [name for name in names if name not in OVERRIDABLE]:
        raise CommandError(
            f"--override {wrong[0]!r}: no check that can be overridden; these can: {', '.join(OVERRIDABLE)}"
        )


def _ask_count(scenario: Scenario) -> None:
    """Have the user type the number of vehicles before a LIVE flight."""
    count = scenario.vehicle_count
    teams = ", ".join(f"{team.name} {team.size}" for team in scenario.teams)
    question = f"LIVE: {scenario.name} will arm and fly {count} vehicles ({teams}). Type their number to start: "
    try:
        answer = input(question)
    except EOFError:
        answer = ""
    if answer.strip() != str(count):
        raise CommandError("not started")


def _end_station(bus: QueuedBus, principal: str) -> str:
    """End the station; why it does not end, or ""."""
    try:
        reply = decode(bus.ask(f"gcs/req/{principal}", encode(Shutdown())), Reply)
    except (BusError, msgspec.MsgspecError) as error:
        return str(error)
    return "" if reply.ok else reply.text


def _fly(scenario: Scenario, kind: RunKind, arguments: argparse.Namespace) -> int:

    bus = QueuedBus(join(kind), lambda: None)
    principal = f"run-{os.getpid()}"
    script = Script(
        scenario,
        bus,
        principal=principal,
        whole_duration=True,
        operator=arguments.operator or login_name() or "run",
        overrides=tuple(arguments.override),
        insists=arguments.yes or not sys.stdin.isatty(),
    )
    interrupted = threading.Event()
    # A KeyboardInterrupt would end the run with vehicles in the air: they return and land first.
    signal.signal(signal.SIGINT, lambda *_: interrupted.set())
    signal.signal(signal.SIGTERM, lambda *_: interrupted.set())
    bar, alarms = ProgressBar(), AlarmLines()
    keeper = StationKeeper(lambda: running(kind), lambda: start(kind, arguments))
    reported = 0
    while not script.done:
        time.sleep(POLL_S)
        if bus.run_pending():
            keeper.heard()
        if interrupted.is_set():
            script.abort("interrupted: vehicles return and land")
        # Its supervisor starts a station that died again; vehicles in the air are not left while that may happen.
        if keeper.silent_s > SILENT_S and (interrupted.is_set() or not script.armed):
            raise CommandError(f"the station has been silent for {SILENT_S:.0f} s: `tui-gcs attach` looks at it")
        script.tick()
        for check in script.overridden[reported:]:
            sys.stderr.write(f"tui-gcs: flying in spite of {check.words()}\n")
        reported = len(script.overridden)
        for line in alarms.new(script.alarms):
            bar.end()
            sys.stderr.write(f"tui-gcs: {line}\n")
        silence = keeper.look(in_flight=bool(script.armed) and not interrupted.is_set())
        # What was heard before is not how the vehicles are now.
        bar.show(script.progress, f"{silence}, before: {script.headline}" if silence else script.headline)
    bar.end()
    if refusal := _end_station(bus, principal):
        sys.stderr.write(f"tui-gcs: the station goes on: {refusal}\n")
    bus.close()
    result = script.referee.result()
    show(arguments, result, script.problem)
    return finish(arguments, document(result, script.problem))
