"""Functions that several subcommands share: loading scenarios, checking the terminal, joining a station's bus."""

import contextlib
import os
import re
import shutil
import sys
import time
from collections.abc import Collection
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.client.launcher import START_LIMIT_S, is_running, start_error
from tui_gcs.core.base.directories import ConfigError, socket_path
from tui_gcs.core.base.open_files import require_open_files
from tui_gcs.core.base.run_kind import RunKind

# What takes long to load (Zenoh, msgspec, shapely) is imported where it is used: `tui-gcs --help` takes 0.1 s.
if TYPE_CHECKING:
    from tui_gcs.core.links import LinkSpec
    from tui_gcs.core.protocol.base import Message
    from tui_gcs.core.protocol.bus import Bus
    from tui_gcs.core.protocol.planning import PlannerInfo
    from tui_gcs.core.protocol.zenoh_bus import ZenohBus
    from tui_gcs.core.scenario.model import Scenario
    from tui_gcs.planner.runtime.planner_file import PlannerFile

M = TypeVar("M", bound="Message")

PRINCIPAL = "cli"
"""The name under which commands ask a station."""
# The size of a plain terminal, also over SSH.
MIN_COLUMNS, MIN_LINES = 80, 24
MAX_CELLS = 500
"""The longest error line about a planner's file, in terminal cells."""
MAX_LOG_FOLDERS = 20
"""How many log folders of rehearsals are kept, and as many of other lock-step flights."""
MAX_FIRST_NETWORK_ID = 999
"""The highest number of a vehicle on the first network; higher numbers belong to further networks."""


def read_planners(files: list[str]) -> "dict[str, PlannerInfo]":
    """Return what the planners in these files declare, by name. Their code runs in processes of its own.

    Raises:
        CommandError: one line with file and line of the mistake.
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
            raise CommandError(f"--planner {clean(str(error), MAX_CELLS)}") from None
        if info.name in found:
            other = clean(found[info.name].file)
            raise CommandError(f"--planner {clean(file)}: planner {info.name!r} is in {other}, too: leave one out")
        found[info.name] = info
    return found


def planner_files(planners: "dict[str, PlannerInfo]") -> "dict[str, PlannerFile]":
    """Return planner files in the form that a planner host in this process takes."""
    from tui_gcs.planner.runtime.planner_file import PlannerFile

    return {name: PlannerFile(name, Path(info.file), info.sha256) for name, info in planners.items()}


def report_planners(planners: "dict[str, PlannerInfo]", scenario: "Scenario") -> None:
    """Report which planner files will fly vehicles and which will not, before the flight begins."""
    from tui_gcs.core.base.text import clean

    flown = {team.planner for team in scenario.teams}
    for info in planners.values():
        sys.stderr.write(f"planner {info.name} {clean(info.version)}: {clean(info.file)}  sha256 {info.sha256}\n")
        if info.name not in flown:
            sys.stderr.write(
                f"WARNING: planner {info.name} flies no vehicle: no team of this scenario says planner = "
                f'"{info.name}" (they say {", ".join(sorted(flown))})\n'
            )


def check_seed(seed: int | None) -> None:
    """Raise `CommandError` for a seed that no scenario may have."""
    if seed is not None and not 0 <= seed < 2**63:
        raise CommandError(f"--seed {seed}: must be from 0 to {2**63 - 1}")


def read_scenario(path: str | None, planners: Collection[str] | None = ()) -> tuple["Scenario", str, str]:
    """Return (scenario, its TOML text, its path); without a path those of the shipped swarm-challenge.

    `planners` are the planners in files, beside the built-in ones. With None a team may name any planner. Raises
    `CommandError`.
    """
    from tui_gcs.core.scenario.load import ScenarioError, load
    from tui_gcs.planner.runtime import registry

    file = Path(path) if path is not None else Path(str(resources.files("tui_gcs"))) / "scenarios/swarm-challenge.toml"
    try:
        scenario = load(file, None if planners is None else {*registry.names(), *planners})
        return scenario, file.read_text(encoding="utf-8"), str(file.resolve())
    except ScenarioError as error:
        raise CommandError("; ".join(str(error).splitlines())) from None


def simulable(scenario: "Scenario") -> "Scenario":
    """Return the scenario if our simulator can fly it, which has one network. Raises `CommandError` otherwise."""
    named = [v for team in scenario.teams for v in team.vehicles]
    named += [place.vehicle for place in scenario.places if place.vehicle is not None]
    if max(named, default=0) > MAX_FIRST_NETWORK_ID:
        raise CommandError(
            f"vehicle {max(named)} is on a second network: simulate each network by a scenario of its own"
        )
    return scenario


def login_name() -> str:
    """Return the login name of the user; "" where the system does not know it."""
    from getpass import getuser

    try:
        return getuser()
    except (KeyError, OSError):
        return ""


def check_writable(json_file: str | None) -> None:
    """Check before the flight that its result can be written. Raises `CommandError`."""
    if json_file is None:
        return
    from tui_gcs.core.base import regular_file

    try:
        regular_file.check_writable(Path(json_file))
    except OSError as error:
        raise CommandError(f"{json_file}: cannot be written ({error.strerror})") from None


def new_folder(parent: Path, name: str) -> Path:
    """Make a new folder of this name, with a number appended if it exists: two flights may begin in one second.

    Raises:
        OSError: the folder cannot be made.
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
    """Remove the oldest log folders called `name`, and return a line that reports it.

    A lock-step flight can be flown again from its seed. Folders with other names are never touched.
    """
    own = re.compile(rf"{re.escape(name)}-\d{{8}}-\d{{6}}(-\d+)?")
    with os.scandir(parent) as entries:
        found = [e for e in entries if own.fullmatch(e.name) and e.is_dir(follow_symlinks=False)]
        oldest_first = sorted(found, key=lambda e: (e.stat(follow_symlinks=False).st_mtime_ns, e.name))
    removed = 0
    for entry in oldest_first[: max(len(oldest_first) - MAX_LOG_FOLDERS, 0)]:
        with contextlib.suppress(OSError):  # another one may be removing it, too
            shutil.rmtree(entry.path)
            removed += 1
    return f"logs of the newest {MAX_LOG_FOLDERS} are kept in {parent}: {removed} older removed\n" if removed else ""


