"""The rows of the settings screen: what this console runs with, beside what stands in the file now."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tui_gcs.client.settings_file import shown_value
from tui_gcs.client.user_settings import (
    CONSOLE,
    DEFAULT,
    ENVIRONMENT,
    FROM_FILE,
    NOW,
    SETTINGS,
    TYPED,
    Setting,
    SettingInUse,
    SettingsError,
    SettingsInUse,
    parsed,
    text_of,
)
from tui_gcs.core.base.text import clean
from tui_gcs.widgets.settings.setting_list import SettingRow

MAX_VALUE = 400
DEFAULTS = {
    "link": "udpin:127.0.0.1:14550, of fly",
    "theme": "dark",
    "keymap": "keymap.toml beside config.toml, if it is there",
}
"""Defaults that are not nothing and not no."""
UNSET = SettingInUse(None, DEFAULT)


def read_file(path: Path | None) -> tuple[dict[str, Any], str]:
    """Return the settings that stand in the file now, and why it cannot be read or ""."""
    try:
        return (parsed(text_of(path), path), "") if path is not None and path.exists() else ({}, "")
    except SettingsError as error:
        return {}, str(error)


def setting_rows(settings: SettingsInUse, in_file: Mapping[str, Any], used: Mapping[str, str]) -> list[SettingRow]:
    """Return a row for each setting. `used` are values that have counted since the console was started."""
    return [_row(settings, key, setting, in_file, used) for key, setting in SETTINGS.items()]


def _row(
    settings: SettingsInUse, key: str, setting: Setting, in_file: Mapping[str, Any], used: Mapping[str, str]
) -> SettingRow:
    began = settings.values.get(key, UNSET)
    written = shown_value(key, in_file[key]) if key in in_file else ""
    started = shown_value(key, began.value) if began.value is not None else ""
    if key in used:
        value, origin = used[key], FROM_FILE if used[key] else DEFAULT
    else:
        value, origin = started, began.origin
    waits = _waits(key, setting, origin, value, written)
    value = value or _default(key, setting)
    return SettingRow(
        key,
        clean(value, MAX_VALUE),
        origin,
        clean(written, MAX_VALUE),
        setting.counts,
        setting.text.replace("`", ""),
        _allowed(key, setting),
        _source(settings, key, setting, origin),
        clean(waits, MAX_VALUE),
    )


def _waits(key: str, setting: Setting, origin: str, value: str, written: str) -> str:
    """Return what the file says that is not in use; an option or variable of this console hides it."""
    if origin in (FROM_FILE, DEFAULT):
        same = written == (value if origin == FROM_FILE else "")
        says = f"the file says {written}" if written else "it is not in the file any more"
        when = CONSOLE if setting.counts == NOW else setting.counts  # it was not written from this console
        return "" if same else f"{says}: that counts for the {when}"
    return f"the file says {written}: {_hides(key, setting, origin)} comes before it" if written else ""


def _hides(key: str, setting: Setting, origin: str) -> str:
    return setting.variable if origin == ENVIRONMENT else f"--{key.replace('_', '-')}"


def _default(key: str, setting: Setting) -> str:
    return DEFAULTS.get(key, "no" if setting.kind is bool else "")


def _source(settings: SettingsInUse, key: str, setting: Setting, origin: str) -> str:
    """Return the place of the value, whole."""
    if origin == FROM_FILE:
        return str(settings.path)
    if origin in (ENVIRONMENT, TYPED):
        return f"{_hides(key, setting, origin)} of this console"
    return "the default"


def _allowed(key: str, setting: Setting) -> str:
    """Return what can be chosen or typed."""
    if setting.choices:
        return ", ".join(setting.choices)
    if key == "operator_at":
        return "latitude and longitude in degrees"
    return {
        bool: "yes or no",
        float: "a number",
        list: "texts, with ; between them",
        dict: "Enter adds one: low = select t1; altitude",
    }.get(setting.kind, "a text")
