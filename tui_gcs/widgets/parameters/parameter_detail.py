"""The panel that explains one parameter: meaning, unit, limits, default, and the vehicles by their values."""

from collections.abc import Sequence

from tui_gcs.core.base.float32 import shown
from tui_gcs.core.protocol.alarms import id_ranges, vehicles_words
from tui_gcs.core.protocol.services import ParamInfoRow
from tui_gcs.feed.fleet_parameters import FleetParameter
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import wrapped

MAX_GROUP_LINES = 12
MAX_CHOICES = 20
"""How many listed values or bits of a parameter are shown."""


class ParameterDetail(LinesView):
    """Everything known of the chosen parameter, and what became of the last change."""

    DEFAULT_CSS = framed("ParameterDetail", "height: 1fr;")

    _parameter: FleetParameter | None = None
    _info: ParamInfoRow | None = None
    _outcome: Sequence[tuple[str, Ink]] = ()

    def show(
        self, parameter: FleetParameter | None, info: ParamInfoRow | None, outcome: Sequence[tuple[str, Ink]]
    ) -> None:
        """Show this parameter, its vehicle's own description of it, and the lines of the last change's `outcome`."""
        self._parameter, self._outcome = parameter, outcome
        self._info = info if parameter is not None and info is not None and info.name == parameter.name else None
        set_title(self, parameter.name if parameter is not None else "parameter")
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        body = detail_lines(self._parameter, self._info, width) if self._parameter is not None else []
        outcome: list[Line] = [[(part, ink)] for text, ink in self._outcome for part in wrapped(text, width)]
        # What became of a change is the newest thing that happened: it is never cut by a long description.
        room = max(0, height - len(outcome))
        if 0 < room < len(body):
            body[room - 1 :] = [
                [(f"… {len(body) - room + 1} more lines: a taller terminal, or y copies all", Ink.MUTED)]
            ]
        return [*body[:room], *outcome]


def detail_lines(parameter: FleetParameter, info: ParamInfoRow | None, width: int) -> list[Line]:
    """Return the values by vehicles, then meaning, limits, listed values, default and type."""
    row = parameter.row
    lines: list[Line] = [[(part, Ink.TEXT)] for part in wrapped(row.text, width, 2)] if row.text else []
    meanings = dict(info.choices) if info is not None else {}
    for at, group in enumerate(parameter.groups[:MAX_GROUP_LINES]):
        ink = Ink.CAUTION if at and parameter.differs else Ink.BOLD
        unit = f" {row.units}" if row.units else ""
        meaning = f" ({meanings[group.value]})" if group.value in meanings else ""
        vehicles = f"vehicle{'s' * (len(group.vehicles) > 1)} {id_ranges(group.vehicles)}"
        lines.append([(f"{shown(group.value)}{unit}{meaning}", ink), (f"   {vehicles}", Ink.TEXT)])
    if (more := len(parameter.groups) - MAX_GROUP_LINES) > 0:
        lines.append([(f"and {more} more values", Ink.MUTED)])
    if parameter.lacking:
        lines.append([(f"not on, or not read from, {vehicles_words(parameter.lacking)}", Ink.MUTED)])
    default = f"default {shown(row.default)}   " if row.default is not None else ""
    lines.append([(f"{default}{row.type}", Ink.MUTED)])
    if info is not None:
        return [*lines, *info_lines(info, row.text, width)]
    return lines if row.text else [*lines, [("no description: this autopilot sends none", Ink.MUTED)]]


def info_lines(info: ParamInfoRow, short: str, width: int) -> list[Line]:
    """Return the limits, whether a reboot is needed, the listed values and bits, then the long description."""
    lines: list[Line] = []
    if info.least is not None or info.most is not None:
        least, most = (shown(limit) if limit is not None else "…" for limit in (info.least, info.most))
        lines.append([(f"from {least} to {most}", Ink.TEXT)])
    if info.reboot:
        lines.append([("takes effect after a reboot", Ink.CAUTION)])
    lines += [[(f"{shown(value):>6}  {text}", Ink.TEXT)] for value, text in info.choices[:MAX_CHOICES]]
    lines += [[(f"bit {bit:>2}  {text}", Ink.TEXT)] for bit, text in info.bits[:MAX_CHOICES]]
    if info.text != short:
        lines += [[(part, Ink.MUTED)] for part in wrapped(info.text, width)]
    return lines
