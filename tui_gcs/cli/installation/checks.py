"""What `tui-gcs doctor` looks at: each check returns findings about this computer, with the command that mends each."""

import errno
import grp
import importlib.metadata
import locale
import os
import platform
import re
import shutil
import socket
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from tui_gcs import __version__
from tui_gcs.cli.common import MIN_COLUMNS, MIN_LINES
from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.cli.installation import config
from tui_gcs.client.launcher import is_running
from tui_gcs.client.user_settings import path_of
from tui_gcs.core.base.directories import ConfigError, runtime_dir, state_dir
from tui_gcs.core.base.open_files import require_open_files
from tui_gcs.core.base.run_kind import RunKind

PORT = 14550
"""The UDP port that vehicles and radios send to unless they are told otherwise."""
MIN_FREE_BYTES = 500_000_000
"""An hour of eight vehicles is some 100 MB of telemetry log; below this the disk may be full within a day's flights."""
MIN_COLORS = 256


class Level(StrEnum):
    """How much a finding matters."""

    GOOD = "ok"
    NOTE = "note"
    """Something is missing that only some need."""
    BAD = "BAD"
    """A flight or a console will not work."""


@dataclass(frozen=True)
class Diagnosis:
    """One thing that was looked at."""

    subject: str
    level: Level
    text: str
    mend: str = ""
    """The command, or what else to do; "" where nothing is to be done."""


def python_version() -> Iterator[Diagnosis]:
    """Check the interpreter."""
    text = f"tui-gcs {__version__}, Python {platform.python_version()}, {platform.system()} {platform.machine()}"
    sound = sys.version_info >= (3, 11)
    yield Diagnosis(
        "version", Level.GOOD if sound else Level.BAD, text, "" if sound else "install Python 3.11 or newer"
    )


def dependencies() -> Iterator[Diagnosis]:
    """Check that every dependency is there, in a version that this one is made for."""
    try:
        wanted = importlib.metadata.requires("tui-gcs") or []
    except importlib.metadata.PackageNotFoundError:
        yield Diagnosis("packages", Level.NOTE, "runs from its source, not installed", "pip install .")
        return
    found, wrong = [], []
    for line in wanted:
        match = re.match(r"([\w.-]+)([^;]*)$", line)
        if match is None:
            continue  # of an extra
        name, bounds = match[1], match[2]
        try:
            version = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            wrong.append(f"{name} is missing")
            continue
        found.append(f"{name} {version}")
        if not _within(version, bounds):
            wrong.append(f"{name} {version} is not {bounds}")
    level = Level.BAD if wrong else Level.GOOD
    yield Diagnosis(
        "packages", level, "; ".join(wrong or found), "install tui-gcs again: pip install ." if wrong else ""
    )


def _within(version: str, bounds: str) -> bool:
    """Whether a version lies in bounds like `>=1.2,<3`; later parts of a number than the bound's are not looked at."""
    mine = _numbers(version)
    for mark, limit in re.findall(r"(>=|==|<)([\d.]+)", bounds):
        other = _numbers(limit)
        part = mine[: len(other)]
        if not {">=": part >= other, "==": part == other, "<": part < other}[mark]:
            return False
    return True


def _numbers(version: str) -> list[int]:
    return [int(number) for number in re.findall(r"\d+", version.partition("+")[0])]


def terminal(environ: Mapping[str, str], is_terminal: bool) -> Iterator[Diagnosis]:
    """Check the terminal: whether it is one, its name, size, colours and characters."""
    if not is_terminal:
        yield Diagnosis(
            "terminal", Level.NOTE, "none here: consoles cannot be shown; run, status, rehearse and vehicle work"
        )
        return
    name = environ.get("TERM", "")
    if name in ("", "dumb", "unknown"):
        yield Diagnosis("terminal", Level.BAD, f"TERM={name!r} cannot show a console", "export TERM=xterm-256color")
        return
    columns, lines = shutil.get_terminal_size()
    small = columns < MIN_COLUMNS or lines < MIN_LINES
    text = f"{name}, {columns}x{lines}"
    mend = f"make the window at least {MIN_COLUMNS}x{MIN_LINES}" if small else ""
    yield Diagnosis("terminal", Level.BAD if small else Level.GOOD, text, mend)
    yield _colors(environ)


def _colors(environ: Mapping[str, str]) -> Diagnosis:
    import curses

    if environ.get("NO_COLOR"):
        return Diagnosis("colours", Level.NOTE, "none: NO_COLOR is set", "unset NO_COLOR")
    if environ.get("COLORTERM") in ("truecolor", "24bit"):
        return Diagnosis("colours", Level.GOOD, "16 million")
    try:
        curses.setupterm()
        count = curses.tigetnum("colors")
    except curses.error:
        return Diagnosis(
            "colours", Level.NOTE, "unknown: no description of this terminal is installed", "apt install ncurses-term"
        )
    if count >= MIN_COLORS:
        return Diagnosis("colours", Level.GOOD, str(count))
    return Diagnosis(
        "colours", Level.NOTE, f"{max(count, 0)}: zones are hard to tell apart", "export TERM=xterm-256color"
    )


