"""Which ways lead to a vehicle, and whether it is one vehicle at all (security.md B.6-24…26, performance of links C.5).

* A second *link* that brings the same system id is asked who it is; the same hardware id and boot clock make it a
  second way to the vehicle. The freshest way is used; another is taken within 2 s when it falls silent.
* A second *address* on the same link is somebody else, or a forger: nothing of it is used and nothing is sent there,
  until the first one has been silent for 3 s (a NAT or a modem gave it a new address), or a valid signature proves it.
* Two vehicles with one id are told by hardware id, by boot clocks that alternate, or by heartbeats from two addresses.
  Then the id is not commanded any more, stops excepted.
"""

import math
from collections import Counter
from collections.abc import Callable

from tui_gcs.core.boot_clock import BootClock, Step
from tui_gcs.core.clock import Clock
from tui_gcs.core.events import ALERT, ERROR, NOTICE, WARNING, EventLog
from tui_gcs.core.messages import EventClass
from tui_gcs.core.vehicle import Path, PathState, Vehicle
from tui_gcs.core.wire.intake import Slot, Source

REBIND_S = 3.0
"""Silence of the address in use after which another one may take over."""
SWITCH_S = 1.2
"""Silence of the path in use after which another accepted one is used: well within 2 s at 1 Hz of heartbeats."""
AHEAD_S, AHEAD_LOOKS = 0.3, 3
"""News on another path newer by this, in so many looks in a row: that path is the fresher one."""
LOOK_S = 1.0
SAME_BOOT_S = 3.0
"""Boot clocks of one vehicle over two links differ by their delays only."""
TWIN_STEPS, TWIN_S = 2, 5.0
"""So many returns to a clock that was left, within this time, are two vehicles."""
SECOND_HEARTBEATS, SECOND_S = 3, 1.5
"""Heartbeats from a second address, over this time and beside the first: no stray frame."""
RESOLVED_S = 10.0
"""Without further evidence for so long, a conflict is over."""
UID_ALTERNATES_S = 5.0
MOST_PATHS = 8
"""Of one vehicle; further sources are counted only."""
ASK_S, ASK_OFTEN = 1.0, 5
"""A candidate is asked who it is every second, five times; then every 10 s."""

AUTOPILOT_VERSION = 148
ON = Step.ON


