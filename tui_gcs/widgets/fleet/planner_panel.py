"""How well each team does: worst idleness beside its ideal, coverage, slots, and metrics of its planner."""

import math
from collections.abc import Sequence

from textual.widget import Widget

from tui_gcs.core.protocol.common import StationStatus, TeamStatus, VehicleRow
from tui_gcs.core.protocol.metric_names import all_words, seen_pct
from tui_gcs.feed.visible_changes import whole_age_s
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import number, outside, packed
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.shown_keys import cut_mark, key_name
from tui_gcs.widgets.basics.strips import Run, cut, cut_before
from tui_gcs.widgets.fleet.selected_panel import brief_lines
from tui_gcs.widgets.fleet.vehicle_alarms import AlarmsByVehicle

ROLE_INKS = {"defend": Ink.DEFEND, "attack": Ink.ATTACK}
WORKER_INKS = {"absent": Ink.MUTED, "late": Ink.WARNING, "dead": Ink.WARNING, "quarantined": Ink.WARNING}


SHOWN_BEFORE = frozenset({"bound_s", "ideal_s", "coverage", "slots", "joined"})
"""Metrics of the patrol planner that the lines above show already, as the station measured them."""

BRIEF_NAME_CELLS = 7


class PlannerPanel(LinesView):
    """Two lines for each team, then the whole fleet, then as many metrics of the planners as fit."""

    DEFAULT_CSS = framed("PlannerPanel", "height: 1fr;")

    _status: StationStatus | None = None

    def show(self, status: StationStatus | None) -> None:
        """Show a status; None when nothing is known."""
        self._status = status
        set_title(self, _title(self, "planner", status))
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        if self._status is None:
            return [[("--", Ink.MUTED)]]
        fleet = fleet_lines(self._status)
        teams = [team_lines(team, self.glyphs) for team in self._status.teams]
        lines = [*as_many(teams, height - len(fleet), key_name(self, "show_planners", "M")), *fleet]
        counted = metric_lines(self._status, width, height - len(lines), cut_mark(self, "show_planners", "M"))
        return [*lines, *counted, *recording_lines(self._status)]


class BriefPanel(LinesView):
    """The selected vehicle and the planners in one panel, for small terminals."""

    DEFAULT_CSS = framed("BriefPanel", "height: 1fr;")

    _status: StationStatus | None = None
    _row: VehicleRow | None = None
    _alarms: AlarmsByVehicle = {}

    def show(self, status: StationStatus | None, row: VehicleRow | None, alarms: AlarmsByVehicle) -> None:
        """Show a vehicle and a status; either may be None."""
        self._status, self._row, self._alarms = status, row, alarms
        set_title(self, _title(self, f"{row.id}, planner" if row is not None else "planner", status))
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        own = self._alarms.get(self._row.id, ()) if self._row is not None else ()
        lines: list[Line] = list(brief_lines(self._row, own, self.glyphs))
        if self._status is not None:
            teams = self._status.teams
            if len(lines) + len(teams) + 1 > height:
                lines = [line for line in lines if any(text for text, _ in line)]
                teams = tuple(sorted(teams, key=_badness, reverse=True))
            same = len({team.role for team in teams}) < len(teams)
            briefs = [[team_brief(team, self.glyphs, by_zone=same)] for team in teams]
            lines += as_many(briefs, height - len(lines) - 1, key_name(self, "show_planners", "M"))
            lines.append(fleet_brief(self._status))
            lines += metric_lines(self._status, width, height - len(lines), cut_mark(self, "show_planners", "M"))
        return lines


def _title(panel: Widget, words: str, status: StationStatus | None) -> str:
    """The title, with the key that shows all metrics if there are any: there is not always room for them."""
    counts = status is not None and any(team.metrics for team in status.teams)
    return f"{words}   {key_name(panel, 'show_planners', 'M')}: all" if counts else words


def _badness(team: TeamStatus) -> tuple[bool, float]:
    """What is shown first where not all teams have room: planners that do not run, then the highest ratio."""
    return team.worker != "running", team.ratio if math.isfinite(team.ratio) else 0.0


def as_many(teams: Sequence[Sequence[Line]], room: int, key: str) -> list[Line]:
    """The lines of as many teams as fit into `room` lines; the last one counts the others, and names the key.

    On a terminal that is too small `room` may be less than nothing.
    """
    lines = [line for of_team in teams for line in of_team]
    if len(lines) <= max(room, 0):
        return lines
    shown = max(0, room - 1) // len(teams[0])
    return [
        *(line for of_team in teams[:shown] for line in of_team),
        [(f"{len(teams) - shown} more teams: {key}", Ink.MUTED)],
    ]


