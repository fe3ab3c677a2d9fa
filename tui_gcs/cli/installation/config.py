"""Settings of a user: `config.toml`, for options that are typed again and again. It imports nothing heavy.

The file is `$TUI_GCS_CONFIG`, else `$XDG_CONFIG_HOME/tui-gcs/config.toml`, else `~/.config/tui-gcs/config.toml`; with
`TUI_GCS_CONFIG=` (empty) none is read. An option on the command line comes before its environment variable, that before
the file, that before the default. A list on the command line replaces the one of the file.
"""

import argparse
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tui_gcs.cli.console_options import THEMES
from tui_gcs.cli.exit_codes import CommandError

if TYPE_CHECKING:
    from tui_gcs.actions.palette.own_commands import OwnCommands

FILE = "TUI_GCS_CONFIG"
"""The variable that names another file."""
MAX_BYTES = 64_000
"""More than any file with these settings; a log that somebody names by mistake is refused at once."""
WITHOUT_SETTINGS = ("stop_fleet", "installation.completion", "installation.doctor")
"""Modules of commands that read no settings: hold, return and land must work whatever stands in a file."""


class Setting(NamedTuple):
    """One key of the file: what it may hold, and which option of which commands it stands for; none for a table.

    It is no dataclass: importing those takes as long as all else that `--help` needs.
    """

    kind: type
    """`str`, `bool`, `float`, `list` of texts, or `dict`: a table of texts."""
    text: str
    """What it means, for the manual."""
    variable: str = ""
    """The environment variable of the option, if it has one."""
    choices: tuple[str, ...] = ()
    only: tuple[str, ...] = ()
    """Modules of the commands that take it; all that have the option where this is empty."""


GENERAL = ("no_color", "quiet")
"""Settings that every command takes, though its arguments hold them only where they were given."""
CHOOSES_STATION = "which station, where both run, for attach, status, preflight and vehicle"
SETTINGS: Mapping[str, Setting] = {
    "link": Setting(list, "links to vehicles, as `--link`"),
    "forward": Setting(list, "other stations that hear the vehicles, as `--forward`"),
    "dialect": Setting(list, "MAVLink definitions of your own, as `--dialect`"),
    "planner": Setting(list, "files of your planners, as `--planner`"),
    "overlay": Setting(list, "drawings on the map, as `--overlay`"),
    "operator": Setting(str, "who signs checks before a start, as `--operator`", "TUI_GCS_OPERATOR"),
    "operator_at": Setting(list, "[latitude, longitude] of the operator for Remote ID, as `--operator-at`"),
    "operator_alt": Setting(float, "height of that place above the WGS-84 ellipsoid, metres, as `--operator-alt`"),
    "kind": Setting(str, CHOOSES_STATION, "", ("sim", "live"), ("station_control", "preflight")),
    "theme": Setting(str, "colours to begin with, as `--theme`", "TUI_GCS_THEME", THEMES),
    "keymap": Setting(str, "file with your own keys, as `--keymap`", "TUI_GCS_KEYMAP"),
    "terrain": Setting(str, "heights of the ground, as `--terrain`", "TUI_GCS_TERRAIN"),
    "base_map": Setting(str, "vector tiles under the map, as `--base-map`", "TUI_GCS_BASE_MAP"),
    "slow": Setting(bool, "for thin links, as `--slow`", "TUI_GCS_SLOW"),
    "plain": Setting(bool, "stock Textual, as `--plain`", "TUI_GCS_PLAIN"),
    "read_only": Setting(bool, "consoles command nothing, as `--read-only`", "TUI_GCS_READ_ONLY"),
    "autopilot": Setting(str, "of simulated vehicles, as `--autopilot`", "", ("ardupilot", "px4", "mixed")),
    "no_color": Setting(bool, "without colours, as `--no-color`", "NO_COLOR"),
    "quiet": Setting(bool, "no progress and remarks, as `--quiet`", "TUI_GCS_QUIET"),
    "commands": Setting(dict, "table of your own commands after `:` in a console"),
}
"""Every key. What gives rights to others, overrides a check, or makes vehicles SIM is not among them: that is typed."""


def path_of(environ: Mapping[str, str]) -> Path | None:
    """Return the path of the file, whether or not it exists; None where none is to be read."""
    if FILE in environ:
        return Path(environ[FILE]) if environ[FILE] else None
    base = environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(base) / "tui-gcs" / "config.toml"


def read(environ: Mapping[str, str]) -> dict[str, Any]:
    """Return the settings of the file by key; none where there is no file.

    Raises:
        CommandError: the file that `$TUI_GCS_CONFIG` names is not there, cannot be read, or holds a mistake; one line
            with file and line.
    """
    path = path_of(environ)
    if path is None or (FILE not in environ and not path.exists()):
        return {}
    import tomllib

    text = _text_of(path)
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # no TOML, nesting without end
        found = re.search(r"\(at line (\d+), column \d+\)", str(error))
        line = found[1] if found else len(text.splitlines())
        raise CommandError(f"{path}:{line}: no TOML: {error}") from None
    for key, value in content.items():
        if problem := _problem(key, value):
            raise CommandError(f"{path}{_line(text, key)}: {problem}")
    return content


