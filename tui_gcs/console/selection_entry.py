"""Which vehicles are meant, typed on the second line without a dialog, so that the screen stays in view."""

from collections.abc import Callable, Mapping

from textual.events import Key

from tui_gcs.console.commands import action_named
from tui_gcs.console.groups import GroupFile, GroupsError
from tui_gcs.console.parts import ConsoleParts
from tui_gcs.feed.notices import Severity
from tui_gcs.feed.selection import SelectionError
from tui_gcs.widgets.basics.number_text import ids

MAX_CELLS = 40
NUMBERS, NAMES = frozenset("0123456789,-"), frozenset("0123456789,-+=_abcdefghijklmnopqrstuvwxyz")
HELP = "3-7,9  t1  all  none  +5 -5   Enter, Esc"


class LineEntry:
    """One line that is being typed; every key that cannot be part of it keeps its meaning."""

    def __init__(self, text: str = "", *, names: bool = False) -> None:
        """Begin with `text`; letters belong to the line only with `names`, else they are keys."""
        self.text = text
        self._accepted = NAMES if names else NUMBERS

    def press(self, key: Key) -> bool:
        """Take a key; return whether it is part of the line."""
        if key.key == "backspace":
            self.text = self.text[:-1]
            return True
        character = (key.character or "").lower()
        if len(character) != 1 or character not in self._accepted:
            return False
        self.text = (self.text + character)[:MAX_CELLS]
        return True


class SelectionEntry:
    """Reads keys into a line, and selects the vehicles that it names."""

    def __init__(
        self, parts: ConsoleParts, groups: GroupFile | None, keymap: Mapping[str, str], on_change: Callable[[], None]
    ) -> None:
        """Keep groups of vehicles in `groups`; `on_change` is called when the line begins, changes or ends."""
        self._parts = parts
        self._groups = groups
        self._keys = keymap.get("app.select", ",".join(action_named("select").keys)).split(",")
        self._on_change = on_change
        self._line: LineEntry | None = None

    @property
    def prompt(self) -> str:
        """What the second line shows; empty while nothing is typed."""
        return f"select {self._line.text}_    {HELP}" if self._line is not None else ""

    @property
    def is_open(self) -> bool:
        """Whether a line is being typed."""
        return self._line is not None

    def begin(self) -> None:
        """Begin a line that may contain names."""
        self._set(LineEntry(names=True))

    def press(self, key: Key) -> bool:
        """Take a key; return whether it went into the line. A key that cannot be part of it ends the line."""
        line = self._line
        if line is None:
            return self._begins(key)
        if line.press(key):
            self._set(line if line.text or key.key != "backspace" else None)
            return True
        self._set(None)
        if key.key == "enter" and line.text:
            self._choose(line.text)
        return key.key in ("enter", "escape")

    def _set(self, line: LineEntry | None) -> None:
        self._line = line
        self._on_change()

    def _begins(self, key: Key) -> bool:
        # Not by a binding: the next key may arrive before Textual has run that.
        if key.key in self._keys:
            self.begin()
        elif getattr(self._parts.app.screen, "DIGITS_SELECT", False) and (key.character or "").isdecimal():
            self._set(LineEntry(str(key.character)))
        else:
            return False
        return True

    def _choose(self, text: str) -> None:
        if why := self.choose(text):
            self._parts.notice(f"not selected: {why}", Severity.CAUTION)

    def choose(self, text: str) -> str:
        """Select the vehicles that `text` names, and notify the operator; return why not, or "" if it was done."""
        feed = self._parts.feed
        fleet = feed.scenario.scenario.name if feed.scenario is not None else ""
        trouble = ""
        try:
            if self._groups is not None:
                feed.selection.groups = self._groups.of(fleet)
        except GroupsError as error:
            trouble = f"   groups: {error}"
        try:
            choice = feed.selection.choose(text, feed.known_vehicles())
            if choice.save_as and self._groups is not None:
                self._groups.keep(fleet, choice.save_as, choice.ids)
        except (SelectionError, GroupsError) as error:
            return f"{error}{trouble}"
        saved = f"{choice.save_as} {'saved' if choice.ids else 'forgotten'}: " if choice.save_as else ""
        level = Severity.CAUTION if trouble else Severity.NORMAL
        self._parts.notice(f"{saved}selected {ids(choice.ids) or 'none'}{trouble}", level)
        return ""