def team_lines(team: TeamStatus, glyphs: GlyphSet) -> list[list[Run]]:
    """A team in two wide lines: role, zone and idleness; then how good that is."""
    worker = "" if team.worker == "running" else f"  {team.worker}"
    return [
        [
            (f"{team.role.upper()} {team.zone[:18]}", ROLE_INKS.get(team.role, Ink.TEXT)),
            ("  worst ", Ink.MUTED),
            (number(team.worst_idleness_s, 1, " s"), Ink.BOLD),
            (f"  avg {number(team.average_idleness_s, 1)}  {team.planner[:8]}", Ink.MUTED),
            (worker, WORKER_INKS.get(team.worker, Ink.MUTED)),
        ],
        [
            (f"  {number(team.ratio, 2)}", _ratio_ink(team)),
            (f" x ideal {number(team.ideal_s, 1)}  cover {number(seen_pct(team.coverage, 0), 0, '%')}", Ink.TEXT),
            (f"  slots {_slots(team)}", Ink.TEXT),
            (f" +{team.reserve} in reserve" if team.reserve else "", Ink.TEXT),
            (_plan_age(team), WORKER_INKS.get(team.worker, Ink.MUTED)),
        ],
    ]


def _slots(team: TeamStatus) -> str:
    """Vehicles on their slots of all slots, without those in reserve."""
    return f"{team.on_slot - team.reserve}/{team.slots - team.reserve}"


def metric_lines(status: StationStatus, width: int, most: int, more: str) -> list[Line]:
    """Metrics of each team's planner on `most` lines, shared equally; `more` ends them if not all fit."""
    counted_by = [(team.role[:3].upper(), all_words(team.metrics, SHOWN_BEFORE)) for team in status.teams]
    words = [[f"{role} {counted[0]}", *counted[1:]] for role, counted in counted_by if counted]
    rows = packed([word for of_team in words for word in of_team], width)
    if len(rows) > most > 0:
        shared = _shared_out([packed(of_team, width) for of_team in words], most)
        rows = [row for of_team in shared for row in of_team]
        rows[-1] = cut_before(rows[-1], width, more) + more
    return [[(row, Ink.MUTED)] for row in rows[: max(most, 0)]]


def _shared_out(rows: list[list[str]], most: int) -> list[list[str]]:
    """The same number of lines for each team; what one does not need goes to the next."""
    shown: list[list[str]] = []
    for index, of_team in enumerate(rows):
        left = most - sum(map(len, shown))
        shown.append(of_team[: -(-left // (len(rows) - index))])
    return shown


def _plan_age(team: TeamStatus) -> str:
    """Age of the plan in words; empty while it is fresh, for a number that always changes costs bytes and attention."""
    age_s = whole_age_s(team.plan_age_s)
    return "  no plan" if age_s is None else f"  plan {age_s}s old" if age_s else ""


def team_brief(team: TeamStatus, glyphs: GlyphSet, *, by_zone: bool = False) -> list[Run]:
    """A team in one line, for small terminals; by its role, or `by_zone` where several have the same one."""
    ink = ROLE_INKS.get(team.role, Ink.TEXT)
    state = "" if team.worker == "running" else f" {team.worker}"
    cover = number(seen_pct(team.coverage, 0))
    slots = _slots(team) + (f"+{team.reserve}" if team.reserve else "")
    text = f" {number(team.worst_idleness_s, 1, 's')} {number(team.ratio, 2)}x"
    # Zones have longer names: what is seen whole is then not said.
    text += f" {slots}{'' if cover == '100' else f' c{cover}%'}" if by_zone else f" cov{cover} {slots}"
    name = cut(team.zone, BRIEF_NAME_CELLS).rstrip() if by_zone else team.role[:3].upper()
    return [(name, ink), (text, Ink.TEXT), (state, WORKER_INKS.get(team.worker, Ink.MUTED))]


def fleet_lines(status: StationStatus) -> list[list[Run]]:
    """Separation, distance outside the area, guard vetoes."""
    vetoes = sum(status.vetoes.values())
    lines: list[list[Run]] = [
        [
            (f"nearest pair {number(status.min_separation_m, 1, ' m')} (3-D)", Ink.TEXT),
            ("   ", Ink.TEXT),
            (f"outside area {outside(status.outside_area_m, ' m')}", _outside_ink(status)),
        ]
    ]
    if vetoes:
        worst = max(status.vetoes, key=lambda reason: status.vetoes[reason])
        lines.append([(f"guard: {vetoes} vetoes, most: {worst}", Ink.CAUTION)])
    return lines


def recording_lines(status: StationStatus) -> list[list[Run]]:
    """The file that the station records to: the last line, for which there is not always room."""
    return [[(f"recording {status.recording}", Ink.MUTED)]] if status.recording else []


def fleet_brief(status: StationStatus) -> list[Run]:
    """What concerns the whole fleet in one line, for small terminals."""
    vetoes = sum(status.vetoes.values())
    return [
        (f"sep {number(status.min_separation_m, 1, 'm')} ", Ink.TEXT),
        (f"out {outside(status.outside_area_m, 'm')}", _outside_ink(status)),
        (f" veto {vetoes}" if vetoes else "", Ink.CAUTION),
    ]


def _ratio_ink(team: TeamStatus) -> Ink:
    # Smooth tours reach 1.14 to 1.24 of the bound, strips there and back 3.3 to 4.0 (docs/planning.md C1).
    return Ink.CAUTION if team.ratio > 2.0 else Ink.BOLD  # NaN is not above


def _outside_ink(status: StationStatus) -> Ink:
    return Ink.WARNING if status.outside_area_m > 0.0 else Ink.TEXT
