"""The fleet: turns received frames into vehicle state. Knows nothing of missions or commands.

Every number from a vehicle is checked here once: what is not finite, not plausible or not from the bound
source address never reaches the rest of the station, and is counted in `Fleet.dropped`.
"""

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

from tui_gcs.core.clock import Clock
from tui_gcs.core.events import ALERT, ERROR, INFO, NOTICE, WARNING, EventLog
from tui_gcs.core.geo import LocalFrame
from tui_gcs.core.links import Address
from tui_gcs.core.messages import EventClass, Freshness
from tui_gcs.core.services.text import TextAssembler
from tui_gcs.core.vehicle import LOST_S, Vehicle
from tui_gcs.core.wire.dialect import decode, message_name
from tui_gcs.core.wire.frames import Frame
from tui_gcs.core.wire.mavlink import AUTOPILOT_INVALID, FLAG_ARMED, NOT_VEHICLES

Fields = dict[str, Any]
OnMessage = Callable[[Vehicle, Fields], None]

NEVER_AUTOPILOT = frozenset({0, 190, 255})
"""Component ids that no flight controller has (security.md B.6-19)."""
MOST_VEHICLES = 255
"""MAVLink's own limit in one id space."""
MOST_SPEED_M_S = 150.0
"""Faster than this between two positions is a jump, not flight."""
CONSISTENT_FIXES = 3
"""After a jump this many consistent positions are needed (security.md B.6-100)."""
REBOOT_STEP_MS = 1000


