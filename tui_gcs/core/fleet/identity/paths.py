"""Path selection: which paths lead to a vehicle, which one is used, and whether a system id is one vehicle at all.

Threats: docs/threats.md B.6-24…26; faults of links: docs/threats.md C.5.

* A second *link* that brings the same system id is asked for AUTOPILOT_VERSION. The same hardware id, boot clock and
  positions make it a second path to the vehicle. The freshest path is used; another one is taken within 2 s when it
  falls silent, and as soon as it is known that nothing arrives over it.
* A second *address* on the same link is another vehicle or a forger. Nothing from it is used and nothing is sent there
  until the first address has been silent for 3 s (a NAT or a modem may have given the vehicle a new one). With valid
  signatures, which a relay brings as well, 1.2 s are enough, and only while the first is silent. An armed vehicle is
  followed to a new address only when it is known to be the same.
* Two vehicles with one id show by hardware id, by boot clocks that alternate, or by heartbeats from two addresses. Then
  the id is not commanded any more, stops excepted.
"""

import math
from collections.abc import Callable

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.rejection_counter import RejectionCounter
from tui_gcs.core.fleet.identity.boot_clock import BootClock, BootTimeResult
from tui_gcs.core.fleet.identity.duplicate_filter import DuplicateFilter
from tui_gcs.core.fleet.identity.identity_checks import IdentityMonitor
from tui_gcs.core.fleet.identity.path import GLOBAL_POSITION_INT, Path, PathState
from tui_gcs.core.fleet.identity.path_correlation import DIFFERENT_VEHICLE_M, PathCorrelation, unexplained_gap_m
from tui_gcs.core.fleet.identity.path_rules import (
    BOOT_CLOCK_TOLERANCE_S,
    MIN_SILENCE_TO_REBIND_S,
    duplicates_possible,
    is_same_vehicle,
    lead_s,
    shares_link,
    uid_of,
)
from tui_gcs.core.fleet.vehicle import HIGH_LATENCY_LOST_AFTER_S, LOST_AFTER_S, Vehicle
from tui_gcs.core.mavlink.sources import Slot, Source
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ALERT, ERROR, NOTICE, WARNING, EventLog

PATH_TIMEOUT_S = 1.2
"""After this much silence of the path in use another accepted one is used: well within 2 s at 1 Hz of heartbeats."""
MIN_AHEAD_S, MIN_AHEAD_CHECKS = 0.3, 5
"""A path that is fresher by 0.3 s in 5 checks in a row is used instead. A link that works for 2 s at a time never gets
there."""
MIN_APART_CHECKS = 2
"""Positions of two accepted paths are far apart in this many checks in a row: no jump that one of them brought first.
"""
CHECK_S = 1.0
"""The slow checks (freshness, positions apart, forgetting) run this often."""
MIN_CONTRADICTION_S = 1.0
"""A path that contradicts for this long leads to another vehicle; less may be a reboot that one link brought first."""
MIN_CLOCK_ALTERNATIONS, CLOCK_ALTERNATION_WINDOW_S = 2, 5.0
"""Two boot clocks that alternate twice within 5 s belong to two vehicles."""
MIN_SECOND_HEARTBEATS, MIN_SECOND_SOURCE_S, SECOND_SOURCE_WINDOW_S = 3, 1.5, 5.0
"""Three heartbeats from a second address, over at least 1.5 s, within 5 s and while the first address is heard: no
stray frame."""
MAX_HEARTBEATS = 64
"""Heartbeat times kept per path: a second vehicle may send heartbeats faster than 1 Hz."""
CONFLICT_TIMEOUT_S = 10.0
"""A conflict ends when there was no further evidence for this long."""
UID_ALTERNATION_WINDOW_S = 5.0
"""Two hardware ids over one path within this time belong to two vehicles; later it is a replaced vehicle."""
MAX_PATHS = 8
"""Paths per vehicle. The one that has been silent longest makes room."""
MIN_REPEATED_FRAMES = 5
"""This many copies of just received signed frames make a second link a path: a relay may carry our frames, too."""
UNACCEPTED_TIMEOUT_S = 120.0
"""A path that was never accepted is forgotten after this much silence."""
REQUEST_S, FAST_REQUESTS = 1.0, 5
"""A candidate is asked for AUTOPILOT_VERSION every second, five times; then every 10 s."""
MAX_UNANSWERED_REQUESTS = 7
"""A path that did not answer this many requests is taken for its system id, unproven: it may be all that is left of it.
"""

