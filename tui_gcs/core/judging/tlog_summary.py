"""The summary of a telemetry log, by system id."""

from collections import Counter
from pathlib import Path
from typing import Any, Literal

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.status_text import TextAssembler
from tui_gcs.core.judging.extent import Extent, ExtentCollector, Place
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink import enum_names as mavlink
from tui_gcs.core.mavlink.frames import Frame, decode
from tui_gcs.core.mavlink.mode_names import mode_name
from tui_gcs.core.records.tlog_reader import TlogReader, read_tlog

HEARTBEAT, GPS_RAW_INT, GLOBAL_POSITION_INT, STATUSTEXT = 0, 24, 33, 253
"""MAVLink message ids that the summary looks into; all others are only counted."""
# GPS_FIX_TYPE_3D_FIX (common.xml).
FIX_3D = 3
MAX_TEXTS = 1000
"""Status texts kept per system, because a log may hold a flood of them."""
TAB_PICTURE = "␉"
"""PX4 ends a text in a tab if it also exists as an event."""
Kind = Literal["vehicle", "station", "component", "unknown"]


class ModeSpan(msgspec.Struct, frozen=True):
    """The mode from a time on, until the next entry."""

    wall_s: float
    mode: str


class ArmedSpan(msgspec.Struct, frozen=True):
    """The time from the first heartbeat that reports armed to the first one that does not."""

    from_wall_s: float
    to_wall_s: float
    ended: bool
    """False: it was still armed in the last heartbeat, at `to_wall_s`."""


class Text(msgspec.Struct, frozen=True):
    """A status text with its chunks put together."""

    wall_s: float
    severity: int
    text: str


class SystemSummary(msgspec.Struct, frozen=True):
    """The content of the log about one MAVLink system id."""

    system: int
    kind: Kind
    """The kind by its heartbeats; "unknown" if there was none."""
    autopilot: str
    vehicle_type: str
    components: tuple[int, ...]
    frames: int
    signed_frames: int
    messages: dict[str, int]
    """Frames by message name, most frequent first; ids the dialect does not know as "UNKNOWN_<id>"."""
    first_wall_s: float
    last_wall_s: float
    extent: Extent | None
    modes: tuple[ModeSpan, ...]
    armed: tuple[ArmedSpan, ...]
    texts: tuple[Text, ...]
    texts_left_off: int = 0


class Summary(msgspec.Struct, frozen=True):
    """The content of a whole log."""

    path: str
    frames: int
    first_wall_s: float
    last_wall_s: float
    skipped_bytes: int
    truncated: bool
    """Whether the file ends inside a record."""
    warnings: tuple[str, ...]
    systems: tuple[SystemSummary, ...]


def summarize(path: Path | str) -> Summary:
    """Read the log once and summarise it.

    Raises:
        TlogError: unreadable, empty, or no telemetry log. A damaged or truncated log is a warning.
    """
    reader = read_tlog(path)
    systems: dict[int, _System] = {}
    for wall_s, frame in reader:
        system = systems.get(frame.system)
        if system is None:
            system = systems[frame.system] = _System(frame.system, wall_s)
        system.add(wall_s, frame)
    results = tuple(systems[number].result() for number in sorted(systems))
    return Summary(
        path=clean(str(path), 500),
        frames=reader.frames,
        first_wall_s=min(system.first_wall_s for system in results),
        last_wall_s=max(system.last_wall_s for system in results),
        skipped_bytes=reader.skipped_bytes,
        truncated=reader.truncated,
        warnings=_warnings(reader),
        systems=results,
    )


def _warnings(reader: TlogReader) -> tuple[str, ...]:
    if not reader.skipped_bytes:
        return ()
    what = "ends inside a record" if reader.truncated else "is damaged"
    return (f"{clean(str(reader.path), 500)} {what}: {reader.skipped_bytes} byte(s) skipped, all else is here",)