def _text_of(path: Path) -> str:
    """Return the text of the file. Raises `CommandError`."""
    from tui_gcs.core.base.regular_file import open_plain

    try:
        with open_plain(path) as file:
            raw = file.read(MAX_BYTES + 1)
        if len(raw) > MAX_BYTES:
            raise CommandError(f"{path}: longer than {MAX_BYTES} bytes: these are no settings of tui-gcs")
        return raw.decode()
    except OSError as error:
        raise CommandError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError as error:
        raise CommandError(f"{path}:{len(raw[: error.start].splitlines())}: no TOML: {error}") from None


def apply(arguments: argparse.Namespace, environ: Mapping[str, str]) -> dict[str, Any]:
    """Fill options that were not given, from the environment or the file, and return the settings of the file in use.

    Raises:
        CommandError: see `read`.
    """
    module = str(arguments.module)
    operator = environ.get(SETTINGS["operator"].variable, "")
    if operator and getattr(arguments, "operator", None) == "":
        arguments.operator = operator
    if module in WITHOUT_SETTINGS or getattr(arguments, "what", "") == "stop":
        return {}
    used = {}
    for key, value in read(environ).items():
        setting = SETTINGS[key]
        if setting.kind is dict:  # it stands for no option: whoever needs the table reads it
            continue
        option, only = key, setting.only
        if key == "kind" and module == "vehicle.verb":  # there, `--kind` of a plan is something else
            option, only = "station", ()
        known = not only or module in only
        if known and _is_open(arguments, option, key in GENERAL) and setting.variable not in environ:
            setattr(arguments, option, _absolute(key, value, environ))
            used[key] = value
    return used


def own_commands(environ: Mapping[str, str]) -> "OwnCommands | None":
    """Return the operator's own commands for `:`; None where the file has none.

    Raises:
        CommandError: see `read`; or one of the commands has a mistake, in one line with file, line and name.
    """
    table, path = read(environ).get("commands"), path_of(environ)
    if not table or path is None:
        return None
    from tui_gcs.actions.palette.own_commands import CommandLineError, OwnCommands

    try:
        return OwnCommands(table)
    except CommandLineError as error:
        line = _line(_text_of(path), error.command, "commands") if error.command else ""
        raise CommandError(f"{path}{line}: commands: {error}") from None


def _is_open(arguments: argparse.Namespace, option: str, general: bool) -> bool:
    """Return whether a command has this option and it was not given: it is what argparse begins with."""
    if not hasattr(arguments, option):
        return general
    value = getattr(arguments, option)
    return value is None or value is False or value in ("", [])


def _absolute(key: str, value: Any, environ: Mapping[str, str]) -> Any:
    """Return paths as seen from the file's folder: a command may be typed anywhere."""
    path = path_of(environ)
    if path is None or key not in ("dialect", "planner", "overlay", "keymap", "terrain", "base_map"):
        return value
    names = [value] if isinstance(value, str) else value
    found = [str(path.absolute().parent / Path(name).expanduser()) for name in names]
    return found[0] if isinstance(value, str) else found


def _problem(key: str, value: Any) -> str:
    """Return what is wrong with one key; "" if nothing is."""
    setting = SETTINGS.get(key)
    if setting is None:
        return f"{key[:30]!r}: no such setting; there are: {', '.join(SETTINGS)}"
    if key == "operator_at":
        sound = isinstance(value, list) and len(value) == 2 and all(type(v) in (int, float) for v in value)
        return "" if sound else "operator_at: must be [latitude, longitude] in degrees"
    if setting.kind is list:
        sound = isinstance(value, list) and all(isinstance(v, str) for v in value)
        return "" if sound else f'{key}: must be a list of texts, as {key} = ["…"]'
    if setting.kind is dict:
        sound = isinstance(value, dict) and all(isinstance(v, str) for v in value.values())
        return "" if sound else f'{key}: must be a table of texts, as [{key}] and below it name = "…"'
    if setting.kind is float:
        return "" if type(value) in (int, float) else f"{key}: must be a number"
    if not isinstance(value, setting.kind):
        return f"{key}: must be {'true or false' if setting.kind is bool else 'a text'}"
    if setting.choices and value not in setting.choices:
        return f"{key} = {str(value)[:30]!r}: must be one of {', '.join(setting.choices)}"
    return ""


def _line(text: str, key: str, table: str = "") -> str:
    """Return `:LINE` of a key in the file or in one of its tables, "" where it has a form that is not looked for."""
    begin = re.search(rf"^\s*\[\s*{table}\s*\]", text, re.MULTILINE) if table else None
    found = re.compile(rf"^\s*[\[\"']*{re.escape(key)}\b", re.MULTILINE).search(text, begin.end() if begin else 0)
    return "" if found is None else f":{len(text[: found.end()].splitlines())}"
