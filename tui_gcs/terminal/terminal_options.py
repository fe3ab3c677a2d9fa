"""The thin link: what the operator says with `--slow` (or `TUI_GCS_SLOW=1`) and what follows for the console.

One picture a second, 16 colours, no mouse, no key protocol beyond the oldest. Imports nothing, for Textual reads its
settings when it is imported.
"""

import os
from collections.abc import Mapping, MutableMapping

PERIOD_S = 1.0
"""Between two pictures."""
TEXTUAL = {
    "TEXTUAL_COLOR_SYSTEM": "standard",
    "TEXTUAL_ANIMATIONS": "none",
    "TEXTUAL_SMOOTH_SCROLL": "0",
    "TEXTUAL_DISABLE_KITTY_KEY": "1",
}


def wants_slow(environ: Mapping[str, str] | None = None) -> bool:
    """Whether the operator said that the link to this terminal is thin."""
    environ = os.environ if environ is None else environ
    return environ.get("TUI_GCS_SLOW", "") not in ("", "0")


def prepare_textual(environ: MutableMapping[str, str]) -> None:
    """Set what Textual will read; what the operator set stays.

    But for COLUMNS and LINES: where a shell exports them they count for more than the terminal, whose changes of size
    would not be followed.
    """
    for name in ("COLUMNS", "LINES"):
        environ.pop(name, None)
    if wants_slow(environ):
        for name, value in TEXTUAL.items():
            environ.setdefault(name, value)
