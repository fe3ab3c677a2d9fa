"""The top line: SIM/LIVE/REPLAY, what flies, how many are heard, armed or ready, which console is in control."""

import time

from rich.cells import cell_len

from tui_gcs.core.protocol.common import RunKind, RunPhase, StationStatus
from tui_gcs.core.protocol.replay import ReplayStatus
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import clock
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, cut

WIDE = 115
MIN_NAME_CELLS = 8
KIND_INKS = {RunKind.SIM: Ink.SELECTED, RunKind.LIVE: Ink.LIVE, RunKind.REPLAY: Ink.REPLAY}
IDLE_WORD = "idle"
"""Replaces `not started` on a narrow terminal."""
NO_PLANNER_WORD = "by hand"
"""No vehicle flies for a planner and none holds: HOLD would be untrue of one that flies its own mission."""
RUN_WORDS = {
    RunPhase.IDLE: "not started",
    RunPhase.STARTING: "starting",
    RunPhase.HOLD: "HOLD",
    RunPhase.RETURNING: "returning",
}


class StatusLine(LinesView):
    """One line from which an operator sees within a second whether all is well."""

    DEFAULT_CSS = "StatusLine { height: 1; }"

    _status: StationStatus | None = None
    _wall_s = float("nan")
    _principal = ""
    _lost = False
    _holds = True

    def show(
        self, status: StationStatus | None, *, wall_s: float, principal: str, lost: bool, holds: bool = True
    ) -> None:
        """Show a status; `lost`: the station is silent and values are `--`; `holds`: some vehicle holds."""
        self._status, self._wall_s, self._principal, self._lost = status, wall_s, principal, lost
        self._holds = holds
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        if self._status is None:
            return [[(" tui-gcs ", Ink.SELECTED), ("  waiting for the station", Ink.MUTED)]]
        # The last values stay on the bus for ever: without this a dead station would look like a quiet one.
        if self._lost:
            return [lost_runs(self._status, width)]
        return [status_runs(self._status, width, self._wall_s, self._principal, self.glyphs, holds=self._holds)]


def lost_runs(status: StationStatus, width: int) -> list[Run]:
    """The line while the station is silent: no value in it is known any more."""
    kind = (f" {status.kind} ", KIND_INKS[status.kind])
    words = f" {status.scenario}  --  links --  -- heard  armed --  control --"
    state = (" STATION ENDED ", Ink.CAUTION) if status.ending else (" STATION LOST ", Ink.ALARM)
    return [kind, state, (words[: max(0, width)], Ink.MUTED)]


def status_runs(
    status: StationStatus, width: int, wall_s: float, principal: str, glyphs: GlyphSet, *, holds: bool = True
) -> list[Run]:
    """The line while the station is heard; narrow terminals get shorter words, not fewer facts."""
    if status.replay is not None:
        return replay_runs(status, status.replay, width, glyphs)
    wide = width >= WIDE
    gap = ("   " if wide else "  ", Ink.TEXT)
    # First, and never cut: SIM must not be taken for LIVE (docs/threats.md R24).
    runs: list[Run] = [(f" {status.kind} ", KIND_INKS[status.kind])]
    if status.scenario:
        runs.append((f" {status.scenario[: 20 if wide else 15]}", Ink.BOLD))
        number = f"{status.round_index + 1}/{len(status.rounds)}"
        runs += [gap, (f"Round {number}" if wide else f"R{number}", Ink.TEXT)]
        running = status.run is RunPhase.RUNNING
        word = clock(status.mission_time_s) if running else RUN_WORDS[status.run]
        if not wide and status.run is RunPhase.IDLE:
            word = IDLE_WORD
        if status.run is RunPhase.HOLD and not holds:
            word = NO_PLANNER_WORD
        runs += [("  ", Ink.TEXT), (word, Ink.CAUTION if status.run is RunPhase.HOLD else Ink.TEXT)]
    runs += [gap, *_links(status, glyphs), ("  ", Ink.TEXT), *_heard(status, wide)]
    runs += [gap, *_armed_or_ready(status)]
    planner = _planner(status, wide, glyphs)
    if planner:
        runs += [gap, *planner]
    control = "you" if status.in_control == principal else status.in_control or "none"
    runs += [gap, (f"control: {control}" if wide else f"ctl {control}", Ink.TEXT)]
    if status.scenario:  # its name gives way to facts
        over = max(0, sum(cell_len(text) for text, _ in runs) - width)
        runs[1] = (cut(runs[1][0], max(MIN_NAME_CELLS, cell_len(runs[1][0]) - over)), Ink.BOLD)
    utc = _utc(wall_s)
    used = sum(len(text) for text, _ in runs) + len(gap[0]) + len(utc)
    if wide and used <= width:  # half a time is worse than none
        runs += [gap, (utc, Ink.MUTED)]
    return runs


