"""The preflight checks: what is wrong, for which vehicles, what to do; acknowledging, reading again, signing."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from textual import events

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.common import Request
from tui_gcs.core.protocol.preflight import (
    CHECKLIST,
    FAILSAFES,
    MAX_NAME_CHARS,
    TITLES,
    AcknowledgeCheck,
    Check,
    CheckState,
    ReadChecks,
    SignOff,
    TickItem,
)
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import StatusUpdated
from tui_gcs.screens.common.text_dialog import LINE_CELLS, REACTION_S, TextDialog
from tui_gcs.widgets.basics.check_lines import check_line, count_line, detail_lines, loud, quiet_lines
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink

Mark = tuple[str, str, tuple[int, ...]]
"""Name, text and vehicles of a check."""


@dataclass
class Operator:
    """The name of the operator at this console, as it was typed; it is journalled."""

    name: str = ""


def typed_into(text: str, event: events.Key) -> str:
    """Return a name after one more key."""
    if event.key == "backspace":
        return text[:-1]
    if event.key == "ctrl+u":
        return ""
    character = event.character if event.is_printable and event.character is not None else ""
    return (text + character)[:MAX_NAME_CHARS]


class PreflightScreen(TextDialog[None]):
    """A dialog over any screen. Arrows mark a check; keys act on the marked one or sign the list; Esc closes."""

    title_text = "checks before a start"

    def __init__(
        self, feed: Feed, ask: Callable[[Request, str], None], operator: Operator, glyphs: GlyphSet, clock: Clock
    ) -> None:
        """`ask` sends a request to the station and reports why it was not done."""
        super().__init__(glyphs)
        self._clock = clock
        self._feed = feed
        self._ask = ask
        self._operator = operator
        self._marked: Mark = ("", "", ())
        """The check that keys act on; it stays marked while others come and go."""
        self._moved_s = -math.inf
        """When the mark went to another check by itself, or its check came to be about other vehicles."""
        self._hint = ""
        self._naming: Callable[[str], None] | None = None
        """What is done with the name that is being typed; None while none is."""
        self._typed = ""

    def on_mount(self) -> None:
        """Begin to receive the feed's messages, and have the station read what it does not know yet."""
        super().on_mount()
        self._feed.listen(self)
        self._marked = _mark_of(self.marked())
        self._read(anew=False)

    def on_status_updated(self, _message: StatusUpdated) -> None:
        """Show the checks; the mark stays with its check, and moves only when that is gone."""
        self._follow()
        self.redraw()

    def _follow(self) -> None:
        if (now := _mark_of(self.marked())) != self._marked:
            self._marked, self._moved_s = now, self._clock.now()

    def on_key(self, event: events.Key) -> None:
        """Mark by arrows, act by the letters of the last line; type a name while it is asked for."""
        event.stop()
        self._hint = ""
        self._follow()  # a status may have arrived that is not drawn yet
        if self._naming is not None:
            self._type(event)
        elif event.key in ("escape", "q", "enter", "P"):
            self.finish(None)
            return
        elif event.key in ("down", "j", "up", "k"):
            self._mark(1 if event.key in ("down", "j") else -1)
        elif event.key == "y":
            self._accept()
        elif event.key == "n":
            self._take_back()
        elif event.key == "R":
            self._read(anew=True)
        elif event.key == "S":
            self._ask_name(self._sign)
        elif event.key == "H":
            self.finish(None)
            self.app.switch_mode("rehearsals")
            return
        self.redraw()

    def _type(self, event: events.Key) -> None:
        if event.key == "escape":
            self._naming = None
        elif event.key == "enter" and self._typed.strip() and self._naming is not None:
            do, self._naming = self._naming, None
            self._operator.name = self._typed.strip()
            do(self._operator.name)
        else:
            self._typed = typed_into(self._typed, event)

    def _ask_name(self, do: Callable[[str], None]) -> None:
        """Ask for the operator's name, then call `do` with it."""
        self._naming, self._typed = do, self._operator.name

    def _accept(self) -> None:
        """Acknowledge the marked check, or tick the marked item of the checklist."""
        check = self.marked()
        if check is None:
            return
        # The key was probably meant for the check that was marked before.
        if self._clock.now() - self._moved_s < REACTION_S:
            self._hint = "this line had just changed: look at it, then y again"
            return
        if check.name == CHECKLIST:
            self._tick(check)
            return
        if not self._can_acknowledge(check):
            self._hint = "only a failsafe that fails can be acknowledged" if not self._feed.requests.read_only else ""
            return

        def ask(name: str) -> None:
            self._ask(AcknowledgeCheck(check.name, check.text, name, check.vehicles), "acknowledge")

        self._as_operator(ask)

    def _tick(self, check: Check) -> None:
        """Tick an item, and mark the next open one, which takes no key for a moment: each is read before its tick."""
        if self._feed.requests.read_only or not is_open_item(check):
            return

        def ask(name: str) -> None:
            self._ask(TickItem(check.text, name), "tick")
            items = [row for row in self.rows() if is_open_item(row)]
            if check in items and len(items) > 1:
                self._marked = _mark_of(items[(items.index(check) + 1) % len(items)])
                self._moved_s = self._clock.now()

        self._as_operator(ask)

    def _take_back(self) -> None:
        """Take back the tick of the marked item."""
        check = self.marked()
        if check is not None and check.state is CheckState.TICKED and not self._feed.requests.read_only:
            self._as_operator(lambda name: self._ask(TickItem(check.text, name, ticked=False), "take back"))

    def _as_operator(self, do: Callable[[str], None]) -> None:
        """Call `do` with the operator's name, which is asked for once."""
        if self._operator.name:
            do(self._operator.name)
        else:
            self._ask_name(do)

    def _sign(self, name: str) -> None:
        revision = self._feed.status.revision if self._feed.status is not None else -1
        self._ask(SignOff(name, revision), "sign")

    def _read(self, *, anew: bool) -> None:
        if not self._feed.requests.read_only and (anew or any(c.state is CheckState.UNKNOWN for c in self.checks())):
            self._ask(ReadChecks(anew=anew), "read")

    def checks(self) -> tuple[Check, ...]:
        """Return the station's checks; none while it is silent."""
        status = self._feed.status
        return status.preflight if status is not None and not self._feed.station_lost else ()

    def rows(self) -> tuple[Check, ...]:
        """Return the checks that can be marked."""
        return loud(self.checks())

    def marked(self) -> Check | None:
        """Return the check that keys act on."""
        rows, was = self.rows(), self._marked
        # The mark stays with the same check; if its text or vehicles have changed, with the most similar one.
        alike = (next((row for row in rows if _mark_of(row)[:parts] == was[:parts]), None) for parts in (3, 2, 1, 0))
        return next((row for row in alike if row is not None), None)

    def _mark(self, by: int) -> None:
        rows, marked = self.rows(), self.marked()
        if marked is not None:
            self._marked = _mark_of(rows[(rows.index(marked) + by) % len(rows)])
            self._moved_s = -math.inf

    def _can_acknowledge(self, check: Check) -> bool:
        return check.name in FAILSAFES and check.state is CheckState.FAIL and not self._feed.requests.read_only

    def body(self) -> list[Line]:
        """Return the counts, the failed checks, the passed ones, the details of the marked one, and the keys."""
        checks, rows, marked = self.checks(), self.rows(), self.marked()
        if not checks:
            return [*self._nothing(), [], [(" Esc = close ", Ink.SELECTED)]]
        detail = detail_lines(marked, LINE_CELLS) if marked is not None else []
        title: list[Line] = [[(TITLES.get(marked.name, marked.name), Ink.MUTED)]] if marked is not None else []
        bottom = [[], *title, *detail, [(self._hint, Ink.CAUTION)] if self._hint else [], self._key_line()]
        quiet = quiet_lines(checks, LINE_CELLS)
        room = max(3, self.room - len(bottom) - len(quiet) - 1)
        at = rows.index(marked) if marked is not None else 0
        first = max(0, min(at - room + 2, len(rows) - room))
        shown = rows[first : first + room]
        lines = [check_line(row, LINE_CELLS, f"{self.glyphs.selected} " if row is marked else "  ") for row in shown]
        if hidden := len(rows) - len(shown):
            lines[-1 if first + room < len(rows) else 0] = [(f"  … {hidden + 1} more: arrows", Ink.CAUTION)]
        return [count_line(checks), *lines, *quiet, *bottom]

    def _nothing(self) -> list[Line]:
        silent = self._feed.status is None or self._feed.station_lost
        text = "the station is silent: nothing is known" if silent else "no vehicle of a team is on the ground"
        return [[(text, Ink.MUTED)]]

    def _key_line(self) -> Line:
        if self._naming is not None:
            return [(" your name ", Ink.SELECTED), (f" {self._typed}_   Enter   Esc = no", Ink.BOLD)]
        marked = self.marked()
        keys = ["y acknowledge"] if marked is not None and self._can_acknowledge(marked) else []
        if marked is not None and marked.name == CHECKLIST and not self._feed.requests.read_only:
            keys = ["n take back"] if marked.state is CheckState.TICKED else ["y tick"]
        keys += [] if self._feed.requests.read_only else ["S sign", "R read", "H rehearse"]
        keys += ["arrows"] if len(self.rows()) > 1 else []
        return [(" Esc = close ", Ink.SELECTED), (f"  {'   '.join(keys)}", Ink.BOLD)]


def is_open_item(check: Check) -> bool:
    """Whether the check is an item of the checklist that is not ticked."""
    return check.name == CHECKLIST and check.state is not CheckState.TICKED


def _mark_of(check: Check | None) -> Mark:
    """Return what the operator sees of a check when acting on it."""
    return (check.name, check.text, check.vehicles) if check is not None else ("", "", ())
