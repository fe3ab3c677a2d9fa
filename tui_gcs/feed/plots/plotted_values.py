"""What can be plotted: a name, a unit and a subject for each value, and the search for them.

Four kinds: telemetry (columns of the fleet frame), metrics of teams and their planners, fields of any MAVLink message,
and parameters. The first two are in what is published anyway; the others are asked for while they are plotted.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.base.text import clean
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.field_meanings import NO_MEANING, field_meaning, usual_value
from tui_gcs.core.protocol.common import FleetFrame, StationStatus
from tui_gcs.core.protocol.fleet import Freshness
from tui_gcs.core.protocol.metric_names import UNITS
from tui_gcs.core.protocol.services import ParamRow
from tui_gcs.core.records.flight_series import numbers_of

Floats = NDArray[np.float64]
MAX_NAME = 80
MAX_VEHICLES = 999
_VEHICLES = re.compile(r"[vV][0-9]{1,6}(-[0-9]{1,6})?(,[0-9]{1,6}(-[0-9]{1,6})?)*", re.ASCII)
FLEET = "fleet"
"""The subject of values of the whole fleet."""


class ValueKind(StrEnum):
    """Where a value comes from."""

    TELEMETRY = "telemetry"
    METRIC = "metric"
    FIELD = "field"
    PARAMETER = "parameter"


@dataclass(frozen=True)
class PlotValue:
    """One value of one subject: what a curve shows."""

    kind: ValueKind
    subject: int | str
    """A vehicle's number, or the name of a team."""
    name: str
    unit: str = ""

    @property
    def who(self) -> str:
        """The subject as a label has it."""
        return f"v{self.subject}" if isinstance(self.subject, int) else self.subject

    @property
    def label(self) -> str:
        """Subject and name."""
        return f"{self.who} {self.name}"


@dataclass(frozen=True)
class ValueName:
    """One line of the search: a value that vehicles or a team have."""

    kind: ValueKind
    name: str
    unit: str = ""
    text: str = ""
    """What it means, where that is known."""
    subject: str = ""
    """The team that it belongs to; "" for values of vehicles."""
    holders: tuple[int, ...] = ()
    """The only vehicles that have it; () where that is not known."""

    @property
    def words(self) -> str:
        """What the search looks into."""
        return f"{self.name} {self.unit} {self.text} {self.kind} {self.subject}".casefold()

    def of(self, vehicles: Iterable[int]) -> tuple[PlotValue, ...]:
        """Return the values of these vehicles, or the one of its team."""
        having = [vehicle for vehicle in vehicles if not self.holders or vehicle in self.holders]
        subjects: Iterable[int | str] = (self.subject,) if self.subject else having
        return tuple(PlotValue(self.kind, subject, self.name, self.unit) for subject in subjects)


@dataclass(frozen=True)
class Telemetry:
    """A number that the fleet frame has of each vehicle."""

    name: str
    unit: str
    text: str
    read: Callable[[FleetFrame], Any]
    """The frame's column, (vehicles,)."""


def _part(column: str, axis: int) -> Callable[[FleetFrame], Any]:
    return lambda frame: [place[axis] for place in getattr(frame, column)]


def _speed(frame: FleetFrame) -> Any:
    return [(v[0] * v[0] + v[1] * v[1]) ** 0.5 for v in frame.velocity_m_s]


