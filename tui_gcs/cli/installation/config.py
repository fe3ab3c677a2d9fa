"""`config.toml` for commands: options that were not typed are filled from the environment or the file.

An option on the command line comes before its environment variable, that before the file, that before the default. A
list on the command line replaces the one of the file. The keys and the file are those of `client.user_settings`.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tui_gcs.cli.exit_codes import CommandError
from tui_gcs.client import user_settings
from tui_gcs.client.user_settings import (
    DEFAULT,
    ENVIRONMENT,
    FROM_FILE,
    PATHS,
    SETTINGS,
    TYPED,
    SettingInUse,
    SettingsError,
    line_of,
    path_of,
    text_of,
)

if TYPE_CHECKING:
    from tui_gcs.actions.palette.own_commands import OwnCommands

WITHOUT_SETTINGS = ("stop_fleet", "installation.completion", "installation.doctor")
"""Modules of commands that read no settings: hold, return and land must work whatever stands in a file."""
GENERAL = ("no_color", "quiet")
"""Settings that every command takes, though its arguments hold them only where they were given."""


def read(environ: Mapping[str, str]) -> dict[str, Any]:
    """Return the settings of the file by key; none where there is no file. Raises `CommandError`."""
    try:
        return user_settings.read(environ)
    except SettingsError as error:
        raise CommandError(str(error)) from None


def apply(arguments: argparse.Namespace, environ: Mapping[str, str]) -> dict[str, Any]:
    """Fill options that were not given, from the environment or the file, and return the settings of the file in use.

    Raises:
        CommandError: see `read`.
    """
    module = str(arguments.module)
    is_free = module in WITHOUT_SETTINGS or getattr(arguments, "what", "") == "stop"
    content = {} if is_free else read(environ)
    if hasattr(arguments, "slow"):  # a command with a console, which shows them
        arguments.settings = in_use(arguments, environ, content)
    operator = environ.get(SETTINGS["operator"].variable, "")
    if operator and getattr(arguments, "operator", None) == "":
        arguments.operator = operator
    used = {}
    for key, value in content.items():
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


def in_use(
    arguments: argparse.Namespace, environ: Mapping[str, str], content: Mapping[str, Any]
) -> dict[str, SettingInUse]:
    """Return each setting as a command with a console runs with it, and where it comes from.

    `arguments` are as they were typed, `content` is that of the file.
    """
    found = {}
    for key, setting in SETTINGS.items():
        known = hasattr(arguments, key) and (not setting.only or arguments.module in setting.only)
        if known and not _is_open(arguments, key, general=False):
            found[key] = SettingInUse(getattr(arguments, key), TYPED)
        elif setting.variable and setting.variable in environ:
            text = environ[setting.variable]
            found[key] = SettingInUse(text not in ("", "0") if setting.kind is bool else text, ENVIRONMENT)
        elif key in content:
            found[key] = SettingInUse(content[key], FROM_FILE)
        else:
            found[key] = SettingInUse(None, DEFAULT)
    return found


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
        line = line_of(text_of(path), error.command, "commands") if error.command else ""
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
    if path is None or key not in PATHS:
        return value
    names = [value] if isinstance(value, str) else value
    found = [str(path.absolute().parent / Path(name).expanduser()) for name in names]
    return found[0] if isinstance(value, str) else found
