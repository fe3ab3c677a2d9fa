"""How PX4 takes, stores and gives back missions, fences and rally points.

There is one transfer at a time, into storage that is not in use: an upload that fails changes nothing. An accepted plan
is judged afterwards (`mission_checks`), and only events report what is wrong with it. Numbers are those of PX4 1.17
(docs/autopilots.md "Mission / fence / rally of PX4").
"""

import math
from dataclasses import replace

from sitl.common import missions
from sitl.common.autopilot import Handler
from sitl.common.missions import ALL, FENCE, KINDS, MISSION, RALLY, Item, Transfer
from sitl.common.parameters import crc32
from sitl.common.platform import Platform
from sitl.common.tasks import Task
from sitl.links.wire import ReceivedFrame
from sitl.px4.announcer import Announcer
from sitl.px4.mission_checks import MissionChecks
from sitl.px4.mission_items import identity, kept, read_frame
from sitl.services.mission_protocol import MissionServer

# More are refused at once with NO_SPACE (docs/autopilots.md "Mission / fence / rally of PX4").
MAX_ITEMS = {MISSION: 10_000, FENCE: 64, RALLY: 32}
# It asks every 260 ms for 5 s, then gives up without a word (measured).
ASK_AGAIN_US = 260_000
GIVE_UP_US = 5_000_000
JUDGE_AFTER_US = 50_000
"""The navigator judges a new plan this long after it was acknowledged."""
LEVELS_ERROR, LEVELS_WARNING = 0x33, 0x44
"""Values of log_levels, the severity of an EVENT."""

_TRANSFER = "mission transfer"


