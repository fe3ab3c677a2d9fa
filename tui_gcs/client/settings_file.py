"""Changes one key of `config.toml`: comments, order and line ends of the operator stay, and so do the permissions.

The new text is checked as a whole before anything is written, so what is written is always read again by the next
command. The file is replaced in one step; where it is a link, the file behind it is.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tui_gcs.client.user_settings import PATHS, SETTINGS, SettingsError, parsed, problem_of, text_of
from tui_gcs.core.base.file_replacement import replace_file

if TYPE_CHECKING:
    from tui_gcs.core.scenario.toml_text import TomlText

COMMANDS = "commands"
"""The table of the operator's own commands."""
NEW_MODE = 0o600
"""Permissions of a new file: it may name radios and places."""


def change(path: Path, key: str, value: Any | None) -> None:
    """Write one key, or with None remove it, so that its default counts.

    Raises:
        SettingsError: the value is no good, the file holds a mistake, or it cannot be written; nothing was changed.
    """
    if value is not None and (problem := problem_of(key, value) or content_problem(key, value, path.parent)):
        raise SettingsError(problem)
    _rewrite(path, lambda text: changed(text, key, value))


def change_command(path: Path, name: str, words: str | None) -> None:
    """Write one of the operator's own commands into the table `[commands]`, or with None remove it.

    `name` is one as `OwnCommands` takes it.

    Raises:
        SettingsError: the file holds a mistake, has the table in another form, or cannot be written; nothing was
            changed.
    """
    _rewrite(path, lambda text: changed_command(text, name, words))


def _rewrite(path: Path, edit: Callable[[str], str]) -> None:
    """Replace the text of the file by what `edit` makes of it, if that can be read again. Raises `SettingsError`."""
    exists = os.path.exists(path)  # noqa: PTH110, for Path.exists raises where a name is too long
    old = text_of(path) if exists else ""
    parsed(old, path)  # a mistake in it is named before it is touched
    new = edit(old)
    parsed(new, path)
    if new != old:
        _replace(path, new, exists=exists)


def changed(text: str, key: str, value: Any | None) -> str:
    """Return the text with another value of a key of the top level, or without it. Raises `SettingsError`."""
    from tui_gcs.core.scenario.load import ScenarioError
    from tui_gcs.core.scenario.toml_text import TomlText

    # The lines of a text begin with a table where it has no key above the first one: a comment line gives it a place.
    try:
        edited = TomlText(text)
        if value is None:
            edited.apply("", {}, owned=(key,))
        elif key in edited.data:
            edited.replace_values([("", key)], value)
        else:
            return _with_new(edited, text, key, value)
        return edited.text
    except ScenarioError:
        raise SettingsError(f"{key}: is written in a way that is not changed here: edit it in the file") from None


def changed_command(text: str, name: str, words: str | None) -> str:
    """Return the text with other words for an own command, or without it. Raises `SettingsError`."""
    from tui_gcs.core.scenario.load import ScenarioError
    from tui_gcs.core.scenario.toml_text import TomlText

    values = {} if words is None else {name: words}
    try:
        edited = TomlText(text)
        if COMMANDS in edited.data:
            if not edited.has_header(COMMANDS):
                raise SettingsError(f"{COMMANDS}: is written in a way that is not changed here: edit it in the file")
            edited.apply(COMMANDS, values, owned=(name,))
        elif values and text.strip():
            edited.insert_table(edited.last_written_line(), f"[{COMMANDS}]", values)
        elif values:
            return f"{text}{_new_table(values)}"
        return edited.text
    except ScenarioError:
        raise SettingsError(f"{name}: is written in a way that is not changed here: edit it in the file") from None


def _new_table(values: dict[str, str]) -> str:
    import tomlkit

    return tomlkit.dumps({COMMANDS: values})


def _with_new(edited: "TomlText", text: str, key: str, value: Any) -> str:
    """Return the text with a key that it does not have yet: below the last of the top level, else as the first line."""
    import tomlkit

    if any(not isinstance(each, dict) for each in edited.data.values()):
        edited.apply("", {key: value})
        return edited.text
    line = tomlkit.document()
    line[key] = value
    end = "\r\n" if "\r\n" in text else "\n"
    first = line.as_string().rstrip("\n").replace("\n", end) + end
    return f"{first}{end}{text}" if text.strip() else first + text


def content_problem(key: str, value: Any, folder: Path) -> str:
    """Return why a command would refuse a value of the right type; "" if it would not. Paths are seen from `folder`."""
    if key in ("link", "forward"):
        return next(filter(None, map(_link_problem, value)), "")
    if key in PATHS:
        names = [value] if isinstance(value, str) else value
        missing = next((name for name in names if not _is_there(folder, name)), None)
        return f"{key}: {missing[:60]!r}: there is no such file" if missing is not None else ""
    if key == "operator_at":
        lat_deg, lon_deg = value
        good = abs(lat_deg) <= 90 and abs(lon_deg) <= 180  # NaN is not
        return "" if good else "operator_at: latitude from -90 to 90, longitude from -180 to 180"
    if key == "operator_alt":
        return "" if -1000 <= value <= 31_767 else "operator_alt: metres from -1000 to 31767"
    if key == "operator" and not (value.strip() and value.isprintable() and len(value) <= 40):
        return "operator: a name of at most 40 characters"
    return ""


def _link_problem(text: str) -> str:
    from tui_gcs.core.links.spec import LinkError, parse_link

    try:
        parse_link(text)
    except LinkError as error:
        return str(error)
    return ""


def _is_there(folder: Path, name: str) -> bool:
    try:
        return bool(name) and name.isprintable() and (folder / Path(name).expanduser()).exists()
    except (OSError, ValueError, RuntimeError):  # too long, a NUL, a home that nobody has
        return False


def _replace(path: Path, text: str, *, exists: bool) -> None:
    """Write the whole file in one step, with its permissions."""
    try:
        real = path.resolve()
        real.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        if exists and not os.access(real, os.W_OK):  # a rename would replace a file that is not to be changed
            raise SettingsError(f"{path}: cannot be written (it is read-only)")
        replace_file(real, text.encode(), new_mode=NEW_MODE)
    except OSError as error:
        raise SettingsError(f"{path}: cannot be written ({error.strerror})") from None


def typed_value(key: str, text: str) -> Any:
    """Return the value that was typed for a key; texts of a list have `;` between them. Raises `SettingsError`."""
    kind, text = SETTINGS[key].kind, text.strip()
    if kind is float or key == "operator_at":
        try:
            numbers = [float(each) for each in text.replace(",", " ").replace(";", " ").split()]
        except ValueError:
            raise SettingsError(f"{key}: {text[:30]!r}: only numbers") from None
        if kind is float and len(numbers) != 1:
            raise SettingsError(f"{key}: one number")
        return numbers[0] if kind is float else numbers
    if kind is list:
        return [each.strip() for each in text.split(";") if each.strip()]
    return text


def shown_value(key: str, value: Any) -> str:
    """Return a value as `typed_value` reads it, and as the screen shows it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict):
        return ", ".join(value)
    if isinstance(value, (list, tuple)):
        return (" " if key == "operator_at" else "; ").join(str(each) for each in value)
    return f"{value:g}" if isinstance(value, float) else str(value)
