"""How ArduCopter takes, stores and gives back missions, fences and rally points.

It requests items with the old MISSION_REQUEST and stores a mission item by item: a failed upload undoes nothing. It
gives back what its 15 bytes per item can hold (`mission_items`). Numbers and texts are those of ArduCopter 4.7
(docs/autopilots.md "Missions, fence, rally of ArduCopter").
"""

import math
from collections.abc import Callable

from sitl.ardupilot.mission_items import INCOMPLETE, STORED, fence_problem
from sitl.common import missions
from sitl.common.autopilot import Handler
from sitl.common.missions import FENCE, KINDS, MISSION, RALLY, Item, Transfer
from sitl.common.platform import Platform
from sitl.common.states import MavSeverity
from sitl.common.tasks import Task
from sitl.links.wire import ReceivedFrame
from sitl.services.mission_protocol import MissionServer

MAX_ITEMS = {MISSION: 650, FENCE: 70, RALLY: 46}
"""Capacity of 16 KiB of storage: 650 is measured, the others follow from 8 and 15 bytes per item."""
# It asks for a missing item each second, and gives up after 8 s with OPERATION_CANCELLED (measured).
ASK_AGAIN_US = 1_000_000
GIVE_UP_US = 8_000_000

GUIDED_ITEM = 2
"""`current` of an item that is flown to at once, and not stored."""
_UPLOAD = "mission upload"
_NAMES = {MISSION: "Mission", FENCE: "Fence", RALLY: "Rally"}
_TOTALS = {MISSION: "MIS_TOTAL", FENCE: "FENCE_TOTAL", RALLY: "RALLY_TOTAL"}


