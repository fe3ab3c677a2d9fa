"""What an action is, and its bindings. Tables of them feed bindings, footer, palette, help and the keymap file."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from textual.binding import Binding, BindingType

from tui_gcs.actions.action_context import ActionContext

COMMAND, VIEW, SCREENS, SELECT, ALARMS = "Fly", "Map", "Screens", "Select", "Alarms"
"""Groups of the help. What is in COMMAND is asked of the station; a console that may not, does not offer it."""
DIGITS = "1 2 3 4 5 6 7 8 9"
APP = "app"
"""Scope of what works on every screen; the others are the modes of the app: fly, plan, …"""

RESUME = "resume"
"""Id of the action by which the planners go on: Enter, on screens with a map."""


def always(_situation: ActionContext) -> str:
    """Return "": the action can always be done."""
    return ""


_CAPITAL = re.compile("[A-Z]")


@dataclass(frozen=True)
class ConsoleAction:
    """One thing that an operator can do by a key or by name.

    `id` names the method (`action_<id>`) of the app or screen, unless `method` does. `keys` are Textual key names, none
    if the key is handled elsewhere; `shown` is the key as an operator reads it. `label` stands in the footer (empty:
    only in the help), and a higher `weight` stays longest in a narrow one. An action with empty `help` is covered by
    the one before it.
    """

    id: str
    keys: tuple[str, ...]
    shown: str
    label: str
    help: str
    group: str
    weight: int = 0
    why_not: Callable[[ActionContext], str] = always
    """Why it can do nothing now, for the operator; "" if it can."""
    label_now: Callable[[ActionContext], str] | None = None
    """The label where it depends on what will happen now."""
    method: str = ""
    """The Textual action string where it is not `id`: `pan(-1, 0)` calls `action_pan(-1, 0)`.

    `transfers.upload` calls that method of the part `transfers` of the screen.
    """
    same_as: str = ""
    """Of a screen's own action: the id of the app's action that its key does there too, see `on_screen`."""

    @property
    def call(self) -> str:
        """The Textual action string that a binding runs; a path is left to `action_part` of the screen."""
        method, bracket, arguments = (self.method or self.id).partition("(")
        if "." not in method:
            return method + bracket + arguments
        return f"part('{method}', {arguments}" if bracket else f"part('{method}')"

    def is_hidden(self, context: ActionContext) -> bool:
        """Whether the footer leaves it out now."""
        return bool(refusal(self, context))


_HUMAN = {"plus": "+", "minus": "-", "question_mark": "?", "colon": ":", "space": "Space"}
_HUMAN |= {"equals_sign": "=", "slash": "/", "full_stop": ".", "comma": ","}


_SHOWN = {"escape": "Esc", "enter": "Enter", "tab": "Tab", "delete": "Del", "pageup": "PgUp", "pagedown": "PgDn"}
_SHOWN |= {"home": "Home", "end": "End", "asterisk": "*", "less_than_sign": "<", "right_square_bracket": "]"}


def human(key: str) -> str:
    """A key as an operator writes it, e.g. `^P`, `F1`, `?`."""
    if key.startswith("ctrl+") and len(key) == 6:
        return f"^{key[5:].upper()}"
    return _HUMAN.get(key, key.upper() if re.fullmatch(r"f[0-9]+", key) else key)


def keys_text(keys: Iterable[str]) -> str:
    """Return the keys of one action as an operator writes them: `u/^Z`."""
    return "/".join(map(human, keys))


def action(
    name: str, keys: str, label: str, text: str, group: str, weight: int = 0, *, do: str = "", **more: Any
) -> ConsoleAction:
    """Return the action of one line of a table: `keys` has blanks between them, `do` is the method if not the name.

    Shown are the first key and those with Ctrl, unless `shown` is given.
    """
    names = keys.split()
    # Terminals with the kitty protocol report a capital letter as shift and the key.
    bound = [name for key in names for name in ([key, f"shift+{key.lower()}"] if _CAPITAL.fullmatch(key) else [key])]
    first = [_SHOWN.get(key, key) for key in names if key == names[0] or key.startswith("ctrl+")]
    more = {"shown": keys_text(first), "weight": weight, "method": do, **more}
    return ConsoleAction(name, tuple(bound), label=label, help=text, group=group, **more)


def refusal(action: ConsoleAction, context: ActionContext) -> str:
    """Why `action` can do nothing now: its own reason, or that this console may not command; else empty."""
    if action.group == COMMAND and context.read_only:
        return context.read_only
    return action.why_not(context)


def on_screen(everywhere: Iterable[ConsoleAction], own: Sequence[ConsoleAction]) -> tuple[ConsoleAction, ...]:
    """Return the app's actions as they are reached from a screen with the actions `own`, for footer, help and alarms.

    A key that does something else on that screen stands behind the key of the fly screen, where it does what the app
    says: `f Enter`. Enter resumes on screens alone that say so, since the app does not bind it.
    """
    actions = tuple(everywhere)
    taken = {key for action in own for key in action.keys}
    same = {action.same_as or action.id for action in own}
    fly = next((action.shown for action in actions if action.id == "show_fly"), "")
    shown = []
    for action in actions:
        differs = action.id == RESUME or not taken.isdisjoint(action.keys)
        elsewhere = fly and differs and action.id not in same
        shown.append(replace(action, shown=f"{fly} {action.shown}") if elsewhere else action)
    return tuple(shown)


def bindings(actions: Iterable[ConsoleAction], scope: str = "") -> list[BindingType]:
    """Textual bindings of the actions that have keys; with a `scope` a keymap can change them."""
    made: list[BindingType] = []
    for action in actions:
        if action.id == "digit":
            made += [Binding(key, f"digit('{key}')", "digit", show=False) for key in action.keys]
        elif action.keys:
            keys = ",".join(action.keys)
            name = action.label or action.help or action.id
            made.append(Binding(keys, action.call, name, show=False, id=f"{scope}.{action.id}" if scope else None))
    return made


def footer_actions(actions: Iterable[ConsoleAction], width: int) -> list[ConsoleAction]:
    """The actions with a label that fit into `width` cells, by weight, in the order they were declared."""
    labelled = [action for action in actions if action.label]
    kept: set[str] = set()
    used = 1
    for action in sorted(labelled, key=lambda action: -action.weight):
        cells = len(action.shown) + 1 + len(action.label) + 2
        if used + cells <= width + 1:
            kept.add(action.id)
            used += cells
    return [action for action in labelled if action.id in kept]
