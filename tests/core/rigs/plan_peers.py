"""Scripted vehicles that hold plans as ArduPilot and PX4 were measured to (facts), traps included.

`ArduPilotPeer(1)` and `Px4Peer(1)` are `Peer`s for a `ServiceRig`; `peer.stores[0]` is the mission on board, as dicts
of MISSION_ITEM_INT fields.
"""

import math
import struct
import zlib
from dataclasses import dataclass, field, replace
from typing import Any

from tests.core.rigs.service_rig import ARDUPILOT, GCS, PX4, Fields, Peer
from tui_gcs.core.plans.model import Plan, PlanItem, PlanKind

ACCEPTED, ERROR, NO_SPACE, WRONG_SEQUENCE, DENIED, CANCELLED = 0, 1, 4, 13, 14, 15
COMMANDS = frozenset({16, 17, 18, 19, 20, 21, 22, 31, 82, 93, 112, 177, 178, 206, *range(5000, 5005), 5100})
PARTS = ("frame", "command", "autocontinue", "param1", "param2", "param3", "param4", "x", "y", "z")
AUTO, PX4_MISSION, PX4_HOLD = 3, 4 << 16 | 4 << 24, 4 << 16 | 3 << 24


def waypoint(index: int, z: float = 20.0, **more: Any) -> PlanItem:
    """The `index`-th of many places near where peers stand."""
    spot = PlanItem(16, 3, (0.0, 0.0, 0.0, 0.0), 473_977_000 + 100 * (index % 97), 85_456_000 + 130 * index, z)
    return replace(spot, **more)


def mission(count: int, first: int = 0) -> Plan:
    """Take-off, way-points, return: `count` items."""
    take_off = PlanItem(22, 3, (0.0, 0.0, 0.0, math.nan), 473_977_000, 85_456_000, 15.0)
    back = PlanItem(20, 2)
    return Plan(PlanKind.MISSION, (take_off, *(waypoint(first + i) for i in range(count - 2)), back))


def square(half: int = 40_000, command: int = 5001, lat: int = 473_978_000, lon: int = 85_456_000) -> list[PlanItem]:
    """A fence polygon around a place; `half` its side in 1e-7 degrees."""
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return [PlanItem(command, 0, (4.0, 0.0, 0.0, 0.0), lat + half * a, lon + half * b) for a, b in corners]


def circle(radius_m: float, command: int = 5004) -> PlanItem:
    return PlanItem(command, 0, (radius_m, 0.0, 0.0, 0.0), 473_979_000, 85_457_000)


def fence(*items: PlanItem) -> Plan:
    return Plan(PlanKind.FENCE, tuple(items or square()))


def rally(*z: float) -> Plan:
    points = (PlanItem(5100, 3, x=473_977_000 + 100 * i, y=85_456_000, z=h) for i, h in enumerate(z))
    return Plan(PlanKind.RALLY, tuple(points))


def f32(value: float) -> float:
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


@dataclass
class PlanPeer(Peer):
    """What both have in common."""

    stores: list[list[Fields]] = field(default_factory=lambda: [[], [], []])
    current: int = 0
    state: int = 1
    kind: int = 0
    receiving: int = -1
    """How many items it expects; -1: none."""
    wanted: int = 0
    got_s: float = 0.0
    asked_s: float = 0.0
    reports: bool = True
    """Whether MISSION_CURRENT comes each second."""
    reported_s: float = -1.0
    deaf_to: set[int] = field(default_factory=set)
    """Items that never reach it."""
    chunked: int = 0
    loses_ack: int = 0
    """So many ACKs of it get lost."""

    def hear(self, name: str, fields: Fields) -> None:
        handler = getattr(self, f"on_{name.lower()}", None)
        self.heard.append((self.now, name, fields))
        if name in self.answers:
            self.answers[name](self, fields)
        elif handler is not None:
            handler(fields)
        elif name == "COMMAND_LONG" and fields["command"] in (511, 512):
            self.ack(fields["command"])

    def verdict(self, kind: int, result: int, opaque_id: int = 0) -> None:
        if self.loses_ack:
            self.loses_ack -= 1
        else:
            self.say_to_us("MISSION_ACK", type=result, mission_type=kind, opaque_id=opaque_id)

    def text(self, text: str, severity: int = 4) -> None:
        self.chunked += len(text) > 50
        for number, at in enumerate(range(0, len(text), 50)):
            more = {"id": self.chunked, "chunk_seq": number} if len(text) > 50 else {}
            self.say("STATUSTEXT", severity=severity, text=text[at : at + 50], **more)

    def tick(self, now: float) -> None:
        super().tick(now)
        if self.reports and now - self.reported_s >= 1.0:
            self.reported_s = now
            self.report()
        if self.receiving >= 0:
            self.wait(now)

    def report(self) -> None:
        raise NotImplementedError

    def wait(self, now: float) -> None:
        raise NotImplementedError


