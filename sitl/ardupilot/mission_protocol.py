"""How ArduCopter takes, keeps and gives back missions, fences and rally points.

It asks with the old MISSION_REQUEST, stores item by item (nothing is undone when an upload fails), and what it
gives back is what its 15 bytes per item could hold (`plan_ardupilot_items`).
Numbers and texts are those of ArduCopter 4.7.
"""

import math

from sitl.ardupilot.mission_items import INCOMPLETE, STORED, fence_problem
from sitl.common import missions
from sitl.common.autopilot import Autopilot
from sitl.common.missions import FENCE, KINDS, MISSION, RALLY, Item, Transfer
from sitl.common.states import Severity
from sitl.common.tasks import Task
from sitl.links.wire import Received

MAX_ITEMS = {MISSION: 650, FENCE: 70, RALLY: 46}
"""What fits into 16 KiB of storage; 650 is measured, the others follow from 8 and 15 bytes per item."""
ASK_AGAIN_US = 1_000_000
GIVE_UP_US = 8_000_000

_UPLOAD = "mission upload"
_NAMES = {MISSION: "Mission", FENCE: "Fence", RALLY: "Rally"}
_TOTALS = {MISSION: "MIS_TOTAL", FENCE: "FENCE_TOTAL", RALLY: "RALLY_TOTAL"}


# Messages


def count(ap: Autopilot, frame: Received) -> None:
    """MISSION_COUNT: an upload begins. The old list is cut to the new length at once."""
    f, kind = frame.fields, frame.fields["mission_type"]
    if kind not in KINDS:
        _acknowledge(ap, frame, missions.UNSUPPORTED, kind)
        return
    if not _end_upload(ap, frame, kind):
        return
    if f["count"] > MAX_ITEMS[kind]:
        _acknowledge(ap, frame, missions.NO_SPACE, kind)
        ap.text(Severity.WARNING, f"Only {MAX_ITEMS[kind]} items are supported")
        return
    if kind != FENCE:
        del ap.plans.of(kind)[f["count"] :]
        _tell(ap, kind)
    _begin(ap, frame, kind, 0, f["count"], [])


def write_partial(ap: Autopilot, frame: Received) -> None:
    """MISSION_WRITE_PARTIAL_LIST: some items are replaced."""
    f, kind = frame.fields, frame.fields["mission_type"]
    if kind not in KINDS:
        _acknowledge(ap, frame, missions.UNSUPPORTED, kind)
    elif _upload(ap, kind) is not None:
        _acknowledge(ap, frame, missions.DENIED, kind)
    elif not 0 <= f["start_index"] <= f["end_index"] <= len(ap.plans.of(kind)):
        ap.text(Severity.WARNING, "Flight plan update rejected")
        _acknowledge(ap, frame, missions.ERROR, kind)
    else:
        _begin(ap, frame, kind, f["start_index"], f["end_index"] + 1, list(ap.plans.fence))


def item_int(ap: Autopilot, frame: Received) -> None:
    """MISSION_ITEM_INT."""
    _take(ap, frame, missions.item_of(frame.fields))


def item(ap: Autopilot, frame: Received) -> None:
    """MISSION_ITEM, the old one with its rough places: taken, and complained of."""
    if not all(math.isfinite(frame.fields[name]) for name in ("x", "y")):
        _acknowledge(ap, frame, missions.INVALID_X, frame.fields["mission_type"])
        return
    _complain(ap, "got MISSION_ITEM; GCS should send MISSION_ITEM_INT")
    _take(ap, frame, missions.item_of_floats(frame.fields))


def request_list(ap: Autopilot, frame: Received) -> None:
    """MISSION_REQUEST_LIST."""
    kind = frame.fields["mission_type"]
    if kind not in KINDS:
        _acknowledge(ap, frame, missions.UNSUPPORTED, kind)
    elif _upload(ap, kind) is not None:
        _acknowledge(ap, frame, missions.DENIED, kind)
    else:
        _send_count(ap, frame, kind)


def request_int(ap: Autopilot, frame: Received) -> None:
    """MISSION_REQUEST_INT: any item, in any order."""
    asked = _asked_for(ap, frame)
    if asked is not None:
        ap.send("MISSION_ITEM_INT", **asked.fields(frame.fields["seq"]), **_addressed(frame))