TELEMETRY = (
    Telemetry("altitude", "m", "height above the scenario's home", _part("position_m", 2)),
    Telemetry("altitude amsl", "m", "height above mean sea level", attrgetter("alt_amsl_m")),
    Telemetry("speed", "m/s", "over ground", _speed),
    Telemetry("climb", "m/s", "vertical speed, up", _part("velocity_m_s", 2)),
    Telemetry("heading", "deg", "where the nose points, from north", attrgetter("heading_deg")),
    Telemetry("east", "m", "position from the scenario's home", _part("position_m", 0)),
    Telemetry("north", "m", "position from the scenario's home", _part("position_m", 1)),
    Telemetry("battery", "%", "charge that is left", attrgetter("battery_pct")),
    Telemetry("voltage", "V", "battery", attrgetter("battery_v")),
    Telemetry("satellites", "", "GPS satellites in use", attrgetter("satellites")),
    Telemetry("gps fix", "", "GPS_FIX_TYPE, 3 and more: 3D", attrgetter("gps_fix")),
    Telemetry("loss", "%", "frames of its link that are lost", attrgetter("loss_pct")),
    Telemetry("position age", "s", "since its newest position", attrgetter("age_s")),
    Telemetry("silence", "s", "since its newest frame", attrgetter("heard_age_s")),
    Telemetry("slot error", "m", "from its place in the planner's plan", attrgetter("slot_error_m")),
    Telemetry("slot lag", "s", "behind its planner's plan", attrgetter("lag_s")),
    Telemetry("layer", "m", "height at which it flies for its team", attrgetter("layer_m")),
    Telemetry("armed", "", "1: armed", attrgetter("armed")),
)
WELL_KNOWN = {
    "GLOBAL_POSITION_INT.relative_alt": "altitude above home",
    "GLOBAL_POSITION_INT.alt": "altitude above mean sea level",
    "VFR_HUD.groundspeed": "speed over ground",
    "VFR_HUD.airspeed": "airspeed",
    "VFR_HUD.climb": "vertical speed, up",
    "VFR_HUD.throttle": "throttle",
    "VFR_HUD.heading": "where the nose points",
    "SYS_STATUS.battery_remaining": "battery charge",
    "SYS_STATUS.voltage_battery": "battery voltage",
    "SYS_STATUS.current_battery": "battery current",
    "GPS_RAW_INT.satellites_visible": "GPS satellites",
    "GPS_RAW_INT.eph": "GPS hdop",
    "VIBRATION.vibration_z": "vibration",
    "POS.RelHomeAlt": "altitude above home",
    "BAT.Volt": "battery voltage",
    "BAT.Curr": "battery current",
    "BAT.RemPct": "battery charge",
    "GPS.Spd": "speed over ground",
    "GPS.NSats": "GPS satellites",
    "VIBE.VibeZ": "vibration",
    "vehicle_local_position.vx": "speed to the north",
    "vehicle_local_position.z": "height, down",
    "battery_status.voltage_v": "battery voltage",
    "battery_status.remaining": "battery charge",
}
"""Fields of messages, DataFlash logs and ULogs in the words that people search for."""
_OF_THE_LINK = ("loss", "position age", "silence")
"""What is known of a vehicle that is not heard."""


def telemetry_names() -> list[ValueName]:
    """Return what every vehicle has."""
    return [ValueName(ValueKind.TELEMETRY, each.name, each.unit, each.text) for each in TELEMETRY]


def telemetry_table(frame: FleetFrame) -> Floats:
    """Return (vehicles, values) in the order of `TELEMETRY`; NaN where it is not known, or not heard any more."""
    table = np.array([each.read(frame) for each in TELEMETRY], dtype=np.float64).reshape(len(TELEMETRY), -1).T
    lost = [row for row, freshness in enumerate(frame.freshness) if freshness is Freshness.LOST]
    if lost:
        unknown = [column for column, each in enumerate(TELEMETRY) if each.name not in _OF_THE_LINK]
        table[np.ix_(lost, unknown)] = np.nan
    return table


