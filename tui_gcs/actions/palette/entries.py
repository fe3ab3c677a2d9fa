"""Actions as the palette and the help list them: a name, the key, what it does, and why it can do nothing now."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from tui_gcs.actions.action import APP, ConsoleAction, refusal
from tui_gcs.actions.action_context import ActionContext
from tui_gcs.actions.orders import ORDERS, why_not_order

NO_ENTRY = frozenset({"digit", "enter", "cancel", "palette", "leave", "form"})
"""Actions that only make sense as keys."""
WHOLE_FLEET = frozenset({"hold_all", "return_all", "land_all"})
"""Actions that command every vehicle at once, without a question."""
SHOW = "show "
"""How the names of the actions begin that show a screen."""
OTHER_WORDS = {
    "detach": "quit exit leave",
    "next_theme": "night day contrast",
    "return_all": "rtl rth home",
    "show_checks": "preflight pre-flight arming checklist",
    "show_fly": "map",
    "show_inspector": "mavlink",
    "show_journal": "events messages",
    "show_links": "forward partners qgroundcontrol",
    "show_onboard": "download dataflash",
    "show_plots": "graph chart",
    "show_setup": "calibrate configuration compass accelerometer",
    "show_tasks": "people control users",
    "show_traffic": "adsb intruders",
}
"""Words that operators of other stations type for an action, by its id."""


@dataclass(frozen=True)
class Entry:
    """One line of the palette."""

    name: str
    key: str
    help: str
    run: str
    """The Textual action string that does it."""
    why_not: str = ""
    other_words: str = ""
    """What else it is called."""
    whole_fleet: bool = False
    """It commands every vehicle at once: only its whole name does it."""

    def matches(self, words: Iterable[str]) -> bool:
        """Whether the name and help contain every word."""
        text = f"{self.name} {self.help} {self.other_words}".casefold()
        return all(word in text for word in words)

    def begins_words(self, words: Iterable[str]) -> bool:
        """Whether every word begins a word of the name or the help."""
        text = f"{self.name} {self.help} {self.other_words}".casefold()
        return all(re.search(rf"\b{re.escape(word)}", text) for word in words)


def entries_of(actions: Iterable[ConsoleAction], scope: str, context: ActionContext) -> list[Entry]:
    """Entries of the actions of the app or a screen that can be chosen by name; those without a help are left out."""
    where = APP if scope == APP else "screen"
    return [
        Entry(
            action.id.replace("_", " "),
            action.shown,
            action.help,
            f"{where}.{action.call}",
            refusal(action, context),
            OTHER_WORDS.get(action.id, ""),
            action.id in WHOLE_FLEET,
        )
        for action in actions
        if action.help and action.id not in NO_ENTRY
    ]


def order_entries(context: ActionContext) -> list[Entry]:
    """Entries of all orders to the selected vehicles."""
    rows = context.rows()
    return [
        Entry(
            order.name,
            f"c {order.key}",
            f"{order.does} (selected vehicles)",
            f"app.order('{order.id}')",
            context.read_only or context.silent or why_not_order(order, context.selected, rows),
        )
        for order in ORDERS
    ]


def found(entries: Iterable[Entry], text: str) -> list[Entry]:
    """Entries that match what was typed, the likeliest first; what can do nothing now comes last.

    A whole name comes before all others, even if it can do nothing now: `:return` must not become `return all` while no
    vehicle is selected. Then come names that begin with it, then entries in which each typed word begins a word.
    Without the last rule `:log` meant HOLD ALL, which works "also from dialogs".
    """
    words = text.casefold().split()
    matching = [entry for entry in entries if entry.matches(words)]
    first = text.casefold().strip()

    def order(entry: Entry) -> tuple[bool, bool, bool, bool]:
        # `:inspector` finds the screen, though its action is called `show inspector`.
        names = (entry.name.casefold(), entry.name.casefold().removeprefix(SHOW))
        begins = any(name.startswith(first) for name in names)
        return first not in names, bool(entry.why_not), not begins, not entry.begins_words(words)

    return sorted(matching, key=order)