class ArduPilotMissions(MissionServer):
    """The mission protocol of one vehicle: one upload per kind of plan at a time."""

    def __init__(self, platform: Platform, fly_to: Callable[[Item], bool]) -> None:
        """`fly_to` takes a guided way-point, and returns whether it is flown to."""
        super().__init__(platform)
        self._fly_to = fly_to
        self._uploads: dict[int, Transfer] = {}
        self._complaints: set[str] = set()
        """Complaints since the last upload began; each is sent once."""

    def handlers(self) -> dict[str, Handler]:
        """Return the handlers of this service."""
        return {**super().handlers(), "MISSION_WRITE_PARTIAL_LIST": self._write_partial}

    def _count(self, frame: ReceivedFrame) -> None:
        """Begin an upload; the old list is cut to the new length at once."""
        number, kind = frame.fields["count"], frame.fields["mission_type"]
        if not self._end_upload(frame, kind):
            return
        if number > MAX_ITEMS[kind]:
            self._acknowledge(frame, missions.NO_SPACE, kind)
            self._outbox.text(MavSeverity.WARNING, f"Only {MAX_ITEMS[kind]} items are supported")
            return
        if kind != FENCE:
            # Nothing is kept for a failed upload: the vehicle then holds the part that was sent, and the old rest is
            # gone.
            del self._plans.of(kind)[number:]
            self._note_change(kind)
        self._begin(frame, kind, 0, number, [])

    def _write_partial(self, frame: ReceivedFrame) -> None:
        """Begin to replace some items."""
        f, kind = frame.fields, frame.fields["mission_type"]
        if not self._may_read(frame):
            return
        if not 0 <= f["start_index"] <= f["end_index"] <= len(self._plans.of(kind)):
            self._outbox.text(MavSeverity.WARNING, "Flight plan update rejected")
            self._acknowledge(frame, missions.ERROR, kind)
        else:
            self._begin(frame, kind, f["start_index"], f["end_index"] + 1, list(self._plans.fence))

    def _item(self, frame: ReceivedFrame) -> None:
        """Take an old MISSION_ITEM with its rough place, and complain."""
        if not all(math.isfinite(frame.fields[name]) for name in ("x", "y")):
            self._acknowledge(frame, missions.INVALID_X, frame.fields["mission_type"])
            return
        self._complain("got MISSION_ITEM; GCS should send MISSION_ITEM_INT")
        self._take(frame, missions.item_of_floats(frame.fields))

    def _request_list(self, frame: ReceivedFrame) -> None:
        if self._may_read(frame):
            self._send_count(frame, frame.fields["mission_type"])

    def _may_read(self, frame: ReceivedFrame) -> bool:
        """Return whether a kind of plan can be read or changed in part; False after a refusal."""
        kind = frame.fields["mission_type"]
        if kind not in KINDS:
            self._acknowledge(frame, missions.UNSUPPORTED, kind)
        elif kind in self._uploads:
            self._acknowledge(frame, missions.DENIED, kind)
        else:
            return True
        return False

    def _as_read(self, item: Item, *, whole: bool) -> Item:
        if not whole:
            self._complain("got MISSION_REQUEST; use MISSION_REQUEST_INT!")
        return item

    def _clear_all(self, frame: ReceivedFrame) -> None:
        """Clear one kind of plan, but not the mission that is flown."""
        kind = frame.fields["mission_type"]
        if not self._end_upload(frame, kind):
            return
        # The mission that is flown cannot be cleared.
        if kind == MISSION and self._plans.flying:
            self._acknowledge(frame, missions.ERROR, kind)
            return
        if kind == FENCE:
            self._outbox.text(MavSeverity.DEBUG, "Fence Indexed OK")
        self._replace(kind, [])
        self._acknowledge(frame, missions.ACCEPTED, kind)

    def _complain(self, text: str) -> None:
        if text not in self._complaints:
            self._complaints.add(text)
            self._outbox.text(MavSeverity.WARNING, text)

    def _send_count(self, frame: ReceivedFrame, kind: int) -> None:
        self._outbox.reply(frame, "MISSION_COUNT", count=len(self._plans.of(kind)), mission_type=kind)

    def _requested_item(self, frame: ReceivedFrame) -> Item | None:
        """Return the item that is requested; None after a refusal."""
        kind: int = frame.fields["mission_type"]
        seq: int = frame.fields["seq"]
        if not self._may_read(frame):
            return None
        # Item 0 is always the real home, whatever was uploaded.
        if kind == MISSION and seq == 0:
            return self.home_item()
        items = self._plans.of(kind)
        if seq < len(items):
            return items[seq]
        if kind == MISSION:
            self._send_count(frame, kind)
        beyond = kind == RALLY or (kind == FENCE and seq > len(items))
        self._acknowledge(frame, missions.INVALID_SEQUENCE if beyond else missions.ERROR, kind)
        return None

    def _end_upload(self, frame: ReceivedFrame, kind: int) -> bool:
        """End the upload of a kind of plan; False (and a refusal) if there is none such, or another station uploads."""
        if kind not in KINDS:
            self._acknowledge(frame, missions.UNSUPPORTED, kind)
            return False
        upload = self._uploads.get(kind)
        if upload is not None and not upload.is_with(frame.system, frame.component):
            self._acknowledge(frame, missions.DENIED, kind)
            return False
        self._forget(kind)
        return True

    def _forget(self, kind: int) -> None:
        self._uploads.pop(kind, None)
        self._tasks.stop(f"{_UPLOAD} {kind}")

    def _begin(self, frame: ReceivedFrame, kind: int, start: int, end: int, fence: list[Item]) -> None:
        """Request items `start` to `end` - 1. A fence is collected, beginning with `fence`, and judged as a whole."""
        now_us = self._clock.now_us
        upload = Transfer(kind, frame.system, frame.component, start, end, now_us, items=fence)
        self._uploads[kind] = upload
        self._complaints.clear()
        if start >= end:
            self._complete(frame, upload)
        else:
            self._tasks.start(f"{_UPLOAD} {kind}", self._ask(upload), now_us)

    def _ask(self, upload: Transfer) -> Task:
        """Request the item, again each second, until nothing has come for 8 s."""
        while True:
            self._outbox.reply(upload, "MISSION_REQUEST", seq=upload.seq, mission_type=upload.kind)
            yield min(ASK_AGAIN_US, max(upload.last_heard_us + GIVE_UP_US - self._clock.now_us, 1))
            if self._clock.now_us - upload.last_heard_us >= GIVE_UP_US:
                break
        self._uploads.pop(upload.kind, None)
        self._outbox.text(MavSeverity.WARNING, f"{_NAMES[upload.kind]} upload timeout")
        self._outbox.reply(upload, "MISSION_ACK", type=missions.CANCELLED, mission_type=upload.kind)

    def _take(self, frame: ReceivedFrame, new: Item) -> None:
        kind = frame.fields["mission_type"]
        # DroneKit's simple_goto. It needs no upload (GCS_Common.cpp, handle_mission_item).
        if kind == MISSION and frame.fields["current"] == GUIDED_ITEM:
            flies = new.command == missions.WAYPOINT and self._fly_to(new)
            self._acknowledge(frame, missions.ACCEPTED if flies else missions.ERROR, kind)
            return
        upload = self._uploads.get(kind)
        if upload is None:
            self._acknowledge(frame, missions.UNSUPPORTED if kind not in KINDS else missions.ERROR, kind)
            return
        if frame.fields["seq"] != upload.seq:
            # The upload goes on: it still waits for the item that was requested.
            self._acknowledge(frame, missions.INVALID_SEQUENCE, kind)
            return
        if not upload.is_with(frame.system, frame.component):
            self._acknowledge(frame, missions.DENIED, kind)
            return
        result = self._store(upload, new)
        if result != missions.ACCEPTED:
            self._acknowledge(frame, result, kind)
            self._forget(kind)
            return
        upload.last_heard_us = self._clock.now_us
        upload.seq += 1
        if upload.seq >= upload.end:
            self._complete(frame, upload)
        else:
            self._tasks.start(f"{_UPLOAD} {kind}", self._ask(upload), self._clock.now_us)

    def _store(self, upload: Transfer, new: Item) -> int:
        """Store one item at once; nothing brings the old one back. Returns a MAV_MISSION_RESULT."""
        items = upload.items if upload.kind == FENCE else self._plans.of(upload.kind)
        if upload.kind == MISSION and new.command == missions.DO_JUMP and not 1 <= new.p1 < max(len(items), upload.end):
            return missions.ERROR
        result, kept = STORED[upload.kind](new)
        if result != missions.ACCEPTED:
            return result
        if upload.seq > len(items):
            return missions.ERROR
        items[upload.seq : upload.seq + 1] = [kept]
        if upload.kind != FENCE:
            self._note_change(upload.kind)
        return missions.ACCEPTED

    def _complete(self, frame: ReceivedFrame, upload: Transfer) -> None:
        result = missions.ACCEPTED
        if upload.kind == MISSION:
            self._outbox.text(MavSeverity.INFO, "Flight plan received")
        elif upload.kind == FENCE:
            result = missions.ACCEPTED if self._write_fence(upload.items) else missions.ERROR
        self._acknowledge(frame, result, upload.kind)
        self._forget(upload.kind)

    def _write_fence(self, items: list[Item]) -> bool:
        """Judge a fence as a whole and store it; False (and texts) keeps the old one."""
        problem = fence_problem(items)
        if problem:
            self._outbox.text(MavSeverity.INFO if problem == INCOMPLETE else MavSeverity.WARNING, problem)
            self._outbox.text(MavSeverity.WARNING, "Fence validation failed")
            return False
        self._outbox.text(MavSeverity.DEBUG, "Fence Indexed OK")
        self._replace(FENCE, items)
        return True

    def replace_all(self, kind: int, items: list[Item]) -> None:
        """Store the list of a file; missions and rally points end before the first bad item, a bad fence is dropped."""
        kept: list[Item] = []
        for new in items[: MAX_ITEMS[kind]]:
            result, stored = STORED[kind](new)
            if result != missions.ACCEPTED:
                break
            kept.append(stored)
        if kind != FENCE:
            self._replace(kind, kept)
        elif len(kept) == len(items):
            self._write_fence(kept)

    def _replace(self, kind: int, items: list[Item]) -> None:
        self._plans.put(kind, items)
        self._note_change(kind)

    def _note_change(self, kind: int) -> None:
        """Set the total of a list, which is a parameter, and pass the change on."""
        items = self._plans.of(kind)
        total = len(items)
        if kind == FENCE:
            points = sum(item.command in missions.POLYGONS | missions.CIRCLES for item in items)
            # FENCE_TOTAL counts as the old fence protocol did, not items.
            total = points + 2 if points >= 3 else 0
        self._params.set(_TOTALS[kind], total)
        self._plans.changed(kind)

    def home_item(self) -> Item:
        """Return item 0 of every mission: the real home, whatever was uploaded."""
        x_m, y_m, z_m = self._state.home_m
        lat_deg, lon_deg = self._body.to_geodetic(x_m, y_m)
        z = z_m + self._spec.ground_amsl_m
        return Item(missions.WAYPOINT, missions.FRAME_AMSL, x=round(lat_deg * 1e7), y=round(lon_deg * 1e7), z=z)
