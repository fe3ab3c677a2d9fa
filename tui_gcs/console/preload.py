"""Screens that are likely to be opened soon: their modules are imported in the background, so that no key waits.

The first frame does not wait for them either: they take as long to import as everything before it.
"""

import importlib
import threading

AFTER_S = 2.0
"""Time after the start at which the first screen is shown for certain."""
SCREENS = (
    "common.palette_dialog",
    "plan.plan_screen",
    "vehicles.vehicles_screen",
    "missions.missions_screen",
    "logs.journal_screen",
    "fly.planners_dialog",
    "parameters.parameters_screen",
    "inspect.inspector_screen",
    "links.links_screen",
    "tasks.tasks_screen",
    "rehearsals.rehearsals_screen",
    "plots.live_plots_screen",
    "flights.flights_screen",
    "traffic.traffic_screen",
    "flights.vehicle_logs_screen",
    "setup.setup_screen",
    "settings.settings_screen",
    "logs.planner_log_screen",
)


def preload_screens() -> None:
    """Begin to import; code that needs one of the modules meanwhile waits only for what is left."""
    # A daemon, so that a console that is left at once does not wait for the imports.
    threading.Thread(target=_import, name="preload", daemon=True).start()


def _import() -> None:
    for name in SCREENS:
        importlib.import_module(f"tui_gcs.screens.{name}")