def need_terminal(*, small: bool = False) -> None:
    """Raise `CommandError` unless a console can be shown here. With `small` any terminal will do."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise CommandError("no terminal here: use `tui-gcs run`, `tui-gcs status` or `tui-gcs demo --headless`")
    if os.environ.get("TERM", "") in ("", "dumb", "unknown"):
        raise CommandError(
            f"TERM={os.environ.get('TERM', '')!r} cannot show a console: set TERM, e.g. xterm-256color;"
            " line by line: `tui-gcs status`, `tui-gcs vehicle list`, `tui-gcs run`"
        )
    require_open_files()
    columns, lines = shutil.get_terminal_size()
    if not small and (columns < MIN_COLUMNS or lines < MIN_LINES):
        raise CommandError(f"the terminal is {columns}x{lines}: at least {MIN_COLUMNS}x{MIN_LINES} is needed")


def running(kind: RunKind) -> bool:
    """Return whether a station of `kind` runs. Raises `CommandError` where its directory cannot be used."""
    try:
        return is_running(kind)
    except ConfigError as error:
        raise CommandError(str(error)) from None


def join(kind: RunKind) -> "ZenohBus":
    """Join the bus of the station of `kind`, and wait for it to come up. Raises `CommandError`."""
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


def ask(bus: "Bus", request: "Message", answer: type[M], advice: str = "") -> M:
    """Return the station's answer to one request; `advice` says what to do where none comes. Raises `CommandError`."""
    import msgspec

    from tui_gcs.core.protocol.bus import REQUEST, BusError
    from tui_gcs.core.protocol.common import decode, encode

    try:
        return decode(bus.ask(REQUEST.format(principal=PRINCIPAL), encode(request)), answer)
    except BusError as error:
        raise CommandError(f"{error}{advice}", ReportCode.NO_ANSWER) from None
    except msgspec.MsgspecError:
        raise CommandError("the station's answer cannot be read: another version of tui-gcs?") from None


def check_links(links: list[str]) -> None:
    """Open and close all links, so that a wrong name or a busy port is found before anything starts.

    Raises:
        CommandError: a link has a wrong form, is named twice, or cannot be opened; one line with what to do.
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
    """Read message definitions, so that a mistake in them is found before anything starts.

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
    """Check that no link is also forwarded to: our vehicles would come back as another station's.

    Raises:
        CommandError: a link and a forwarding partner lead into each other.
    """
    from tui_gcs.core.links.overlaps import led_into

    specs = _parsed(links)
    for spec in _parsed(forward):
        if name := led_into(spec, specs):
            raise CommandError(f"forward {spec.name} leads back into {name}: name another station")


def loopback_only(links: list[str]) -> None:
    """Check that all links are on this machine, which `--kind sim` requires. Raises `CommandError`."""
    from tui_gcs.core.links.spec import is_loopback

    for spec in _parsed(links):
        if not is_loopback(spec.host):
            raise CommandError(
                f"link {spec.name}: --kind sim takes loopback links only; without it these vehicles are LIVE"
            )


def _parsed(links: list[str]) -> list["LinkSpec"]:
    from tui_gcs.core.links import LinkError, parse_link

    try:
        return [parse_link(text) for text in links]
    except LinkError as error:
        raise CommandError(str(error)) from None
