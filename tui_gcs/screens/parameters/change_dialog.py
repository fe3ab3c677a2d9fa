"""The dialog that lists a change of parameters, vehicle by vehicle, and asks for a confirmation."""

from collections.abc import Collection, Mapping

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.float32 import shown
from tui_gcs.core.formats.parameter_files import holds
from tui_gcs.core.protocol.alarms import id_ranges
from tui_gcs.core.protocol.setup import Number
from tui_gcs.feed.fleet_parameters import FleetParameters
from tui_gcs.feed.parameter_transfers import ParameterChange
from tui_gcs.screens.common.sure_dialog import ConfirmDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.palette import Ink

MAX_LINES = 40


class ChangeDialog(ConfirmDialog):
    """Shows what is set on which vehicle, from which value; `y` sends it, Esc leaves everything as it is."""

    def __init__(
        self,
        change: ParameterChange,
        parameters: FleetParameters,
        armed: Collection[int],
        notes: Collection[str],
        glyphs: GlyphSet,
        clock: Clock,
    ) -> None:
        """Ask about `change`; `armed` are vehicles that may be flying, `notes` are more lines to know."""
        vehicles = change.vehicles
        super().__init__(f"{change.what}: vehicle{'s' * (len(vehicles) > 1)} {id_ranges(vehicles)}", glyphs, clock)
        self._lines = [*change_lines(change, parameters), *([(note, Ink.MUTED)] for note in notes)]
        self._armed = sorted(set(armed).intersection(vehicles))

    def body(self) -> list[Line]:
        """Return the changes, a warning for armed vehicles, and the keys."""
        warning: list[Line] = []
        if self._armed:
            words = f"ARMED: {id_ranges(self._armed)}: it takes effect in flight, at once"
            warning = [[], [(words, Ink.WARNING)]]
        keys: Line = [(" Esc = leave it ", Ink.SELECTED), ("   y = set", Ink.BOLD)]
        return [*self._lines[:MAX_LINES], *warning, [], keys]


def change_lines(change: ParameterChange, parameters: FleetParameters) -> list[Line]:
    """Return a line for each parameter, old value and new value; vehicles with the same ones stand together."""
    found: dict[tuple[str, Number | None, Number], list[int]] = {}
    for vehicle, values in change.values.items():
        held = parameters.of(vehicle)
        for name, value in values.items():
            old = held[name].value if name in held else None
            found.setdefault((name, old, value), []).append(vehicle)
    lines: list[Line] = []
    for (name, old, value), vehicles in sorted(found.items(), key=lambda each: each[0][0]):
        was = shown(old) if old is not None else "?"
        lines.append(
            [(f"{name:<16} {was:>10} -> {shown(value):<10}", Ink.BOLD), (f"  {id_ranges(vehicles)}", Ink.TEXT)]
        )
    return lines


def values_for(vehicles: Collection[int], values: Mapping[str, Number], parameters: FleetParameters) -> ParameterChange:
    """Return the change that gives these vehicles these values, without values that they hold already."""
    needed: dict[int, Mapping[str, Number]] = {}
    for vehicle in vehicles:
        held = parameters.of(vehicle)
        differing = {n: v for n, v in values.items() if n in held and not holds(held[n], v)}
        if differing:
            needed[vehicle] = differing
    names = list(values)
    what = f"{names[0]} = {shown(values[names[0]])}" if len(names) == 1 else f"{len(names)} parameters"
    return ParameterChange(what, needed)
