"""Everything about one vehicle: the row of the fleet frame, and the details that the station returns for one."""

import math
from collections.abc import Sequence

from tui_gcs.core.protocol.common import Alarm, Freshness, Phase, VehicleRow
from tui_gcs.core.protocol.services import Details, VehicleInfo
from tui_gcs.feed.visible_changes import whole_age_s
from tui_gcs.widgets.basics.alarm_line import LEVEL_INKS
from tui_gcs.widgets.basics.border_titles import framed, set_title
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line, LinesView
from tui_gcs.widgets.basics.number_text import (
    UNKNOWN,
    gps,
    hand_words,
    heading,
    number,
    phase_words,
    slot_words,
    speed_m_s,
)
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.basics.strips import Run, wrapped
from tui_gcs.widgets.fleet.severity_levels import INKS, MARKS
from tui_gcs.widgets.fleet.vehicle_alarms import LEVELS, level_now

MAX_ALARMS, MAX_CHECK_LINES = 3, 4
LABEL_CELLS = 6
VALUE_LINES = 10
"""Lines below state and alarms, with firmware and hardware in a line each."""
UNKNOWN_DETAILS = Details()
NONE = "n or number + Enter selects a vehicle"


class VehicleDetail(LinesView):
    """The panel: as many lines as fit, the most important first; in a low panel five dense lines."""

    DEFAULT_CSS = framed("VehicleDetail") + "VehicleDetail.-dense { border: none; }"

    _row: VehicleRow | None = None
    _info: VehicleInfo | None = None
    _alarms: Sequence[Alarm] = ()
    _wind_m_s: tuple[float, float] | None = None

    def show(
        self,
        row: VehicleRow | None,
        info: VehicleInfo | None,
        alarms: Sequence[Alarm],
        wind_m_s: tuple[float, float] | None,
    ) -> None:
        """Show a vehicle with its alarms; `info` may be missing or about another vehicle."""
        self._row, self._alarms, self._wind_m_s = row, alarms, wind_m_s
        self._info = info if info is not None and row is not None and info.id == row.id else None
        set_title(self, "selected")
        self.update_lines()

    def lines(self, width: int, height: int) -> Sequence[Line]:
        """See `LinesView.lines`."""
        if self._row is None:
            return [[(NONE, Ink.MUTED)]]
        view = DetailLines(self._row, self._info, self._alarms, self._wind_m_s, self.glyphs)
        return view.dense(width) if self.has_class("-dense") else view.tall(width, height)


