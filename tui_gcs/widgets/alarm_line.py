"""The second line: the worst thing the operator must act on and the key that answers it, or nothing."""

from dataclasses import dataclass

from tui_gcs.core.messages import FleetFrame, Freshness, Phase
from tui_gcs.widgets.levels import Level, level_of
from tui_gcs.widgets.lines import Line, LinesView
from tui_gcs.widgets.palette import Ink
from tui_gcs.widgets.words import ids, number


@dataclass(frozen=True)
class Notice:
    """A line for the operator."""

    text: str
    level: Level = Level.NORMAL


class AlarmLine(LinesView):
    """Prompt over alarm over notice: one line, plain text."""

    DEFAULT_CSS = "AlarmLine { height: 1; }"

    _prompt = ""
    _alarm = Notice("")
    _notice = Notice("")

    def set_prompt(self, text: str) -> None:
        """Something that waits for the next key; empty when nothing does."""
        self._prompt = text
        self.update_lines()

    def set_alarm(self, alarm: Notice) -> None:
        """The worst alarm; empty text for none."""
        self._alarm = alarm
        self.update_lines()

    def set_notice(self, notice: Notice) -> None:
        """What became of the last command; empty text for nothing."""
        self._notice = notice
        self.update_lines()

    def lines(self, width: int, height: int) -> list[Line]:
        """See `LinesView.lines`."""
        if self._prompt:
            return [[(f" {self._prompt} ", Ink.SELECTED)]]
        if self._alarm.text:
            tag = " ! WARN " if self._alarm.level is Level.WARNING else " ^ CAUT "
            ink = Ink.ALARM if self._alarm.level is Level.WARNING else Ink.SELECTED_CAUTION
            text_ink = Ink.WARNING if self._alarm.level is Level.WARNING else Ink.CAUTION
            tail = f"   | {self._notice.text}" if self._notice.text else ""
            return [[(tag, ink), (f" {self._alarm.text}", text_ink), (tail, Ink.TEXT)]]
        inks = {Level.WARNING: Ink.WARNING, Level.CAUTION: Ink.CAUTION}
        return [[(f" {self._notice.text}", inks.get(self._notice.level, Ink.MUTED))]]


def worst_of(frame: FleetFrame | None) -> Notice:
    """The worst that can be seen in a fleet frame, vehicles with the same trouble in one line."""
    if frame is None:
        return Notice("")
    rows = frame.rows()
    level = max((level_of(row) for row in rows), default=Level.NORMAL)
    if level < Level.CAUTION:
        return Notice("")
    bad = [row for row in rows if level_of(row) is level]
    lost = [row.id for row in bad if row.freshness is Freshness.LOST]
    if lost:
        return Notice(f"{_vehicles(lost)} LOST in flight: last seen on the map  {_HOLD}", level)
    if stale := [row.id for row in bad if row.freshness is Freshness.STALE]:
        return Notice(f"{_vehicles(stale)} position not updated  {_HOLD}", level)
    if taken := [row.id for row in bad if row.phase is Phase.TAKEN_OUT]:
        return Notice(f"{_vehicles(taken)} in the air, not ours to steer", level)
    lowest = min(bad, key=lambda row: row.battery_pct)
    others = f" and {len(bad) - 1} more" if len(bad) > 1 else ""
    act = "r return and land" if lowest.armed else ""
    return Notice(f"vehicle {lowest.id}{others}: battery {number(lowest.battery_pct, 0)} %   {act}".rstrip(), level)


_HOLD = "!h HOLD ALL"


def _vehicles(vehicles: list[int]) -> str:
    return f"vehicle {vehicles[0]}" if len(vehicles) == 1 else f"vehicles {ids(vehicles)}"
