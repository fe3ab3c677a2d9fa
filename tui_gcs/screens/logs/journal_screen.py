"""The journal screen: what happened, filtered by vehicle, class, severity and words; older lines come as one goes up.

New events come with the feed; older ones are asked of the station, piece by piece of its journal file, those of
earlier starts of the station, too.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from rich.cells import cell_len
from textual import events
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.screen import Screen

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.viewer_actions import JOURNAL_ACTIONS
from tui_gcs.core.protocol.common import Event, EventClass, GetJournal
from tui_gcs.core.protocol.event_scope import concerns
from tui_gcs.core.protocol.journal import JOURNAL_END
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import EventRaised, SelectionChanged, StationBack, StationLost
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.event_lines import severity_mark
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, cut
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.basics.wrapping import wrapped

MOST_LINES = 6
"""Of one event."""
LEAST_CELLS = 20
KEPT = 20_000
"""Older lines held; beyond that the newest wins."""
MOST_PIECES = 20
"""Of the file, looked through for one key press, until something fits the filter."""
MOST_FILTER = 40
SEVERITIES = (7, 5, 4, 2)
"""Steps of the severity filter: all, notices and worse, warnings and worse, critical and worse."""
SEVERITY_WORDS = {7: "all", 5: "notice+", 4: "warning+", 2: "critical+"}


@dataclass(frozen=True)
class Sieve:
    """What is shown."""

    words: str = ""
    cls: EventClass | None = None
    severity: int = 7
    vehicles: frozenset[int] | None = None
    """None: whoever it is about."""

    def passes(self, event: Event) -> bool:
        """Whether this event fits all of it."""
        if event.severity > self.severity or (self.cls is not None and event.cls is not self.cls):
            return False
        if self.vehicles is not None and not concerns(event, self.vehicles):
            return False
        line = f"{event.source} {event.cls} {event.text}".casefold()
        return all(word in line for word in self.words.casefold().split())


class JournalLines(LinesView):
    """The events, oldest on top, each in as many lines as its text takes; `up` events from the end."""

    DEFAULT_CSS = """
    JournalLines { height: 1fr; border: solid #4a5560; border-title-color: #d8dee4; }
    JournalLines.-ascii { border: ascii #4a5560; }
    """

    _events: Sequence[Event] = ()
    _principal = ""
    up = 0
    fit = 1
    """Events that were whole on the screen last."""

    def show(self, events_: Sequence[Event], title: str, principal: str) -> None:
        """Show these, as far as they fit."""
        self._events, self._principal = events_, principal
        self.up = max(0, min(self.up, len(events_) - 1))
        set_title(self, title)
        self.update_lines()

    def go(self, up: int, events_: Sequence[Event]) -> None:
        """So many of these from the end; at the oldest one no farther than a screen is filled."""
        end = max(1, len(events_) - max(0, up))
        used = 0
        for at, event in enumerate(events_[: end + self.room]):
            used += len(journal_lines(event, self.size.width, self._principal))
            if used > self.room or at >= self.room:
                break
            end = max(end, at + 1)
        self.up = max(0, len(events_) - end)

    @property
    def room(self) -> int:
        """Lines that fit."""
        return max(1, self.size.height)

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        end = len(self._events) - self.up
        shown = self._events[max(0, end - height) : end]
        if not shown:
            return [[("nothing that fits: Esc ends the filter, PgUp looks further back", Ink.MUTED)]]
        lines: list[Line] = []
        self.fit = 0
        for event in reversed(shown):
            lines = [*journal_lines(event, width, self._principal), *lines]
            if len(lines) > height:
                break
            self.fit += 1
        return lines[-height:]


def journal_lines(event: Event, width: int, principal: str) -> list[Line]:
    """The whole event: what was told in a line that had no room for it is read here."""
    *head, (text, ink) = journal_line(event, width, principal)
    indent = sum(cell_len(piece) for piece, _ in head)
    room = max(LEAST_CELLS, width - indent)
    if cell_len(text) <= room:
        return [[*head, (text, ink)]]
    pieces = wrapped(text, room, MOST_LINES, placeholder=" ..")
    return [[*head, (pieces[0], ink)], *([(" " * indent, ink), (piece, ink)] for piece in pieces[1:])]


def journal_line(event: Event, width: int, principal: str) -> list[Run]:
    """Day where there is room, UTC, severity, class, source, text."""
    mark, ink = severity_mark(event.severity)
    stamp = "%m-%d %H:%M:%S" if width >= 100 else "%H:%M:%S"
    try:
        when = time.strftime(stamp, time.gmtime(event.wall_s))
    except (OverflowError, ValueError, OSError):  # a damaged line
        when = "--:--:--"
    source = "you" if event.source == principal else event.source
    cls, cells = (f"{event.cls:<10} ", 20) if width >= 100 else (f"{event.cls[:3]} ", 14)
    return [
        (f"{when} ", Ink.MUTED),
        (f"{mark} ", ink),
        (cls, Ink.MUTED),
        (f"{cut(source, cells)} ", Ink.TEXT),
        (event.text, ink),
    ]


def _key(event: Event) -> tuple[int, float, str]:
    return event.seq, event.wall_s, event.text


class JournalScreen(Screen[None]):
    """What happened, and why."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = JOURNAL_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(JOURNAL_ACTIONS, "journal")
    AUTO_FOCUS = None
    CSS = "JournalScreen { layout: vertical; }"

    def __init__(self, feed: Feed, *, glyphs: GlyphSet = UNICODE) -> None:
        """For this feed."""
        super().__init__()
        self.feed = feed
        self.is_typing = False
        """Keys are letters of the filter."""
        self._glyphs = glyphs
        self._sieve = Sieve()
        self._only_selected = False
        self._events: list[Event] = []
        self._has: set[tuple[int, float, str]] = set()
        self._before = JOURNAL_END
        self._asking = False
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.journal_lines = JournalLines(glyphs=glyphs)

    def compose(self) -> ComposeResult:
        """Status, alarm; lines; keys."""
        yield self.top_lines
        yield self.journal_lines
        yield FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=self._glyphs, feed=self.feed, here="show_journal")

    def on_mount(self) -> None:
        """What the feed has, and then what the file has."""
        self.feed.listen(self)
        self._take(tuple(self.feed.events.kept))
        self._ask_older()

    def on_unmount(self) -> None:
        """No more messages."""
        self.feed.leave(self)

    def on_screen_resume(self) -> None:
        """What changed while another screen was shown."""
        self.show()

    def on_resize(self) -> None:
        """More or fewer lines fit."""
        self.show()

    # ------------------------------------------------------------ messages

    def on_event_raised(self, message: EventRaised) -> None:
        """New lines; who reads older ones is not moved."""
        before = len(self._events)
        self._take(message.events)
        if self.journal_lines.up:
            self.journal_lines.up += sum(map(self._sieve.passes, self._events[before:]))
        self.show()

    def on_selection_changed(self, _message: SelectionChanged) -> None:
        """Other vehicles, where only those are shown."""
        if self._only_selected:
            self._sift()

    def on_station_lost(self, _message: StationLost) -> None:
        """The title says so."""
        self.show()

    def on_station_back(self, _message: StationBack) -> None:
        """Heard again."""
        self.show()

    # ------------------------------------------------------------ lines

    def _fresh(self, events_: Sequence[Event]) -> list[Event]:
        fresh = [event for event in events_ if _key(event) not in self._has]
        self._has.update(map(_key, fresh))
        return fresh

    def _take(self, new: Sequence[Event]) -> None:
        """What the feed brings is the newest, whatever the time of day says: clocks are set in flight, too."""
        self._events = [*self._events, *self._fresh(new)][-KEPT:]

    def _take_older(self, piece: Sequence[Event]) -> None:
        """A piece of the file, in the file's order: each before what follows it there."""
        place = {_key(event): at for at, event in enumerate(self._events)}
        fresh = set(map(_key, self._fresh(piece)))
        merged: list[Event] = []
        done = 0
        for event in piece:
            if _key(event) in fresh:
                merged.append(event)
            elif (at := place.get(_key(event), -1)) >= done:
                merged += self._events[done : at + 1]
                done = at + 1
        self._events = [*merged, *self._events[done:]][-KEPT:]

    def _shown(self) -> list[Event]:
        if self._sieve == Sieve():
            return self._events
        return [event for event in self._events if self._sieve.passes(event)]

    def show(self) -> None:
        """What fits the filter."""
        if self.is_current:
            self.journal_lines.show(self._shown(), self._title(), self.feed.requests.principal)

    def _title(self) -> str:
        sieve = self._sieve
        parts = ["journal", "follows" if not self.journal_lines.up else f"{self.journal_lines.up} events from the end"]
        if self.is_typing or sieve.words:
            parts.append(f"words: {sieve.words}{'_ (Enter keeps, Esc ends)' if self.is_typing else ''}")
        if sieve.cls is not None:
            parts.append(f"class {sieve.cls}")
        if sieve.severity != SEVERITIES[0]:
            parts.append(SEVERITY_WORDS[sieve.severity])
        if sieve.vehicles is not None:
            parts.append(f"vehicles {ids(sieve.vehicles) or 'none selected'}")
        if not self._before:
            parts.append("from its beginning")
        if self.feed.station_lost:
            parts.append("STATION SILENT: nothing newer is known")
        return "   ".join(parts)

    def _ask_older(self) -> None:
        """One piece more of the file, or several until something new fits the filter."""
        if not self._asking and self._before and not self.feed.station_lost:
            self._asking = True
            self.run_worker(self._older(), group="journal", exit_on_error=False)

    async def _older(self) -> None:
        shown = len(self._shown())
        try:
            for _ in range(MOST_PIECES):
                reply = await self.feed.requests.send(GetJournal(before=self._before))
                if not reply.ok:
                    break
                self._before = reply.journal_at
                self._take_older(reply.events)
                if not self._before or len(self._shown()) >= shown + self.journal_lines.room:
                    break
        finally:
            self._asking = False
        self.show()

    # ------------------------------------------------------------ keys

    def on_key(self, event: events.Key) -> None:
        """While words are typed, keys are letters of them."""
        if not self.is_typing:
            return
        event.stop()
        event.prevent_default()
        words = self._sieve.words
        if event.key in ("enter", "escape"):
            self.is_typing = False
            words = "" if event.key == "escape" else words
        elif event.key == "backspace":
            words = words[:-1]
        elif event.character is not None and event.is_printable:
            words = (words + event.character)[:MOST_FILTER]
        self._sift(words=words)

    def _sift(self, **changes: object) -> None:
        """Another filter: from the end, and further back if little fits."""
        vehicles = frozenset(self.feed.selection.ids) if self._only_selected else None
        old = self._sieve
        values = {"words": old.words, "cls": old.cls, "severity": old.severity, **changes, "vehicles": vehicles}
        self._sieve = Sieve(**values)  # type: ignore[arg-type]
        self.journal_lines.up = 0
        self.show()
        if len(self._shown()) < self.journal_lines.room:
            self._ask_older()

    def action_filter(self) -> None:
        """Begin to type."""
        self.is_typing = True
        self.show()

    def action_next_class(self) -> None:
        """All, then one after the other."""
        classes = [None, *EventClass]
        self._sift(cls=classes[(classes.index(self._sieve.cls) + 1) % len(classes)])

    def action_next_severity(self) -> None:
        """Less and less."""
        at = SEVERITIES.index(self._sieve.severity)
        self._sift(severity=SEVERITIES[(at + 1) % len(SEVERITIES)])

    def action_of_selected(self) -> None:
        """Only the selected vehicles, or all."""
        self._only_selected = not self._only_selected
        self._sift()

    def action_cancel(self) -> None:
        """Everything."""
        self._only_selected = False
        self._sift(words="", cls=None, severity=SEVERITIES[0])

    def _move(self, by: int) -> None:
        lines = self.journal_lines
        count = len(self._shown())
        if lines.up + by > count - lines.room:
            self._ask_older()
        lines.go(lines.up + by, self._shown())
        self.show()

    def action_up(self) -> None:
        """One older."""
        self._move(1)

    def action_down(self) -> None:
        """One newer."""
        self._move(-1)

    def action_page_up(self) -> None:
        """A page older."""
        self._move(max(1, self.journal_lines.fit - 1))

    def action_page_down(self) -> None:
        """A page newer."""
        self._move(-max(1, self.journal_lines.fit - 1))

    def action_oldest(self) -> None:
        """The oldest that is here; older ones are asked for."""
        self._move(len(self._events))

    def action_newest(self) -> None:
        """Follow."""
        self._move(-len(self._events))
