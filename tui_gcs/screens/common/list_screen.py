"""The base of screens with lists of rows: choosing a row and looking at another vehicle by keys and clicks."""

from typing import Any

from textual.screen import Screen

from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.row_copies import copy_rows
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowPicked, RowsView


class ListScreen(Screen[None]):
    """A screen with one list, or several of which one is shown; its keys are those of `actions/list_actions.py`."""

    DIGITS_SELECT = True
    """A digit begins the number of a vehicle to select, see `ConsoleApp`."""
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-wide")]
    # None would let Textual put the cursor into a hidden prompt, which then takes every key.
    AUTO_FOCUS = ""

    def __init__(self, feed: Feed) -> None:
        super().__init__()
        self.feed = feed

    @property
    def row_list(self) -> RowsView[Any]:
        """The list that keys are for."""
        raise NotImplementedError

    def show_chosen(self) -> None:
        """Show what belongs to the chosen row; called whenever another one was chosen."""
        raise NotImplementedError

    def say_copied(self, text: str, ink: Ink) -> None:
        """Report what was copied, below the report of the key before: `y` is also the answer to a question."""
        raise NotImplementedError

    def on_row_picked(self, message: RowPicked) -> None:
        """Choose the row that was clicked."""
        message.view.show(message.view.rows, message.index)
        self.show_chosen()

    def action_look(self, by: int) -> None:
        """Look at the next or previous vehicle."""
        frame = self.feed.frame
        self.feed.selection.step(by, frame.ids if frame is not None else ())

    def action_step(self, by: int) -> None:
        """Choose the row above or below."""
        self.row_list.step(by)
        self.show_chosen()

    def action_page(self, by: int) -> None:
        """Move by a page."""
        self.action_step(by * self.row_list.page)

    def action_end(self, direction: int) -> None:
        """Choose the first row (-1) or the last one (1)."""
        self.action_step(direction * len(self.row_list.rows))

    def action_copy_row(self) -> None:
        """Copy the chosen row to the terminal's clipboard."""
        rows = self.row_list
        self.say_copied(*copy_rows(self.app, [rows.record(rows.chosen_row)] if rows.rows else []))

    def action_copy_rows(self) -> None:
        """Copy all rows of the list to the terminal's clipboard."""
        rows = self.row_list
        self.say_copied(*copy_rows(self.app, [rows.record(row) for row in rows.rows]))
