"""Settings of a user: the keys of `config.toml`, reading the file, and where each value in use comes from.

The file is `$TUI_GCS_CONFIG`, else `$XDG_CONFIG_HOME/tui-gcs/config.toml`, else `~/.config/tui-gcs/config.toml`; with
`TUI_GCS_CONFIG=` (empty) none is read. This module imports nothing heavy, because every command reads the file.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

FILE = "TUI_GCS_CONFIG"
"""The variable that names another file."""
MAX_BYTES = 64_000
"""More than any file with these settings; a log that somebody names by mistake is refused at once."""
THEMES = ("dark", "night", "day", "contrast")
"""Names on the command line, in the order of `terminal.themes.THEMES`, which is not imported: it takes long."""
NOW, CONSOLE, STATION, COMMAND = "at once", "next console", "next station", "next command"
"""When a change of the file counts."""


class SettingsError(Exception):
    """The settings cannot be read or written: one line with file, line and reason."""


class Setting(NamedTuple):
    """One key of the file: what it may hold, and which option of which commands it stands for; none for a table.

    It is no dataclass: importing those takes as long as all else that `--help` needs.
    """

    kind: type
    """`str`, `bool`, `float`, `list` of texts, or `dict`: a table of texts."""
    text: str
    """What it means, for the manual."""
    counts: str
    """When a change of the file counts."""
    variable: str = ""
    """The environment variable of the option, if it has one."""
    choices: tuple[str, ...] = ()
    only: tuple[str, ...] = ()
    """Modules of the commands that take it; all that have the option where this is empty."""


_CHOOSES_STATION = "which station, where both run, for attach, status, preflight and vehicle"
SETTINGS: Mapping[str, Setting] = {
    "link": Setting(list, "links to vehicles, as `--link`", STATION),
    "forward": Setting(list, "other stations that hear the vehicles, as `--forward`", STATION),
    "dialect": Setting(list, "MAVLink definitions of your own, as `--dialect`", STATION),
    "planner": Setting(list, "files of your planners, as `--planner`", STATION),
    "overlay": Setting(list, "drawings on the map, as `--overlay`", CONSOLE),
    "operator": Setting(str, "who signs checks before a start, as `--operator`", NOW, "TUI_GCS_OPERATOR"),
    "operator_at": Setting(list, "[latitude, longitude] of the operator for Remote ID, as `--operator-at`", STATION),
    "operator_alt": Setting(
        float, "height of that place above the WGS-84 ellipsoid, metres, as `--operator-alt`", STATION
    ),
    "kind": Setting(str, _CHOOSES_STATION, COMMAND, "", ("sim", "live"), ("station_control", "preflight")),
    "theme": Setting(str, "colours to begin with, as `--theme`", NOW, "TUI_GCS_THEME", THEMES),
    "keymap": Setting(str, "file with your own keys, as `--keymap`", CONSOLE, "TUI_GCS_KEYMAP"),
    "terrain": Setting(str, "heights of the ground, as `--terrain`", CONSOLE, "TUI_GCS_TERRAIN"),
    "base_map": Setting(str, "vector tiles under the map, as `--base-map`", CONSOLE, "TUI_GCS_BASE_MAP"),
    "slow": Setting(bool, "for thin links, as `--slow`", CONSOLE, "TUI_GCS_SLOW"),
    "plain": Setting(bool, "stock Textual, as `--plain`", CONSOLE, "TUI_GCS_PLAIN"),
    "read_only": Setting(bool, "consoles command nothing, as `--read-only`", CONSOLE, "TUI_GCS_READ_ONLY"),
    "autopilot": Setting(str, "of simulated vehicles, as `--autopilot`", STATION, "", ("ardupilot", "px4", "mixed")),
    "no_color": Setting(bool, "without colours, as `--no-color`", COMMAND, "NO_COLOR"),
    "quiet": Setting(bool, "no progress and remarks, as `--quiet`", COMMAND, "TUI_GCS_QUIET"),
    "commands": Setting(dict, "table of your own commands after `:` in a console", NOW),
}
"""Every key. What gives rights to others, overrides a check, or makes vehicles SIM is not among them: that is typed."""
PATHS = ("dialect", "planner", "overlay", "keymap", "terrain", "base_map")
"""Settings that name files, as seen from the folder of `config.toml`."""

DEFAULT, FROM_FILE, ENVIRONMENT, TYPED = "default", "file", "environment", "option"
"""Where a value comes from; the later in this row, the more it counts."""


class SettingInUse(NamedTuple):
    """The value with which a command runs; None: the default."""

    value: Any
    origin: str


class SettingsInUse(NamedTuple):
    """What a console shows of the settings."""

    path: Path | None = None
    """The path of the file, whether or not it exists; None: no file is read."""
    values: Mapping[str, SettingInUse] = {}
    """By key, as the console was started; keys that are not there have their default."""

    def text(self, key: str) -> str:
        """Return the value of a text in use; "" for its default."""
        found = self.values.get(key)
        return str(found.value) if found is not None and found.value is not None else ""


def path_of(environ: Mapping[str, str]) -> Path | None:
    """Return the path of the file, whether or not it exists; None where none is to be read."""
    if FILE in environ:
        return Path(environ[FILE]) if environ[FILE] else None
    base = environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(base) / "tui-gcs" / "config.toml"


def read(environ: Mapping[str, str]) -> dict[str, Any]:
    """Return the settings of the file by key; none where there is no file.

    Raises:
        SettingsError: the file that `$TUI_GCS_CONFIG` names is not there, cannot be read, or holds a mistake.
    """
    path = path_of(environ)
    if path is None or (FILE not in environ and not path.exists()):
        return {}
    return parsed(text_of(path), path)


def text_of(path: Path) -> str:
    """Return the text of the file. Raises `SettingsError`."""
    from tui_gcs.core.base.regular_file import open_plain

    try:
        with open_plain(path) as file:
            raw = file.read(MAX_BYTES + 1)
        if len(raw) > MAX_BYTES:
            raise SettingsError(f"{path}: longer than {MAX_BYTES} bytes: these are no settings of tui-gcs")
        return raw.decode()
    except OSError as error:
        raise SettingsError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError as error:
        raise SettingsError(f"{path}:{len(raw[: error.start].splitlines())}: no TOML: {error}") from None


def parsed(text: str, path: Path) -> dict[str, Any]:
    """Return the settings in a text by key; `path` names it in mistakes. Raises `SettingsError`."""
    import tomllib

    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # no TOML, nesting without end
        found = re.search(r"\(at line (\d+), column \d+\)", str(error))
        line = found[1] if found else len(text.splitlines())
        raise SettingsError(f"{path}:{line}: no TOML: {error}") from None
    for key, value in content.items():
        if problem := problem_of(key, value):
            raise SettingsError(f"{path}{line_of(text, key)}: {problem}")
    return content


def problem_of(key: str, value: Any) -> str:
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


def line_of(text: str, key: str, table: str = "") -> str:
    """Return `:LINE` of a key in the file or in one of its tables, "" where it has a form that is not looked for."""
    begin = re.search(rf"^\s*\[\s*{table}\s*\]", text, re.MULTILINE) if table else None
    found = re.compile(rf"^\s*[\[\"']*{re.escape(key)}\b", re.MULTILINE).search(text, begin.end() if begin else 0)
    return "" if found is None else f":{len(text[: found.end()].splitlines())}"