# Message ids (minimal.xml, common.xml).
HEARTBEAT, AUTOPILOT_VERSION = 0, 148


class PathSelector:
    """Accepts and refuses the paths of all vehicles and selects the one that each vehicle uses."""

    def __init__(
        self,
        clock: Clock,
        events: EventLog,
        dropped: RejectionCounter,
        place_again: Callable[[Source, int], None],
    ) -> None:
        """Refused frames are counted in `dropped`.

        `place_again` makes the registry decide anew about the frames of a system.
        """
        self._place_again = place_again
        self._clock = clock
        self._events = events
        self._dropped = dropped
        self._identity = IdentityMonitor()
        self._alternations_s: dict[int, list[float]] = {}
        self._next_look_s = -math.inf
        self._vehicles: list[Vehicle] = []
        """The vehicles of the last `tick`."""
        self.on_move: list[Callable[[Vehicle], None]] = []
        """Called with a vehicle that is heard from a new address without proof: it may be another vehicle."""
        self.on_replace: list[Callable[[Vehicle], None]] = []
        """Called with a vehicle when its system id is known to belong to another vehicle."""
        self.on_reboot: list[Callable[[Vehicle], None]] = []
        """Called with a vehicle that has rebooted."""

    def first_path(self, source: Source) -> Path:
        """Return the path of a new vehicle, accepted."""
        source.vehicle_count += 1
        return Path(source, PathState.USED, self._clock.now())

    def add(self, vehicle: Vehicle, source: Source) -> Path | None:
        """Add `source`, which brings this vehicle's id, as a path to be judged; None if no more fit."""
        if len(vehicle.paths) >= MAX_PATHS:
            others = [path for path in vehicle.paths if path.state is not PathState.USED]
            if not others:
                return None
            self._drop(vehicle, min(others, key=lambda path: path.last_heard_s))
        path = Path(source, PathState.CANDIDATE, self._clock.now())
        if shares_link(vehicle, path):
            path.state = PathState.CONFLICT
        vehicle.paths.append(path)
        if vehicle.duplicate_filter is None and duplicates_possible(vehicle):
            self._renew(vehicle)
        return path

    def take_unaccepted(self, slot: Slot, now: float) -> bool:
        """Judge a frame over a path that is not accepted.

        It is never recorded, passed on or believed: returns False.
        """
        vehicle: Vehicle = slot.owner
        path = vehicle.path_of(slot.stream.source)
        if path is None:
            slot.stream.source.forget(slot.system)
            return False
        # A camera may have an address of its own, which is no evidence about its vehicle's address.
        if slot.component != vehicle.component:
            self._dropped.count("component at another address", vehicle.id)
            return False
        self._dropped["second source of one system id"] += 1
        if vehicle.identity.keyed:
            self._signed(vehicle, path, slot, now)
            return False
        path.slots[slot.msgid] = slot
        if slot.msgid == AUTOPILOT_VERSION:
            path.uid, path.answered = uid_of(slot), True
        elif slot.msgid == HEARTBEAT and self._is_replay(vehicle, path, slot):
            # The newest ones are what a second link of the same vehicle brings, until it is known as one.
            if shares_link(vehicle, path) or not vehicle.heartbeats.is_recent(slot.raw):
                text = "its own heartbeats come again from another address: a replay"
                self._report(vehicle, text, WARNING, every_s=30)
        elif slot.msgid == HEARTBEAT and now - vehicle.last_heard_s < MIN_SECOND_SOURCE_S:
            newest_s = path.heartbeats_s[1 - MAX_HEARTBEATS :]
            path.heartbeats_s = [*(t for t in newest_s if now - t < SECOND_SOURCE_WINDOW_S), now]
        # Once the vehicle is silent, this may be its new address.
        if now - vehicle.last_heard_s > MIN_SILENCE_TO_REBIND_S:
            self._on_silence(vehicle, path, now)
        elif shares_link(vehicle, path):
            path.state = PathState.CONFLICT
            self._second_on_link(vehicle, path, now)
        else:
            self._on_another_link(vehicle, path, slot, now)
        return False

    @staticmethod
    def _is_replay(vehicle: Vehicle, path: Path, slot: Slot) -> bool:
        """Whether a heartbeat over a path that is not accepted repeats one of the vehicle."""
        newest = vehicle.path.slots.get(HEARTBEAT)
        if newest is not None:  # it may not have been handed to the telemetry yet
            vehicle.heartbeats.add(newest.raw)
        path.replayed, path.replays = vehicle.heartbeats.find(slot.raw, path.replayed)
        return path.replays

    def _signed(self, vehicle: Vehicle, path: Path, slot: Slot, now: float) -> None:
        """Judge a path by frames with good signatures: it leads to this vehicle, or to a relay or replayer.

        A replayer may bring a frame that was lost on its own way. So another address on the same link is used only
        while the one before is silent, and no longer; stops go to both.
        """
        copy = vehicle.duplicate_filter is not None and vehicle.duplicate_filter.is_copy(slot.raw, path)
        if vehicle.duplicate_filter is not None:
            vehicle.duplicate_filter.is_first(slot.raw, path, now, accepted=False)
        path.proven_s = now
        before = next((used for used in vehicle.used_paths() if used.source.link == path.source.link), None)
        if before is not None:
            if path.displaced or (not copy and now - before.last_heard_s > PATH_TIMEOUT_S):
                self._displace(vehicle, before, path)
        elif not copy:
            self._accept(vehicle, path, "proven by its signature")
            if now - vehicle.path.last_heard_s > PATH_TIMEOUT_S:
                self._use(vehicle, path)
        else:
            path.repeated_frames += 1
            if path.repeated_frames >= MIN_REPEATED_FRAMES:
                self._accept(vehicle, path, "it brings the same signed frames")

    def _second_on_link(self, vehicle: Vehicle, path: Path, now: float) -> None:
        """Judge another address on the same link, while the vehicle is heard."""
        self._report(vehicle, "a second source uses this system id: its frames are not used", ERROR, every_s=30)
        beats_s = path.heartbeats_s
        if (
            len(beats_s) >= MIN_SECOND_HEARTBEATS
            and beats_s[-1] - beats_s[0] >= MIN_SECOND_SOURCE_S
            and beats_s[-1] == now
        ):
            self.block(vehicle, f"several vehicles use id {vehicle.system}", in_flight=False)

    def _on_another_link(self, vehicle: Vehicle, path: Path, slot: Slot, now: float) -> None:
        if vehicle.duplicate_filter is not None:
            vehicle.duplicate_filter.is_first(slot.raw, path, now, accepted=False)
        if slot.msgid == GLOBAL_POSITION_INT:
            path.correlation = path.correlation or PathCorrelation()
            path.correlation.compare(vehicle.path.position, slot)
        same = is_same_vehicle(vehicle, path, now, silent=False, is_unique=self._is_unique)
        if same:
            self._accept(vehicle, path, "the same vehicle")
            return
        if same is None:
            path.contradicts_since_s = math.inf
        else:
            path.contradicts_since_s = min(path.contradicts_since_s, now)
        if now - path.contradicts_since_s >= MIN_CONTRADICTION_S:
            path.state = PathState.CONFLICT
        evidence = same is False or slot.msgid == HEARTBEAT
        if path.state is PathState.CONFLICT and evidence and not path.replays:
            self.block(vehicle, f"several vehicles use id {vehicle.system}", in_flight=False)

    def _is_unique(self, uid: str) -> bool:
        """Return whether at most one vehicle has that hardware id."""
        return sum(vehicle.identity.uid == uid for vehicle in self._vehicles) <= 1

    def _on_silence(self, vehicle: Vehicle, path: Path, now: float) -> None:
        """Judge a path while the vehicle is silent: this may be its new address."""
        path.state = PathState.CANDIDATE
        same = is_same_vehicle(vehicle, path, now, silent=True, is_unique=self._is_unique)
        text = f"heard from another address on {path.source.link}: asked for its identity"
        if same:
            self._follow(vehicle, path)
        # A new address of a disarmed vehicle is taken at once, of an armed one only after several unanswered requests:
        # it may be all that is still heard of the vehicle.
        elif not vehicle.telemetry.armed or (same is None and path.version_requests > MAX_UNANSWERED_REQUESTS):
            self._rebind(vehicle, path)
        elif same is None:
            self._report(vehicle, text, WARNING, every_s=30)
        elif same is False:
            text = f"another vehicle uses id {vehicle.system}; the one that was armed is not heard"
            self.block(vehicle, text, in_flight=False)

    def due_version_requests(self, vehicles: list[Vehicle]) -> list[tuple[Vehicle, Path]]:
        """Return the paths to ask for AUTOPILOT_VERSION now; each at most once a second."""
        now = self._clock.now()
        due = [(vehicle, vehicle.path) for vehicle in self._identity.due_requests(now)]
        for vehicle in vehicles:
            if len(vehicle.paths) == 1:
                continue
            for path in vehicle.paths:
                if (
                    path.state is PathState.USED
                    or now < path.next_request_s
                    or now - path.last_heard_s >= MIN_SILENCE_TO_REBIND_S
                ):
                    continue
                if path.state is PathState.CANDIDATE or not shares_link(vehicle, path):
                    path.version_requests += 1
                    path.next_request_s = now + (
                        REQUEST_S if path.version_requests <= FAST_REQUESTS else 10 * REQUEST_S
                    )
                    due.append((vehicle, path))
        return due

    def _accept(self, vehicle: Vehicle, path: Path, why: str) -> None:
        path.state = PathState.USED
        path.source.vehicle_count += 1
        if path.high_latency:
            vehicle.telemetry.high_latency_s = self._clock.now()
        self._end_closed(vehicle, path)
        self._renew(vehicle)
        self._report(vehicle, f"also heard on {path.source.link}: {why}", NOTICE, every_s=30)

    def _follow(self, vehicle: Vehicle, path: Path) -> None:
        """Use the same vehicle's new address."""
        distant = path.high_latency or vehicle.path.high_latency
        rebooted = not distant and abs(path.boot_offset_s() - vehicle.path.boot_offset_s()) > BOOT_CLOCK_TOLERANCE_S
        self._take(vehicle, path)
        self._report(vehicle, f"now heard from another address on {path.source.link}: the same vehicle", NOTICE)
        if rebooted:
            self._rebooted(vehicle)

    def _rebind(self, vehicle: Vehicle, path: Path) -> None:
        """Use a new address of a silent vehicle without proof; no commands are sent before it is identified."""
        for other in vehicle.used_paths():
            _withdraw(other, PathState.CANDIDATE)
        self._take(vehicle, path)
        # Nothing proves that it is the same vehicle, so that home, mode and set-up are not taken over.
        vehicle.forget_boot()
        vehicle.identity.moved = "heard from another address: asked for its identity"
        text = f"now heard from another address on {path.source.link}: its identity is asked for first"
        self._report(vehicle, text, WARNING)
        for listener in self.on_move:
            listener(vehicle)
        if path.answered:
            self._known(vehicle, path.uid)
            vehicle.identity.uid = path.uid

    def _take(self, vehicle: Vehicle, path: Path) -> None:
        """Use `path` from now on, and no other address on its link."""
        for other in vehicle.used_paths():
            if other.source.link == path.source.link:
                _withdraw(other, PathState.CONFLICT)
        path.state = PathState.USED
        path.source.vehicle_count += 1
        self._put_in_use(vehicle, path)

    def _displace(self, vehicle: Vehicle, before: Path, path: Path) -> None:
        """Use another address on the same link, proven by its signature; the one before returns when it is heard."""
        came_back = path.displaced
        for other in vehicle.paths:
            if other.source.link == path.source.link:
                other.displaced = other is before and not came_back
        # Stops go to the displaced address for a while longer: the new one may be a relay.
        before.proven_s = before.last_heard_s
        _withdraw(before, PathState.CONFLICT)
        path.state = PathState.USED
        path.source.vehicle_count += 1
        if vehicle.path is before:
            self._put_in_use(vehicle, path)
        else:
            self._renew(vehicle)
        text = f"now heard from another address on {path.source.link}: proven by its signature"
        self._report(vehicle, text, NOTICE, every_s=30)

    def _use(self, vehicle: Vehicle, path: Path) -> None:
        if vehicle.path is path:
            return
        text = f"link {path.source.link} used instead of {vehicle.path.source.link}"
        self._put_in_use(vehicle, path)
        self._report(vehicle, text, NOTICE, every_s=30)

    def _put_in_use(self, vehicle: Vehicle, path: Path) -> None:
        """Make `path` the one in use and continue the boot clock, less what the new path may be slower."""
        before = vehicle.path.boot_clock
        if before.boot_ms >= 0:
            # The new path may be slower by this much: its first positions are then no step back in time.
            path.boot_clock = BootClock(max(0, before.boot_ms - round(BOOT_CLOCK_TOLERANCE_S * 1e3)), before.at_s)
        vehicle.path = path
        for each in vehicle.paths:
            each.ahead_checks = 0
        self._renew(vehicle)

    def _renew(self, vehicle: Vehicle) -> None:
        """Have it decided anew what is done with each kind of frame, since that depends on the paths."""
        if not duplicates_possible(vehicle):
            vehicle.duplicate_filter = None
        elif vehicle.duplicate_filter is None:
            vehicle.duplicate_filter = DuplicateFilter()
        for path in vehicle.paths:
            self._place_again(path.source, vehicle.system)

    def _end_closed(self, vehicle: Vehicle, path: Path) -> None:
        """Drop closed connections on the link of `path`: a client that reconnects has another address."""
        for old in [used for used in vehicle.used_paths() if used is not path and used.source.gone]:
            if old.source.link != path.source.link:
                continue
            if vehicle.path is old:
                self._use(vehicle, path)
            old.source.vehicle_count -= 1
            self._drop(vehicle, old)

    def _drop(self, vehicle: Vehicle, path: Path) -> None:
        vehicle.paths.remove(path)
        path.source.forget(vehicle.system)

    def tick(self, vehicles: list[Vehicle]) -> None:
        """Use the freshest path of each vehicle on which orders arrive; look for second vehicles; end old conflicts."""
        now, self._vehicles = self._clock.now(), vehicles
        look = now >= self._next_look_s - 1e-9
        if look:
            self._next_look_s = now + CHECK_S
        for vehicle in vehicles:
            if len(vehicle.paths) > 1:
                self._choose(vehicle, now, look=look)
        for vehicle in self._identity.look(vehicles, now, check_sequences=look):
            self._renew(vehicle)
        for vehicle in vehicles:
            if vehicle.identity.blocked_s > -math.inf and now - vehicle.identity.blocked_s > CONFLICT_TIMEOUT_S:
                vehicle.identity.blocked, vehicle.identity.blocked_in_flight, vehicle.identity.blocked_s = (
                    "",
                    False,
                    -math.inf,
                )
                self._report(vehicle, "only one vehicle uses this id again", NOTICE)

    def _choose(self, vehicle: Vehicle, now: float, *, look: bool) -> None:
        if look:
            self._forget_silent(vehicle, now)
        used, silent_s = vehicle.path, now - vehicle.path.last_heard_s
        others = [path for path in vehicle.used_paths() if path is not used]
        fresh = [path for path in others if not path.high_latency and now - path.last_heard_s < PATH_TIMEOUT_S]
        reached = [path for path in fresh if not path.up_way_dead]
        if fresh and (silent_s > PATH_TIMEOUT_S or used.high_latency):
            self._use(vehicle, max(reached or fresh, key=lambda path: path.last_heard_s))
        elif reached and used.up_way_dead:
            self._use(vehicle, max(reached, key=lambda path: path.last_heard_s))
        elif not fresh and silent_s > LOST_AFTER_S and not used.high_latency:
            distant = [
                path for path in others if path.high_latency and now - path.last_heard_s < HIGH_LATENCY_LOST_AFTER_S
            ]
            if distant:
                self._use(vehicle, max(distant, key=lambda path: path.last_heard_s))
        elif look:
            self._apart(vehicle, others, now)
            for path in others if vehicle.path is used else ():
                ahead_s = lead_s(path, used) if path in reached else 0.0
                path.ahead_checks = path.ahead_checks + 1 if ahead_s > MIN_AHEAD_S else 0
                if path.ahead_checks >= MIN_AHEAD_CHECKS:
                    self._use(vehicle, path)
                    return

    def _apart(self, vehicle: Vehicle, others: list[Path], now: float) -> None:
        """Refuse accepted paths with positions far apart: they were two vehicles all the time."""
        ours = vehicle.path.position
        for path in others:
            theirs = path.position
            fresh = ours is not None and theirs is not None and now - min(ours.t_s, theirs.t_s) < MIN_SECOND_SOURCE_S
            path.apart_checks = (
                path.apart_checks + 1 if fresh and unexplained_gap_m(ours, theirs) > DIFFERENT_VEHICLE_M else 0
            )
            if path.apart_checks >= MIN_APART_CHECKS:
                _withdraw(path, PathState.CONFLICT)
                self.block(vehicle, f"several vehicles use id {vehicle.system}", in_flight=False)
                self._renew(vehicle)

    def _forget_silent(self, vehicle: Vehicle, now: float) -> None:
        if vehicle.duplicate_filter is not None:
            vehicle.duplicate_filter.prune(now)
        for path in list(vehicle.paths):
            if path.state is not PathState.USED and now - max(path.last_heard_s, path.since_s) > UNACCEPTED_TIMEOUT_S:
                self._drop(vehicle, path)

    def check_boot_time(self, vehicle: Vehicle, boot_ms: int, now: float) -> BootTimeResult:
        """Take the boot time of a new position over the path in use and return what it means."""
        step = vehicle.path.boot_clock.check(boot_ms, now)
        if step is BootTimeResult.REBOOT:
            self._rebooted(vehicle)
        elif step is BootTimeResult.OTHER_CLOCK:
            self._clocks_alternate(vehicle, now)
        return step

    def check_unused_path(self, slot: Slot, now: float) -> None:
        """Check the boot clock in a position over an accepted path that is not in use."""
        vehicle: Vehicle = slot.owner
        path = vehicle.path_of(slot.stream.source)
        if path is not None and path.boot_clock.check(slot.values()[0], now) is BootTimeResult.OTHER_CLOCK:
            self._clocks_alternate(vehicle, now)

    def _clocks_alternate(self, vehicle: Vehicle, now: float) -> None:
        times = [t for t in self._alternations_s.get(vehicle.id, []) if now - t < CLOCK_ALTERNATION_WINDOW_S] + [now]
        self._alternations_s[vehicle.id] = times[-MIN_CLOCK_ALTERNATIONS:]
        # One alternation may be a frame that was very late.
        if len(times) >= MIN_CLOCK_ALTERNATIONS:
            self._identity.confirm_conflict(vehicle, now)
            self.block(vehicle, f"several vehicles use id {vehicle.system} on one address", in_flight=True)

    def _rebooted(self, vehicle: Vehicle) -> None:
        vehicle.integrity.reboots += 1
        vehicle.forget_boot()
        self._events.report(EventClass.PROCESSING, f"vehicle {vehicle.id}", "rebooted", WARNING)
        for listener in self.on_reboot:
            listener(vehicle)

    def take_version(self, vehicle: Vehicle, slot: Slot, now: float) -> None:
        """Take AUTOPILOT_VERSION over an accepted path and compare its hardware id with the known one."""
        uid = uid_of(slot)
        if vehicle.identity.moved:
            self._known(vehicle, uid)
        elif vehicle.identity.uid and uid and uid != vehicle.identity.uid:
            # Two ids within seconds alternate: two vehicles. Later it is a vehicle that replaced the other one.
            if now - vehicle.identity.uid_reported_s < UID_ALTERNATION_WINDOW_S:
                self._identity.confirm_conflict(vehicle, now)
                self.block(vehicle, f"several vehicles use id {vehicle.system} on one address", in_flight=True)
            else:
                self._replaced(vehicle)
        vehicle.identity.uid, vehicle.identity.uid_reported_s = uid, now

    def _known(self, vehicle: Vehicle, uid: str) -> None:
        """End `moved`: the vehicle at the new address has identified itself."""
        vehicle.identity.moved = ""
        if vehicle.identity.uid and uid != vehicle.identity.uid:
            self._replaced(vehicle)

    def _replaced(self, vehicle: Vehicle) -> None:
        text = f"another vehicle has id {vehicle.system} now: it does not go on with what the other one did"
        self._report(vehicle, text, WARNING)
        for listener in self.on_replace:
            listener(vehicle)

    def block(self, vehicle: Vehicle, why: str, *, in_flight: bool) -> None:
        """Record evidence that two vehicles use this id: no commands but stops for `CONFLICT_TIMEOUT_S`."""
        vehicle.identity.blocked_s = self._clock.now()
        vehicle.identity.blocked = why
        vehicle.identity.blocked_in_flight |= in_flight
        self._report(vehicle, f"DUPLICATE ID: {why}; not commanded until one of them is gone", ALERT, every_s=30)

    def forget(self, vehicle: Vehicle) -> None:
        """Drop what is kept of a vehicle that is removed."""
        self._alternations_s.pop(vehicle.id, None)
        self._identity.forget(vehicle)
        for path in vehicle.paths:
            path.source.forget(vehicle.system)
            path.source.vehicle_count -= path.state is PathState.USED

    def _report(self, vehicle: Vehicle, text: str, severity: int, every_s: float = 0.0) -> None:
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, severity, every_s=every_s)


def _withdraw(path: Path, state: PathState) -> None:
    path.state = state
    path.source.vehicle_count -= 1
    path.version_requests, path.next_request_s, path.uid, path.answered = 0, -math.inf, "", False
    path.heartbeats_s, path.contradicts_since_s = [], math.inf
    path.correlation, path.matching_positions, path.apart_checks = None, 0, 0
