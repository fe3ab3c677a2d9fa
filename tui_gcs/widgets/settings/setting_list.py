"""The list of settings, and the panel of the chosen one."""

from collections.abc import Sequence
from typing import NamedTuple

from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import Run, cut, wrapped

KEY_CELLS, ORIGIN_CELLS, COUNTS_CELLS = 13, 12, 13
SPARE_CELLS = 4
"""The blanks between the columns, and the mark."""


class SettingRow(NamedTuple):
    """One setting as the screen shows it."""

    setting: str
    value: str
    """What this console runs with; "" for nothing."""
    origin: str
    """default, file, environment or option."""
    in_file: str
    """What stands in the file; "" where it is not there."""
    counts: str
    """When a change of the file counts."""
    meaning: str
    allowed: str
    """What can be chosen or typed."""
    source: str
    """The file, variable or option that the value comes from, whole."""
    waits: str
    """What the file says that does not count yet, and why; "" if the value in use is that of the file."""


class SettingList(RowsView[SettingRow]):
    """A line for each setting; one whose change does not count yet has a mark."""

    DEFAULT_CSS = framed("SettingList", "width: 1fr; height: 1fr;")

    def header(self, width: int) -> Line:
        """Return the column titles."""
        cells = self._value_cells(width)
        titles = f"  {'SETTING':<{KEY_CELLS}} {'VALUE':<{cells}} {'FROM':<{ORIGIN_CELLS}} CHANGE COUNTS"
        return [(titles, Ink.MUTED)]

    def row_line(self, row: SettingRow, width: int, *, is_chosen: bool) -> Line:
        """Return one setting as a line."""
        mark = "*" if row.waits else " "
        value = cut(row.value or "-", self._value_cells(width))
        text = f" {mark}{cut(row.setting, KEY_CELLS)} {value} {row.origin:<{ORIGIN_CELLS}} {row.counts}"
        if is_chosen:
            return [(cut(text, width), Ink.SELECTED)]
        ink = Ink.CAUTION if row.waits else Ink.MUTED if row.origin == "default" else Ink.TEXT
        return [(text, ink)]

    @staticmethod
    def _value_cells(width: int) -> int:
        return max(8, width - KEY_CELLS - ORIGIN_CELLS - COUNTS_CELLS - SPARE_CELLS - 1)


class SettingPanel(LinesView):
    """All about the chosen setting, and what became of the last key."""

    DEFAULT_CSS = framed("SettingPanel", "height: 8;")

    _row: SettingRow | None = None
    _report: Sequence[Run] = ()

    def show(self, row: SettingRow | None, report: Sequence[Run]) -> None:
        """Show this setting, and the lines of the last key."""
        self._row, self._report = row, report
        set_title(self, row.setting if row is not None else "nothing")
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        report: list[Line] = [[(part, ink)] for text, ink in self._report for part in wrapped(text, width)]
        runs = _texts(self._row) if self._row is not None else []
        body: list[Line] = [[(part, ink)] for text, ink in runs for part in wrapped(text, width)]
        return [*body[: max(0, height - len(report))], *report]


def _texts(row: SettingRow) -> list[Run]:
    texts: list[Run] = [(row.meaning, Ink.BOLD)]
    texts.append((f"in use: {row.value or 'nothing'}   from {row.source}", Ink.TEXT))
    if row.waits:
        texts.append((row.waits, Ink.CAUTION))
    return [*texts, (f"{row.allowed}; a change of the file counts: {row.counts}", Ink.MUTED)]
