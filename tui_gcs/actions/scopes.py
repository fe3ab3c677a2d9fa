"""Every table of actions, by the scope that a keymap file calls it."""

from tui_gcs.actions.action import APP
from tui_gcs.actions.flight_actions import FLIGHT_ACTIONS
from tui_gcs.actions.inspector_actions import INSPECTOR_ACTIONS
from tui_gcs.actions.link_actions import LINK_ACTIONS
from tui_gcs.actions.mission_actions import MISSION_ACTIONS
from tui_gcs.actions.parameter_actions import PARAMETER_ACTIONS
from tui_gcs.actions.plan_actions import PLAN_ACTIONS
from tui_gcs.actions.plot_actions import PLOT_ACTIONS
from tui_gcs.actions.rehearsal_actions import REHEARSAL_ACTIONS
from tui_gcs.actions.replay_actions import REPLAY_ACTIONS, REPLAY_SCOPE
from tui_gcs.actions.settings_actions import SETTINGS_ACTIONS
from tui_gcs.actions.setup_actions import SETUP_ACTIONS
from tui_gcs.actions.table import APP_ACTIONS, FLY_ACTIONS
from tui_gcs.actions.task_actions import TASK_ACTIONS
from tui_gcs.actions.traffic_actions import TRAFFIC_ACTIONS
from tui_gcs.actions.vehicle_log_actions import VEHICLE_LOG_ACTIONS
from tui_gcs.actions.viewer_actions import JOURNAL_ACTIONS, PLANNER_LOG_ACTIONS, VEHICLES_ACTIONS

SCOPES = {
    APP: APP_ACTIONS,
    "fly": FLY_ACTIONS,
    "plan": PLAN_ACTIONS,
    "missions": MISSION_ACTIONS,
    "vehicles": VEHICLES_ACTIONS,
    "journal": JOURNAL_ACTIONS,
    "parameters": PARAMETER_ACTIONS,
    "inspector": INSPECTOR_ACTIONS,
    "links": LINK_ACTIONS,
    "tasks": TASK_ACTIONS,
    "flights": FLIGHT_ACTIONS,
    "rehearsals": REHEARSAL_ACTIONS,
    "onboard": VEHICLE_LOG_ACTIONS,
    REPLAY_SCOPE: REPLAY_ACTIONS,
    "plots": PLOT_ACTIONS,
    "traffic": TRAFFIC_ACTIONS,
    "setup": SETUP_ACTIONS,
    "settings": SETTINGS_ACTIONS,
    "planner_log": PLANNER_LOG_ACTIONS,
}
