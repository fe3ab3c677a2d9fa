"""The lists of the setup screen: sections with their states, and the lines of one section."""

from tui_gcs.core.protocol.alarms import id_ranges
from tui_gcs.feed.setup_watch import ATTENTION, DONE, UNKNOWN, FleetSetupField, SectionSummary
from tui_gcs.widgets.basics.border_titles import framed
from tui_gcs.widgets.basics.copied_rows import Record
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import cut

MARKS = {ATTENTION: "!", UNKNOWN: "?", DONE: " "}
INKS = {ATTENTION: Ink.CAUTION, UNKNOWN: Ink.MUTED, DONE: Ink.TEXT}
SECTION_CELLS, LABEL_CELLS, PARAM_CELLS = 9, 24, 16
MAX_LABEL_CELLS = 28
"""No label takes more than this beside its value on a narrow terminal; the panel shows it whole."""
WIDE_CELLS = 76
"""From this width on the parameter's name has room beside its value."""
STATE_CELLS = 20
"""From this width on a section's state has room as a word behind its mark."""


class SectionList(RowsView[SectionSummary]):
    """A line for each section: its worst state, and which vehicles are in it."""

    DEFAULT_CSS = framed("SectionList", "width: 30; height: 1fr;")

    is_active = True
    """Whether keys are for this list."""

    def row_line(self, row: SectionSummary, width: int, *, is_chosen: bool) -> Line:
        """Return a section as a line; a state has a mark, and where there is room a word, not only a colour."""
        vehicles = row.vehicles_in(row.state)
        all_ = sum(len(each) for _, _, each in row.texts)
        where = f": {id_ranges(vehicles)}" if len(vehicles) < all_ else ""
        state = "attention" if row.state == ATTENTION else row.state
        behind = f"{state}{where}" if width >= STATE_CELLS else where.removeprefix(": ")
        text = f"{MARKS[row.state]} {row.section:<{SECTION_CELLS}} {behind}"
        return [(cut(text, width), _ink(row.state, is_chosen=is_chosen, is_active=self.is_active))]

    def record(self, row: SectionSummary) -> Record:
        """Return the section, its worst state, and what is so or missing on which vehicles."""
        found = "; ".join(f"{state}: {text} [{id_ranges(vehicles)}]" for state, text, vehicles in row.texts)
        return {"section": row.section, "state": row.state, "found": found}


class FieldList(RowsView[FleetSetupField]):
    """A line for each value, sensor, failsafe or motor of a section."""

    DEFAULT_CSS = framed("FieldList", "width: 1fr; height: 1fr;")

    is_active = False
    """Whether keys are for this list."""
    vehicles: tuple[int, ...] = ()
    """The vehicles that the screen is about: a line that only some of them have names those."""

    def row_line(self, row: FleetSetupField, width: int, *, is_chosen: bool) -> Line:
        """Return a line; where vehicles differ, each value names its vehicles."""
        state = ATTENTION if row.attention else DONE
        label = _label(row)
        if width < WIDE_CELLS:
            # Columns as narrow as their labels leave the values, which are the news, more room.
            what = cut(label, min(MAX_LABEL_CELLS, max(map(len, map(_label, self.rows)))))
        elif row.row.words:  # which names the parameter, where there is one
            what = cut(label, LABEL_CELLS + 1 + PARAM_CELLS)
        else:
            what = f"{cut(label, LABEL_CELLS)} {cut(group_or_parameter(row), PARAM_CELLS)}"
        whose = f"[{id_ranges(row.vehicles)}] " if len(row.values) == 1 and self._is_of_some(row) else ""
        text = f"{MARKS[state]} {what} {whose}{field_words(row)}"
        return [(cut(text, width), _ink(state, is_chosen=is_chosen, is_active=self.is_active))]

    def record(self, row: FleetSetupField) -> Record:
        """Return the line, its parameter, whether it needs attention, and what it is on each vehicle."""
        words = {vehicle: value for value, vehicles in row.values for vehicle in vehicles}
        own: dict[str, object] = {"line": row.row.label, "parameter": row.row.param, "attention": row.attention}
        return own | {f"vehicle_{vehicle}": words[vehicle] for vehicle in sorted(words)}

    def _is_of_some(self, row: FleetSetupField) -> bool:
        return bool(set(self.vehicles).difference(row.vehicles))


def _label(row: FleetSetupField) -> str:
    return row.row.param if row.row.act == "gain" else row.row.label


def group_or_parameter(row: FleetSetupField) -> str:
    """Return the loop of a gain, and the parameter of any other line."""
    return row.row.label if row.row.act == "gain" else row.row.param


def field_words(row: FleetSetupField) -> str:
    """Return the value that all have, or each value with its vehicles."""
    if len(row.values) == 1:
        return row.values[0][0]
    return "; ".join(f"{words} [{id_ranges(vehicles)}]" for words, vehicles in row.values)


def _ink(state: str, *, is_chosen: bool, is_active: bool) -> Ink:
    if not is_chosen:
        return INKS[state]
    if not is_active:
        return Ink.BOLD
    return Ink.SELECTED_CAUTION if state == ATTENTION else Ink.SELECTED
