"""The keymap file: other keys for actions, checked whole before the console is shown.

    [app]
    show_help = ["f1", "question_mark"]
    [fly]
    zoom_in = ["i"]

Textual silently accepts unknown ids, and silently takes a key away from the action that had it (docs/terminal.md B6).
So both are refused here, with the line's name and what to do.
"""

import contextlib
import os
import re
import tomllib
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from tui_gcs.actions.action import APP, ConsoleAction, keys_text
from tui_gcs.core.base.text import clean

RESERVED = {
    "exclamation_mark": "begins HOLD ALL (!h)",
    "escape": "leaves everywhere",
    "enter": "confirms",
    "ctrl+c": "belongs to the terminal",
    "ctrl+q": "leaves the console",
    "ctrl+z": "belongs to the terminal",
    "ctrl+m": "is Enter on most terminals",
    "ctrl+i": "is Tab on most terminals",
    "ctrl+h": "is Backspace on most terminals",
}
"""Keys that no action may have, and why."""
_KEY = re.compile(r"(?:(?:ctrl|shift|alt)\+)*[a-zA-Z0-9_]+")
MAX_BYTES = 16_000
"""A keymap with three keys for every action takes a third of this."""
MAX_CELLS = 1000
"""Length of a reason: it may list all actions."""
Tables = Mapping[str, tuple[ConsoleAction, ...]]
"""The tables of actions by their scope in a keymap file."""


class KeymapError(ValueError):
    """A keymap is not used; the text is one line with place, reason and what to do."""


def default_path() -> Path:
    """Path of the operator's keymap: `$XDG_CONFIG_HOME/tui-gcs/keymap.toml`."""
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "tui-gcs" / "keymap.toml"


def read_keymap(path: Path, tables: Tables) -> dict[str, str]:
    """The keymap in `path` as Textual takes it: keys, with commas between, by `scope.id`.

    Raises:
        KeymapError: it cannot be read, or is not sound.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise KeymapError(f"{path}: longer than {MAX_BYTES} bytes: that is no keymap")
        if path.exists() and not (path.is_file() or path.is_dir()):  # a pipe or a device never ends
            raise KeymapError(f"{path}: not a file")
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise KeymapError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:  # no TOML, no UTF-8, numbers and nesting without end
        raise KeymapError(f"{path}: no TOML: {clean(str(error))}") from None
    try:
        return checked(content, tables)
    except KeymapError as error:
        raise KeymapError(f"{path}: {clean(str(error), MAX_CELLS)}") from None


def checked(content: Mapping[str, Any], tables: Tables) -> dict[str, str]:
    """Return the keymap of a parsed file. Raises `KeymapError`."""
    found: dict[str, tuple[str, ...]] = {}
    for scope, entries in content.items():
        if scope not in tables or not isinstance(entries, dict):
            raise KeymapError(f"[{scope[:30]}]: no such part; there are: {', '.join(tables)}")
        changeable = {action.id: action for action in tables[scope] if action.keys and not _is_reserved(action)}
        for name, keys in entries.items():
            where = f"[{scope}] {name[:30]}"
            if name not in changeable:
                raise KeymapError(f"{where}: no such action; there are: {', '.join(changeable)}")
            found[f"{scope}.{name}"] = tuple(_key(key, where) for key in _list(keys, where))
    _no_clash(found, tables)
    return {name: ",".join(keys) for name, keys in found.items()}


def _list(keys: object, where: str) -> list[Any]:
    listed = [keys] if isinstance(keys, str) else keys
    if not isinstance(listed, list) or not listed:
        raise KeymapError(f'{where}: name keys as ["f1", "ctrl+b"]')
    return listed


def _key(key: object, where: str) -> str:
    if not isinstance(key, str) or not _KEY.fullmatch(key):
        raise KeymapError(f"{where}: {str(key)[:20]!r} is no key; keys are named as a, A, f1, ctrl+a, plus, minus")
    if not _is_known(key.rsplit("+", 1)[-1]):
        raise KeymapError(f"{where}: {key[:20]}: no terminal has such a key; plus, minus, f1 to f24, pageup are names")
    # A terminal sends Alt as Esc and the key (docs/terminal.md B6); behind tmux they cannot be told apart.
    if key.startswith("alt+"):
        raise KeymapError(f"{where}: {key}: Alt is the same as Esc and the key; take ctrl+ or a function key")
    if key in RESERVED or key.isdigit():
        raise KeymapError(f"{where}: {key} is taken: it {RESERVED.get(key, 'numbers vehicles')}")
    return key


def _is_known(name: str) -> bool:
    """Whether a key has this name: a letter or digit, a named key, or a character by its name (question_mark)."""
    from textual.keys import (
        KEY_NAME_REPLACEMENTS,
        KEY_TO_UNICODE_NAME,
        Keys,
    )  # only a console with a keymap waits for it

    if len(name) == 1 or name in KEY_NAME_REPLACEMENTS.values() or any(name == key.value for key in Keys):
        return True
    with contextlib.suppress(KeyError):
        character = KEY_TO_UNICODE_NAME.get(name, name.replace("_", " ").upper())
        return name not in KEY_NAME_REPLACEMENTS and bool(unicodedata.lookup(character))
    return False


def _no_clash(changed: Mapping[str, tuple[str, ...]], tables: Tables) -> None:
    """Raise `KeymapError` unless every key of a scope, together with those of the app, belongs to one action."""
    # A key of the app works on every screen: each scope is checked together with it.
    for scope in tables:
        if scope == APP and len(tables) > 1:
            continue  # with every other scope, below
        owner: dict[str, str] = {}
        for part in dict.fromkeys((APP, scope)):
            for action in tables.get(part, ()):
                name = f"{part}.{action.id}"
                for key in changed.get(name, action.keys):
                    other = owner.setdefault(key, name)
                    if other != name and (name in changed or other in changed):
                        raise KeymapError(f"{key} is for {other} and for {name}: give one of them another key")


def _is_reserved(action: ConsoleAction) -> bool:
    return any(key in RESERVED for key in action.keys)


def with_keys(actions: Iterable[ConsoleAction], scope: str, keymap: Mapping[str, str]) -> tuple[ConsoleAction, ...]:
    """Return the actions with the keys of the keymap, for footer and help."""
    shown = []
    for action in actions:
        keys = keymap.get(f"{scope}.{action.id}")
        if keys is None:
            shown.append(action)
        else:
            names = tuple(keys.split(","))
            shown.append(replace(action, keys=names, shown=keys_text(names)))
    return tuple(shown)
