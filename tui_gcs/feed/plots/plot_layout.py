"""What a plots screen shows: panes, the values in each, the length of the window; and views saved under a name.

Views are one small JSON file beside the operator's other files. A damaged one counts as empty.
"""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.feed.plots.plotted_values import MAX_NAME, PlotValue, ValueKind

MAX_PANES = 6
MAX_CURVES = 8
"""Values of one pane: as many as have a look of their own."""
MAX_VIEWS, MAX_BYTES = 100, 500_000
MAX_VIEW_NAME = 40
WINDOWS_S = (30.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0, 7200.0)
DEFAULT_WINDOW = 1
WHOLE_FLIGHT = len(WINDOWS_S)
"""Index of the window that holds all."""


@dataclass
class PanePlan:
    """The values of one pane; they have one unit."""

    values: list[PlotValue] = field(default_factory=list)

    @property
    def unit(self) -> str:
        """The unit of its scale; "" without values."""
        return self.values[0].unit if self.values else ""

    @property
    def title(self) -> str:
        """What all its values have in common, or their names."""
        names = dict.fromkeys(value.name for value in self.values)
        subjects = dict.fromkeys(value.who for value in self.values)
        text = ", ".join(names)
        return f"{next(iter(subjects))}  {text}" if len(subjects) == 1 else text

    def label(self, value: PlotValue) -> str:
        """What distinguishes a value in this pane: its vehicle, its name, or both."""
        if len({each.name for each in self.values}) == 1:
            return value.who
        if len({each.subject for each in self.values}) == 1:
            return value.name
        return value.label


@dataclass
class PlotLayout:
    """Panes from the top, and the chosen one."""

    panes: list[PanePlan] = field(default_factory=lambda: [PanePlan()])
    chosen: int = 0
    window: int = DEFAULT_WINDOW
    """Index into `WINDOWS_S`, or `WHOLE_FLIGHT`."""

    @property
    def pane(self) -> PanePlan:
        """The chosen pane."""
        return self.panes[self.chosen]

    @property
    def values(self) -> list[PlotValue]:
        """All values, each once."""
        return list(dict.fromkeys(value for pane in self.panes for value in pane.values))

    @property
    def window_words(self) -> str:
        """The length of the window."""
        if self.window == WHOLE_FLIGHT:
            return "whole flight"
        seconds = WINDOWS_S[self.window]
        return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"

    def toggle(self, values: tuple[PlotValue, ...]) -> str:
        """Add values to the chosen pane, or remove them if it has all of them; return a line about it.

        A pane has one unit: values with another one go into the first pane that has it, or into a new one.
        """
        if not values:
            return "there is no vehicle yet"
        holder = next((pane for pane in self.panes if set(values) <= set(pane.values)), None)
        if holder is not None:
            holder.values = [value for value in holder.values if value not in values]
            return f"{values[0].name} is not shown any more"
        pane = self._pane_for(values[0].unit)
        if pane is None:
            return (
                f"{MAX_PANES} panes are shown already, none of them in {values[0].unit or 'this unit'}: Del removes one"
            )
        new = [value for value in values if value not in pane.values]
        room = MAX_CURVES - len(pane.values)
        pane.values += new[:room]
        self.chosen = self.panes.index(pane)
        left_out = len(new) - len(new[:room])
        more = f"; {left_out} more do not fit: select fewer vehicles, or + makes a pane" if left_out else ""
        return f"{values[0].name} of {len(new[:room])} is shown{more}"

    def _pane_for(self, unit: str) -> PanePlan | None:
        if not self.pane.values or self.pane.unit == unit:
            return self.pane
        found = next((pane for pane in self.panes if pane.values and pane.unit == unit), None)
        if found is None and self.add_pane():
            return self.pane
        return found

    def add_pane(self) -> bool:
        """Add an empty pane below the chosen one and choose it; False if there is no room."""
        if len(self.panes) >= MAX_PANES:
            return False
        self.chosen += 1
        self.panes.insert(self.chosen, PanePlan())
        return True

    def remove_pane(self) -> None:
        """Remove the chosen pane; the last one is emptied."""
        del self.panes[self.chosen]
        self.panes = self.panes or [PanePlan()]
        self.chosen = min(self.chosen, len(self.panes) - 1)

    def choose(self, by: int) -> None:
        """Choose another pane; it stops at both ends."""
        self.chosen = max(0, min(self.chosen + by, len(self.panes) - 1))

    def change_window(self, by: int) -> None:
        """Make the window longer (1) or shorter (-1)."""
        self.window = max(0, min(self.window + by, WHOLE_FLIGHT))


class _SavedValue(msgspec.Struct, array_like=True):
    """A value in a file."""

    kind: ValueKind
    subject: int | str
    name: str
    unit: str


class _SavedView(msgspec.Struct):
    """A layout in a file."""

    panes: list[list[_SavedValue]]
    window: int


class PlotViews:
    """Layouts by name on disk, or in memory only without a path."""

    def __init__(self, path: Path | None) -> None:
        """Read the views kept at `path`."""
        self._path = path
        self._views: dict[str, _SavedView] = _read(path) if path is not None else {}

    @property
    def names(self) -> list[str]:
        """The names of all views."""
        return sorted(self._views)

    def save(self, name: str, layout: PlotLayout) -> str:
        """Keep a layout; return a line about it, with the reason if it could not be written."""
        name = clean(name, MAX_VIEW_NAME).strip()
        if not name:
            return "a view needs a name"
        if name not in self._views and len(self._views) >= MAX_VIEWS:
            return f"{MAX_VIEWS} views are kept already: save under the name of one"
        panes = [[_SavedValue(v.kind, v.subject, v.name, v.unit) for v in pane.values] for pane in layout.panes]
        self._views[name] = _SavedView(panes, layout.window)
        return self._write(f"view {name} is saved")

    def remove(self, name: str) -> str:
        """Forget a view; return a line about it."""
        if self._views.pop(name, None) is None:
            return f"there is no view {clean(name, MAX_VIEW_NAME)}"
        return self._write(f"view {name} is removed")

    def layout(self, name: str) -> PlotLayout | None:
        """Return a saved layout; None if there is none of this name."""
        saved = self._views.get(name)
        if saved is None:
            return None
        panes = [
            PanePlan(
                [
                    PlotValue(v.kind, _clean_subject(v.subject), clean(v.name, MAX_NAME), clean(v.unit, 16))
                    for v in pane[:MAX_CURVES]
                ]
            )
            for pane in saved.panes[:MAX_PANES]
        ]
        return PlotLayout(panes or [PanePlan()], 0, max(0, min(saved.window, WHOLE_FLIGHT)))

    def _write(self, words: str) -> str:
        if self._path is None:
            return words
        # Replaced as a whole, so that another console never reads half a file.
        new = self._path.with_suffix(".new")
        try:
            new.write_bytes(msgspec.json.format(msgspec.json.encode(self._views)))
            new.replace(self._path)
        except OSError as error:
            return f"{words}, until this console ends: {self._path} cannot be written ({error.strerror})"
        return words


def _clean_subject(subject: int | str) -> int | str:
    return subject if isinstance(subject, int) else clean(subject, MAX_NAME)


def _read(path: Path) -> dict[str, _SavedView]:
    try:
        if path.stat().st_size > MAX_BYTES:
            return {}
        held: Any = json.loads(path.read_text(encoding="utf-8"))
        views = msgspec.convert(held, dict[str, _SavedView])
    except (OSError, ValueError, RecursionError, msgspec.ValidationError):
        return {}
    return {clean(name, MAX_VIEW_NAME): view for name, view in list(views.items())[:MAX_VIEWS]}