def characters() -> Iterator[Diagnosis]:
    """Check that the locale can write the map's characters."""
    encoding = locale.getpreferredencoding(False)
    if encoding.upper().replace("-", "") == "UTF8":
        yield Diagnosis("unicode", Level.GOOD, "UTF-8: the map is drawn in braille; TUI_GCS_ASCII=1 draws it without")
    else:
        yield Diagnosis("unicode", Level.NOTE, f"{encoding}: the map is drawn in ASCII", "export LANG=C.UTF-8")


def directories() -> Iterator[Diagnosis]:
    """Check the directories of both kinds of station, and the free space for logs."""
    for kind in RunKind:
        try:
            places = f"{runtime_dir(kind)} (socket), {state_dir(kind)} (logs, keys)"
            yield Diagnosis(f"{kind.lower()} files", Level.GOOD, places)
        except ConfigError as error:
            yield Diagnosis(f"{kind.lower()} files", Level.BAD, str(error))
            continue
        free = shutil.disk_usage(state_dir(kind)).free
        if free < MIN_FREE_BYTES:
            text = f"{free / 1e6:.0f} MB are free for logs"
            yield Diagnosis(f"{kind.lower()} disk", Level.BAD, text, f"du -h {state_dir(kind)}")
    try:
        require_open_files()
    except ConfigError as error:
        yield Diagnosis("open files", Level.BAD, str(error))


def settings(environ: Mapping[str, str]) -> Iterator[Diagnosis]:
    """Check `config.toml`."""
    path = path_of(environ)
    try:
        found = config.read(environ)
        config.own_commands(environ)
    except CommandError as error:
        yield Diagnosis("settings", Level.BAD, str(error))
        return
    keys = ", ".join(found) or "none"
    yield Diagnosis("settings", Level.GOOD, f"{path}: {keys}" if path is not None else "none: TUI_GCS_CONFIG is empty")


def stations() -> Iterator[Diagnosis]:
    """Report which stations run."""
    for kind in RunKind:
        try:
            if is_running(kind):
                yield Diagnosis(f"{kind.lower()} station", Level.GOOD, "is running: tui-gcs attach shows it")
        except ConfigError:
            continue  # said by `directories`


def port() -> Iterator[Diagnosis]:
    """Check that the usual port is free."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as trial:
        try:
            trial.bind(("127.0.0.1", PORT))
        except OSError as error:
            taken = error.errno == errno.EADDRINUSE
            text = f"UDP {PORT} {'is taken: a station or another program listens' if taken else error.strerror}"
            look = f"lsof -i UDP:{PORT}" if platform.system() == "Darwin" else f"ss -lunp 'sport = :{PORT}'"
            yield Diagnosis("port", Level.NOTE, text, f"{look}   shows who; or --link udpin:0.0.0.0:{PORT + 1}")
            return
    yield Diagnosis("port", Level.GOOD, f"UDP {PORT} is free")


def serial_devices() -> Iterator[Diagnosis]:
    """Check the serial devices: radios and USB cables, and whether this user may open them."""
    try:
        from serial.tools.list_ports import comports
    except ImportError:
        return  # said by `dependencies`
    devices = sorted(info.device for info in comports() if info.vid is not None)
    if not devices:
        yield Diagnosis("serial", Level.GOOD, "no radio or USB cable is plugged in")
    for device in devices:
        yield _device(Path(device))


def _device(path: Path) -> Diagnosis:
    if os.access(path, os.R_OK | os.W_OK):
        return Diagnosis("serial", Level.GOOD, f"{path}: --link serial:{path}:57600")
    try:
        group = grp.getgrgid(path.stat().st_gid).gr_name
    except (OSError, KeyError):
        group = "dialout"
    mend = f'sudo usermod -aG {group} "$USER"   then log in again'
    return Diagnosis("serial", Level.BAD, f"{path}: may not be opened; it belongs to the group {group}", mend)


def simulators() -> Iterator[Diagnosis]:
    """Report whether real autopilots are here to be simulated."""
    found = [path for name in ("arducopter", "px4") if (path := shutil.which(name))]
    text = ", ".join(found) or "no real ArduCopter or PX4 on PATH; simulated ones are built in (tui-gcs sim)"
    yield Diagnosis("simulators", Level.GOOD, text)


def all_checks(environ: Mapping[str, str], is_terminal: bool) -> list[Diagnosis]:
    """Return the findings of every check, in the order in which they are shown."""
    checks: tuple[Callable[[], Iterator[Diagnosis]], ...] = (
        python_version,
        dependencies,
        lambda: terminal(environ, is_terminal),
        characters,
        directories,
        lambda: settings(environ),
        stations,
        port,
        serial_devices,
        simulators,
    )
    return [finding for check in checks for finding in check()]
