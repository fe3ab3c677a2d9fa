"""The flights screen: layout, views and keys."""

import asyncio
import math
from collections.abc import Callable, Coroutine
from typing import Any, ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.flight_actions import FLIGHT_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.core.judging.flight_timeline import FlightReadError, FlightTimeline, TimelineEntry
from tui_gcs.core.judging.timeline_process import read_timeline
from tui_gcs.core.records.event_log import CRITICAL, DEBUG, NOTICE, WARNING
from tui_gcs.core.records.flight_archive import FlightArchive, RecordedFlight
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.draft_screen import typed_path
from tui_gcs.screens.common.polled_screen import PolledScreen
from tui_gcs.screens.common.typed_words import TypedWords
from tui_gcs.screens.flights.flight_files import FlightFiles
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.flights.flight_lists import FlightList, FlightPanel, TimelineList, remark, size_words
from tui_gcs.widgets.forms.prompt_bar import PromptBar

LISTED_LABELS = {"select": ""}
"""No vehicle is selected for what this screen does, and the smallest terminal has no room for it."""
OPENED_LABELS = {"select": "", "enter": "replay", "replay": "", "next_severity": "alarms", "cancel": "back"}
"""What keys do in an opened telemetry log, for the footer."""
LOG_LABELS = OPENED_LABELS | {"enter": "plots here", "plot": ""}
"""The same for the log of a vehicle, which cannot be replayed."""
ALARM_SOURCE = "alarm"
"""The source of what the station's alarm table reported."""
PARTS: dict[str, Callable[[TimelineEntry], bool]] = {
    "": lambda entry: entry.severity <= DEBUG,
    "alarms": lambda entry: entry.source == ALARM_SOURCE,
    "notices": lambda entry: entry.severity <= NOTICE,
    "warnings": lambda entry: entry.severity <= WARNING,
    "critical": lambda entry: entry.severity <= CRITICAL,
}
"""Which of the entries are shown, by the words of the title: everything first."""