class PathBook:
    """Judges the paths of all vehicles."""

    def __init__(self, clock: Clock, events: EventLog, dropped: Counter[str]) -> None:
        """Refused frames are counted in `dropped`."""
        self._clock = clock
        self._events = events
        self._dropped = dropped
        self._twin_s: dict[int, list[float]] = {}
        self._next_look_s = -math.inf
        self.on_move: list[Callable[[Vehicle], None]] = []
        """Called when a vehicle is heard from an address that nobody has vouched for: it may be somebody else."""
        self.on_switch: list[Callable[[Vehicle], None]] = []
        """Called when another proven path of the same vehicle is used from now on."""
        self.on_reboot: list[Callable[[Vehicle], None]] = []

    # ---------------------------------------------------------------- new ways

    def begin(self, source: Source) -> Path:
        """The first path of a new vehicle."""
        source.bound += 1
        return Path(source, PathState.USED, self._clock.now())

    def add(self, vehicle: Vehicle, source: Source) -> Path | None:
        """Another source brings this vehicle's id: a path to be judged; None if there are too many already."""
        if len(vehicle.paths) >= MOST_PATHS:
            silent = min(vehicle.paths, key=lambda path: path.heard_s)
            if silent is vehicle.path or silent.state is PathState.USED:
                return None
            vehicle.paths.remove(silent)
        same_link = any(path.source.link == source.link for path in vehicle.used_paths())
        path = Path(source, PathState.CONFLICT if same_link else PathState.CANDIDATE, self._clock.now())
        vehicle.paths.append(path)
        return path

    # ---------------------------------------------------------------- frames that are not used

    def unproven(self, slot: Slot, now: float) -> bool:
        """A frame over a path that is not accepted; never recorded, passed on or believed."""
        vehicle: Vehicle = slot.owner
        path = vehicle.path_of(slot.stream.source)
        if path is None:
            slot.stream.source.forget(slot.system)
            return False
        self._dropped["second source of one system id"] += 1
        if vehicle.keyed:  # the gate let only good signatures through: this is the vehicle
            self._accept(vehicle, path, "proven by its signature")
            self._use(vehicle, path)
        elif now - vehicle.path.heard_s > REBIND_S:
            self._rebind(vehicle, path)
        elif path.state is PathState.CANDIDATE:
            self._learn(vehicle, path, slot)
        else:
            self._second(vehicle, path, slot, now)
        return False

    def _second(self, vehicle: Vehicle, path: Path, slot: Slot, now: float) -> None:
        text = "a second source uses this system id: its frames are not used"
        self._events.say(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, ERROR, every_s=30)
        if slot.msgid == 0 and slot.component == vehicle.component and now - vehicle.path.heard_s < SECOND_S:
            path.heartbeats += 1
        if path.heartbeats >= SECOND_HEARTBEATS and now - path.since_s >= SECOND_S:
            self.block(vehicle, f"two vehicles use id {vehicle.system}", in_flight=False)

    def _learn(self, vehicle: Vehicle, path: Path, slot: Slot) -> None:
        """What a candidate says of itself."""
        if slot.component == vehicle.component:
            path.slots[slot.msgid] = slot
        if slot.msgid == AUTOPILOT_VERSION:
            path.uid = uid_of(slot)
        if path.uid and vehicle.uid and path.uid != vehicle.uid:
            path.state = PathState.CONFLICT
            self.block(vehicle, f"two vehicles use id {vehicle.system}", in_flight=False)
            return
        offset_s = path.boot_offset_s() - vehicle.path.boot_offset_s()
        if abs(offset_s) > SAME_BOOT_S:
            path.state = PathState.CONFLICT
            self.block(vehicle, f"two vehicles use id {vehicle.system}", in_flight=False)
        elif not math.isnan(offset_s) and path.uid == vehicle.uid:
            self._accept(vehicle, path, "the same vehicle")

    def candidates(self, vehicles: list[Vehicle]) -> list[tuple[Vehicle, Path]]:
        """Paths that are to be asked now who is there; each is asked at most once a second."""
        now = self._clock.now()
        due = []
        for vehicle in vehicles:
            if len(vehicle.paths) == 1:
                continue
            for path in vehicle.paths:
                if path.state is PathState.CANDIDATE and now >= path.ask_next_s and now - path.heard_s < REBIND_S:
                    path.asked += 1
                    path.ask_next_s = now + (ASK_S if path.asked < ASK_OFTEN else 10 * ASK_S)
                    due.append((vehicle, path))
        return due

    # ---------------------------------------------------------------- changes

    def _accept(self, vehicle: Vehicle, path: Path, why: str) -> None:
        path.state = PathState.USED
        path.source.bound += 1
        if vehicle.recent is None:
            vehicle.recent = {}
        self._renew(vehicle)
        text = f"also heard on {path.source.link}: {why}"
        self._events.say(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, NOTICE)

    def _rebind(self, vehicle: Vehicle, path: Path) -> None:
        """The old address is silent: take the new one, and ask who is there before anything is sent."""
        for old in [p for p in vehicle.paths if p is not path and p.source.link == path.source.link]:
            vehicle.paths.remove(old)
            old.source.forget(vehicle.system)
            old.source.bound -= old.state is PathState.USED
        path.state = PathState.USED
        path.source.bound += 1
        vehicle.path = path
        vehicle.identified, vehicle.firmware_token = False, ""
        path.boot = BootClock()
        self._renew(vehicle)
        text = f"now heard from another address on {path.source.link}: who it is, is asked first"
        self._events.say(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, WARNING)
        for listener in self.on_move:
            listener(vehicle)

    def _use(self, vehicle: Vehicle, path: Path) -> None:
        if vehicle.path is path:
            return
        before, vehicle.path = vehicle.path, path
        path.boot = BootClock()
        for each in vehicle.paths:
            each.ahead = 0
        self._renew(vehicle)
        text = f"link {path.source.link} used instead of {before.source.link}"
        self._events.say(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, NOTICE)
        for listener in self.on_switch:
            listener(vehicle)

    def _renew(self, vehicle: Vehicle) -> None:
        """What is done with frames depends on the paths: look it up anew for each kind."""
        for path in vehicle.paths:
            path.source.forget(vehicle.system)

    # ---------------------------------------------------------------- time

    def tick(self, vehicles: list[Vehicle]) -> None:
        """Use the freshest path, end what is over."""
        now = self._clock.now()
        look = now >= self._next_look_s
        if look:
            self._next_look_s = now + LOOK_S
        for vehicle in vehicles:
            if len(vehicle.paths) > 1:
                self._choose(vehicle, now, look=look)
            if vehicle.blocked_s > -math.inf and now - vehicle.blocked_s > RESOLVED_S:
                vehicle.blocked, vehicle.blocked_in_flight, vehicle.blocked_s = "", False, -math.inf
                text = "only one vehicle uses this id again"
                self._events.say(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, NOTICE)

    def _choose(self, vehicle: Vehicle, now: float, *, look: bool) -> None:
        others = [path for path in vehicle.used_paths() if path is not vehicle.path and now - path.heard_s < SWITCH_S]
        if not others:
            return
        if now - vehicle.path.heard_s > SWITCH_S:
            self._use(vehicle, max(others, key=lambda path: path.heard_s))
        elif look:
            for path in others:
                lead_s = vehicle.path.boot_offset_s() - path.boot_offset_s()
                path.ahead = path.ahead + 1 if lead_s > AHEAD_S else 0
                if path.ahead >= AHEAD_LOOKS:
                    self._use(vehicle, path)
                    return
        if vehicle.recent is not None and look:
            vehicle.recent = {raw: t for raw, t in vehicle.recent.items() if now - t < REBIND_S}

    # ---------------------------------------------------------------- is it one vehicle?

    def boot_time(self, vehicle: Vehicle, boot_ms: int, now: float) -> Step:
        """Judge the boot clock of a new position over the path in use."""
        step = vehicle.path.boot.seen(boot_ms, now)
        if step is ON:
            return step
        if step is Step.REBOOT:
            vehicle.reboots += 1
            vehicle.identified = False
            vehicle.prearm_ok = False
            self._events.say(EventClass.PROCESSING, f"vehicle {vehicle.id}", "rebooted", WARNING)
            for listener in self.on_reboot:
                listener(vehicle)
        elif step is Step.TWIN:
            times = [t for t in self._twin_s.get(vehicle.id, []) if now - t < TWIN_S] + [now]
            self._twin_s[vehicle.id] = times[-TWIN_STEPS:]
            if len(times) >= TWIN_STEPS:
                self.block(vehicle, f"two vehicles use id {vehicle.system} on one address", in_flight=True)
        return step

    def version(self, vehicle: Vehicle, slot: Slot, now: float) -> None:
        """AUTOPILOT_VERSION came over the path in use: is it the board we know?"""
        uid = uid_of(slot)
        if vehicle.uid and uid and uid != vehicle.uid and now - vehicle.uid_s < UID_ALTERNATES_S:
            self.block(vehicle, f"two vehicles use id {vehicle.system} on one address", in_flight=True)
        if uid != vehicle.uid:
            vehicle.uid = uid
        vehicle.uid_s = now

    def block(self, vehicle: Vehicle, why: str, *, in_flight: bool) -> None:
        """Evidence that this id is not one vehicle: no commands but stops, until it is gone."""
        vehicle.blocked_s = self._clock.now()
        vehicle.blocked = why
        vehicle.blocked_in_flight |= in_flight
        text = f"DUPLICATE ID: {why}; not commanded until one of them is gone"
        self._events.say(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, ALERT, every_s=30)

    def forget(self, vehicle: Vehicle) -> None:
        """The vehicle is not known any more."""
        self._twin_s.pop(vehicle.id, None)
        for path in vehicle.paths:
            path.source.forget(vehicle.system)
            path.source.bound -= path.state is PathState.USED


def uid_of(slot: Slot) -> str:
    """The hardware id in AUTOPILOT_VERSION: uid2 if the board has one, else uid; empty if neither."""
    fields = slot.fields()
    uid2 = bytes(fields["uid2"])
    if any(uid2):
        return uid2.hex()
    return f"{fields['uid']:016x}" if fields["uid"] else ""
