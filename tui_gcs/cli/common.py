"""What several subcommands need: loading scenarios, looking at the terminal, joining a station's bus."""

import contextlib
import ipaddress
import os
import re
import shutil
import sys
import time
from collections.abc import Collection
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.client.launcher import START_LIMIT_S, is_running, start_error
from tui_gcs.core.base.directories import ConfigError, socket_path
from tui_gcs.core.base.run_kind import RunKind

if TYPE_CHECKING:
    from tui_gcs.core.links import LinkSpec
    from tui_gcs.core.protocol.planning import PlannerInfo
    from tui_gcs.core.protocol.zenoh_bus import ZenohBus
    from tui_gcs.core.scenario.model import Scenario
    from tui_gcs.planner.runtime.planner_file import PlannerFile

LEAST_COLUMNS, LEAST_LINES = 80, 24
OURSELVES = ("127.0.0.1", "localhost", "::1", "0.0.0.0", "::")  # noqa: S104 - compared with, not bound
MOST_CELLS = 500
"""Of one line about a planner's file."""
MOST_FOLDERS = 20
"""Logs of so many rehearsals, and of so many other flights in lock-step, are kept."""
ONE_NETWORK = 999
"""Numbers above are vehicles of further networks."""


def read_planners(files: list[str]) -> "dict[str, PlannerInfo]":
    """What the planners in these files declare, by name; their code runs in processes of its own.

    Raises:
        CommandError: one line with file and line of what is wrong.
    """
    if not files:
        return {}
    from tui_gcs.core.base.text import clean
    from tui_gcs.planner.runtime.describe import DescribeError, describe_file

    found: dict[str, PlannerInfo] = {}
    for file in files:
        try:
            info = describe_file(file)
        except DescribeError as error:
            raise CommandError(f"--planner {clean(str(error), MOST_CELLS)}") from None
        if info.name in found:
            other = clean(found[info.name].file)
            raise CommandError(f"--planner {clean(file)}: planner {info.name!r} is in {other}, too: leave one out")
        found[info.name] = info
    return found


def planner_files(planners: "dict[str, PlannerInfo]") -> "dict[str, PlannerFile]":
    """As a host in this process takes them: lock-step runs are one process."""
    from tui_gcs.planner.runtime.planner_file import PlannerFile

    return {name: PlannerFile(name, Path(info.file), info.sha256) for name, info in planners.items()}


def say_planners(planners: "dict[str, PlannerInfo]", scenario: "Scenario") -> None:
    """Which files will fly the vehicles, and which will not: shown before they do."""
    from tui_gcs.core.base.text import clean

    flown = {team.planner for team in scenario.teams}
    for info in planners.values():
        sys.stderr.write(f"planner {info.name} {clean(info.version)}: {clean(info.file)}  sha256 {info.sha256}\n")
        if info.name not in flown:
            sys.stderr.write(
                f"WARNING: planner {info.name} flies nobody: no team of this scenario says planner = "
                f'"{info.name}" (they say {", ".join(sorted(flown))})\n'
            )


def check_seed(seed: int | None) -> None:
    """Raise CommandError for a seed that no scenario may have."""
    if seed is not None and not 0 <= seed < 2**63:
        raise CommandError(f"--seed {seed}: must be from 0 to {2**63 - 1}")


def read_scenario(path: str | None, planners: Collection[str] | None = ()) -> tuple["Scenario", str, str]:
    """(scenario, its TOML text, its path); None is the shipped swarm-challenge.

    `planners`: names of those in files, beside the known ones; None: it may name any. Raises `CommandError`.
    """
    from tui_gcs.core.scenario.load import ScenarioError, load
    from tui_gcs.planner.runtime import registry

    file = Path(path) if path is not None else Path(str(resources.files("tui_gcs"))) / "scenarios/swarm-challenge.toml"
    try:
        scenario = load(file, None if planners is None else {*registry.names(), *planners})
        return scenario, file.read_text(encoding="utf-8"), str(file.resolve())
    except ScenarioError as error:
        raise CommandError(str(error)) from None


def simulable(scenario: "Scenario") -> "Scenario":
    """The scenario, if our simulator can fly it: it has one network. Raises `CommandError`."""
    named = [v for team in scenario.teams for v in team.vehicles]
    named += [place.vehicle for place in scenario.places if place.vehicle is not None]
    if max(named, default=0) > ONE_NETWORK:
        raise CommandError(
            f"vehicle {max(named)} is on a second network: simulate each network by a scenario of its own"
        )
    return scenario


def login_name() -> str:
    """Who runs this, as the system calls him; "" where it does not say."""
    from getpass import getuser

    try:
        return getuser()
    except (KeyError, OSError):
        return ""


def check_writable(json_file: str | None) -> None:
    """Tell before the flight that its result cannot be written. Raises `CommandError`."""
    if json_file is None:
        return
    from tui_gcs.core.base import regular_file as plain_file

    try:
        plain_file.check_writable(Path(json_file))
    except OSError as error:
        raise CommandError(f"{json_file}: cannot be written ({error.strerror})") from None


def new_folder(parent: Path, name: str) -> Path:
    """A folder of this name that was not there, with a number where it was: two flights may begin in one second.

    Raises:
        OSError: it cannot be made.
    """
    number = 1
    while True:
        folder = parent / (name if number == 1 else f"{name}-{number}")
        try:
            folder.mkdir()
        except FileExistsError:
            number += 1
        else:
            return folder