class Px4Missions(MissionServer):
    """The mission protocol of one vehicle: one upload or download at a time."""

    def __init__(self, platform: Platform, announcer: Announcer) -> None:
        super().__init__(platform)
        self._announcer = announcer
        self._checks = MissionChecks(platform, announcer)
        self._transfer: Transfer | None = None
        """The transfer that is under way."""
        self._sending = False
        """Whether that transfer is a download."""
        self._done: Transfer | None = None
        """The last upload that was completed; its last item may come again."""

    def handlers(self) -> dict[str, Handler]:
        """Return the handlers of this service."""
        own = {"MISSION_ACK": self._acknowledged, "MISSION_SET_CURRENT": self._set_current}
        return {**super().handlers(), **own}

    def _count(self, frame: ReceivedFrame) -> None:
        """Begin an upload, unless another transfer is under way."""
        kind, number = frame.fields["mission_type"], frame.fields["count"]
        if self._transfer is not None:
            self._count_when_busy(frame, self._transfer)
        # An unknown type has room for no items.
        elif number > MAX_ITEMS.get(kind, 0):
            self._acknowledge(frame, missions.NO_SPACE, kind)
        elif number == 0:
            if kind in KINDS:
                self._replace(kind, [], 0)
            self._acknowledge(frame, missions.ACCEPTED, kind)
        else:
            upload = Transfer(kind, frame.system, frame.component, 0, number, self._clock.now_us)
            self._begin(upload, self._ask(upload), sending=False)

    def _count_when_busy(self, frame: ReceivedFrame, transfer: Transfer) -> None:
        kind = frame.fields["mission_type"]
        if self._sending:
            self._complain("WPM: IGN MISSION_COUNT: Busy", "mavlink_mission_ignore_mis_count")
        elif transfer.is_with(frame.system, frame.component):
            # The first request was probably lost.
            if transfer.seq == 0:
                transfer.last_heard_us = self._clock.now_us
                self._tasks.start(_TRANSFER, self._ask(transfer), self._clock.now_us)
                return
            self._complain("WPM: REJ. CMD: Busy", "mavlink_mission_getlist_busy")
        self._acknowledge(frame, missions.ERROR, kind)

    def _item(self, frame: ReceivedFrame) -> None:
        """Take an old MISSION_ITEM with its rough place."""
        if all(math.isfinite(frame.fields[name]) for name in ("x", "y")):
            self._take(frame, missions.item_of_floats(frame.fields))

    def _request_list(self, frame: ReceivedFrame) -> None:
        """Begin a download, unless another transfer is under way."""
        kind, transfer = frame.fields["mission_type"], self._transfer
        if kind not in KINDS:
            return
        ours = transfer is not None and self._sending and transfer.is_with(frame.system, frame.component)
        if transfer is not None and not (ours and (transfer.kind == kind or transfer.seq >= transfer.end)):
            text = "Mission download request ignored, already active"
            self._announcer.announce(text, "mavlink_mission_req_ignored", levels=LEVELS_WARNING)
            return
        number = len(self._plans.of(kind))
        download = Transfer(kind, frame.system, frame.component, 0, number, self._clock.now_us)
        self._begin(download, self._wait(download), sending=True)
        opaque_id = self._plans.ids[kind]
        self._outbox.reply(frame, "MISSION_COUNT", count=number, mission_type=kind, opaque_id=opaque_id)

    def _as_read(self, item: Item, *, whole: bool) -> Item:
        return replace(item, frame=read_frame(item, whole=whole))

    def _acknowledged(self, frame: ReceivedFrame) -> None:
        """End a download by MISSION_ACK; an upload is ended only by CANCELLED."""
        transfer = self._transfer
        if transfer is None or not transfer.is_with(frame.system, frame.component):
            return
        sent = self._sending and transfer.kind == frame.fields["mission_type"]
        if sent or (not self._sending and frame.fields["type"] == missions.CANCELLED):
            self._end()

    def _clear_all(self, frame: ReceivedFrame) -> None:
        """Clear one kind of plan, or all three by 255. During a transfer there is no acknowledgement."""
        kind = frame.fields["mission_type"]
        if self._transfer is not None:
            self._complain("WPM: IGN CLEAR CMD: Busy", "mavlink_mission_ignore_clear")
            return
        for each in KINDS if kind == ALL else (kind,):
            if each in KINDS:
                self._replace(each, [], 0)
        self._acknowledge(frame, missions.ACCEPTED, kind)

    def _set_current(self, frame: ReceivedFrame) -> None:
        """Choose the item of the mission: this is the only way, DO_SET_MISSION_CURRENT is unsupported."""
        seq = frame.fields["seq"]
        if seq < len(self._plans.mission):
            self._plans.seq = seq
            self._plans.changed(MISSION)
        else:
            self._complain("WPM: WP CURR CMD: Not in list", "mavlink_mission_seq_out_of_bounds")

    def _begin(self, transfer: Transfer, task: Task, *, sending: bool) -> None:
        self._transfer, self._sending = transfer, sending
        self._tasks.start(_TRANSFER, task, self._clock.now_us)

    def _end(self) -> None:
        self._transfer = None
        self._tasks.stop(_TRANSFER)

    def _ask(self, transfer: Transfer) -> Task:
        """Request the item, again every 0.26 s; after 5 s without an answer the upload ends silently."""
        while self._clock.now_us - transfer.last_heard_us < GIVE_UP_US:
            self._outbox.reply(transfer, "MISSION_REQUEST_INT", seq=transfer.seq, mission_type=transfer.kind)
            yield ASK_AGAIN_US
        self._transfer = None

    def _wait(self, transfer: Transfer) -> Task:
        """End a download after 5 s without a request."""
        while self._clock.now_us - transfer.last_heard_us < GIVE_UP_US:
            yield GIVE_UP_US - (self._clock.now_us - transfer.last_heard_us)
        self._transfer = None

    def _requested_item(self, frame: ReceivedFrame) -> Item | None:
        """Return the next item, or the last one again; any other request ends the download."""
        transfer, seq = self._transfer, frame.fields["seq"]
        if transfer is None or not transfer.is_with(frame.system, frame.component):
            return None
        if not self._sending:
            self._complain("WPM: REJ. CMD: Busy", "mavlink_mission_getlist_busy")
            return None
        if transfer.kind != frame.fields["mission_type"]:
            return None
        transfer.last_heard_us = self._clock.now_us
        items = self._plans.of(transfer.kind)
        if seq == transfer.seq and seq < min(transfer.end, len(items)):
            transfer.seq += 1
        elif seq != transfer.seq - 1:
            self._end()
            self._acknowledge(frame, missions.ERROR, transfer.kind)
            self._complain("WPM: REJ. CMD: Req. WP was unexpected", "mavlink_mission_wp_unexpected")
            return None
        found: Item = items[seq]
        return found

    def _take(self, frame: ReceivedFrame, new: Item) -> None:
        """Take an item of an upload; one that was not requested is ignored."""
        transfer, kind, seq = self._transfer, frame.fields["mission_type"], frame.fields["seq"]
        if transfer is None:
            self._take_when_idle(frame)
        elif not transfer.is_with(frame.system, frame.component):
            return
        elif self._sending:
            self._complain("IGN MISSION_ITEM: Busy", "mavlink_mission_mis_item_busy")
            self._acknowledge(frame, missions.ERROR, kind)
        # The refusal names the type of the transfer, not that of the item.
        elif kind != transfer.kind:
            self._acknowledge(frame, missions.ERROR, transfer.kind)
        else:
            transfer.last_heard_us = self._clock.now_us
            if seq == transfer.seq:
                self._store(frame, transfer, new)

    def _take_when_idle(self, frame: ReceivedFrame) -> None:
        """Acknowledge the last item of a completed upload again: the first acknowledgement was lost."""
        done = self._done
        if done is not None and done.is_with(frame.system, frame.component) and frame.fields["seq"] == done.end - 1:
            self._acknowledge(frame, missions.ACCEPTED, done.kind, done.crc)
            return
        self._complain("IGN MISSION_ITEM: No transfer", "mavlink_mission_no_transfer")
        self._acknowledge(frame, missions.ERROR, frame.fields["mission_type"])

    def _store(self, frame: ReceivedFrame, transfer: Transfer, new: Item) -> None:
        result, stored = kept(transfer.kind, new)
        if result != missions.ACCEPTED:
            self._end()
            if result != missions.ERROR:
                self._complain("IGN MISSION_ITEM: Invalid item", "mavlink_mission_mis_item_invalid")
            self._acknowledge(frame, result, transfer.kind)
            return
        transfer.crc = crc32(identity(new), transfer.crc)
        transfer.items.append(stored)
        transfer.seq += 1
        if transfer.seq < transfer.end:
            self._tasks.start(_TRANSFER, self._ask(transfer), self._clock.now_us)
            return
        self._end()
        self._done = transfer
        # The opaque id is a checksum over the items: the same plan again changes nothing, not even the current item.
        if transfer.crc != self._plans.ids[transfer.kind]:
            self._replace(transfer.kind, transfer.items, transfer.crc)
        self._acknowledge(frame, missions.ACCEPTED, transfer.kind, transfer.crc)

    def _replace(self, kind: int, items: list[Item], opaque_id: int) -> None:
        """Store a whole list; it is judged a moment later."""
        plans = self._plans
        plans.put(kind, items)
        plans.ids[kind] = opaque_id
        if kind == MISSION:
            plans.feasible = False
            plans.seq = next((seq for seq, stored in enumerate(items) if stored.current), 0)
        self._judge_after(kind, JUDGE_AFTER_US)
        # The mission has to fit into it.
        if kind == FENCE:
            self._judge_after(MISSION, 2 * JUDGE_AFTER_US)
        plans.changed(kind)

    def _judge_after(self, kind: int, wait_us: int) -> None:
        self._tasks.after(f"judge {kind}", wait_us, lambda: self._checks.judge(kind), self._clock.now_us)

    def _complain(self, text: str, event: str) -> None:
        self._announcer.alert(text, event, levels=LEVELS_ERROR)
