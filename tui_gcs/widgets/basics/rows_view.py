"""A list of rows with one chosen row that stays in view: the base of the tables of the list screens."""

from collections.abc import Callable, Hashable, Sequence
from typing import Generic, TypeVar

from textual import events
from textual.message import Message

from tui_gcs.widgets.basics.border_titles import show_beyond
from tui_gcs.widgets.basics.copied_rows import Record, record_of
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import wrapped

T = TypeVar("T")


class RowPicked(Message):
    """A row was clicked."""

    def __init__(self, view: "RowsView[T]", index: int) -> None:
        super().__init__()
        self.view, self.index = view, index


class RowsView(LinesView, Generic[T]):
    """Rows below a header; a subclass returns the text of both. How many rows are hidden stands in the border."""

    EMPTY = "nothing to show"
    """The line where there is no row."""

    def __init__(self, **options: object) -> None:
        """Begin without rows."""
        super().__init__(**options)  # type: ignore[arg-type]
        self.rows: Sequence[T] = ()
        self.chosen = 0
        """Index of the chosen row."""
        self.empty_text = self.EMPTY
        self._first = 0

    def header(self, width: int) -> Line | None:
        """Return the line of column titles; None for none."""
        return None

    def row_line(self, row: T, width: int, *, is_chosen: bool) -> Line:
        """Return the text of one row."""
        raise NotImplementedError

    def record(self, row: T) -> Record:
        """Return the values of a row by their titles, for the clipboard."""
        return record_of(row)

    @property
    def chosen_row(self) -> T | None:
        """The chosen row; None without rows."""
        return self.rows[self.chosen] if self.rows else None

    def show(self, rows: Sequence[T], chosen: int | None = None) -> None:
        """Show these rows; `chosen` is the index of the row that stays in view."""
        self.rows = rows
        wanted = self.chosen if chosen is None else chosen
        self.chosen = max(0, min(wanted, len(rows) - 1))
        self.update_lines()

    def show_kept(self, rows: Sequence[T], key: Callable[[T], Hashable]) -> None:
        """Show these rows; the one with the same key as the chosen one before stays chosen."""
        chosen = key(self.chosen_row) if self.chosen_row is not None else None
        self.show(rows, next((at for at, row in enumerate(rows) if key(row) == chosen), self.chosen))

    def step(self, by: int) -> None:
        """Choose the row `by` rows below; it stops at both ends."""
        self.show(self.rows, self.chosen + by)

    @property
    def page(self) -> int:
        """The number of rows that one page moves."""
        return max(1, self.size.height - 2)

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        if not self.rows:
            show_beyond(self, 0, 0)
            return [[(line, Ink.MUTED)] for line in wrapped(self.empty_text, width)]
        header = self.header(width)
        room = max(1, height - (header is not None))
        highest = max(0, len(self.rows) - room)
        self._first = max(0, min(max(self._first, self.chosen - room + 1), self.chosen, highest))
        shown = self.rows[self._first : self._first + room]
        show_beyond(self, self._first, len(self.rows) - self._first - len(shown), "arrows, PgUp, PgDn")
        rows = [self.row_line(row, width, is_chosen=self._first + at == self.chosen) for at, row in enumerate(shown)]
        return [*([header] if header is not None else []), *rows]

    def on_click(self, event: events.Click) -> None:
        """Post `RowPicked` for the clicked row."""
        offset = event.get_content_offset(self)
        if offset is None or not self.rows:
            return
        index = self._first + offset.y - (self.header(self.size.width) is not None)
        if self._first <= index < len(self.rows):
            self.post_message(RowPicked(self, index))