class _System:
    """Collects what one system id sent."""

    def __init__(self, number: int, wall_s: float) -> None:
        self._number = number
        self._frames: Counter[int] = Counter()
        self._signed = 0
        self._components: set[int] = set()
        self._kind: Kind = "unknown"
        self._autopilot = self._vehicle_type = ""
        self._autopilot_component: int | None = None
        self._first_s = self._last_s = wall_s
        self._estimated, self._gps = ExtentCollector(), ExtentCollector()
        self._modes: list[ModeSpan] = []
        self._armed: list[ArmedSpan] = []
        self._texts: list[Text] = []
        self._texts_left_off = 0
        self._assembler = TextAssembler()
        self._handlers = {
            HEARTBEAT: self._heartbeat,
            GPS_RAW_INT: self._gps_position,
            GLOBAL_POSITION_INT: self._estimated_position,
            STATUSTEXT: self._status_text,
        }

    def add(self, wall_s: float, frame: Frame) -> None:
        """Take one frame of this system."""
        self._first_s = min(self._first_s, wall_s)
        self._last_s = max(self._last_s, wall_s)
        self._frames[frame.msgid] += 1
        self._signed += frame.signed
        self._components.add(frame.component)
        handler = self._handlers.get(frame.msgid)
        if handler is not None:
            message = decode(frame)
            if message is not None:
                handler(wall_s, message.component, message.fields)

    def _heartbeat(self, wall_s: float, component: int, fields: dict[str, Any]) -> None:
        """Take identity, mode and arming of the flight controller; of two, the first one counts."""
        autopilot, vehicle_type = fields["autopilot"], fields["type"]
        kind = _kind(autopilot, vehicle_type)
        # Companion computers and gimbals send heartbeats under the vehicle's system id, too.
        if self._kind == "vehicle" and component != self._autopilot_component:
            return
        if kind == "vehicle":
            self._autopilot_component = component
            self._autopilot = mavlink.autopilot_name(autopilot)
            self._note_mode(wall_s, mode_name(autopilot, vehicle_type, fields["custom_mode"]))
            self._note_armed(wall_s, bool(fields["base_mode"] & mavlink.FLAG_ARMED))
        elif self._kind == "station":
            return
        self._kind, self._vehicle_type = kind, mavlink.type_name(vehicle_type)

    def _note_mode(self, wall_s: float, mode: str) -> None:
        if not self._modes or self._modes[-1].mode != mode:
            self._modes.append(ModeSpan(wall_s, mode))

    def _note_armed(self, wall_s: float, is_armed: bool) -> None:
        last = self._armed[-1] if self._armed else None
        if last is not None and not last.ended:
            self._armed[-1] = ArmedSpan(last.from_wall_s, wall_s, not is_armed)
        elif is_armed:
            self._armed.append(ArmedSpan(wall_s, wall_s, False))

    def _estimated_position(self, wall_s: float, _component: int, fields: dict[str, Any]) -> None:
        lat_deg, lon_deg = fields["lat"] / 1e7, fields["lon"] / 1e7
        self._estimated.add(Place(wall_s, lat_deg, lon_deg, fields["alt"] / 1e3, fields["relative_alt"] / 1e3))

    def _gps_position(self, wall_s: float, _component: int, fields: dict[str, Any]) -> None:
        # Without a fix receivers repeat old or zero positions.
        if fields["fix_type"] >= FIX_3D:
            self._gps.add(Place(wall_s, fields["lat"] / 1e7, fields["lon"] / 1e7, fields["alt"] / 1e3))

    def _status_text(self, wall_s: float, _component: int, fields: dict[str, Any]) -> None:
        self._keep_expired(wall_s)
        whole = self._assembler.add(self._number, fields, wall_s)
        if whole is not None:
            self._keep_text(wall_s, fields["severity"], whole)

    def _keep_expired(self, wall_s: float) -> None:
        for _, severity, text in self._assembler.expired(wall_s):
            # A text whose last chunk never came is put where the log still was.
            self._keep_text(min(wall_s, self._last_s), severity, text)

    def _keep_text(self, wall_s: float, severity: int, text: str) -> None:
        if len(self._texts) < MAX_TEXTS:
            self._texts.append(Text(wall_s, severity, text.rstrip(TAB_PICTURE)))
        else:
            self._texts_left_off += 1

    def result(self) -> SystemSummary:
        """The summary of the frames so far."""
        self._keep_expired(float("inf"))
        return SystemSummary(
            system=self._number,
            kind=self._kind,
            autopilot=self._autopilot,
            vehicle_type=self._vehicle_type,
            components=tuple(sorted(self._components)),
            frames=self._frames.total(),
            signed_frames=self._signed,
            messages={dialect.label(msgid): count for msgid, count in self._frames.most_common()},
            first_wall_s=self._first_s,
            last_wall_s=self._last_s,
            extent=self._estimated.result() or self._gps.result(),
            modes=tuple(self._modes),
            armed=tuple(self._armed),
            texts=tuple(self._texts),
            texts_left_off=self._texts_left_off,
        )


def _kind(autopilot: int, vehicle_type: int) -> Kind:
    """The kind of system that sends such a heartbeat."""
    if vehicle_type == mavlink.TYPE_GCS:
        return "station"
    if autopilot == mavlink.AUTOPILOT_INVALID or vehicle_type in mavlink.NOT_VEHICLES:
        return "component"
    return "vehicle"
