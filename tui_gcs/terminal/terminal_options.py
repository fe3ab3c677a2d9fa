"""How the operator's terminal is to be used: `--slow` and `--plain`, handed on in the environment.

`--slow` (`TUI_GCS_SLOW=1`) is for thin links: one picture a second, 16 colours, no mouse, the oldest key protocol only.
`--plain` (`TUI_GCS_PLAIN=1`) runs on stock Textual, see `variant`. This module imports nothing, because Textual reads
its settings from the environment when it is imported.
"""

import os
from collections.abc import Mapping, MutableMapping

SLOW_PERIOD_S = 1.0
"""Time between two pictures on a thin link."""
SLOW_SETTINGS = {
    "TEXTUAL_COLOR_SYSTEM": "standard",
    "TEXTUAL_ANIMATIONS": "none",
    "TEXTUAL_SMOOTH_SCROLL": "0",
    "TEXTUAL_DISABLE_KITTY_KEY": "1",
}
"""Textual's settings that keep bytes few (docs/terminal.md B6, B8)."""


def wants_slow(environ: Mapping[str, str] | None = None) -> bool:
    """Whether the link to this terminal is thin, as the operator set it."""
    return _is_set("TUI_GCS_SLOW", environ)


def wants_plain(environ: Mapping[str, str] | None = None) -> bool:
    """Whether the console is to run on stock Textual."""
    return _is_set("TUI_GCS_PLAIN", environ)


def _is_set(name: str, environ: Mapping[str, str] | None) -> bool:
    environ = os.environ if environ is None else environ
    return environ.get(name, "") not in ("", "0")


def prepare_textual(environ: MutableMapping[str, str]) -> None:
    """Set what Textual will read from the environment; settings of the operator stay."""
    # Where a shell exports COLUMNS and LINES, Textual prefers them to the terminal and would not follow its size.
    for name in ("COLUMNS", "LINES"):
        environ.pop(name, None)
    if wants_slow(environ):
        for name, value in SLOW_SETTINGS.items():
            environ.setdefault(name, value)