def request(ap: Autopilot, frame: Received) -> None:
    """MISSION_REQUEST, the old one: answered with rough places, and complained of."""
    asked = _asked_for(ap, frame)
    if asked is None:
        return
    _complain(ap, "got MISSION_REQUEST; use MISSION_REQUEST_INT!")
    ap.send("MISSION_ITEM", **missions.float_fields(asked, frame.fields["seq"]), **_addressed(frame))


def clear_all(ap: Autopilot, frame: Received) -> None:
    """MISSION_CLEAR_ALL: one kind at a time, and not the mission that is flown."""
    kind = frame.fields["mission_type"]
    if kind not in KINDS:
        _acknowledge(ap, frame, missions.UNSUPPORTED, kind)
        return
    if not _end_upload(ap, frame, kind):
        return
    if kind == MISSION and ap.plans.flying:
        _acknowledge(ap, frame, missions.ERROR, kind)
        return
    if kind == FENCE:
        ap.text(Severity.DEBUG, "Fence Indexed OK")
    _replace(ap, kind, [])
    _acknowledge(ap, frame, missions.ACCEPTED, kind)


def _complain(ap: Autopilot, text: str) -> None:
    """Once between two uploads."""
    if text not in ap.stores.complained:
        ap.stores.complained.add(text)
        ap.text(Severity.WARNING, text)


def _addressed(frame: Received) -> dict[str, int]:
    return {
        "target_system": frame.system,
        "target_component": frame.component,
        "mission_type": frame.fields["mission_type"],
    }


def _acknowledge(ap: Autopilot, frame: Received, result: int, kind: int) -> None:
    ap.send("MISSION_ACK", target_system=frame.system, target_component=frame.component, type=result, mission_type=kind)


def _send_count(ap: Autopilot, frame: Received, kind: int) -> None:
    ap.send("MISSION_COUNT", count=len(ap.plans.of(kind)), **_addressed(frame))


def _asked_for(ap: Autopilot, frame: Received) -> Item | None:
    """The item, or None and a refusal."""
    kind: int = frame.fields["mission_type"]
    seq: int = frame.fields["seq"]
    if kind not in KINDS:
        _acknowledge(ap, frame, missions.UNSUPPORTED, kind)
        return None
    if _upload(ap, kind) is not None:
        _acknowledge(ap, frame, missions.DENIED, kind)
        return None
    if kind == MISSION and seq == 0:
        return home_item(ap)
    items = ap.plans.of(kind)
    if seq < len(items):
        return items[seq]
    if kind == MISSION:
        _send_count(ap, frame, kind)
    beyond = kind == RALLY or (kind == FENCE and seq > len(items))
    _acknowledge(ap, frame, missions.INVALID_SEQUENCE if beyond else missions.ERROR, kind)
    return None


# An upload


def _upload(ap: Autopilot, kind: int) -> Transfer | None:
    return ap.stores.uploads.get(kind)


def _end_upload(ap: Autopilot, frame: Received, kind: int) -> bool:
    """End an upload of that kind; False (and a refusal) if it is somebody else's."""
    upload = _upload(ap, kind)
    if upload is not None and not upload.is_with(frame.system, frame.component):
        _acknowledge(ap, frame, missions.DENIED, kind)
        return False
    _forget(ap, kind)
    return True


def _forget(ap: Autopilot, kind: int) -> None:
    ap.stores.uploads.pop(kind, None)
    ap.tasks.stop(f"{_UPLOAD} {kind}")


def _begin(ap: Autopilot, frame: Received, kind: int, start: int, end: int, fence: list[Item]) -> None:
    """Ask for items `start` to `end` - 1. A fence is collected, beginning with `fence`, and judged as a whole."""
    upload = Transfer(kind, frame.system, frame.component, start, end, ap.now_us, items=fence)
    ap.stores.uploads[kind] = upload
    ap.stores.complained.clear()
    if start >= end:
        _complete(ap, frame, upload)
    else:
        ap.tasks.start(f"{_UPLOAD} {kind}", _ask(ap, upload), ap.now_us)


def _ask(ap: Autopilot, upload: Transfer) -> Task:
    """Ask, again each second, until nothing has come for 8 s."""
    while True:
        ap.send(
            "MISSION_REQUEST",
            target_system=upload.system,
            target_component=upload.component,
            seq=upload.seq,
            mission_type=upload.kind,
        )
        yield min(ASK_AGAIN_US, max(upload.heard_us + GIVE_UP_US - ap.now_us, 1))
        if ap.now_us - upload.heard_us >= GIVE_UP_US:
            break
    ap.stores.uploads.pop(upload.kind, None)
    ap.text(Severity.WARNING, f"{_NAMES[upload.kind]} upload timeout")
    ap.send(
        "MISSION_ACK",
        target_system=upload.system,
        target_component=upload.component,
        type=missions.CANCELLED,
        mission_type=upload.kind,
    )


