"""Screens that are likely to be opened soon: their modules are read in the background, so that no key waits for it.

The first frame does not wait for them either: they take as long to read as everything before it does.
"""

import importlib
import threading

AFTER_S = 2.0
"""So long after the start: what is shown first is shown by then."""
SCREENS = (
    "plan.plan_screen",
    "vehicles.vehicles_screen",
    "missions.missions_screen",
    "logs.journal_screen",
    "fly.planners_dialog",
)


def read_ahead() -> None:
    """Begin. Whoever needs one of the modules meanwhile waits for no more than what is left."""
    threading.Thread(target=_read, name="read ahead", daemon=True).start()


def _read() -> None:
    for name in SCREENS:
        importlib.import_module(f"tui_gcs.screens.{name}")