@dataclass
class ArduPilotPeer(PlanPeer):
    """Item by item, home as item 0, the old question once a second, 8 s of patience."""

    autopilot: int = ARDUPILOT
    most: int = 650

    def on_mission_count(self, fields: Fields) -> None:
        kind, count = fields["mission_type"], fields["count"]
        if count > self.most:
            self.verdict(kind, NO_SPACE)
            self.text(f"Only {self.most} items are supported")
            return
        self.kind, self.receiving, self.wanted, self.got_s = kind, count, 0, self.now
        self.fresh: list[Fields] = []
        if kind == 0:
            del self.stores[0][count:]
        if count == 0:
            self.complete()
        else:
            self.request()

    def request(self) -> None:
        self.asked_s = self.now
        self.say_to_us("MISSION_REQUEST", seq=self.wanted, mission_type=self.kind)

    def wait(self, now: float) -> None:
        if now - self.got_s > 8.0:
            self.receiving = -1
            self.verdict(self.kind, CANCELLED)
            self.text("Mission upload timeout")
        elif now - self.asked_s >= 1.0:
            self.request()

    def on_mission_item_int(self, fields: Fields) -> None:
        kind, seq = fields["mission_type"], fields["seq"]
        if seq in self.deaf_to:
            return
        if self.receiving < 0:
            self.verdict(kind, ERROR)
        elif seq != self.wanted:
            self.verdict(kind, WRONG_SEQUENCE)
        elif result := self.wrong(fields):
            self.receiving = -1
            self.verdict(kind, result)
        else:
            self.take(kind, seq, fields)

    def wrong(self, fields: Fields) -> int:
        if fields["command"] not in COMMANDS:
            return 3
        if fields["frame"] not in (0, 2, 3, 5, 6, 10, 11):
            return 2
        return 10 if abs(fields["x"]) > 900_000_000 else 0

    def take(self, kind: int, seq: int, fields: Fields) -> None:
        store = self.stores[kind] if kind == 0 else self.fresh
        store[seq : seq + 1] = [self.kept(kind, seq, fields)]
        self.wanted, self.got_s = seq + 1, self.now
        if self.wanted == self.receiving:
            self.complete()
        else:
            self.request()

    def complete(self) -> None:
        self.receiving = -1
        if self.kind == 1 and any(f["param1"] != 4 for f in self.fresh if f["command"] == 5001):
            self.text("Fence validation failed")
            self.verdict(1, ERROR)
            return
        if self.kind:
            self.stores[self.kind] = self.fresh
        self.verdict(self.kind, ACCEPTED)

    def kept(self, kind: int, seq: int, fields: Fields) -> Fields:
        made = {part: fields[part] for part in PARTS}
        place = fields["command"] in (16, 17, 18, 19, 21, 22, 31, 82, 5100)
        made["frame"] = {5: 0, 6: 3, 2: 0}.get(made["frame"], made["frame"]) if place else 0
        made["autocontinue"] = int(kind == 0)
        made["z"] = f32(int(f32(made["z"]) * 100) / 100) if place else 0.0
        if fields["command"] in (16, 22, 82):
            made |= {"param1": float(int(made["param1"])), "param2": 0.0, "param3": 0.0, "param4": 0.0}
        if kind == 2:
            made |= {"z": float(int(made["z"])), "param4": 0.0}
        if kind == 0 and seq == 0:
            made |= {"frame": 0, "command": 16, "x": -353_632_610, "y": 1_491_652_299, "z": 584.09}
        return made

    def on_mission_request_list(self, fields: Fields) -> None:
        kind = fields["mission_type"]
        if self.receiving >= 0:
            self.verdict(kind, DENIED)
        else:
            self.say_to_us("MISSION_COUNT", count=len(self.stores[kind]), mission_type=kind)

    def on_mission_request_int(self, fields: Fields) -> None:
        kind, seq = fields["mission_type"], fields["seq"]
        if self.receiving >= 0:
            self.verdict(kind, DENIED)
        elif seq >= len(self.stores[kind]):
            self.verdict(kind, ERROR)
        else:
            item = self.stores[kind][seq]
            self.say_to_us("MISSION_ITEM_INT", **item, seq=seq, current=0, mission_type=kind)

    def on_mission_clear_all(self, fields: Fields) -> None:
        kind = fields["mission_type"]
        if kind > 2:
            self.verdict(kind, 3)
        elif kind == 0 and self.armed and self.custom_mode == AUTO:
            self.verdict(0, ERROR)
        else:
            self.stores[kind].clear()
            self.verdict(kind, ACCEPTED)

    def on_command_long(self, fields: Fields) -> None:
        if fields["command"] != 224:
            self.ack(fields["command"])
        elif fields["param1"] >= len(self.stores[0]):
            self.ack(224, 2)
        else:
            self.current = max(1, int(fields["param1"]))
            self.ack(224)
            self.report()

    def report(self) -> None:
        total = max(0, len(self.stores[0]) - 1)
        flies = self.armed and self.custom_mode == AUTO
        state = 1 if not total else 3 if flies else 2
        self.say("MISSION_CURRENT", seq=self.current, total=total, mission_state=state, mission_mode=int(flies))


