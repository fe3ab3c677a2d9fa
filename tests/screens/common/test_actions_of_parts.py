"""What a table of actions leaves to a screen is there: its method, or that of a part."""

import re
from operator import attrgetter

import pytest
from textual.app import App
from textual.screen import Screen

from tui_gcs.actions.scopes import SCOPES
from tui_gcs.app import ReplayApp
from tui_gcs.client.user_settings import SettingsInUse
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.records.flight_archive import FlightArchive
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.plots.value_recorder import ValueRecorder
from tui_gcs.screens.flights.flights_screen import FlightsScreen
from tui_gcs.screens.flights.vehicle_logs_screen import VehicleLogsScreen
from tui_gcs.screens.fly.fly_screen import FlyScreen
from tui_gcs.screens.inspect.inspector_screen import InspectorScreen
from tui_gcs.screens.links.links_screen import LinksScreen
from tui_gcs.screens.logs.journal_screen import JournalScreen
from tui_gcs.screens.logs.planner_log_screen import PlannerLogScreen
from tui_gcs.screens.missions.missions_screen import MissionsScreen
from tui_gcs.screens.parameters.parameters_screen import ParametersScreen
from tui_gcs.screens.plan.plan_screen import PlanScreen
from tui_gcs.screens.plots.live_plots_screen import LivePlotsScreen
from tui_gcs.screens.rehearsals.rehearsals_screen import RehearsalsScreen
from tui_gcs.screens.settings.settings_screen import SettingsScreen
from tui_gcs.screens.setup.setup_screen import SetupScreen
from tui_gcs.screens.tasks.tasks_screen import TasksScreen
from tui_gcs.screens.traffic.traffic_screen import TrafficScreen
from tui_gcs.screens.vehicles.vehicles_screen import VehiclesScreen

HANDLED_BEFORE = {"form", "corner", "snapping", "pointer"}
"""Lines of the help alone: Textual, the map and the forms have these keys."""


def screen_of(scope: str) -> Screen | type[ReplayApp]:
    clock = VirtualClock()
    feed = Feed(MemoryBus(), "test", clock=clock)
    drafts = {
        "plan": PlanScreen,
        "missions": MissionsScreen,
        "parameters": ParametersScreen,
        "inspector": InspectorScreen,
        "links": LinksScreen,
        "tasks": TasksScreen,
        "traffic": TrafficScreen,
        "onboard": VehicleLogsScreen,
        "setup": SetupScreen,
    }
    if scope in drafts:
        return drafts[scope](feed, clock)
    if scope == "replay":  # the player is controlled on every screen
        return ReplayApp
    if scope == "flights":
        return FlightsScreen(feed, clock, FlightArchive({}))
    if scope == "settings":
        return SettingsScreen(feed, SettingsInUse())
    if scope == "rehearsals":
        return RehearsalsScreen(feed, clock, None, lambda: 0, lambda *_: None)
    if scope == "plots":
        return LivePlotsScreen(feed, ValueRecorder(feed.requests))
    return {"fly": FlyScreen, "vehicles": VehiclesScreen, "journal": JournalScreen, "planner_log": PlannerLogScreen}[
        scope
    ](feed)


@pytest.mark.parametrize("scope", [scope for scope in SCOPES if scope != "app"])
async def test_every_action_has_its_method(scope: str) -> None:
    async with App().run_test():  # some widgets look for their app when they are made
        screen = screen_of(scope)
        for action in SCOPES[scope]:
            if action.id in HANDLED_BEFORE or (action.id == "digit" and not action.keys):
                continue
            path = re.match(r"(?:part|edit)\('([\w.]+)'", action.call)
            name = action.call.partition("(")[0]
            assert callable(attrgetter(path[1] if path else f"action_{name}")(screen)), action
            assert callable(getattr(screen, f"action_{name}")), action
