"""The inspector screen: layout, filter and keys."""

from typing import Any, ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.inspector_actions import INSPECTOR_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.inspection import MessageRow
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.message_inspection import MessageInspector, matching
from tui_gcs.feed.messages import SelectionChanged, StationBack, StationLost
from tui_gcs.screens.common.polled_screen import PolledScreen
from tui_gcs.screens.common.row_copies import copy_text
from tui_gcs.screens.common.typed_words import TypedWords
from tui_gcs.screens.inspect.message_rates import MessageRates
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.forms.prompt_bar import PromptBar
from tui_gcs.widgets.inspect.dropped_list import DroppedList
from tui_gcs.widgets.inspect.message_list import MessageList
from tui_gcs.widgets.inspect.message_panel import MessagePanel


class InspectorScreen(PolledScreen):
    """The messages of the selected vehicles, or of all that is received while none is selected."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = INSPECTOR_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(INSPECTOR_ACTIONS, "inspector")
    LOOK_S = 0.5
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
        super().__init__(feed)
        self.typed = TypedWords()
        self._glyphs = glyphs
        self._as_bytes = False
        self._rate_for: MessageRow | None = None
        """The message whose rate is being typed: another one may be chosen by the time it is."""
        self.inspector = MessageInspector(feed.requests, self.show_all)
        self.rates = MessageRates(self, feed, clock, glyphs, self._show_fields)
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

    @on(events.ScreenResume)
    @on(SelectionChanged)
    @on(StationBack)
    def look_again(self) -> None:
        """Look at once; rates are measured anew, because nothing was asked meanwhile."""
        self.inspector.pause()
        self.look()

    async def ask_station(self) -> None:
        """Ask for the messages, and for the fields of the chosen one."""
        chosen = self.message_list.chosen_row
        dropped = self.feed.status.dropped if self.feed.status is not None else {}
        await self.inspector.look(self.feed.selection.ids, chosen.row.key if chosen is not None else None, dropped)

    @on(events.Resize)
    @on(StationLost)
    def show_all(self) -> None:
        """Show the messages that fit the filter."""
        if not self.is_current:
            return
        words = self.typed.words
        self.message_list.empty_text = "nothing fits: Esc ends the search" if words else "nothing is received yet"
        self.message_list.show_kept(matching(self.inspector.messages, words), lambda each: each.row.key)
        self.dropped_list.show(self.inspector.dropped)
        self._show_fields()

    def _show_fields(self) -> None:
        set_title(self.message_list, self._title(f"messages  {len(self.message_list.rows)}"))
        set_title(self.dropped_list, self._title(f"dropped  {len(self.dropped_list.rows)} reasons"))
        chosen = self.message_list.chosen_row
        self.panel.waiting = "FROZEN before it was chosen" if self.is_frozen else "waiting for its newest frame"
        self.panel.show(chosen, self.inspector.frame, self.rates.report, as_bytes=self._as_bytes)

    def _title(self, begin: str) -> str:
        selected = self.feed.selection.ids
        parts = [begin, vehicles_words(selected) if selected else "everything received"]
        if search := self.typed.title("find"):
            parts.append(search)
        if self.inspector.left_out:
            parts.append(f"{self.inspector.left_out} more: select fewer vehicles")
        if self.is_frozen:
            parts.append("FROZEN: z goes on")
        if self.feed.station_lost:
            parts.append("STATION SILENT")
        return "   ".join(parts)

    def on_key(self, event: events.Key) -> None:
        """Take keys as letters of the filter while it is typed."""
        if self.typed.take(event):
            self.show_all()
            self.show_chosen()

    def say_copied(self, text: str, ink: Ink) -> None:
        """See `ListScreen`."""
        self.rates.say_copied(text, ink)

    # ---------------------------------------------------------------- keys

    def show_chosen(self) -> None:
        """Show the row that was chosen now, with its fields as soon as they come."""
        self._show_fields()
        self.look()

    @property
    def row_list(self) -> RowsView[Any]:
        """The messages, or what was dropped."""
        return self.dropped_list if self.has_class("-dropped") else self.message_list

    def action_filter(self) -> None:
        """Begin to type the filter."""
        self.typed.is_typing = True
        self.show_all()

    def action_cancel(self) -> None:
        """End the filter, and forget the report of the last key."""
        self.typed.words, self.rates.report = "", ()
        self.set_class(False, "-large")
        self.show_all()

    def action_freeze(self) -> None:
        """Stop the picture, or let it go on."""
        self.is_frozen = not self.is_frozen
        if self.is_frozen:
            self._show_fields()
        else:
            self.look_again()

    def action_next_view(self) -> None:
        """Show the messages, or what was dropped."""
        self.toggle_class("-dropped")
        self.show_all()

    def action_as_bytes(self) -> None:
        """Show the newest frame as bytes, or as fields."""
        self._as_bytes = not self._as_bytes
        self._show_fields()

    def action_enlarge(self) -> None:
        """Give the whole screen to the fields, or share it with the list again."""
        self.toggle_class("-large")

    def action_scroll(self, lines: int) -> None:
        """Show other fields of the message."""
        self.panel.scroll_by(lines)

    def action_copy_row(self) -> None:
        """Copy what is shown of the message; of what was dropped, the chosen row."""
        text = self.panel.copied()
        if self.has_class("-dropped"):
            super().action_copy_row()
        elif text:
            self.say_copied(*copy_text(self.app, f"{len(text.splitlines())} lines", text))
        else:
            self.say_copied("there is nothing to copy yet", Ink.CAUTION)

    def action_rate(self) -> None:
        """Ask for the rate of the chosen message."""
        chosen = self.message_list.chosen_row
        why = self.rates.why_not(chosen.row if chosen is not None else None)
        if why or chosen is None:
            self.rates.say(why, Ink.CAUTION)
            return
        self._rate_for = chosen.row
        vehicles = self.rates.vehicles_of(chosen.row)
        self.rate_bar.ask(f"{chosen.row.name} of {vehicles_words(vehicles)}, Hz (0 = off, auto) =")

    @on(PromptBar.Answered, "#rate")
    def _set_rate(self, message: PromptBar.Answered) -> None:
        self.set_focus(None)
        if message.text is not None and message.text.strip() and self._rate_for is not None:
            self.rates.ask(self._rate_for, message.text)
