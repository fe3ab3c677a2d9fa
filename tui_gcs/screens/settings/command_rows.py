"""The operator's own commands on the settings screen: a row for each, and how one is written into the file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tui_gcs.actions.palette.own_commands import CommandLineError, OwnCommands
from tui_gcs.client.settings_file import COMMANDS, change_command
from tui_gcs.client.user_settings import CONSOLE, FROM_FILE, NOW, SettingsError, SettingsInUse, parsed, text_of
from tui_gcs.core.base.text import clean
from tui_gcs.widgets.settings.setting_list import SettingRow

MARK = ":"
"""Rows of own commands begin with it, as they are typed; no setting does."""
MAX_WORDS = 400


def command_rows(
    settings: SettingsInUse, in_file: Mapping[str, Any], used: Mapping[str, str] | None
) -> list[SettingRow]:
    """Return a row for each command that is in use or in the file. `used` are those in use, if this console set any."""
    started = settings.values.get(COMMANDS)
    in_use = used if used is not None else (started.value if started is not None and started.value else {})
    written = in_file.get(COMMANDS, {})
    return [_row(settings, name, in_use.get(name, ""), written.get(name, "")) for name in sorted({*in_use, *written})]


def _row(settings: SettingsInUse, name: str, words: str, written: str) -> SettingRow:
    waits = ""
    if words != written:
        says = f"the file says {written!r}" if written else "it is not in the file any more"
        waits = f"{says}: that counts for the {CONSOLE}"
    return SettingRow(
        MARK + clean(name, 20),
        clean(words, MAX_WORDS),
        FROM_FILE,
        clean(written, MAX_WORDS),
        NOW,
        f"what is typed instead of :{clean(name, 20)}",
        "steps with ; between them, as `:` takes them",
        str(settings.path),
        clean(waits, MAX_WORDS),
    )


def write_command(path: Path, name: str, words: str | None) -> OwnCommands:
    """Write one command into the file, or with None remove it; return all that the file has then.

    Raises:
        SettingsError: the commands would not be good together, or the file cannot be changed; nothing was changed.
    """
    table = dict(parsed(text_of(path), path).get(COMMANDS, {})) if path.exists() else {}
    if words is not None:
        table[name] = words
    else:
        table.pop(name, None)
    try:
        commands = OwnCommands(table)
    except CommandLineError as error:
        raise SettingsError(str(error)) from None
    change_command(path, name, words)
    return commands
