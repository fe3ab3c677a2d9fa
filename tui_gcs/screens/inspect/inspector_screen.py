"""The inspector screen: layout, filter and keys."""

from typing import ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal
from textual.screen import Screen

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.inspector_actions import INSPECTOR_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.inspection import MessageRow
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.message_inspection import MessageInspector, matching
from tui_gcs.feed.messages import SelectionChanged, StationBack, StationLost
from tui_gcs.screens.inspect.message_rates import MessageRates
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.number_text import ids
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowPicked
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.forms.prompt_bar import PromptBar
from tui_gcs.widgets.inspect.dropped_list import DroppedList
from tui_gcs.widgets.inspect.message_list import MessageList
from tui_gcs.widgets.inspect.message_panel import MessagePanel

MAX_FILTER = 40
LOOK_S = 0.5
"""The station is asked this often while the screen is shown and not frozen."""


class InspectorScreen(Screen[None]):
    """The messages of the selected vehicles, or of all that is received while none is selected."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = INSPECTOR_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(INSPECTOR_ACTIONS, "inspector")
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-wide")]
    # None would let Textual put the cursor into the hidden prompt, which then takes every key.
    AUTO_FOCUS = ""
    CSS = """
    InspectorScreen { layout: vertical; }
    InspectorScreen #middle { height: 1fr; }
    InspectorScreen MessageList { width: 62; }
    InspectorScreen MessagePanel { width: 1fr; }
    InspectorScreen.-narrow #middle { layout: vertical; }
    InspectorScreen.-narrow MessageList { width: 1fr; }
    InspectorScreen.-narrow MessagePanel { width: 1fr; height: 10; }
    InspectorScreen.-dropped MessageList, InspectorScreen.-dropped MessagePanel { display: none; }
    InspectorScreen.-dropped DroppedList { display: block; }
    InspectorScreen.-large MessageList { display: none; }
    InspectorScreen.-large MessagePanel, InspectorScreen.-large.-narrow MessagePanel { width: 1fr; height: 1fr; }
    """

    def __init__(self, feed: Feed, clock: Clock, *, glyphs: GlyphSet = UNICODE) -> None:
        """Show what the station of `feed` receives."""
        super().__init__()
        self.feed = feed
        self.is_typing = False
        """Keys are letters of the filter."""
        self.is_frozen = False
        self._glyphs = glyphs
        self._words = ""
        self._as_bytes = False
        self._is_looking = False
        self._rate_for: MessageRow | None = None
        """The message whose rate is being typed: another one may be chosen by the time it is."""
        self.inspector = MessageInspector(feed.requests, self.show_all)
        self.rates = MessageRates(self, feed, clock, glyphs, self._show_chosen)
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.message_list = MessageList(glyphs=glyphs)
        self.dropped_list = DroppedList(glyphs=glyphs)
        self.panel = MessagePanel(glyphs=glyphs)
        self.rate_bar = PromptBar("rate")

    def compose(self) -> ComposeResult:
        """Compose the top lines, the lists, the panel of one message, the question and the footer."""
        yield self.top_lines
        with Horizontal(id="middle"):
            yield self.message_list
            yield self.dropped_list
            yield self.panel
        yield self.rate_bar
        yield FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=self._glyphs, feed=self.feed, here="show_inspector")

    def on_mount(self) -> None:
        """Begin to receive the feed's messages, and to ask."""
        self.feed.listen(self)
        self.set_interval(LOOK_S, self.look)

    @on(events.ScreenResume)
    @on(SelectionChanged)
    @on(StationBack)
    def look_again(self) -> None:
        """Look at once; rates are measured anew, because nothing was asked meanwhile."""
        self.inspector.pause()
        self.look()

    def look(self) -> None:
        """Ask the station what it receives; not while another screen is shown, nor while the picture is frozen."""
        if self.is_current and not self.is_frozen and not self._is_looking and not self.feed.station_lost:
            self._is_looking = True
            self.run_worker(self._look(), group="look", exit_on_error=False)

    async def _look(self) -> None:
        chosen = self.message_list.chosen_row
        dropped = self.feed.status.dropped if self.feed.status is not None else {}
        try:
            await self.inspector.look(self.feed.selection.ids, chosen.row.key if chosen is not None else None, dropped)
        finally:
            self._is_looking = False

    @on(events.Resize)
    @on(StationLost)
    def show_all(self) -> None:
        """Show the messages that fit the filter."""
        if not self.is_current:
            return
        chosen = self.message_list.chosen_row
        rows = matching(self.inspector.messages, self._words)
        # The same message stays chosen while others come and go.
        keys = [each.row.key for each in rows]
        at = keys.index(chosen.row.key) if chosen is not None and chosen.row.key in keys else self.message_list.chosen
        self.message_list.empty_text = "nothing fits: Esc ends the search" if self._words else "nothing is received yet"
        self.message_list.show(rows, at)
        self.dropped_list.show(self.inspector.dropped)
        self._show_chosen()

    def _show_chosen(self) -> None:
        set_title(self.message_list, self._title(f"messages  {len(self.message_list.rows)}"))
        set_title(self.dropped_list, self._title(f"dropped  {len(self.dropped_list.rows)} reasons"))
        chosen = self.message_list.chosen_row
        self.panel.waiting = "FROZEN before it was chosen" if self.is_frozen else "waiting for its newest frame"
        self.panel.show(chosen, self.inspector.frame, self.rates.report, as_bytes=self._as_bytes)

    def _title(self, begin: str) -> str:
        selected = self.feed.selection.ids
        parts = [begin, f"vehicles {ids(selected)}" if selected else "everything received"]
        if self._words or self.is_typing:
            parts.append(f"find: {self._words}{'_ (Enter keeps, Esc ends)' if self.is_typing else ''}")
        if self.inspector.left_out:
            parts.append(f"{self.inspector.left_out} more: select fewer vehicles")
        if self.is_frozen:
            parts.append("FROZEN: z goes on")
        if self.feed.station_lost:
            parts.append("STATION SILENT")
        return "   ".join(parts)

    def on_key(self, event: events.Key) -> None:
        """Take keys as letters of the filter while it is typed."""
        if not self.is_typing:
            return
        event.stop()
        event.prevent_default()
        if event.key in ("enter", "escape"):
            self.is_typing = False
            self._words = "" if event.key == "escape" else self._words
        elif event.key == "backspace":
            self._words = self._words[:-1]
        elif event.character is not None and event.is_printable:
            self._words = (self._words + event.character)[:MAX_FILTER]
        self.show_all()
        self._choose_by_key()

    def on_row_picked(self, message: RowPicked) -> None:
        """Choose the row that was clicked."""
        message.view.show(message.view.rows, message.index)
        self._choose_by_key()

    def _choose_by_key(self) -> None:
        """Show the row that was chosen now, with its fields as soon as they come."""
        self._show_chosen()
        self.look()

    # ---------------------------------------------------------------- keys

    @property
    def _list(self) -> MessageList | DroppedList:
        return self.dropped_list if self.has_class("-dropped") else self.message_list

    def action_filter(self) -> None:
        """Begin to type the filter."""
        self.is_typing = True
        self.show_all()

    def action_cancel(self) -> None:
        """End the filter, and forget the report of the last key."""
        self._words, self.rates.report = "", ()
        self.set_class(False, "-large")
        self.show_all()

    def action_freeze(self) -> None:
        """Stop the picture, or let it go on."""
        self.is_frozen = not self.is_frozen
        if self.is_frozen:
            self._show_chosen()
        else:
            self.look_again()

    def action_next_view(self) -> None:
        """Show the messages, or what was dropped."""
        self.toggle_class("-dropped")
        self.show_all()

    def action_as_bytes(self) -> None:
        """Show the newest frame as bytes, or as fields."""
        self._as_bytes = not self._as_bytes
        self._show_chosen()

    def action_enlarge(self) -> None:
        """Give the whole screen to the fields, or share it with the list again."""
        self.toggle_class("-large")

    def action_scroll(self, lines: int) -> None:
        """Show other fields of the message."""
        self.panel.scroll_by(lines)

    def action_copy(self) -> None:
        """Send what is shown of the message to the terminal's clipboard."""
        text = self.panel.copied()
        if not text:
            self.rates.say("there is nothing to copy yet", Ink.CAUTION)
            return
        self.app.copy_to_clipboard(text)
        self.rates.say(f"{len(text.splitlines())} lines sent to the terminal's clipboard", Ink.NORMAL)

    def action_rate(self) -> None:
        """Ask for the rate of the chosen message."""
        chosen = self.message_list.chosen_row
        why = self.rates.why_not(chosen.row if chosen is not None else None)
        if why or chosen is None:
            self.rates.say(why, Ink.CAUTION)
            return
        self._rate_for = chosen.row
        vehicles = self.rates.vehicles_of(chosen.row)
        self.rate_bar.ask(f"{chosen.row.name} of vehicle {ids(vehicles)}, Hz (0 = off, auto) =")

    @on(PromptBar.Answered, "#rate")
    def _set_rate(self, message: PromptBar.Answered) -> None:
        self.set_focus(None)
        if message.text is not None and message.text.strip() and self._rate_for is not None:
            self.rates.ask(self._rate_for, message.text)

    def action_look(self, by: int) -> None:
        """Look at the next or previous vehicle."""
        frame = self.feed.frame
        self.feed.selection.step(by, frame.ids if frame is not None else ())

    def action_step(self, by: int) -> None:
        """Choose the row above or below."""
        self._list.step(by)
        self._choose_by_key()

    def action_page(self, by: int) -> None:
        """Move by a page."""
        self.action_step(by * self._list.page)

    def action_end(self, direction: int) -> None:
        """Choose the first row (-1) or the last one (1)."""
        self.action_step(direction * len(self._list.rows))