@dataclass
class Px4Peer(PlanPeer):
    """All or nothing, numbers for plans, strict order, 250 ms and 5 s, a verdict after the ACK."""

    autopilot: int = PX4
    custom_mode: int = PX4_HOLD
    ids: list[int] = field(default_factory=lambda: [0, 0, 0])
    sending: int = -1
    """The kind that is being read, -1: none."""
    expected: int = 0
    flyable: bool = True
    tells_state: bool = True
    """Since 1.17 MISSION_CURRENT says whether the mission can be flown."""
    events: int = 0
    busy_till_s: float = 0.0
    last_s: float = 0.0

    def on_mission_count(self, fields: Fields) -> None:
        kind, count = fields["mission_type"], fields["count"]
        if self.sending >= 0 or self.now < self.busy_till_s or (self.receiving >= 0 and self.wanted):
            self.verdict(kind, ERROR)
            self.text("WPM: IGN MISSION_COUNT: Busy\t", 2)
            return
        if count > (10_000, 64, 32)[kind]:
            self.verdict(kind, NO_SPACE)
            return
        self.kind, self.receiving, self.wanted, self.got_s = kind, count, 0, self.now
        self.fresh: list[Fields] = []
        self.crc = 0
        self.request()

    def request(self) -> None:
        self.asked_s = self.now
        self.say_to_us("MISSION_REQUEST_INT", seq=self.wanted, mission_type=self.kind)

    def wait(self, now: float) -> None:
        if now - self.got_s > 5.0:
            self.receiving = -1
        elif now - self.asked_s >= 0.25:
            self.request()

    def on_mission_item_int(self, fields: Fields) -> None:
        kind, seq = fields["mission_type"], fields["seq"]
        if seq in self.deaf_to:
            return
        if self.receiving < 0:
            again = seq + 1 == self.wanted and self.ids[kind]
            self.verdict(kind, ACCEPTED if again else ERROR, self.ids[kind] if again else 0)
        elif seq == self.wanted:
            self.take(kind, seq, fields)

    def take(self, kind: int, seq: int, fields: Fields) -> None:
        self.got_s = self.now
        place = fields["frame"] != 2
        if (
            fields["command"] not in COMMANDS
            or fields["frame"] not in (0, 2, 3, 5, 6)
            or place == (fields["command"] in (20, 93, 112, 177, 178, 206))
        ):
            self.receiving = -1
            self.verdict(kind, 3)
            return
        self.fresh.append(self.kept(kind, fields))
        packed = struct.pack("<BHB4fiif", *(fields[part] for part in PARTS))
        self.crc = zlib.crc32(packed, self.crc)
        self.wanted = seq + 1
        if self.wanted < self.receiving:
            self.request()
            return
        known = self.ids[kind] == self.crc
        self.receiving, self.stores[kind], self.ids[kind] = -1, self.fresh, self.crc
        self.verdict(kind, ACCEPTED, self.crc)
        if not known:
            self.judge(kind)

    def judge(self, kind: int) -> None:
        if kind == 1 and any(f["command"] == 5001 and abs(f["x"] - 473_977_000) > 1_000_000 for f in self.fresh):
            self.text("Geofence invalid, doesn't contain Home position\t", 2)
        if kind == 0:
            self.state = 0
            self.after(0.2, self.think)

    def think(self) -> None:
        if self.tells_state:
            self.state = 2 if self.flyable else 1
        elif not self.flyable:
            self.events += 1
            self.say(
                "EVENT",
                id=0x1FE4222,
                event_time_boot_ms=0,
                sequence=self.events,
                log_levels=0x33,
                arguments=[0] * 40,
                destination_component=0,
                destination_system=0,
            )

    def kept(self, kind: int, fields: Fields) -> Fields:
        made = {part: fields[part] for part in PARTS}
        if fields["frame"] == 2:
            return made
        made["frame"] = {0: 5, 3: 6}.get(fields["frame"], fields["frame"]) if kind != 1 else 5
        made["autocontinue"] = fields["autocontinue"] if kind == 0 else 0
        made["x"], made["y"] = round(made["x"] * 1e-7 * 1e7), round(made["y"] * 1e-7 * 1e7)
        made["param3"] = 0.0
        yaw = made["param4"]
        made["param4"] = math.degrees(f32(math.radians(yaw) % (2 * math.pi))) if kind == 0 else 0.0
        if fields["command"] == 22:
            made |= {"param1": 0.0, "param2": 0.0}
        return made

    def on_mission_request_list(self, fields: Fields) -> None:
        kind = fields["mission_type"]
        if self.receiving >= 0 or (self.sending >= 0 and self.sending != kind):
            self.text("Mission download request ignored, already active\t", 6)
            return
        self.sending, self.expected, self.last_s = kind, 0, self.now
        count = len(self.stores[kind])
        self.say_to_us("MISSION_COUNT", count=count, mission_type=kind, opaque_id=self.ids[kind])

    def on_mission_request_int(self, fields: Fields) -> None:
        seq = fields["seq"]
        if self.sending < 0:
            return
        self.last_s = self.now
        if seq == self.expected and seq < len(self.stores[self.sending]):
            self.expected += 1
        elif seq != self.expected - 1:
            kind, self.sending = self.sending, -1
            self.verdict(kind, ERROR)
            return
        item = self.stores[self.sending][seq]
        self.say_to_us("MISSION_ITEM_INT", **item, seq=seq, current=0, mission_type=self.sending)

    def on_mission_ack(self, fields: Fields) -> None:
        if fields["target_system"] == self.system:
            self.sending = -1
            if fields["type"] == CANCELLED:
                self.receiving = -1

    def on_mission_clear_all(self, fields: Fields) -> None:
        if self.sending < 0 and self.receiving < 0:
            for kind in range(3) if fields["mission_type"] == 255 else (fields["mission_type"],):
                self.stores[kind], self.ids[kind] = [], 0
            self.verdict(fields["mission_type"], ACCEPTED)

    def on_mission_set_current(self, fields: Fields) -> None:
        if fields["seq"] < len(self.stores[0]):
            self.current = fields["seq"]

    def on_command_long(self, fields: Fields) -> None:
        self.ack(fields["command"], 3 if fields["command"] == 224 else 0)

    def tick(self, now: float) -> None:
        if self.sending >= 0 and now - self.last_s > 5.0:
            self.sending = -1
        super().tick(now)

    def report(self) -> None:
        total = len(self.stores[0])
        ids = {"mission_id": self.ids[0], "fence_id": self.ids[1], "rally_points_id": self.ids[2]}
        state = (self.state if total else 1) * self.tells_state
        self.say("MISSION_CURRENT", seq=self.current, total=total or 65535, mission_state=state, mission_mode=2, **ids)


__all__ = ["GCS", "ArduPilotPeer", "PlanPeer", "Px4Peer"]
