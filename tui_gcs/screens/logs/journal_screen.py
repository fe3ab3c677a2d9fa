"""The journal screen: events, filtered by vehicle, class, severity and words; older ones are read as one scrolls up.

New events come with the feed. Older ones are requested from the station, in pieces of its journal file; these may be of
earlier runs of the station.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from rich.cells import cell_len
from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.screen import Screen

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.viewer_actions import JOURNAL_ACTIONS
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import EventClass, GetJournal, JournalEvent
from tui_gcs.core.protocol.event_scope import concerns
from tui_gcs.core.protocol.journal import JOURNAL_END
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import EventRaised, EventsForgotten, SelectionChanged, StationBack, StationLost
from tui_gcs.screens.common.row_copies import copy_rows
from tui_gcs.screens.common.typed_words import TypedWords
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.copied_rows import Record
from tui_gcs.widgets.basics.event_lines import severity_mark
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, cut, wrapped
from tui_gcs.widgets.basics.top_lines import TopLines

MAX_EVENT_LINES = 6
"""The most lines of one event."""
MIN_TEXT_CELLS = 20
MAX_EVENTS = 20_000
"""The most events held; beyond that the oldest are dropped."""
MAX_PIECES = 20
"""The most pieces of the journal file that are searched for one key press, until something fits the filter."""
SEVERITIES = (7, 5, 4, 2)
"""Steps of the severity filter: all, notices and worse, warnings and worse, critical and worse."""
SEVERITY_WORDS = {7: "all", 5: "notice+", 4: "warning+", 2: "critical+"}


@dataclass(frozen=True)
class EventFilter:
    """Which events are shown: all parts of the filter must fit."""

    words: str = ""
    cls: EventClass | None = None
    severity: int = 7
    vehicles: frozenset[int] | None = None
    """None: events of all vehicles."""

    def passes(self, event: JournalEvent) -> bool:
        """Return whether an event fits every part of the filter."""
        if event.severity > self.severity or (self.cls is not None and event.cls is not self.cls):
            return False
        if self.vehicles is not None and not concerns(event, self.vehicles):
            return False
        line = f"{event.source} {event.cls} {event.text}".casefold()
        return all(word in line for word in self.words.casefold().split())


class JournalLines(LinesView):
    """The events, oldest first, each in as many lines as its text takes; `up` events from the end."""

    DEFAULT_CSS = framed("JournalLines", "height: 1fr;")

    _events: Sequence[JournalEvent] = ()
    _principal = ""
    up = 0
    fit = 1
    """Number of events that were completely in view last."""

    def show(self, events_: Sequence[JournalEvent], title: str, principal: str) -> None:
        """Show these events, as many as fit."""
        self._events, self._principal = events_, principal
        self.up = max(0, min(self.up, len(events_) - 1))
        set_title(self, title)
        self.update_lines()

    def go(self, up: int, events_: Sequence[JournalEvent]) -> None:
        """Scroll to `up` events from the end; at the oldest event no farther than a screen is filled."""
        end = max(1, len(events_) - max(0, up))
        used = 0
        # At the oldest event the view stops when it is full, not when the event stands alone at its bottom.
        for at, event in enumerate(events_[: end + self.room]):
            used += len(journal_lines(event, self.size.width, self._principal))
            if used > self.room or at >= self.room:
                break
            end = max(end, at + 1)
        self.up = max(0, len(events_) - end)

    @property
    def room(self) -> int:
        """The number of lines that fit."""
        return max(1, self.size.height)

    @property
    def events_in_view(self) -> Sequence[JournalEvent]:
        """The events that are completely in view, oldest first."""
        end = len(self._events) - self.up
        return self._events[max(0, end - self.fit) : end]

    def lines(self, width: int, height: int) -> list[Line]:
        """Return as many of the newest events as fit."""
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


def journal_lines(event: JournalEvent, width: int, principal: str) -> list[Line]:
    """Return a whole event, in several lines if needed: elsewhere its text may have been cut."""
    *head, (text, ink) = journal_line(event, width, principal)
    indent = sum(cell_len(piece) for piece, _ in head)
    room = max(MIN_TEXT_CELLS, width - indent)
    if cell_len(text) <= room:
        return [[*head, (text, ink)]]
    pieces = wrapped(text, room, MAX_EVENT_LINES, placeholder=" ..")
    return [[*head, (pieces[0], ink)], *([(" " * indent, ink), (piece, ink)] for piece in pieces[1:])]


def journal_line(event: JournalEvent, width: int, principal: str) -> list[Run]:
    """Return an event in one line: time in UTC, with the day where there is room, severity, class, source, text."""
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


def journal_record(event: JournalEvent) -> Record:
    """Return an event for the clipboard, with date and time in UTC."""
    try:
        when = time.strftime("%Y-%m-%d %H:%M:%S", time.gmtime(event.wall_s))
    except (OverflowError, ValueError, OSError):  # a damaged line
        when = ""
    own: dict[str, object] = {"time_utc": when, "class": event.cls, "severity": event.severity, "source": event.source}
    return own | {"text": event.text}


def _key(event: JournalEvent) -> tuple[int, float, str]:
    return event.seq, event.wall_s, event.text


class JournalScreen(Screen[None]):
    """The list of events, and the keys that scroll and filter it."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = JOURNAL_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(JOURNAL_ACTIONS, "journal")
    AUTO_FOCUS = None
    CSS = "JournalScreen { layout: vertical; }"

    def __init__(self, feed: Feed, *, glyphs: GlyphSet = UNICODE) -> None:
        super().__init__()
        self.feed = feed
        self.typed = TypedWords()
        self._glyphs = glyphs
        self._filter = EventFilter()
        self._only_selected = False
        self._events: list[JournalEvent] = []
        self._has: set[tuple[int, float, str]] = set()
        self._before = JOURNAL_END
        self._copied = ""
        """What the last key copied; in the title until the next key."""
        self._asking = False
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.journal_lines = JournalLines(glyphs=glyphs)

    def compose(self) -> ComposeResult:
        """Compose the top lines, the events and the footer."""
        yield self.top_lines
        yield self.journal_lines
        yield FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=self._glyphs, feed=self.feed, here="show_journal")

    def on_mount(self) -> None:
        """Begin to receive the feed's messages, show its events, and request older ones."""
        self.feed.listen(self)
        self._take(tuple(self.feed.events.kept))
        self._ask_older()

    def on_event_raised(self, message: EventRaised) -> None:
        """Append new events; the view stays where it is while the operator reads older ones."""
        before = len(self._events)
        self._take(message.events)
        # Lines under the eyes of the operator must not move when new ones arrive below.
        if self.journal_lines.up:
            self.journal_lines.up += sum(map(self._filter.passes, self._events[before:]))
        self.show()

    def on_events_forgotten(self, _message: EventsForgotten) -> None:
        """Begin anew: a replay went back in time."""
        self._events, self._has = [], set()
        self.journal_lines.up = 0
        self.show()

    def on_selection_changed(self, _message: SelectionChanged) -> None:
        """Show the events of the vehicles that are selected now, if only those are shown."""
        if self._only_selected:
            self._set_filter()

    def _fresh(self, events_: Sequence[JournalEvent]) -> list[JournalEvent]:
        fresh = [event for event in events_ if _key(event) not in self._has]
        self._has.update(map(_key, fresh))
        return fresh

    def _take(self, new: Sequence[JournalEvent]) -> None:
        """Append events of the feed."""
        # What the feed brings is newest, whatever its time of day: clocks are set in flight, too.
        self._events = [*self._events, *self._fresh(new)][-MAX_EVENTS:]

    def _take_older(self, piece: Sequence[JournalEvent]) -> None:
        """Insert a piece of the file, in the file's order, each event before the one that follows it there."""
        place = {_key(event): at for at, event in enumerate(self._events)}
        fresh = set(map(_key, self._fresh(piece)))
        # The file and the feed overlap: an event that is known already marks where the piece belongs.
        merged: list[JournalEvent] = []
        done = 0
        for event in piece:
            if _key(event) in fresh:
                merged.append(event)
            elif (at := place.get(_key(event), -1)) >= done:
                merged += self._events[done : at + 1]
                done = at + 1
        self._events = [*merged, *self._events[done:]][-MAX_EVENTS:]

    def _shown(self) -> list[JournalEvent]:
        if self._filter == EventFilter():
            return self._events
        return [event for event in self._events if self._filter.passes(event)]

    @on(events.ScreenResume)
    @on(events.Resize)
    @on(StationLost)
    @on(StationBack)
    def show(self) -> None:
        """Show the events that fit the filter."""
        if self.is_current:
            self.journal_lines.show(self._shown(), self._title(), self.feed.requests.principal)

    def _title(self) -> str:
        if self._copied:
            return self._copied
        chosen = self._filter
        parts = ["journal", "follows" if not self.journal_lines.up else f"{self.journal_lines.up} events from the end"]
        if search := self.typed.title("words"):
            parts.append(search)
        if chosen.cls is not None:
            parts.append(f"class {chosen.cls}")
        if chosen.severity != SEVERITIES[0]:
            parts.append(SEVERITY_WORDS[chosen.severity])
        if chosen.vehicles is not None:
            parts.append(vehicles_words(chosen.vehicles) if chosen.vehicles else "no vehicle selected")
        if not self._before:
            parts.append("from its beginning")
        if self.feed.station_lost:
            parts.append("STATION SILENT: nothing newer is known")
        return "   ".join(parts)

    def _ask_older(self) -> None:
        """Request one more piece of the file, or several until something new fits the filter."""
        if not self._asking and self._before and not self.feed.station_lost:
            self._asking = True
            self.run_worker(self._older(), group="journal", exit_on_error=False)

    async def _older(self) -> None:
        shown = len(self._shown())
        try:
            # A filter may fit few events: several pieces are read for one key press.
            for _ in range(MAX_PIECES):
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

    def on_key(self, event: events.Key) -> None:
        """Take keys as letters of the filter while it is typed."""
        if self.typed.take(event):
            self._set_filter(words=self.typed.words)

    def _set_filter(self, **changes: object) -> None:
        """Change the filter and show the newest events that fit; request older ones if few do."""
        self._copied = ""
        vehicles = frozenset(self.feed.selection.ids) if self._only_selected else None
        old = self._filter
        values = {"words": old.words, "cls": old.cls, "severity": old.severity, **changes, "vehicles": vehicles}
        self._filter = EventFilter(**values)  # type: ignore[arg-type]
        self.journal_lines.up = 0
        self.show()
        if len(self._shown()) < self.journal_lines.room:
            self._ask_older()

    def action_filter(self) -> None:
        """Begin to type the words of the filter."""
        self.typed.is_typing = True
        self.show()

    def action_next_class(self) -> None:
        """Show the next class of events; after the last one all classes."""
        classes = [None, *EventClass]
        self._set_filter(cls=classes[(classes.index(self._filter.cls) + 1) % len(classes)])

    def action_next_severity(self) -> None:
        """Show only more severe events; after the last step all events."""
        at = SEVERITIES.index(self._filter.severity)
        self._set_filter(severity=SEVERITIES[(at + 1) % len(SEVERITIES)])

    def action_of_selected(self) -> None:
        """Show only events of the selected vehicles, or of all."""
        self._only_selected = not self._only_selected
        self._set_filter()

    def action_cancel(self) -> None:
        """End the filter: all events are shown."""
        self._only_selected = False
        self.typed.words = ""
        self._set_filter(words="", cls=None, severity=SEVERITIES[0])

    def action_scroll(self, events_: int) -> None:
        """Scroll to older events, or to newer ones if negative; older ones than are held are requested."""
        self._copied = ""
        lines = self.journal_lines
        if lines.up + events_ > len(self._shown()) - lines.room:
            self._ask_older()
        lines.go(lines.up + events_, self._shown())
        self.show()

    def action_copy_row(self) -> None:
        """Copy the events in view to the terminal's clipboard."""
        self._copy(self.journal_lines.events_in_view)

    def action_copy_rows(self) -> None:
        """Copy all events held that fit the filter to the terminal's clipboard."""
        self._copy(self._shown())

    def _copy(self, copied: Sequence[JournalEvent]) -> None:
        self._copied, _ = copy_rows(self.app, [journal_record(event) for event in copied])
        self.show()

    def action_page(self, pages: int) -> None:
        """Scroll by pages to older events, or to newer ones if negative."""
        self.action_scroll(pages * max(1, self.journal_lines.fit - 1))

    def action_end(self, direction: int) -> None:
        """Scroll to the oldest event held (1), or to the newest one and follow (-1)."""
        self.action_scroll(direction * len(self._events))
