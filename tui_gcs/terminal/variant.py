"""The one place that chooses between stock Textual (`--plain`) and what writes less and never blocks.

Stock Textual uses none of the modules in `terminal.private`: it is the way out when another version of Textual, or a
terminal, does not get on with them. It writes more bytes (300 instead of 2 kB/s for a map with 8 vehicles,
docs/terminal.md B2), freezes while a terminal does not read, and may carry out keys of a slow line in another order.
"""

from typing import TYPE_CHECKING

from textual import events
from textual.widget import Widget

from tui_gcs.terminal.terminal_options import wants_plain

if TYPE_CHECKING or wants_plain():
    from tui_gcs.terminal.plain_app import PlainApp as TerminalApp

    async def run_own_binding(widget: Widget, event: events.Key) -> None:
        """Leave the key to Textual, which looks for bindings when the field did not want it."""
else:
    from tui_gcs.terminal.private.diff_app import DiffApp as TerminalApp
    from tui_gcs.terminal.private.field_bindings import run_own_binding

__all__ = ["TerminalApp", "run_own_binding"]
