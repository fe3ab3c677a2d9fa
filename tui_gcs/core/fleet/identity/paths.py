"""Which ways lead to a vehicle, and whether it is one vehicle at all (security.md B.6-24…26, faults of links C.5).

* A second *link* that brings the same system id is asked who it is; the same hardware id, boot clock and positions make
  it a second way to the vehicle. The freshest way is used; another is taken within 2 s when it falls silent.
* A second *address* on the same link is somebody else, or a forger: nothing of it is used and nothing is sent there,
  until the first one has been silent for 3 s (a NAT or a modem gave it a new address); with valid signatures, which a
  relay brings, too, for 1.2 s, and only for as long.
  Who is armed is followed to a new address only when it is known to be the same.
* Two vehicles with one id are told by hardware id, by boot clocks that alternate, or by heartbeats from two addresses.
  Then the id is not commanded any more, stops excepted.
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
"""Silence of the path in use after which another accepted one is used: well within 2 s at 1 Hz of heartbeats."""
MIN_AHEAD_S, MIN_AHEAD_CHECKS = 0.3, 5
"""News on another path newer by this, in so many looks in a row: that path is the fresher one. A link that is up for
2 s at a time never is."""
MIN_APART_CHECKS = 2
"""Positions of two accepted paths far apart in so many looks in a row: no jump that one of them brought first."""
CHECK_S = 1.0
MIN_CONTRADICTION_S = 1.0
"""What contradicts for so long is another vehicle; less may be a reboot that one link told first."""
MIN_CLOCK_ALTERNATIONS, CLOCK_ALTERNATION_WINDOW_S = 2, 5.0
"""So many turns of two boot clocks, within this time, are two vehicles."""
MIN_SECOND_HEARTBEATS, MIN_SECOND_SOURCE_S, SECOND_SOURCE_WINDOW_S = 3, 1.5, 5.0
"""Heartbeats from a second address, over and within these times and beside the first: no stray frame."""
MAX_HEARTBEATS = 64
"""Kept of these: a second vehicle may send its heartbeats faster than 1 Hz."""
CONFLICT_TIMEOUT_S = 10.0
"""Without further evidence for so long, a conflict is over."""
UID_ALTERNATION_WINDOW_S = 5.0
MAX_PATHS = 8
"""Of one vehicle; the one that was silent longest makes room."""
MIN_REPEATED_FRAMES = 5
"""Copies of just received signed frames that a second link brings: who relays those may carry our answers, too."""
UNACCEPTED_TIMEOUT_S = 120.0
"""A path that was never accepted is forgotten after so much silence."""
REQUEST_S, FAST_REQUESTS = 1.0, 5
"""A candidate is asked who it is every second, five times; then every 10 s."""
MAX_UNANSWERED_REQUESTS = 7
"""Who does not answer so many questions is taken for what its id says, unproven: it may be all that is heard of it."""

HEARTBEAT, AUTOPILOT_VERSION = 0, 148


class PathSelector:
    """Judges the paths of all vehicles."""

    def __init__(
        self,
        clock: Clock,
        events: EventLog,
        dropped: RejectionCounter,
        place_again: Callable[[Source, int], None],
    ) -> None:
        """Refused frames are counted in `dropped`; `place_again` has it decided anew what is done with a system's."""
        self._place_again = place_again
        self._clock = clock
        self._events = events
        self._dropped = dropped
        self._doubts = IdentityMonitor()
        self._twin_s: dict[int, list[float]] = {}
        self._next_look_s = -math.inf
        self._vehicles: list[Vehicle] = []
        """As of the last `tick`."""
        self.on_move: list[Callable[[Vehicle], None]] = []
        """Called when a vehicle is heard from an address that nobody has vouched for: it may be somebody else."""
        self.on_replace: list[Callable[[Vehicle], None]] = []
        """Called when it is known that another vehicle has this id now."""
        self.on_reboot: list[Callable[[Vehicle], None]] = []

    # ---------------------------------------------------------------- new ways

    def first_path(self, source: Source) -> Path:
        """The first path of a new vehicle."""
        source.vehicle_count += 1
        return Path(source, PathState.USED, self._clock.now())

    def add(self, vehicle: Vehicle, source: Source) -> Path | None:
        """Another source brings this vehicle's id: a path to be judged; None if there are too many already."""
        if len(vehicle.paths) >= MAX_PATHS:
            others = [path for path in vehicle.paths if path.state is not PathState.USED]
            if not others:
                return None
            self._drop(vehicle, min(others, key=lambda path: path.heard_s))
        path = Path(source, PathState.CANDIDATE, self._clock.now())
        if shares_link(vehicle, path):
            path.state = PathState.CONFLICT
        vehicle.paths.append(path)
        if vehicle.duplicate_filter is None and duplicates_possible(vehicle):
            self._renew(vehicle)
        return path

    # ---------------------------------------------------------------- frames that are not used

    def take_unaccepted(self, slot: Slot, now: float) -> bool:
        """A frame over a path that is not accepted; never recorded, passed on or believed."""
        vehicle: Vehicle = slot.owner
        path = vehicle.path_of(slot.stream.source)
        if path is None:
            slot.stream.source.forget(slot.system)
            return False
        if slot.component != vehicle.component:  # a camera of its own address: says nothing of its vehicle's
            self._dropped.count("component at another address", vehicle.id)
            return False
        self._dropped["second source of one system id"] += 1
        if vehicle.identity.keyed:
            self._signed(vehicle, path, slot, now)
            return False
        path.slots[slot.msgid] = slot
        if slot.msgid == AUTOPILOT_VERSION:
            path.uid, path.answered = uid_of(slot), True
        elif slot.msgid == HEARTBEAT and now - vehicle.heard_s < MIN_SECOND_SOURCE_S:
            newest_s = path.heartbeats_s[1 - MAX_HEARTBEATS :]
            path.heartbeats_s = [*(t for t in newest_s if now - t < SECOND_SOURCE_WINDOW_S), now]
        if now - vehicle.heard_s > MIN_SILENCE_TO_REBIND_S:
            self._instead(vehicle, path, now)
        elif shares_link(vehicle, path):
            path.state = PathState.CONFLICT
            self._beside(vehicle, path, now)
        else:
            self._on_another_link(vehicle, path, slot, now)
        return False

    def _signed(self, vehicle: Vehicle, path: Path, slot: Slot, now: float) -> None:
        """The gate let only good signatures through: this is the vehicle, or somebody repeats what it said.

        Who repeats may bring a frame whose original was lost. So another address on the same link is used only while
        the one before is silent, and no longer; stops go to both.
        """
        copy = vehicle.duplicate_filter is not None and vehicle.duplicate_filter.is_copy(slot.raw, path)
        if vehicle.duplicate_filter is not None:
            vehicle.duplicate_filter.is_first(slot.raw, path, now, accepted=False)
        path.proven_s = now
        before = next((used for used in vehicle.used_paths() if used.source.link == path.source.link), None)
        if before is not None:
            if path.displaced or (not copy and now - before.heard_s > PATH_TIMEOUT_S):
                self._displace(vehicle, before, path)
        elif not copy:
            self._accept(vehicle, path, "proven by its signature")
            if now - vehicle.path.heard_s > PATH_TIMEOUT_S:
                self._use(vehicle, path)
        else:
            path.repeated_frames += 1
            if path.repeated_frames >= MIN_REPEATED_FRAMES:
                self._accept(vehicle, path, "it brings the same signed frames")

    def _beside(self, vehicle: Vehicle, path: Path, now: float) -> None:
        """Somebody else on the same link."""
        text = "a second source uses this system id: its frames are not used"
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, ERROR, every_s=30)
        beats_s = path.heartbeats_s
        if (
            len(beats_s) >= MIN_SECOND_HEARTBEATS
            and beats_s[-1] - beats_s[0] >= MIN_SECOND_SOURCE_S
            and beats_s[-1] == now
        ):
            self.block(vehicle, f"two vehicles use id {vehicle.system}", in_flight=False)

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
        if path.state is PathState.CONFLICT and (same is False or slot.msgid == HEARTBEAT):
            self.block(vehicle, f"two vehicles use id {vehicle.system}", in_flight=False)

    def _is_unique(self, uid: str) -> bool:
        """Whether one vehicle at most has that hardware id."""
        return sum(vehicle.identity.uid == uid for vehicle in self._vehicles) <= 1

    def _instead(self, vehicle: Vehicle, path: Path, now: float) -> None:
        """The vehicle is silent: this may be its new address."""
        path.state = PathState.CANDIDATE
        same = is_same_vehicle(vehicle, path, now, silent=True, is_unique=self._is_unique)
        text = f"heard from another address on {path.source.link}: asked who it is"
        if same:
            self._follow(vehicle, path)
        elif not vehicle.telemetry.armed or (same is None and path.version_requests > MAX_UNANSWERED_REQUESTS):
            self._rebind(vehicle, path)
        elif same is None:
            self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, WARNING, every_s=30)
        elif same is False:
            text = f"another vehicle uses id {vehicle.system}; the one that was armed is not heard"
            self.block(vehicle, text, in_flight=False)

    def due_version_requests(self, vehicles: list[Vehicle]) -> list[tuple[Vehicle, Path]]:
        """Paths on which is to be asked now who is there; each at most once a second."""
        now = self._clock.now()
        due = [(vehicle, vehicle.path) for vehicle in self._doubts.due_requests(now)]
        for vehicle in vehicles:
            if len(vehicle.paths) == 1:
                continue
            for path in vehicle.paths:
                if (
                    path.state is PathState.USED
                    or now < path.next_request_s
                    or now - path.heard_s >= MIN_SILENCE_TO_REBIND_S
                ):
                    continue
                if path.state is PathState.CANDIDATE or not shares_link(vehicle, path):
                    path.version_requests += 1
                    path.next_request_s = now + (
                        REQUEST_S if path.version_requests <= FAST_REQUESTS else 10 * REQUEST_S
                    )
                    due.append((vehicle, path))
        return due

    # ---------------------------------------------------------------- changes

    def _accept(self, vehicle: Vehicle, path: Path, why: str) -> None:
        path.state = PathState.USED
        path.source.vehicle_count += 1
        if path.high_latency:
            vehicle.telemetry.high_latency_s = self._clock.now()
        self._end_closed(vehicle, path)
        self._renew(vehicle)
        text = f"also heard on {path.source.link}: {why}"
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, NOTICE, every_s=30)

    def _follow(self, vehicle: Vehicle, path: Path) -> None:
        """The same vehicle at another address."""
        distant = path.high_latency or vehicle.path.high_latency
        rebooted = not distant and abs(path.boot_offset_s() - vehicle.path.boot_offset_s()) > BOOT_CLOCK_TOLERANCE_S
        self._take(vehicle, path)
        text = f"now heard from another address on {path.source.link}: the same vehicle"
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, NOTICE)
        if rebooted:
            self._rebooted(vehicle)

    def _rebind(self, vehicle: Vehicle, path: Path) -> None:
        """The old address is silent: take the new one, and ask who is there before anything is sent."""
        for other in vehicle.used_paths():
            _withdraw(other, PathState.CANDIDATE)
        self._take(vehicle, path)
        vehicle.forget_boot()
        vehicle.identity.moved = "heard from another address: asked who it is"
        text = f"now heard from another address on {path.source.link}: who it is, is asked first"
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, WARNING)
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
        """Another address on the same link, proven by its signature; the one before comes back when it speaks."""
        came_back = path.displaced
        for other in vehicle.paths:
            if other.source.link == path.source.link:
                other.displaced = other is before and not came_back
        before.proven_s = before.heard_s
        _withdraw(before, PathState.CONFLICT)
        path.state = PathState.USED
        path.source.vehicle_count += 1
        if vehicle.path is before:
            self._put_in_use(vehicle, path)
        else:
            self._renew(vehicle)
        text = f"now heard from another address on {path.source.link}: proven by its signature"
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, NOTICE, every_s=30)

    def _use(self, vehicle: Vehicle, path: Path) -> None:
        if vehicle.path is path:
            return
        text = f"link {path.source.link} used instead of {vehicle.path.source.link}"
        self._put_in_use(vehicle, path)
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, NOTICE, every_s=30)

    def _put_in_use(self, vehicle: Vehicle, path: Path) -> None:
        """Its boot clock goes on where the other was, less what the new way may be slower."""
        before = vehicle.path.boot_clock
        if before.boot_ms >= 0:
            path.boot_clock = BootClock(max(0, before.boot_ms - round(BOOT_CLOCK_TOLERANCE_S * 1e3)), before.at_s)
        vehicle.path = path
        for each in vehicle.paths:
            each.ahead_checks = 0
        self._renew(vehicle)

    def _renew(self, vehicle: Vehicle) -> None:
        """What is done with frames depends on the paths: decide it anew for each kind."""
        if not duplicates_possible(vehicle):
            vehicle.duplicate_filter = None
        elif vehicle.duplicate_filter is None:
            vehicle.duplicate_filter = DuplicateFilter()
        for path in vehicle.paths:
            self._place_again(path.source, vehicle.system)

    def _end_closed(self, vehicle: Vehicle, path: Path) -> None:
        """A client that connected anew has another address: nothing will come from the old one any more."""
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

    # ---------------------------------------------------------------- time

    def tick(self, vehicles: list[Vehicle]) -> None:
        """Use the freshest path, end what is over."""
        now, self._vehicles = self._clock.now(), vehicles
        look = now >= self._next_look_s - 1e-9
        if look:
            self._next_look_s = now + CHECK_S
        for vehicle in vehicles:
            if len(vehicle.paths) > 1:
                self._choose(vehicle, now, look=look)
        for vehicle in self._doubts.look(vehicles, now, look=look):
            self._renew(vehicle)
        for vehicle in vehicles:
            if vehicle.identity.blocked_s > -math.inf and now - vehicle.identity.blocked_s > CONFLICT_TIMEOUT_S:
                vehicle.identity.blocked, vehicle.identity.blocked_in_flight, vehicle.identity.blocked_s = (
                    "",
                    False,
                    -math.inf,
                )
                text = "only one vehicle uses this id again"
                self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, NOTICE)

    def _choose(self, vehicle: Vehicle, now: float, *, look: bool) -> None:
        if look:
            self._tidy(vehicle, now)
        used, silent_s = vehicle.path, now - vehicle.path.heard_s
        others = [path for path in vehicle.used_paths() if path is not used]
        fresh = [path for path in others if not path.high_latency and now - path.heard_s < PATH_TIMEOUT_S]
        if fresh and (silent_s > PATH_TIMEOUT_S or used.high_latency):
            self._use(vehicle, max(fresh, key=lambda path: path.heard_s))
        elif not fresh and silent_s > LOST_AFTER_S and not used.high_latency:
            distant = [path for path in others if path.high_latency and now - path.heard_s < HIGH_LATENCY_LOST_AFTER_S]
            if distant:
                self._use(vehicle, max(distant, key=lambda path: path.heard_s))
        elif look:
            self._apart(vehicle, others, now)
            for path in others if vehicle.path is used else ():
                ahead_s = lead_s(path, used) if path in fresh else 0.0
                path.ahead_checks = path.ahead_checks + 1 if ahead_s > MIN_AHEAD_S else 0
                if path.ahead_checks >= MIN_AHEAD_CHECKS:
                    self._use(vehicle, path)
                    return

    def _apart(self, vehicle: Vehicle, others: list[Path], now: float) -> None:
        """Two accepted ways whose positions go apart were two vehicles all the time."""
        ours = vehicle.path.position
        for path in others:
            theirs = path.position
            fresh = ours is not None and theirs is not None and now - min(ours.t_s, theirs.t_s) < MIN_SECOND_SOURCE_S
            path.apart_checks = (
                path.apart_checks + 1 if fresh and unexplained_gap_m(ours, theirs) > DIFFERENT_VEHICLE_M else 0
            )
            if path.apart_checks >= MIN_APART_CHECKS:
                _withdraw(path, PathState.CONFLICT)
                self.block(vehicle, f"two vehicles use id {vehicle.system}", in_flight=False)
                self._renew(vehicle)

    def _tidy(self, vehicle: Vehicle, now: float) -> None:
        if vehicle.duplicate_filter is not None:
            vehicle.duplicate_filter.prune(now)
        for path in list(vehicle.paths):
            if path.state is not PathState.USED and now - max(path.heard_s, path.since_s) > UNACCEPTED_TIMEOUT_S:
                self._drop(vehicle, path)

    # ---------------------------------------------------------------- is it one vehicle?

    def check_boot_time(self, vehicle: Vehicle, boot_ms: int, now: float) -> BootTimeResult:
        """Judge the boot clock of a new position over the path in use."""
        step = vehicle.path.boot_clock.check(boot_ms, now)
        if step is BootTimeResult.REBOOT:
            self._rebooted(vehicle)
        elif step is BootTimeResult.OTHER_CLOCK:
            self._twin(vehicle, now)
        return step

    def check_unused_path(self, slot: Slot, now: float) -> None:
        """A position over an accepted path that is not in use: only its boot clock is looked at."""
        vehicle: Vehicle = slot.owner
        path = vehicle.path_of(slot.stream.source)
        if path is not None and path.boot_clock.check(slot.values()[0], now) is BootTimeResult.OTHER_CLOCK:
            self._twin(vehicle, now)

    def _twin(self, vehicle: Vehicle, now: float) -> None:
        times = [t for t in self._twin_s.get(vehicle.id, []) if now - t < CLOCK_ALTERNATION_WINDOW_S] + [now]
        self._twin_s[vehicle.id] = times[-MIN_CLOCK_ALTERNATIONS:]
        if len(times) >= MIN_CLOCK_ALTERNATIONS:
            self._doubts.confirm_conflict(vehicle, now)
            self.block(vehicle, f"two vehicles use id {vehicle.system} on one address", in_flight=True)

    def _rebooted(self, vehicle: Vehicle) -> None:
        vehicle.integrity.reboots += 1
        vehicle.forget_boot()
        self._events.report(EventClass.PROCESSING, f"vehicle {vehicle.id}", "rebooted", WARNING)
        for listener in self.on_reboot:
            listener(vehicle)

    def take_version(self, vehicle: Vehicle, slot: Slot, now: float) -> None:
        """AUTOPILOT_VERSION came over an accepted path: is it the board we know?"""
        uid = uid_of(slot)
        if vehicle.identity.moved:
            self._known(vehicle, uid)
        elif vehicle.identity.uid and uid and uid != vehicle.identity.uid:
            if now - vehicle.identity.uid_reported_s < UID_ALTERNATION_WINDOW_S:
                self._doubts.confirm_conflict(vehicle, now)
                self.block(vehicle, f"two vehicles use id {vehicle.system} on one address", in_flight=True)
            else:
                self._replaced(vehicle)
        vehicle.identity.uid, vehicle.identity.uid_reported_s = uid, now

    def _known(self, vehicle: Vehicle, uid: str) -> None:
        """It said who it is, at its new address."""
        vehicle.identity.moved = ""
        if vehicle.identity.uid and uid != vehicle.identity.uid:
            self._replaced(vehicle)

    def _replaced(self, vehicle: Vehicle) -> None:
        text = f"another vehicle has id {vehicle.system} now: it does not go on with what the other one did"
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, WARNING)
        for listener in self.on_replace:
            listener(vehicle)

    def block(self, vehicle: Vehicle, why: str, *, in_flight: bool) -> None:
        """Evidence that this id is not one vehicle: no commands but stops, until it is gone."""
        vehicle.identity.blocked_s = self._clock.now()
        vehicle.identity.blocked = why
        vehicle.identity.blocked_in_flight |= in_flight
        text = f"DUPLICATE ID: {why}; not commanded until one of them is gone"
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, ALERT, every_s=30)

    def forget(self, vehicle: Vehicle) -> None:
        """The vehicle is not known any more."""
        self._twin_s.pop(vehicle.id, None)
        self._doubts.forget(vehicle)
        for path in vehicle.paths:
            path.source.forget(vehicle.system)
            path.source.vehicle_count -= path.state is PathState.USED


def _withdraw(path: Path, state: PathState) -> None:
    path.state = state
    path.source.vehicle_count -= 1
    path.version_requests, path.next_request_s, path.uid, path.answered = 0, -math.inf, "", False
    path.heartbeats_s, path.contradicts_since_s = [], math.inf
    path.correlation, path.matching_positions, path.apart_checks = None, 0, 0