def replay_runs(status: StationStatus, replay: ReplayStatus, width: int, glyphs: GlyphSet) -> list[Run]:
    """The line of a recording: what is played, where it stands, and how fast; then what flew at that moment."""
    wide = width >= WIDE
    gap = ("   " if wide else "  ", Ink.TEXT)
    length = clock(replay.length_s).removeprefix("T+") if replay.length_s == replay.length_s else "?"
    if replay.searching:
        pace = (f"to {replay.searching}", Ink.CAUTION)
    elif replay.said:
        pace = (f"{'PAUSED: ' if replay.paused else ''}{replay.said}", Ink.CAUTION)
    elif replay.paused:
        pace = ("PAUSED", Ink.CAUTION)
    else:
        pace = (f"{glyphs.running} {replay.speed:g}x", Ink.NORMAL)
    runs: list[Run] = [
        (f" {status.kind} ", KIND_INKS[status.kind]),
        (f" {status.scenario}", Ink.BOLD),
        gap,
        (f"{clock(replay.at_s)}/{length}", Ink.BOLD),
        ("  ", Ink.TEXT),
        pace,
        gap,
        *_heard(status, wide),
        gap,
        (f"armed {status.armed}", Ink.BOLD if status.armed else Ink.TEXT),
        gap,
        (_utc(status.wall_s), Ink.MUTED),
    ]
    over = max(0, sum(cell_len(text) for text, _ in runs) - width)
    runs[1] = (cut(runs[1][0], max(MIN_NAME_CELLS, cell_len(runs[1][0]) - over)), Ink.BOLD)
    return runs


def _links(status: StationStatus, glyphs: GlyphSet) -> list[Run]:
    up = sum(link.up for link in status.links)
    if up < len(status.links):
        return [(f"links {glyphs.lost} {up}/{len(status.links)}", Ink.WARNING)]
    return [("links ", Ink.TEXT), (glyphs.bullet, Ink.NORMAL if up else Ink.MUTED), (f" {up}", Ink.TEXT)]


def _heard(status: StationStatus, wide: bool) -> list[Run]:
    ink = Ink.TEXT if status.heard >= status.vehicles else Ink.CAUTION
    return [(f"{status.heard}/{status.vehicles}" + (" heard" if wide else ""), ink)]


def _armed_or_ready(status: StationStatus) -> list[Run]:
    """How many are armed; before the mission's first start how many could be started."""
    members = [vehicle for team in status.teams for vehicle in team.members]
    if status.armed or status.mission_time_s > 0.0 or not members:
        return [(f"armed {status.armed}", Ink.BOLD if status.armed else Ink.TEXT)]
    ready = sum(vehicle not in status.not_ready for vehicle in members)
    return [(f"ready {ready}/{len(members)}", Ink.TEXT if ready == len(members) else Ink.CAUTION)]


def _planner(status: StationStatus, wide: bool, glyphs: GlyphSet) -> list[Run]:
    """The planners' names and the worst of their states."""
    if not status.teams:
        return []
    names = "+".join(dict.fromkeys(team.planner for team in status.teams))
    workers = {team.worker for team in status.teams}
    name = names[: 20 if wide else 8]
    for bad in ("quarantined", "dead", "late"):
        if bad in workers:
            return [(f"{name} ! {bad}", Ink.WARNING)]
    if "absent" in workers:
        return [(f"{name} {glyphs.stopped}", Ink.TEXT), (" absent" if wide else " none", Ink.MUTED)]
    if "running" in workers:
        rate_hz = min(team.rate_hz for team in status.teams)
        rate = f" {rate_hz:.0f} Hz" if wide and rate_hz == rate_hz else ""
        return [(f"{name} ", Ink.TEXT), (glyphs.running, Ink.NORMAL), (rate, Ink.TEXT)]
    return [(f"{name} {glyphs.stopped}", Ink.TEXT)]


def _utc(wall_s: float) -> str:
    return time.strftime("%H:%M:%SZ", time.gmtime(wall_s)) if wall_s == wall_s else ""
