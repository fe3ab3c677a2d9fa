"""How PX4 takes, keeps and gives back missions, fences and rally points.

One transfer at a time, into storage that is not in use: an upload that fails changes nothing. An accepted plan is
judged afterwards (`plan_px4_checks`), and only events say what is wrong with it. Numbers are those of PX4 1.17.
"""

import math
from typing import TYPE_CHECKING

from sitl.common import missions
from sitl.common.missions import ALL, FENCE, KINDS, MISSION, RALLY, Item, Transfer
from sitl.common.parameters import crc32
from sitl.common.states import Severity
from sitl.common.tasks import Task
from sitl.links.wire import Received
from sitl.px4.mission_checks import judge_fence, judge_mission, judge_rally
from sitl.px4.mission_items import identity, kept, read_frame

if TYPE_CHECKING:
    from sitl.px4.multicopter import Px4

MAX_ITEMS = {MISSION: 10_000, FENCE: 64, RALLY: 32}
ASK_AGAIN_US = 260_000
GIVE_UP_US = 5_000_000
JUDGE_AFTER_US = 50_000
"""The navigator looks at a new plan after it was acknowledged."""

NO_MISSION = 65535
"""MISSION_CURRENT.total when there is none."""
REFUSED, NOT_STARTED = 1, 2
"""mission_state: none (or none that may be flown), not started."""

LEVEL_ERROR, LEVEL_WARNING = 0x33, 0x44
"""Log levels of events: in the vehicle's log and for others."""

_TRANSFER = "mission transfer"


def count(ap: "Px4", frame: Received) -> None:
    """MISSION_COUNT: an upload begins, unless anything else is under way."""
    kind, number = frame.fields["mission_type"], frame.fields["count"]
    transfer = _transfer(ap)
    if transfer is not None:
        _count_when_busy(ap, frame, transfer)
    elif number > MAX_ITEMS.get(kind, 0):
        _acknowledge(ap, frame, missions.NO_SPACE, kind)
    elif number == 0:
        if kind in KINDS:
            _replace(ap, kind, [], 0)
        _acknowledge(ap, frame, missions.ACCEPTED, kind)
    else:
        _begin(ap, Transfer(kind, frame.system, frame.component, 0, number, ap.now_us), sending=False)


def _count_when_busy(ap: "Px4", frame: Received, transfer: Transfer) -> None:
    kind = frame.fields["mission_type"]
    if ap.stores.sending:
        _critical(ap, "WPM: IGN MISSION_COUNT: Busy", "mavlink_mission_ignore_mis_count")
    elif transfer.is_with(frame.system, frame.component):
        if transfer.seq == 0:  # it seems our request was lost
            transfer.heard_us = ap.now_us
            ap.tasks.start(_TRANSFER, _ask(ap, transfer), ap.now_us)
            return
        _critical(ap, "WPM: REJ. CMD: Busy", "mavlink_mission_getlist_busy")
    _acknowledge(ap, frame, missions.ERROR, kind)


def item_int(ap: "Px4", frame: Received) -> None:
    """MISSION_ITEM_INT."""
    _take(ap, frame, missions.item_of(frame.fields))


def item(ap: "Px4", frame: Received) -> None:
    """MISSION_ITEM, the old one with its rough places."""
    if all(math.isfinite(frame.fields[name]) for name in ("x", "y")):
        _take(ap, frame, missions.item_of_floats(frame.fields))


def request_list(ap: "Px4", frame: Received) -> None:
    """MISSION_REQUEST_LIST: a download begins."""
    kind = frame.fields["mission_type"]
    if kind not in KINDS:
        return
    transfer = _transfer(ap)
    ours = transfer is not None and ap.stores.sending and transfer.is_with(frame.system, frame.component)
    if transfer is not None and not (ours and (transfer.kind == kind or transfer.seq >= transfer.end)):
        text = "Mission download request ignored, already active"
        ap.tell(text, "mavlink_mission_req_ignored", levels=LEVEL_WARNING)
        return
    number = len(ap.plans.of(kind))
    _begin(ap, Transfer(kind, frame.system, frame.component, 0, number, ap.now_us), sending=True)
    ap.send(
        "MISSION_COUNT",
        target_system=frame.system,
        target_component=frame.component,
        count=number,
        mission_type=kind,
        opaque_id=ap.plans.ids[kind],
    )


