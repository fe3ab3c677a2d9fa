"""The parameters screen: layout, search and keys."""

import math
from pathlib import Path
from typing import ClassVar

from textual import events, on
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal
from textual.worker import WorkType

from tui_gcs.actions import APP_ACTIONS, ConsoleAction, bindings
from tui_gcs.actions.parameter_actions import PARAMETER_ACTIONS
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.float32 import shown
from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.feed.favourites import Favourites
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.fleet_parameters import FleetParameter, ParameterFilter, group_of
from tui_gcs.feed.messages import FleetUpdated, SelectionChanged, StationBack, StationLost
from tui_gcs.feed.parameter_transfers import ParameterTransfers
from tui_gcs.screens.common.draft_screen import typed_path
from tui_gcs.screens.common.list_screen import ListScreen
from tui_gcs.screens.common.typed_words import TypedWords
from tui_gcs.screens.parameters.parameter_edits import NONE_SELECTED, ParameterEdits
from tui_gcs.widgets.basics.border_titles import set_title
from tui_gcs.widgets.basics.footer import FooterLine
from tui_gcs.widgets.basics.glyphs import UNICODE, GlyphSet
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run
from tui_gcs.widgets.basics.top_lines import TopLines
from tui_gcs.widgets.forms.prompt_bar import PromptBar
from tui_gcs.widgets.parameters.parameter_detail import ParameterDetail
from tui_gcs.widgets.parameters.parameter_list import ParameterList

PROGRESS_PERIOD_S = 0.5
"""While parameters arrive the table is compared anew at most this often: for 50 vehicles it takes 80 ms."""
MAX_NAMED_CELLS = 24
"""Vehicles whose numbers take more cells in the title are counted."""
VIEWS = ("all", "differing", "changed from default", "a favourite")
VIEW_KEYS = ("all", "differing", "changed", "favourites")
"""What Tab is called in the footer when it leads to one of them."""