class Fleet:
    """All vehicles heard on one network, by system id."""

    def __init__(self, clock: Clock, events: EventLog, frame: LocalFrame, own_system: int) -> None:
        """`frame` is the scenario's ENU frame; `own_system` is this station's id, never a vehicle's."""
        self.vehicles: dict[int, Vehicle] = {}
        self.dropped: Counter[str] = Counter()
        self.frame = frame
        self._clock = clock
        self._events = events
        self._own_system = own_system
        self._on_new: list[Callable[[Vehicle], None]] = []
        self._on_reboot: list[Callable[[Vehicle], None]] = []
        self._on_move: list[Callable[[Vehicle], None]] = []
        self._on_message: dict[str, list[OnMessage]] = {}
        self._lost: set[int] = set()
        self._texts = TextAssembler()
        self._handlers: dict[str, OnMessage] = {
            "HEARTBEAT": self._heartbeat,
            "GLOBAL_POSITION_INT": self._position,
            "GPS_RAW_INT": self._gps,
            "SYS_STATUS": self._sys_status,
            "BATTERY_STATUS": self._battery,
            "EXTENDED_SYS_STATE": self._extended_state,
            "STATUSTEXT": self._status_text,
            "AUTOPILOT_VERSION": self._version,
            "HOME_POSITION": self._home,
        }

    def in_order(self) -> list[Vehicle]:
        """All vehicles by id."""
        return [self.vehicles[i] for i in sorted(self.vehicles)]

    def on_new(self, listener: Callable[[Vehicle], None]) -> None:
        """Call `listener` for each vehicle heard for the first time."""
        self._on_new.append(listener)

    def on_reboot(self, listener: Callable[[Vehicle], None]) -> None:
        """Call `listener` when a vehicle's clock went back: its message intervals are gone."""
        self._on_reboot.append(listener)

    def on_move(self, listener: Callable[[Vehicle], None]) -> None:
        """Call `listener` when a system id is heard from another address than before: it may be somebody else."""
        self._on_move.append(listener)

    def on_message(self, name: str, listener: OnMessage) -> None:
        """Call `listener` for each message `name` of a known vehicle, after the fleet took it."""
        self._on_message.setdefault(name, []).append(listener)

    def receive(self, link: str, address: Address, frame: Frame) -> None:
        """Take one valid frame that came in on `link` from `address`."""
        if frame.system == 0:
            self.dropped["system id 0"] += 1
            return
        if frame.system == self._own_system:
            self.dropped["our own system id"] += 1
            text = f"another station uses our system id {self._own_system}: change one of them"
            self._events.say(EventClass.CONNECTION, "station", text, ERROR, every_s=30)
            return
        vehicle = self.vehicles.get(frame.system)
        if vehicle is None:
            vehicle = self._discover(link, address, frame)
            if vehicle is None:
                return
        if not self._is_bound_source(vehicle, link, address):
            return
        now = self._clock.now()
        vehicle.heard_s = now
        vehicle.count_sequence(frame.component, frame.seq)
        if frame.component != vehicle.component and message_name(frame.msgid) != "STATUSTEXT":
            return  # a camera or companion of this vehicle: counted as heard, not the autopilot's word
        message = decode(frame)
        if message is None:
            self.dropped["unknown message id"] += 1
            return
        vehicle.message_s[frame.msgid] = now
        handler = self._handlers.get(message.name)
        if handler is not None:
            handler(vehicle, message.fields)
        for listener in self._on_message.get(message.name, ()):
            listener(vehicle, message.fields)

    def tick(self) -> None:
        """Notice vehicles that fell silent or came back; finish chunked texts."""
        now = self._clock.now()
        for vehicle in self.vehicles.values():
            lost = vehicle.freshness(now) is Freshness.LOST
            if lost and vehicle.id not in self._lost:
                self._lost.add(vehicle.id)
                text = f"LOST: nothing heard for {LOST_S:.1f} s"
                self._events.say(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, ERROR)
            elif not lost and vehicle.id in self._lost:
                self._lost.discard(vehicle.id)
                self._events.say(EventClass.CONNECTION, f"vehicle {vehicle.id}", "heard again", NOTICE)
        for system, severity, text in self._texts.expired(now):
            self._tell_text(self.vehicles[system], severity, text)

    def reframe(self, frame: LocalFrame) -> None:
        """Use another ENU frame: positions are computed anew."""
        self.frame = frame
        for vehicle in self.vehicles.values():
            if vehicle.has_position():
                x, y = frame.to_enu(vehicle.lat_deg, vehicle.lon_deg)
                vehicle.position_m = (float(x), float(y), vehicle.alt_rel_m)

    def _discover(self, link: str, address: Address, frame: Frame) -> Vehicle | None:
        """A new vehicle if `frame` is a flight controller's heartbeat, else None (counted)."""
        message = decode(frame) if frame.msgid == 0 else None
        if message is None:
            self.dropped["before its first heartbeat"] += 1
            return None
        fields = message.fields
        if (
            fields["autopilot"] == AUTOPILOT_INVALID
            or fields["type"] in NOT_VEHICLES
            or frame.component in NEVER_AUTOPILOT
        ):
            self.dropped["not a vehicle"] += 1
            return None
        if len(self.vehicles) >= MOST_VEHICLES:
            self.dropped["vehicle table full"] += 1
            return None
        vehicle = Vehicle(frame.system, link, address, fields["autopilot"], fields["type"], frame.component)
        vehicle.heard_s = self._clock.now()
        self.vehicles[frame.system] = vehicle
        self._events.say(EventClass.CONNECTION, f"vehicle {vehicle.id}", f"heard on {link}", INFO)
        for listener in self._on_new:
            listener(vehicle)
        return vehicle

    def _is_bound_source(self, vehicle: Vehicle, link: str, address: Address) -> bool:
        """One vehicle speaks from one address; it may move to another once the old one is silent (B.6-24, 26)."""
        if (link, address) == (vehicle.link, vehicle.address):
            return True
        if self._clock.now() - vehicle.heard_s <= 3.0:
            self.dropped["second source of one system id"] += 1
            text = "a second source uses this system id: its frames are not used"
            self._events.say(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, ERROR, every_s=30)
            return False
        vehicle.link, vehicle.address = link, address
        vehicle.identified, vehicle.firmware_token = False, ""
        text = f"now heard from another address on {link}: who it is, is asked first"
        self._events.say(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, WARNING)
        for listener in self._on_move:
            listener(vehicle)
        return True

    # ---------------------------------------------------------------- messages

    def _heartbeat(self, vehicle: Vehicle, fields: Fields) -> None:
        vehicle.heartbeat_s = self._clock.now()
        vehicle.autopilot, vehicle.type = fields["autopilot"], fields["type"]
        vehicle.custom_mode = fields["custom_mode"]
        vehicle.armed = bool(fields["base_mode"] & FLAG_ARMED)
        vehicle.system_status = fields["system_status"]

    def _position(self, vehicle: Vehicle, fields: Fields) -> None:
        now = self._clock.now()
        boot_ms = fields["time_boot_ms"]
        if boot_ms + REBOOT_STEP_MS < vehicle.boot_ms:
            self._reboot(vehicle)
        vehicle.boot_ms = boot_ms
        lat_deg, lon_deg = fields["lat"] / 1e7, fields["lon"] / 1e7
        if (fields["lat"] == 0 and fields["lon"] == 0) or abs(lat_deg) > 90 or abs(lon_deg) > 180:
            self.dropped["invalid position"] += 1
            return
        x, y = self.frame.to_enu(lat_deg, lon_deg)
        place = (float(x), float(y), fields["relative_alt"] / 1e3)
        if self._is_jump(vehicle, place, now):
            self.dropped["implausible position"] += 1
            return
        vehicle.lat_deg, vehicle.lon_deg = lat_deg, lon_deg
        vehicle.alt_rel_m, vehicle.alt_amsl_m = place[2], fields["alt"] / 1e3
        vehicle.position_m = place
        vehicle.velocity_m_s = (fields["vy"] / 100, fields["vx"] / 100, -fields["vz"] / 100)
        if fields["hdg"] != 65535:
            vehicle.heading_deg = fields["hdg"] / 100
        vehicle.position_s = now

    def _is_jump(self, vehicle: Vehicle, place: tuple[float, float, float], now: float) -> bool:
        """Whether `place` is farther from the last position than flight allows, and not yet confirmed by others."""
        if not vehicle.has_position():
            return False
        reach_m = 50.0 + MOST_SPEED_M_S * max(0.0, now - vehicle.position_s)
        if math.dist(place, vehicle.position_m) <= reach_m:
            vehicle.suspect_jumps = 0
            return False
        consistent = vehicle.suspect_jumps > 0 and math.dist(place, vehicle.suspect_m) <= reach_m
        vehicle.suspect_jumps = vehicle.suspect_jumps + 1 if consistent else 1
        vehicle.suspect_m = place
        text = "position jumped: not used until confirmed"
        self._events.say(EventClass.SENSOR, f"vehicle {vehicle.id}", text, WARNING, every_s=10)
        return vehicle.suspect_jumps <= CONSISTENT_FIXES

    def _reboot(self, vehicle: Vehicle) -> None:
        vehicle.reboots += 1
        vehicle.identified = False
        vehicle.prearm_ok = False
        self._events.say(EventClass.PROCESSING, f"vehicle {vehicle.id}", "rebooted", WARNING)
        for listener in self._on_reboot:
            listener(vehicle)

    def _gps(self, vehicle: Vehicle, fields: Fields) -> None:
        vehicle.gps_fix = fields["fix_type"]
        vehicle.satellites = fields["satellites_visible"] if fields["satellites_visible"] != 255 else -1

    def _sys_status(self, vehicle: Vehicle, fields: Fields) -> None:
        prearm_check = 0x10000000  # MAV_SYS_STATUS_PREARM_CHECK
        vehicle.prearm_ok = bool(fields["onboard_control_sensors_health"] & prearm_check)
        if not vehicle.has_battery_status:
            vehicle.battery_pct = _percent(fields["battery_remaining"])
            vehicle.battery_v = _millivolt(fields["voltage_battery"])

    def _battery(self, vehicle: Vehicle, fields: Fields) -> None:
        if fields["id"] != 0:
            return
        vehicle.has_battery_status = True
        before, vehicle.battery_pct = vehicle.battery_pct, _percent(fields["battery_remaining"])
        for limit, severity in ((25.0, WARNING), (15.0, ALERT)):
            if vehicle.battery_pct < limit <= before:
                self._events.say(EventClass.SENSOR, f"vehicle {vehicle.id}", f"battery below {limit:.0f} %", severity)
        cells = [v for v in fields["voltages"] if v != 65535]
        vehicle.battery_v = sum(cells) / 1e3 if cells else math.nan

    def _extended_state(self, vehicle: Vehicle, fields: Fields) -> None:
        vehicle.landed_state = fields["landed_state"]

    def _version(self, vehicle: Vehicle, fields: Fields) -> None:
        vehicle.identified = True
        vehicle.firmware_token = bytes(fields["flight_custom_version"]).hex()

    def _home(self, vehicle: Vehicle, fields: Fields) -> None:
        if fields["latitude"] or fields["longitude"]:
            x, y = self.frame.to_enu(fields["latitude"] / 1e7, fields["longitude"] / 1e7)
            vehicle.home_m = (float(x), float(y), 0.0)

    def _status_text(self, vehicle: Vehicle, fields: Fields) -> None:
        whole = self._texts.add(vehicle.id, fields, self._clock.now())
        if whole is not None:
            self._tell_text(vehicle, fields["severity"], whole)

    def _tell_text(self, vehicle: Vehicle, severity: int, text: str) -> None:
        text = text.rstrip("\u2409 ")  # PX4 ends texts that also come as events in a TAB
        severity = severity if 0 <= severity <= 7 else NOTICE
        if severity <= WARNING:
            vehicle.recent_reasons = [*vehicle.recent_reasons[-19:], (self._clock.now(), text)]
        cls = EventClass.SENSOR if text.startswith(("PreArm", "Arm:", "EKF", "GPS")) else EventClass.VEHICLE
        self._events.say(cls, f"vehicle {vehicle.id}", text, severity, every_s=5)


def _percent(value: int) -> float:
    """BATTERY remaining 0…100; anything else is unknown."""
    return float(value) if 0 <= value <= 100 else math.nan


def _millivolt(value: int) -> float:
    return value / 1e3 if 0 < value < 65535 else math.nan