def request_int(ap: "Px4", frame: Received) -> None:
    """MISSION_REQUEST_INT: the next item, or the last one again."""
    asked = _asked_for(ap, frame)
    if asked is not None:
        fields = {**asked.fields(frame.fields["seq"]), "frame": read_frame(asked, whole=True)}
        ap.send("MISSION_ITEM_INT", **fields, **_addressed(frame))


def request(ap: "Px4", frame: Received) -> None:
    """MISSION_REQUEST, the old one: rough places, frames without _INT."""
    asked = _asked_for(ap, frame)
    if asked is not None:
        fields = {**missions.float_fields(asked, frame.fields["seq"]), "frame": read_frame(asked, whole=False)}
        ap.send("MISSION_ITEM", **fields, **_addressed(frame))


def acknowledged(ap: "Px4", frame: Received) -> None:
    """MISSION_ACK: ends a download; ends an upload only if it says CANCELLED."""
    transfer = _transfer(ap)
    if transfer is None or not transfer.is_with(frame.system, frame.component):
        return
    sent = ap.stores.sending and transfer.kind == frame.fields["mission_type"]
    if sent or (not ap.stores.sending and frame.fields["type"] == missions.CANCELLED):
        _end(ap)


def clear_all(ap: "Px4", frame: Received) -> None:
    """MISSION_CLEAR_ALL: 255 clears all three. Not while a transfer is under way: no acknowledgement then."""
    kind = frame.fields["mission_type"]
    if _transfer(ap) is not None:
        _critical(ap, "WPM: IGN CLEAR CMD: Busy", "mavlink_mission_ignore_clear")
        return
    for each in KINDS if kind == ALL else (kind,):
        if each in KINDS:
            _replace(ap, each, [], 0)
    _acknowledge(ap, frame, missions.ACCEPTED, kind)


def set_current(ap: "Px4", frame: Received) -> None:
    """MISSION_SET_CURRENT: the only way; DO_SET_MISSION_CURRENT is unsupported."""
    seq = frame.fields["seq"]
    if seq < len(ap.plans.mission):
        ap.plans.seq = seq
        ap.plans.changed(MISSION)
    else:
        _critical(ap, "WPM: WP CURR CMD: Not in list", "mavlink_mission_seq_out_of_bounds")


# The transfer


def _transfer(ap: "Px4") -> Transfer | None:
    return ap.stores.transfer


def _begin(ap: "Px4", transfer: Transfer, *, sending: bool) -> None:
    ap.stores.transfer, ap.stores.sending = transfer, sending
    ap.tasks.start(_TRANSFER, _wait(ap, transfer) if sending else _ask(ap, transfer), ap.now_us)


def _end(ap: "Px4") -> None:
    ap.stores.transfer = None
    ap.tasks.stop(_TRANSFER)


def _ask(ap: "Px4", transfer: Transfer) -> Task:
    """Ask for the item, again every 0.26 s; after 5 s without an answer it is forgotten without a word."""
    while ap.now_us - transfer.heard_us < GIVE_UP_US:
        ap.send(
            "MISSION_REQUEST_INT",
            target_system=transfer.system,
            target_component=transfer.component,
            seq=transfer.seq,
            mission_type=transfer.kind,
        )
        yield ASK_AGAIN_US
    ap.stores.transfer = None


def _wait(ap: "Px4", transfer: Transfer) -> Task:
    """A download ends when nothing was asked for 5 s."""
    while ap.now_us - transfer.heard_us < GIVE_UP_US:
        yield GIVE_UP_US - (ap.now_us - transfer.heard_us)
    ap.stores.transfer = None


def _asked_for(ap: "Px4", frame: Received) -> Item | None:
    """The item, if it is asked for in turn; anything else ends the download."""
    transfer, seq = _transfer(ap), frame.fields["seq"]
    if transfer is None or not transfer.is_with(frame.system, frame.component):
        return None
    if not ap.stores.sending:
        _critical(ap, "WPM: REJ. CMD: Busy", "mavlink_mission_getlist_busy")
        return None
    if transfer.kind != frame.fields["mission_type"]:
        return None
    transfer.heard_us = ap.now_us
    items = ap.plans.of(transfer.kind)
    if seq == transfer.seq and seq < min(transfer.end, len(items)):
        transfer.seq += 1
    elif seq != transfer.seq - 1:
        _end(ap)
        _acknowledge(ap, frame, missions.ERROR, transfer.kind)
        _critical(ap, "WPM: REJ. CMD: Req. WP was unexpected", "mavlink_mission_wp_unexpected")
        return None
    found: Item = items[seq]
    return found