def metric_values(status: StationStatus) -> dict[PlotValue, float]:
    """Return the numbers of the fleet, of its teams and of their planners."""
    found = {
        _metric(FLEET, "min_separation_m"): status.min_separation_m,
        _metric(FLEET, "outside_area_m"): status.outside_area_m,
        _metric(FLEET, "heard"): float(status.heard),
        _metric(FLEET, "armed"): float(status.armed),
    }
    for team in status.teams:
        found |= {
            _metric(team.name, "worst_idleness_s"): team.worst_idleness_s,
            _metric(team.name, "average_idleness_s"): team.average_idleness_s,
            _metric(team.name, "coverage_pct"): team.coverage * 100.0,
            _metric(team.name, "ratio"): team.ratio,
            _metric(team.name, "on_slot"): float(team.on_slot),
            _metric(team.name, "plan_age_s"): team.plan_age_s,
            _metric(team.name, "rate_hz"): team.rate_hz,
        }
        found |= {_metric(team.name, name): value for name, value in team.metrics.items()}
    return found


def _metric(subject: str, name: str) -> PlotValue:
    """Return a value whose name ends with its unit: `worst_idleness_s` is "worst idleness" in s."""
    for end, unit in {**UNITS, "_hz": " Hz"}.items():
        if name.endswith(end) and name != end:
            return PlotValue(
                ValueKind.METRIC, subject, _plain(name.removesuffix(end)), unit.strip().replace("°", "deg")
            )
    return PlotValue(ValueKind.METRIC, subject, _plain(name))


def _plain(name: str) -> str:
    return clean(name, MAX_NAME).replace("_", " ").strip()


def metric_names(status: StationStatus | None) -> list[ValueName]:
    """Return what the fleet and its teams count now."""
    values = metric_values(status) if status is not None else {}
    return [ValueName(value.kind, value.name, value.unit, "", str(value.subject)) for value in values]


def field_names(messages: Iterable[str]) -> list[ValueName]:
    """Return all numbers of these messages. The first call imports pymavlink's dialect, which takes 80 ms."""
    layouts = [dialect.layout_named(message) for message in dict.fromkeys(messages)]
    return [
        ValueName(ValueKind.FIELD, name, unit, WELL_KNOWN.get(name, ""))
        for layout in layouts
        if layout is not None
        for name, unit in numbers_of(layout)
    ]


def field_value(name: str, sent: float) -> float:
    """Return a field's number as it was sent in its usual unit; NaN where it means "not known"."""
    message, _, field = name.partition(".")
    field = field.partition("[")[0]
    meaning = field_meaning(message, field)
    return usual_value(sent, meaning, _type_of(message, field)) if meaning is not NO_MEANING else sent


def _type_of(message: str, field: str) -> str:
    layout = dialect.layout_named(message)
    return next((each.type for each in layout.fields if each.name == field), "") if layout is not None else ""


def parameter_names(rows: Iterable[ParamRow]) -> list[ValueName]:
    """Return the parameters of a vehicle that are known."""
    return [ValueName(ValueKind.PARAMETER, row.name, row.units, row.text) for row in rows]


def split_vehicles(typed: str) -> tuple[tuple[int, ...], str]:
    """Return the vehicles that are named in a search as `v3` or `v1-4,7`, and the other words."""
    vehicles: list[int] = []
    others: list[str] = []
    for word in typed.split():
        if _VEHICLES.fullmatch(word) is None:
            others.append(word)
            continue
        for part in word[1:].split(","):
            low, _, high = part.partition("-")
            last = min(int(high or low), int(low) + MAX_VEHICLES)
            vehicles += range(int(low), last + 1)
    return tuple(dict.fromkeys(vehicles))[:MAX_VEHICLES], " ".join(others)


def matching(names: Sequence[ValueName], typed: str) -> list[ValueName]:
    """Return the names that have every word; those whose name or meaning begins as it was typed come first."""
    words = typed.casefold().split()
    if not words:
        return list(names)
    phrase = " ".join(words)
    found = [each for each in names if all(word in each.words for word in words)]

    def rank(each: ValueName) -> int:
        name, text = each.name.casefold(), each.text.casefold()
        return 0 if name.startswith(phrase) or text.startswith(phrase) else 1 if name.startswith(words[0]) else 2

    return sorted(found, key=rank)
