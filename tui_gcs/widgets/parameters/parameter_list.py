"""The list of parameters: name, value of the vehicle that is looked at, and which vehicles differ from it."""

from collections.abc import Collection, Sequence

from tui_gcs.core.base.float32 import shown
from tui_gcs.core.protocol.alarms import id_ranges
from tui_gcs.feed.fleet_parameters import FleetParameter
from tui_gcs.widgets.basics.border_titles import framed
from tui_gcs.widgets.basics.copied_rows import Record
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.rows_view import RowsView
from tui_gcs.widgets.basics.strips import cut

NAME_CELLS, VALUE_CELLS, UNIT_CELLS, OTHERS_CELLS = 16, 11, 6, 22
WIDE_CELLS = 72
"""From this width on the unit and the meaning have room."""


class ParameterList(RowsView[FleetParameter]):
    """A line for each parameter of the compared vehicles."""

    DEFAULT_CSS = framed("ParameterList", "width: 1fr; height: 1fr;")

    _lead: int | None = None
    _favourites: Collection[str] = ()

    def show_parameters(
        self, rows: Sequence[FleetParameter], chosen: int, lead: int | None, favourites: Collection[str]
    ) -> None:
        """Show these parameters with the values of `lead`, the vehicle that is looked at."""
        self._lead, self._favourites = lead, favourites
        self.show(rows, chosen)

    def header(self, width: int) -> Line:
        """Return the titles; the value's column names the vehicle."""
        value = f"VEHICLE {self._lead}" if self._lead is not None else "VALUE"
        title = f"  {'NAME':<{NAME_CELLS}} {value:>{VALUE_CELLS}} "
        unit = f"{'UNIT':<{UNIT_CELLS}} " if width >= WIDE_CELLS else ""
        return [(f"{title}{unit}OTHERS", Ink.MUTED)]

    def row_line(self, row: FleetParameter, width: int, *, is_chosen: bool) -> Line:
        """Return a parameter as a line; what differs between vehicles has a mark and words, not only a colour."""
        value = row.value_of(self._lead) if self._lead is not None else None
        mark = "*" if row.name in self._favourites else " "
        ink = Ink.CAUTION if row.differs else Ink.BOLD if row.is_changed else Ink.TEXT
        number = shown(value) if value is not None else "--"
        text = f"{mark}{'!' if row.differs else ' '}{cut(row.name, NAME_CELLS)} {number:>{VALUE_CELLS}} "
        if width >= WIDE_CELLS:
            text += f"{cut(row.row.units, UNIT_CELLS)} "
        others = others_words(row, self._lead)
        rest = f"{cut(others, OTHERS_CELLS)} {row.row.text}" if width >= WIDE_CELLS else others
        if is_chosen:
            return [(cut(text + rest, width), Ink.SELECTED_CAUTION if row.differs else Ink.SELECTED)]
        return [(text, ink), (rest, ink if row.differs else Ink.MUTED)]

    def record(self, row: FleetParameter) -> Record:
        """Return name, unit, default and meaning, and the value of each compared vehicle."""
        values = {vehicle: shown(group.value) for group in row.groups for vehicle in group.vehicles}
        default = shown(row.row.default) if row.row.default is not None else ""
        own: dict[str, object] = {"name": row.name, "units": row.row.units, "default": default, "meaning": row.row.text}
        vehicles = sorted({*values, *row.lacking})
        return own | {f"vehicle_{vehicle}": values.get(vehicle, "") for vehicle in vehicles}


def others_words(row: FleetParameter, lead: int | None) -> str:
    """Return which vehicles hold another value than `lead`, or that it is not the default; "" if nothing is odd."""
    value = row.value_of(lead) if lead is not None else None
    if row.differs or (lead is not None and value is None):
        other = [group for group in row.groups if lead not in group.vehicles]
        if len(other) == 1:
            return f"{id_ranges(other[0].vehicles)}: {shown(other[0].value)}"
        return f"{len(row.groups)} different values"
    if row.is_changed and row.row.default is not None:
        return f"default {shown(row.row.default)}"
    return ""