def _take(ap: "Px4", frame: Received, new: Item) -> None:
    """An item of an upload; only the one that was asked for is looked at."""
    transfer, kind, seq = _transfer(ap), frame.fields["mission_type"], frame.fields["seq"]
    if transfer is None:
        _take_when_idle(ap, frame)
    elif not transfer.is_with(frame.system, frame.component):
        return
    elif ap.stores.sending:
        _critical(ap, "IGN MISSION_ITEM: Busy", "mavlink_mission_mis_item_busy")
        _acknowledge(ap, frame, missions.ERROR, kind)
    elif kind != transfer.kind:
        _acknowledge(ap, frame, missions.ERROR, transfer.kind)
    else:
        transfer.heard_us = ap.now_us
        if seq == transfer.seq:
            _store(ap, frame, transfer, new)


def _take_when_idle(ap: "Px4", frame: Received) -> None:
    """The last item once more: our acknowledgement was lost."""
    done = ap.stores.done
    if done is not None and done.is_with(frame.system, frame.component) and frame.fields["seq"] == done.end - 1:
        _acknowledge(ap, frame, missions.ACCEPTED, done.kind, done.crc)
        return
    _critical(ap, "IGN MISSION_ITEM: No transfer", "mavlink_mission_no_transfer")
    _acknowledge(ap, frame, missions.ERROR, frame.fields["mission_type"])


def _store(ap: "Px4", frame: Received, transfer: Transfer, new: Item) -> None:
    result, stored = kept(transfer.kind, new)
    if result != missions.ACCEPTED:
        _end(ap)
        if result != missions.ERROR:
            _critical(ap, "IGN MISSION_ITEM: Invalid item", "mavlink_mission_mis_item_invalid")
        _acknowledge(ap, frame, result, transfer.kind)
        return
    transfer.crc = crc32(identity(new), transfer.crc)
    transfer.items.append(stored)
    transfer.seq += 1
    if transfer.seq < transfer.end:
        ap.tasks.start(_TRANSFER, _ask(ap, transfer), ap.now_us)
        return
    _end(ap)
    ap.stores.done = transfer
    if transfer.crc != ap.plans.ids[transfer.kind]:
        _replace(ap, transfer.kind, transfer.items, transfer.crc)
    _acknowledge(ap, frame, missions.ACCEPTED, transfer.kind, transfer.crc)


def _replace(ap: "Px4", kind: int, items: list[Item], opaque_id: int) -> None:
    """Take a whole list; it is judged a moment later."""
    plans = ap.plans
    plans.put(kind, items)
    plans.ids[kind] = opaque_id
    if kind == MISSION:
        plans.feasible = False
        plans.seq = next((seq for seq, stored in enumerate(items) if stored.current), 0)
    judge = {MISSION: judge_mission, FENCE: judge_fence, RALLY: judge_rally}[kind]
    ap.tasks.after(f"judge {kind}", JUDGE_AFTER_US, lambda: judge(ap), ap.now_us)
    if kind == FENCE:  # the mission has to fit into it
        ap.tasks.after(f"judge {MISSION}", 2 * JUDGE_AFTER_US, lambda: judge_mission(ap), ap.now_us)
    plans.changed(kind)


def _addressed(frame: Received) -> dict[str, int]:
    return {
        "target_system": frame.system,
        "target_component": frame.component,
        "mission_type": frame.fields["mission_type"],
    }


def _acknowledge(ap: "Px4", frame: Received, result: int, kind: int, opaque_id: int = 0) -> None:
    ap.send(
        "MISSION_ACK",
        target_system=frame.system,
        target_component=frame.component,
        type=result,
        mission_type=kind,
        opaque_id=opaque_id,
    )


def _critical(ap: "Px4", text: str, event: str) -> None:
    ap.tell(text, event, severity=Severity.CRITICAL, levels=LEVEL_ERROR)


def mission_current(ap: "Px4") -> dict[str, int]:
    """Fields of MISSION_CURRENT on the ground: state 1 with a total says that the mission is refused."""
    plans = ap.plans
    return {
        "seq": plans.seq,
        "total": len(plans.mission) or NO_MISSION,
        "mission_state": NOT_STARTED if plans.feasible else REFUSED,
        "mission_id": plans.ids[MISSION],
        "fence_id": plans.ids[FENCE],
        "rally_points_id": plans.ids[RALLY],
    }
