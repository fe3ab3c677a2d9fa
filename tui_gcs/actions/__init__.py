"""What an operator can do, declared once: tables of actions, and the orders to vehicles.

Entry points: `ConsoleAction` and the tables (`APP_ACTIONS`, `FLY_ACTIONS`, …), from which bindings, footer, palette,
help and the keymap file are made; `orders.ORDERS`, from which the menu and dialogs of orders are made. A screen lists
its own actions in `ACTIONS`; `APP_ACTIONS` work everywhere but in dialogs.

What always holds: an action decides by an `ActionContext` alone whether it can do anything now, and returns the reason
if not. Not here: what an action does (methods of screens and `console.commands`), and any screen or feed.
"""

from tui_gcs.actions.action import ALARMS as ALARMS
from tui_gcs.actions.action import APP as APP
from tui_gcs.actions.action import COMMAND as COMMAND
from tui_gcs.actions.action import SCREENS as SCREENS
from tui_gcs.actions.action import SELECT as SELECT
from tui_gcs.actions.action import VIEW as VIEW
from tui_gcs.actions.action import ConsoleAction as ConsoleAction
from tui_gcs.actions.action import bindings as bindings
from tui_gcs.actions.action import footer_actions as footer_actions
from tui_gcs.actions.action import refusal as refusal
from tui_gcs.actions.action_context import ActionContext as ActionContext
from tui_gcs.actions.table import APP_ACTIONS as APP_ACTIONS
from tui_gcs.actions.table import FLY_ACTIONS as FLY_ACTIONS