class FlightsScreen(PolledScreen):
    """Recordings on this computer; one of them opened shows what happened in it."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = FLIGHT_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(FLIGHT_ACTIONS, "flights")
    LOOK_S = 2.0
    NEEDS_STATION = False
    CSS = """
    FlightsScreen { layout: vertical; }
    FlightsScreen.-opened FlightList { display: none; }
    FlightsScreen.-opened TimelineList { display: block; }
    """

    def __init__(self, feed: Feed, clock: Clock, archive: FlightArchive, *, glyphs: GlyphSet = UNICODE) -> None:
        """Show the recordings of `archive`."""
        super().__init__(feed)
        self.typed = TypedWords()
        self.read: Callable[[RecordedFlight, tuple[RecordedFlight, ...]], Coroutine[Any, Any, FlightTimeline]] = (
            read_timeline
        )
        self._glyphs = glyphs
        self._archive = archive
        self._flights: tuple[RecordedFlight, ...] = ()
        self._opened: tuple[RecordedFlight, FlightTimeline] | None = None
        self._part = ""
        self.files = FlightFiles(self, feed, clock, glyphs, self.show_all, archive)
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.flight_list = FlightList(glyphs=glyphs)
        self.timeline_list = TimelineList(glyphs=glyphs)
        self.panel = FlightPanel(glyphs=glyphs)
        self.export_bar = PromptBar("export")
        self.open_bar = PromptBar("open")
        self._export_of: RecordedFlight | None = None
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed, here="show_flights")

    def compose(self) -> ComposeResult:
        """Compose the top lines, the lists, the panel, the questions and the footer."""
        yield self.top_lines
        yield self.flight_list
        yield self.timeline_list
        yield self.panel
        yield self.export_bar
        yield self.open_bar
        yield self.footer

    @on(events.ScreenResume)
    def look_again(self) -> None:
        """Look at once."""
        self.look()

    async def ask_station(self) -> None:
        """List the recordings. The station is not asked: they are files."""
        self._flights = await asyncio.to_thread(self._archive.scan)
        self.show_all()

    @on(events.Resize)
    def show_all(self) -> None:
        """Show the list, or what happened in the opened flight; the same row stays chosen."""
        if not self.is_current:
            return
        words = self.typed.words.casefold().split()
        find = self.typed.title("find")
        shown = [flight for flight in self._flights if _fits(words, _words_of(flight))] if not self._opened else []
        self.flight_list.empty_text = "no recording fits" if words else "nothing was recorded yet; + opens a file"
        if self._opened is None:
            self.flight_list.show_kept(shown, lambda flight: flight.path)
            size_mb = sum(flight.size_bytes for flight in self._flights) / 1e6
            title = f"flights  {len(self._flights)}   {size_mb:.0f} MB"
            set_title(self.flight_list, f"{title}   {find}" if find else title)
        else:
            self._show_timeline(*self._opened, words, find)
        self.footer.relabel(self._labels())
        flight = self._opened[0] if self._opened is not None else self.flight_list.chosen_row
        entry = self.timeline_list.chosen_row if self._opened is not None else None
        self.panel.show(flight, self._opened[1] if self._opened is not None else None, self.files.report, entry)

    def _labels(self) -> dict[str, str]:
        if self._opened is None:
            return LISTED_LABELS
        return OPENED_LABELS if self._opened[0].is_telemetry else LOG_LABELS

    def _show_timeline(self, flight: RecordedFlight, opened: FlightTimeline, words: list[str], find: str) -> None:
        is_shown = PARTS[self._part]
        entries = [e for e in opened.entries if is_shown(e) and _fits(words, f"{e.source} {e.text}")]
        self.timeline_list.first_wall_s = opened.first_wall_s
        self.timeline_list.empty_text = (
            "nothing that fits: w shows others" if words or self._part else "nothing happened"
        )
        self.timeline_list.show_kept(entries, lambda entry: entry)
        parts = (clean(flight.path.name, 40), f"{len(entries)} entries", self._part, find)
        set_title(self.timeline_list, "   ".join(filter(None, parts)))

    def show_chosen(self) -> None:
        """Show the chosen row."""
        self.show_all()

    @property
    def row_list(self) -> RowsView[Any]:
        """The flights, or what happened in the opened one."""
        return self.timeline_list if self._opened is not None else self.flight_list

    @property
    def _chosen(self) -> RecordedFlight | None:
        return self._opened[0] if self._opened is not None else self.flight_list.chosen_row

    def on_key(self, event: events.Key) -> None:
        """Take keys as letters of the words while they are typed."""
        if self.typed.take(event):
            self.show_all()

    def say_copied(self, text: str, ink: Ink) -> None:
        """See `ListScreen`."""
        self.files.say_copied(text, ink)

    # ---------------------------------------------------------------- keys

    def action_enter(self) -> None:
        """Open the chosen flight; in an opened one replay it from the chosen moment, or plot a vehicle's log there."""
        if self._opened is None:
            flight = self.flight_list.chosen_row
            if flight is not None:
                self.files.say(f"reading {clean(flight.path.name, 60)}, {size_words(flight.size_bytes)} …")
                self.run_worker(self._open(flight), group="open", exclusive=True, exit_on_error=False)
        elif self._opened[0].is_telemetry:
            self.action_replay()
        else:
            self.action_plot()

    async def _open(self, flight: RecordedFlight) -> None:
        try:
            opened = await self.read(flight, self._flights)
        except FlightReadError as error:
            self.files.say(str(error), Ink.WARNING)
            return
        self._opened, self._part, self.typed.words = (flight, opened), "", ""
        self.timeline_list.chosen = 0
        self.set_class(True, "-opened")
        self.files.report = ()
        self.show_all()

    def action_replay(self) -> None:
        """Replay the flight, in an opened one from the chosen moment on."""
        entry: TimelineEntry | None = self.timeline_list.chosen_row if self._opened is not None else None
        at_s = entry.wall_s - self._opened[1].first_wall_s if self._opened is not None and entry is not None else 0.0
        self.files.replay(self._chosen, at_s)

    def action_plot(self) -> None:
        """Show values of the marked recordings over time, or of the chosen one; in an opened one at its entry."""
        marked = [flight for flight in self._flights if flight.path in self.flight_list.marked]
        chosen = self._chosen
        entry: TimelineEntry | None = self.timeline_list.chosen_row if self._opened is not None else None
        at_s = entry.wall_s if entry is not None else math.nan
        self.files.plot(marked or ([chosen] if chosen is not None else []), at_s)

    def action_mark(self) -> None:
        """Mark the chosen recording for the plots, or take its mark off, and go on to the next."""
        flight = self.flight_list.chosen_row
        if flight is None or self._opened is not None:
            self.files.say(
                "marks are set in the list: Esc first" if self._opened else "no flight is chosen", Ink.CAUTION
            )
            return
        self.flight_list.marked ^= {flight.path}
        self.flight_list.step(1)
        self.show_all()

    def action_export(self) -> None:
        """Ask for the file that the tracks go to."""
        flight = self._export_of = self._chosen
        if flight is None:
            self.files.say("no flight is chosen", Ink.CAUTION)
        else:
            self.export_bar.ask("export tracks to (.csv .kml .gpx)", f"{flight.path.stem}.kml")

    @on(PromptBar.Answered, "#export")
    def _export_answered(self, message: PromptBar.Answered) -> None:
        self.set_focus(None)
        path = typed_path(message.text) if message.text is not None else None
        if path is not None and self._export_of is not None:
            self.files.export(self._export_of, path)

    def action_open_file(self) -> None:
        """Ask for a file to add to the list."""
        self.open_bar.ask("open .tlog, .bin or .ulg")

    @on(PromptBar.Answered, "#open")
    def _open_answered(self, message: PromptBar.Answered) -> None:
        self.set_focus(None)
        path = typed_path(message.text) if message.text is not None else None
        if path is not None:
            self.files.open_file(path)
            self.look()

    def action_delete(self) -> None:
        """Ask whether the chosen recording is to be removed."""
        if self._opened is not None:
            self.files.say("Esc first: flights are deleted in the list", Ink.CAUTION)
        else:
            self.files.delete(self.flight_list.chosen_row, self.look)

    def action_copy_row(self) -> None:
        """Copy the path of the chosen recording, or of its report; in an opened one the chosen entry."""
        if self._opened is None:
            self.files.copy_path_of(self._chosen)
        else:
            super().action_copy_row()

    def action_filter(self) -> None:
        """Begin to type the words to look for."""
        self.typed.is_typing = True
        self.show_all()

    def action_next_severity(self) -> None:
        """Show alarms alone, or only graver entries; after the last step all."""
        parts = list(PARTS)
        self._part = parts[(parts.index(self._part) + 1) % len(parts)]
        self.show_all()

    def action_cancel(self) -> None:
        """End the search; without one go back to the list. The report of the last key goes with either."""
        self.files.report = ()
        if self.typed.words:
            self.typed.words = ""
        elif self._opened is not None:
            self._opened = None
            self.set_class(False, "-opened")
        self.show_all()


def _words_of(flight: RecordedFlight) -> str:
    return f"{flight.path.name} {flight.source} {flight.what} {remark(flight)}"


def _fits(words: list[str], text: str) -> bool:
    return not words or all(word in text.casefold() for word in words)