class DetailLines:
    """The values of one vehicle as lines, for a high panel or dense for a low one."""

    def __init__(
        self,
        row: VehicleRow,
        info: VehicleInfo | None,
        alarms: Sequence[Alarm],
        wind_m_s: tuple[float, float] | None,
        glyphs: GlyphSet,
    ) -> None:
        """Show `row` with the details of `info`, if there are any."""
        self._row, self._info, self._alarms, self._wind, self._glyphs = row, info, alarms, wind_m_s, glyphs
        self._more = info.details if info is not None else UNKNOWN_DETAILS
        self._known = row.freshness is not Freshness.LOST

    def tall(self, width: int, height: int) -> list[Line]:
        """Lines of label and value; values of a lost vehicle are not shown as if they were still true."""
        first: list[Line] = [self._title(), _pair("state", self._state(), INKS[level_now(self._row, self._alarms)])]
        first += [self._alarm_line(alarm) for alarm in self._alarms[:MAX_ALARMS]]
        values = [
            ("alt", self._altitude()),
            ("spd", f"{self._speed()}  home {self._home()}"),
            ("bat", self._battery()),
            ("gps", f"{self._gps()}   ekf {self._estimator()}"),
            ("slot", self._slot("")),
            ("link", self._link()),
            ("att", f"{self._attitude()}  air {number(self._more.airspeed_m_s, 1)} m/s"),
            ("item", f"{self._item()}   wind {self._wind_words()}"),
            *self._identity(width, is_high=height >= len(first) + VALUE_LINES),
            ("place", f"{number(self._row.lat_deg, 6)} {number(self._row.lon_deg, 6)}"),
        ]
        always = ("link", "fw", "uid", "item")
        lines = [*first, *(_pair(name, text if self._known or name in always else UNKNOWN) for name, text in values)]
        checks = self._checks(width)
        at = min(len(lines), max(len(first) + 4, height - len(checks))) if self._is_in_doubt() else len(lines)
        return [*lines[:at], *checks, *lines[at:]]

    def dense(self, width: int) -> list[Line]:
        """Five lines of 80 cells."""
        row = self._row
        head = f"vehicle {row.id}  {row.team[:10]}  {row.autopilot}  "
        first: Line = [(head, Ink.BOLD), (self._state(), INKS[level_now(row, self._alarms)])]
        if self._known:
            where: Line = [(f"{self._altitude()}   {self._speed()}  home {self._home()}", Ink.TEXT)]
            power: Line = [(f"bat {self._battery()}   gps {self._gps()}   ekf {self._estimator()}", Ink.TEXT)]
        else:
            where = [(f"last place {number(row.lat_deg, 6)} {number(row.lon_deg, 6)}", Ink.TEXT)]
            power = []
        slot = self._slot() if self._known else slot_words(self._row.slot)
        others = f"{slot}   {self._item()}   wind {self._wind_words()}"
        others += f"   {self._attitude()}" if self._known else f"   {self._link()}"
        heard = f"loss {number(row.loss_pct, 1)} %{self._round_trip()}   " if self._known else ""
        identity: Line = [(f"{heard}fw {self._firmware_and_uid(width - len(heard) - 3)}", Ink.TEXT)]
        return [first, where, power, self._checks(width)[0] if self._is_in_doubt() else [(others, Ink.TEXT)], identity]

    def _title(self) -> list[Run]:
        row = self._row
        team = f"  {row.team}" if row.team else ""
        return [(f"vehicle {row.id}{team}  {row.autopilot} {row.vehicle_type}", Ink.BOLD)]

    def _state(self) -> str:
        row = self._row
        if not self._known:
            age_s = whole_age_s(row.heard_age_s)
            return f"LOST, last heard {UNKNOWN if age_s is None else age_s} s ago"
        age_s = whole_age_s(row.age_s) if row.freshness is Freshness.STALE else 0
        old = f"  position {age_s} s old" if age_s else ""
        prearm = "  prearm ok" if self._info is not None and self._info.ready and not row.armed else ""
        does = f"{row.phase}: {hand_words(row)}" if row.phase is Phase.BY_HAND else phase_words(row)
        return f"{row.mode}  {'ARMED' if row.armed else 'disarmed'}  {does}{prearm}{old}"

    def _alarm_line(self, alarm: Alarm) -> Line:
        mark = MARKS[LEVELS[alarm.level]] or "i"
        return [(f"{mark} {alarm.tag:<4}{alarm.title}  {alarm.text}", LEVEL_INKS[alarm.level])]

    def _altitude(self) -> str:
        row = self._row
        return (
            f"{number(row.position_m[2], 1)} m rel  {number(row.alt_amsl_m, 1)} amsl"
            f"  climb {_signed(row.velocity_m_s[2])}"
        )

    def _speed(self) -> str:
        speed = number(speed_m_s(self._row.velocity_m_s), 1)
        return f"{speed} m/s  hdg {heading(self._row.heading_deg, self._glyphs.degree)}"

    def _battery(self) -> str:
        more = self._more
        # The battery's own estimate, where it makes one, knows more than the percentages that it reports.
        left_s = more.battery_left_s if math.isfinite(more.battery_left_s) else self._row.battery_left_s
        left = f"  ~{left_s / 60:.0f} min" if math.isfinite(left_s) else ""
        amps = f"  {number(more.battery_a, 1)} A" if math.isfinite(more.battery_a) else ""
        return f"{number(self._row.battery_v, 1)} V  {number(self._row.battery_pct)} %{left}{amps}"

    def _gps(self) -> str:
        error = f" ±{number(self._more.position_error_m, 1)} m" if math.isfinite(self._more.position_error_m) else ""
        hdop = f" hdop {number(self._more.hdop, 1)}" if math.isfinite(self._more.hdop) else ""
        return f"{gps(self._row.gps_fix, self._row.satellites)}{error}{hdop}"

    def _estimator(self) -> str:
        return self._more.estimator or UNKNOWN

    def _attitude(self) -> str:
        more, degree = self._more, self._glyphs.degree
        return f"roll {_signed(more.roll_deg, 0)}{degree} pitch {_signed(more.pitch_deg, 0)}{degree}"

    def _home(self) -> str:
        """Distance and bearing to home."""
        home, place = self._more.home_m, self._row.position_m
        if home is None or not math.isfinite(place[0]):
            return UNKNOWN
        east, north = home[0] - place[0], home[1] - place[1]
        bearing_deg = math.degrees(math.atan2(east, north)) % 360.0
        return f"{math.hypot(east, north):.0f} m {heading(bearing_deg, self._glyphs.degree)}"

    def _slot(self, label: str = "slot ") -> str:
        lag = f"  {_signed(self._row.lag_s)} s" if math.isfinite(self._row.lag_s) else ""
        return f"{slot_words(self._row.slot, label)}  off {number(self._row.slot_error_m, 1)} m{lag}"

    def _link(self) -> str:
        return f"loss {number(self._row.loss_pct, 1)} %{self._round_trip()}  {self._row.link}"

    def _round_trip(self) -> str:
        rtt_s = self._info.rtt_s if self._info is not None else math.nan
        return f"  rtt {rtt_s * 1000:.0f} ms" if math.isfinite(rtt_s) else ""

    def _item(self) -> str:
        info = self._info
        if info is None or not info.mission_items:
            return "no mission"
        current = UNKNOWN if info.mission_current is None else str(info.mission_current + 1)
        return f"mission {current}/{info.mission_items}"

    def _wind_words(self) -> str:
        """Speed of the wind, and where it comes from."""
        if self._wind is None:
            return UNKNOWN
        east, north = self._wind
        from_deg = math.degrees(math.atan2(-east, -north)) % 360.0
        return f"{math.hypot(east, north):.1f} m/s from {heading(from_deg, self._glyphs.degree)}"

    def _firmware(self) -> str:
        version = self._info.firmware if self._info is not None else ""
        return f"{version or UNKNOWN}  {self._row.signing}"

    def _identity(self, width: int, *, is_high: bool) -> list[tuple[str, str]]:
        """Firmware and hardware, in one line unless there is room for two."""
        short = self._firmware_and_uid(width - LABEL_CELLS)
        return (
            [("fw", self._firmware()), ("uid", self._uid())]
            if is_high and self._uid() not in short
            else [("fw", short)]
        )

    def _uid(self) -> str:
        return (self._info.uid if self._info is not None else "") or UNKNOWN

    def _firmware_and_uid(self, room: int) -> str:
        """Firmware and hardware id; a long id is cut in its middle, `tui-gcs vehicle show` has all of it."""
        firmware = f"{self._firmware()}  "
        uid = self._uid()
        left = room - len(firmware)
        if len(uid) <= left:
            return firmware + uid
        half = max(4, min(8, (left - 2) // 2))
        return f"{firmware}{uid[:half]}..{uid[-half:]}"

    def _is_in_doubt(self) -> bool:
        """Whether the reason why it cannot arm, or a doubt about its identity, matters more than other values."""
        blocked = self._info is not None and not self._row.armed and not self._info.ready
        return bool(self._row.problem) or blocked

    def _checks(self, width: int) -> list[Line]:
        """Why it could not arm, or what else is wrong; the worst first."""
        if self._row.problem:
            return _wrapped("WHO?", self._row.problem, width, Ink.WARNING)
        if self._info is None:
            return [_pair("check", UNKNOWN, Ink.MUTED)]
        blocking = "; ".join(problem.text for problem in self._info.problems if problem.blocks)
        if blocking:
            return _wrapped("check", blocking, width, Ink.TEXT if self._row.armed else Ink.CAUTION)
        odd = "; ".join(problem.text for problem in self._info.problems)
        return _wrapped("check", "ready" + (f": {odd}" if odd else ""), width)


def _wrapped(label: str, text: str, width: int, ink: Ink = Ink.TEXT) -> list[Line]:
    lines = wrapped(text, max(20, width - LABEL_CELLS))[:MAX_CHECK_LINES]
    return [_pair(label if not index else "", line, ink) for index, line in enumerate(lines)]


def _pair(label: str, text: str, ink: Ink = Ink.TEXT) -> list[Run]:
    return [(f"{label:<{LABEL_CELLS}}", Ink.MUTED), (text, ink)]


def _signed(value: float, digits: int = 1) -> str:
    text = number(value, digits)
    return text if text == UNKNOWN or text.startswith("-") else f"+{text}"