def _take(ap: Autopilot, frame: Received, new: Item) -> None:
    kind = frame.fields["mission_type"]
    upload = _upload(ap, kind)
    if upload is None:
        _acknowledge(ap, frame, missions.UNSUPPORTED if kind not in KINDS else missions.ERROR, kind)
        return
    if frame.fields["seq"] != upload.seq:
        _acknowledge(ap, frame, missions.INVALID_SEQUENCE, kind)  # and goes on waiting for the right one
        return
    if not upload.is_with(frame.system, frame.component):
        _acknowledge(ap, frame, missions.DENIED, kind)
        return
    result = _put(ap, upload, new)
    if result != missions.ACCEPTED:
        _acknowledge(ap, frame, result, kind)
        _forget(ap, kind)
        return
    upload.heard_us = ap.now_us
    upload.seq += 1
    if upload.seq >= upload.end:
        _complete(ap, frame, upload)
    else:
        ap.tasks.start(f"{_UPLOAD} {kind}", _ask(ap, upload), ap.now_us)


def _put(ap: Autopilot, upload: Transfer, new: Item) -> int:
    """Store one item at once: there is no way back."""
    items = upload.items if upload.kind == FENCE else ap.plans.of(upload.kind)
    if upload.kind == MISSION and new.command == missions.DO_JUMP and not 1 <= new.p1 < max(len(items), upload.end):
        return missions.ERROR
    result, kept = STORED[upload.kind](new)
    if result != missions.ACCEPTED:
        return result
    if upload.seq > len(items):
        return missions.ERROR
    items[upload.seq : upload.seq + 1] = [kept]
    if upload.kind != FENCE:
        _tell(ap, upload.kind)
    return missions.ACCEPTED


def _complete(ap: Autopilot, frame: Received, upload: Transfer) -> None:
    result = missions.ACCEPTED
    if upload.kind == MISSION:
        ap.text(Severity.INFO, "Flight plan received")
    elif upload.kind == FENCE:
        result = missions.ACCEPTED if write_fence(ap, upload.items) else missions.ERROR
    _acknowledge(ap, frame, result, upload.kind)
    _forget(ap, upload.kind)


# What is kept


def write_fence(ap: Autopilot, items: list[Item]) -> bool:
    """Judge a fence as a whole and take it; False (with the texts) leaves the old one."""
    problem = fence_problem(items)
    if problem:
        ap.text(Severity.INFO if problem == INCOMPLETE else Severity.WARNING, problem)
        ap.text(Severity.WARNING, "Fence validation failed")
        return False
    ap.text(Severity.DEBUG, "Fence Indexed OK")
    _replace(ap, FENCE, items)
    return True


def replace_all(ap: Autopilot, kind: int, items: list[Item]) -> bool:
    """Take a list as it came in a file. A mission or rally points end before the first bad item."""
    kept: list[Item] = []
    for new in items[: MAX_ITEMS[kind]]:
        result, stored = STORED[kind](new)
        if result != missions.ACCEPTED:
            break
        kept.append(stored)
    good = len(kept) == len(items)
    if kind == FENCE:
        return good and write_fence(ap, kept)
    _replace(ap, kind, kept)
    return good


def _replace(ap: Autopilot, kind: int, items: list[Item]) -> None:
    ap.plans.put(kind, items)
    _tell(ap, kind)


def _tell(ap: Autopilot, kind: int) -> None:
    """Totals are parameters; who flies wants to know."""
    items = ap.plans.of(kind)
    total = len(items)
    if kind == FENCE:
        points = sum(item.command in missions.POLYGONS | missions.CIRCLES for item in items)
        total = points + 2 if points >= 3 else 0  # of an old protocol: not the number of items
    ap.params.set(_TOTALS[kind], total)
    ap.plans.changed(kind)


def home_item(ap: Autopilot) -> Item:
    """Item 0 of every mission: the real home, whatever was sent."""
    x_m, y_m, z_m = ap.home_m
    lat_deg, lon_deg = ap.vehicles.to_geodetic(ap.index, x_m, y_m)
    z = z_m + ap.spec.ground_amsl_m
    return Item(missions.WAYPOINT, missions.FRAME_AMSL, x=round(lat_deg * 1e7), y=round(lon_deg * 1e7), z=z)