class ParametersScreen(ListScreen):
    """The parameters of the compared vehicles: those selected, or all while none is."""

    ACTIONS: ClassVar[tuple[ConsoleAction, ...]] = PARAMETER_ACTIONS
    BINDINGS: ClassVar[list[BindingType]] = bindings(PARAMETER_ACTIONS, "parameters")
    CSS = """
    ParametersScreen { layout: vertical; }
    ParametersScreen #middle { height: 1fr; }
    ParametersScreen ParameterDetail { width: 44; }
    ParametersScreen.-narrow #middle { layout: vertical; }
    ParametersScreen.-narrow ParameterDetail { width: 1fr; height: 8; }
    """

    def __init__(self, feed: Feed, clock: Clock, *, folder: Path | None = None, glyphs: GlyphSet = UNICODE) -> None:
        """Show parameters known to the station of `feed`; favourites are kept in `folder`."""
        super().__init__(feed)
        self.typed = TypedWords()
        self._glyphs = glyphs
        self._clock = clock
        self._view = 0
        self._shown_s = -math.inf
        self._described: tuple[str, int] | None = None
        """The parameter and vehicle whose description was asked for last."""
        self.favourites = Favourites(folder / "favourite-parameters.json" if folder is not None else None)
        self.transfers = ParameterTransfers(feed.requests, clock, self._on_news)
        self.edits = ParameterEdits(self, feed, clock, self.transfers, glyphs, self.show_all)
        self.top_lines = TopLines(feed, glyphs=glyphs)
        self.parameter_list = ParameterList(glyphs=glyphs)
        self.detail = ParameterDetail(glyphs=glyphs)
        self.footer = FooterLine((*APP_ACTIONS, *self.ACTIONS), glyphs=glyphs, feed=feed, here="show_parameters")
        self.value_bar = PromptBar("value")
        self.path_bar = PromptBar("path")
        self._path_for = self.edits.load

    def compose(self) -> ComposeResult:
        """Compose the top lines, the list, the details, the questions and the footer."""
        yield self.top_lines
        with Horizontal(id="middle"):
            yield self.parameter_list
            yield self.detail
        yield self.value_bar
        yield self.path_bar
        yield self.footer

    def on_mount(self) -> None:
        """Begin to receive the feed's messages."""
        self.feed.listen(self)

    @on(SelectionChanged)
    def forget_refusal(self) -> None:
        """Drop what was said about vehicles that were not selected."""
        if self.edits.report and self.edits.report[0][0] == NONE_SELECTED:
            self.edits.report = ()

    @on(events.ScreenResume)
    @on(SelectionChanged)
    @on(StationBack)
    def look_again(self) -> None:
        """Ask the station for what it knows of the compared vehicles, and show it."""
        if self.is_current:
            # As a function, not a coroutine: a newer look cancels this one before it has begun.
            look: WorkType[None] = self._look
            self.run_worker(look, group="look", exclusive=True, exit_on_error=False)
            self.show_all()

    async def _look(self) -> None:
        self._described = None  # a vehicle may have been fetched meanwhile, with its descriptions
        await self.transfers.look(self.compared())

    @on(events.Resize)
    @on(StationLost)
    def show_all(self) -> None:
        """Show the parameters that fit the search."""
        if not self.is_current:
            return
        self._shown_s = self._clock.now()
        chosen = self.parameter_list.chosen_row
        rows = self._matching()
        # The same parameter stays chosen while the search changes around it; where it is gone, for instance because it
        # does not differ any more, the next one is.
        names = [row.name for row in rows]
        at = names.index(chosen.name) if chosen is not None and chosen.name in names else self.parameter_list.chosen
        self.parameter_list.empty_text = self._empty_text()
        self.parameter_list.show_parameters(rows, at, self._lead(), self.favourites.names)
        self.footer.relabel({"next_view": VIEW_KEYS[(self._view + 1) % len(VIEWS)]})
        self.show_chosen()

    @property
    def row_list(self) -> ParameterList:
        """The parameters that fit the search."""
        return self.parameter_list

    def show_chosen(self) -> None:
        """Show title and description of the chosen parameter."""
        set_title(self.parameter_list, self._title(len(self.parameter_list.rows)))
        row, lead = self.parameter_list.chosen_row, self._lead()
        self.detail.show(row, self.transfers.description, self._outcome())
        if row is not None and lead is not None and (row.name, lead) != self._described:
            self._described = (row.name, lead)
            describe: WorkType[None] = self._describe
            self.run_worker(describe, group="describe", exclusive=True, exit_on_error=False)

    async def _describe(self) -> None:
        if self._described is not None:
            name, vehicle = self._described
            await self.transfers.describe(vehicle, name)

    def compared(self) -> tuple[int, ...]:
        """Return the vehicles that are compared: those selected, all while none is."""
        return self.feed.shown_vehicles()

    def _lead(self) -> int | None:
        compared = self.compared()
        return self.feed.selection.lead or (compared[0] if compared else None)

    def _matching(self) -> list[FleetParameter]:
        view = VIEWS[self._view]
        wanted = ParameterFilter(
            self.typed.words,
            only_differing=view == "differing",
            only_changed=view == "changed from default",
            favourites=frozenset(self.favourites.names) if view == "a favourite" else None,
        )
        return wanted.matching(self.transfers.parameters.table(self.compared()))

    def _title(self, count: int) -> str:
        compared = self.compared()
        all_ = len(self.transfers.parameters.table(compared))
        parts = [f"parameters  {count} of {all_}"]
        if search := self.typed.title("find"):
            parts.append(search)  # before what may be cut off on a narrow terminal
        named = vehicles_words(compared) if compared else "no vehicle"
        parts += [named if len(named) <= MAX_NAMED_CELLS else f"{len(compared)} vehicles", VIEWS[self._view]]
        unknown = [vehicle for vehicle in compared if not self.transfers.parameters.is_complete(vehicle)]
        if unknown and not self.transfers.progress:
            parts.append("R reads the rest")
        if self.feed.station_lost:
            parts.append("STATION SILENT")
        return "   ".join(parts)

    def _empty_text(self) -> str:
        known = [vehicle for vehicle in self.compared() if self.transfers.parameters.of(vehicle)]
        if not known:
            return "no parameter is known: R reads them from the vehicles, some seconds each"
        if self._view and self.typed.words:
            return f"none that is {VIEWS[self._view]} fits: Esc ends the search, Tab the view"
        if self._view:
            mark = "; * marks one" if VIEWS[self._view] == "a favourite" else ""
            return f"no parameter is {VIEWS[self._view]}{mark}: Tab shows others"
        return "nothing fits: Esc ends the search"

    def _outcome(self) -> list[Run]:
        lines = [
            (f"vehicle {task.vehicle}: {task.what} {100 * task.done // task.total if task.total else 0} %", Ink.MUTED)
            for task in self.transfers.progress.values()
        ]
        return [*lines[:6], *self.edits.report]

    def _on_news(self) -> None:
        # Arriving values need no picture each: the end of a transfer always has one.
        if not self.transfers.progress or self._clock.now() - self._shown_s >= PROGRESS_PERIOD_S:
            self.show_all()

    def on_fleet_updated(self, _message: FleetUpdated) -> None:
        """Show a fleet that was not heard before."""
        if self.is_current and not self.parameter_list.rows and self.compared():
            self.show_all()

    def on_key(self, event: events.Key) -> None:
        """Take keys as letters of the search while it is typed."""
        if self.typed.take(event):
            self.show_all()
            if not self.typed.is_typing or event.key != "escape":
                self.parameter_list.show(self.parameter_list.rows, 0)
                self.show_chosen()

    def say_copied(self, text: str, ink: Ink) -> None:
        """See `ListScreen`."""
        self.edits.say_copied(text, ink)

    # ---------------------------------------------------------------- keys

    def action_filter(self) -> None:
        """Begin to type the search."""
        self.typed.is_typing = True
        self.show_all()

    def action_cancel(self) -> None:
        """End the search, and forget the report of the last key."""
        self.typed.words, self.edits.report = "", ()
        self.show_all()

    def action_next_view(self) -> None:
        """Show all, those that differ, those changed from their default, the favourites."""
        self._view = (self._view + 1) % len(VIEWS)
        self.show_all()

    def action_favourite(self) -> None:
        """Mark the chosen parameter as a favourite, or not."""
        row = self.parameter_list.chosen_row
        if row is not None:
            self.edits.say(self.favourites.toggle(row.name))

    def action_next_group(self) -> None:
        """Choose the first parameter of the next group of names."""
        self._to_group(1)

    def action_previous_group(self) -> None:
        """Choose the first parameter of the group before."""
        self._to_group(-1)

    def _to_group(self, by: int) -> None:
        rows, at = self.parameter_list.rows, self.parameter_list.chosen
        if not rows:
            return
        here = group_of(rows[at].name)
        while 0 <= at + by < len(rows) and group_of(rows[at].name) == here:
            at += by
        here = group_of(rows[at].name)
        while at > 0 and group_of(rows[at - 1].name) == here:
            at -= 1
        self.action_step(at - self.parameter_list.chosen)

    def action_edit(self) -> None:
        """Ask for a value of the chosen parameter."""
        row = self.parameter_list.chosen_row
        if row is None or not self._may_change():
            return
        lead = self._lead()
        held = row.value_of(lead) if lead is not None else None
        unit = f" ({row.row.units})" if row.row.units else ""
        self.value_bar.ask(f"{row.name}{unit} =", shown(held if held is not None else row.groups[0].value))

    @on(PromptBar.Answered, "#value")
    def _set_value(self, message: PromptBar.Answered) -> None:
        row = self.parameter_list.chosen_row
        self.set_focus(None)
        if message.text is not None and row is not None:
            self.edits.set(row, message.text)

    def action_copy(self) -> None:
        """Copy the chosen parameter from the vehicle looked at to the other selected ones."""
        row = self.parameter_list.chosen_row
        if row is not None and self._may_change():
            self.edits.copy([row])

    def action_copy_all(self) -> None:
        """Copy all listed parameters from the vehicle looked at to the other selected ones."""
        if self._may_change():
            self.edits.copy(self.parameter_list.rows)

    def action_undo(self) -> None:
        """Take the last change back."""
        if not self.feed.requests.read_only:
            self.edits.undo()

    def action_fetch(self) -> None:
        """Read all parameters of the compared vehicles from them."""
        self.edits.fetch(self.compared())

    def action_load(self) -> None:
        """Ask for the parameter file to compare with."""
        if self._may_change():
            self._path_for = self.edits.load
            self.path_bar.ask("load parameters from")

    def action_write(self) -> None:
        """Ask for the file to write."""
        self._path_for = self.edits.write
        self.path_bar.ask("save parameters to", f"vehicle-{self._lead() or 0}.params")

    @on(PromptBar.Answered, "#path")
    def _take_path(self, message: PromptBar.Answered) -> None:
        self.set_focus(None)
        path = typed_path(message.text) if message.text is not None else None
        if path is not None:
            self._path_for(path)

    def _may_change(self) -> bool:
        why = self.edits.why_not()
        if why:
            self.edits.say(why, Ink.CAUTION)
        return not why