def bound_folders(parent: Path, name: str) -> str:
    """Remove the oldest log folders called `name` (of flights in lock-step), so that few stay; says so in a line.

    A flight can be flown again from its seed. Folders that are called otherwise are never touched.
    """
    own = re.compile(rf"{re.escape(name)}-\d{{8}}-\d{{6}}(-\d+)?")
    with os.scandir(parent) as entries:
        found = [e for e in entries if own.fullmatch(e.name) and e.is_dir(follow_symlinks=False)]
        oldest_first = sorted(found, key=lambda e: (e.stat(follow_symlinks=False).st_mtime_ns, e.name))
    removed = 0
    for entry in oldest_first[: max(len(oldest_first) - MOST_FOLDERS, 0)]:
        with contextlib.suppress(OSError):  # another one may be removing it, too
            shutil.rmtree(entry.path)
            removed += 1
    return f"logs of the newest {MOST_FOLDERS} are kept in {parent}: {removed} older removed\n" if removed else ""


def need_terminal(*, small: bool = False) -> None:
    """Raise `CommandError` unless a console can be shown here; with `small` the few lines of a small terminal do."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise CommandError("no terminal here: use `tui-gcs run`, `tui-gcs status` or `tui-gcs demo --headless`")
    if os.environ.get("TERM", "") in ("", "dumb", "unknown"):
        raise CommandError(
            f"TERM={os.environ.get('TERM', '')!r} cannot show a console: set TERM, e.g. xterm-256color;"
            " line by line: `tui-gcs status`, `tui-gcs vehicle list`, `tui-gcs run`"
        )
    columns, lines = shutil.get_terminal_size()
    if not small and (columns < LEAST_COLUMNS or lines < LEAST_LINES):
        raise CommandError(f"the terminal is {columns}x{lines}: at least {LEAST_COLUMNS}x{LEAST_LINES} is needed")


def running(kind: RunKind) -> bool:
    """Whether a station of `kind` runs. Raises `CommandError` where its directory cannot be used."""
    try:
        return is_running(kind)
    except ConfigError as error:
        raise CommandError(str(error)) from None


def join(kind: RunKind) -> "ZenohBus":
    """Join the bus of the station of `kind`, waiting for it to come up. Raises `CommandError`."""
    from tui_gcs.core.protocol.bus import BusError
    from tui_gcs.core.protocol.zenoh_bus import connect

    end = time.monotonic() + START_LIMIT_S
    while True:
        try:
            if socket_path(kind).exists():
                return connect(socket_path(kind))
            problem = "it does not answer"
        except BusError as error:
            problem = str(error)
        if why := start_error(kind):
            raise CommandError(why)
        if time.monotonic() > end:
            if running(kind):  # on a busy machine it may be up a moment later: nobody should think that there is none
                raise CommandError(
                    f"the {kind} station is running, but {problem}, after {START_LIMIT_S:.0f} s: try `tui-gcs attach`"
                    " or `tui-gcs status` again; `tui-gcs stop` ends it"
                )
            raise CommandError(f"the {kind} station did not start: {problem}")
        time.sleep(0.05)


def check_links(links: list[str]) -> None:
    """Open all links and let go of them, so that a wrong name or a busy port is told before anything starts.

    Raises:
        CommandError: a link is no link, is named twice, or cannot be opened; one line with what to do.
    """
    from tui_gcs.core.links import LinkError, try_links

    specs = _parsed(links)
    names = [spec.name for spec in specs]
    for spec in specs:
        if spec.scheme == "replay":  # its vehicles would look alive, and take no command
            raise CommandError(f"link {spec.name}: a recording is no vehicle. Watch it with `tui-gcs replay`")
        if names.count(spec.name) > 1:
            raise CommandError(f"link {spec.name} is named twice: leave one out")
    try:
        try_links(specs)
    except LinkError as error:
        raise CommandError(str(error)) from None


def check_dialects(files: list[str]) -> None:
    """Read definitions of messages, so that a mistake in them is told before anything starts.

    Raises:
        CommandError: one line with file, message, reason, and what to do.
    """
    if not files:
        return
    from tui_gcs.core.mavlink.dialect import DialectError, add_xml

    for file in files:
        try:
            add_xml(Path(file))
        except DialectError as error:
            raise CommandError(str(error)) from None


def check_forward(links: list[str], forward: list[str]) -> None:
    """Our own vehicles must not come back to us as somebody else's. Raises `CommandError`."""
    listening = {spec.port: spec.name for spec in _parsed(links) if spec.scheme in ("udpin", "tcpin")}
    for spec in _parsed(forward):
        if spec.scheme in ("udpout", "tcp") and spec.port in listening and spec.host in OURSELVES:
            raise CommandError(f"forward {spec.name} leads back into {listening[spec.port]}: name another station")


def loopback_only(links: list[str]) -> None:
    """`--kind sim` is for simulators on this machine. Raises `CommandError`."""
    for spec in _parsed(links):
        if not _is_loopback(spec.host):
            raise CommandError(
                f"link {spec.name}: --kind sim takes loopback links only; without it these vehicles are LIVE"
            )


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name, or none (serial): who knows where that leads
        return False


def _parsed(links: list[str]) -> list["LinkSpec"]:
    from tui_gcs.core.links import LinkError, parse_link

    try:
        return [parse_link(text) for text in links]
    except LinkError as error:
        raise CommandError(str(error)) from None
