"""The vehicle registry: all vehicles by number, found by their heartbeats, on one or several networks.

`VehicleRegistry.place` decides once for each kind of frame what is done with it; the hot path in `mavlink.intake` then
only follows. What is refused, and why, is counted in `VehicleRegistry.dropped`.
"""

import math
from collections import Counter
from collections.abc import Callable
from typing import Any, Protocol

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.rejection_counter import RejectionCounter
from tui_gcs.core.fleet.identity.autopilot_component import is_autopilot, replaces_autopilot
from tui_gcs.core.fleet.identity.boot_clock import BootClock
from tui_gcs.core.fleet.identity.duplicate_filter import DuplicateFilter
from tui_gcs.core.fleet.identity.path import GLOBAL_POSITION_INT, Path, PathState
from tui_gcs.core.fleet.identity.paths import PathSelector
from tui_gcs.core.fleet.identity.unconfirmed_systems import UnconfirmedSystemMonitor
from tui_gcs.core.fleet.other_stations import COMMANDS, OtherStations
from tui_gcs.core.fleet.rejection_report import RejectionReporter
from tui_gcs.core.fleet.status_text import StatusTextReporter
from tui_gcs.core.fleet.telemetry import TelemetryDecoder
from tui_gcs.core.fleet.vehicle import IDS_PER_NETWORK, LOST_AFTER_S, Vehicle, VehicleIdentity
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.mavlink.dialect import MavlinkMessage, label
from tui_gcs.core.mavlink.intake import Intake
from tui_gcs.core.mavlink.sources import CALL, KEEP, STATE, Slot, Source, Stream
from tui_gcs.core.protocol.common import EventClass, Freshness
from tui_gcs.core.records.event_log import ERROR, INFO, NOTICE, WARNING, EventLog

Fields = dict[str, Any]
OnMessage = Callable[[Vehicle, Fields], None]
OnRadio = Callable[[Source, Fields], None]
OnComponent = Callable[[Vehicle, int, Fields], None]
"""A listener to messages of a component; its arguments are vehicle, component id and fields."""
Gate = Callable[[bytes], bool]

# Message ids (minimal.xml, common.xml): what decides that a vehicle exists, what it is and how it is.
HEARTBEAT, AUTOPILOT_VERSION, STATUSTEXT, HIGH_LATENCY2 = 0, 148, 253, 235
SETUP_SIGNING = 256
"""Message id of SETUP_SIGNING, which carries a key: from a vehicle it is an attack, and is neither recorded nor passed
on."""
RADIO_IDS = frozenset({109, 166})
"""RADIO_STATUS and 3DR's older RADIO: sent by the modem, not by a vehicle."""
MAX_CONFIRMED, MAX_UNCONFIRMED = 255, 64
"""Vehicles of one network: MAVLink's own limit, and how many unconfirmed ones beside them (docs/threats.md B.6-20)."""
MAX_COMPONENTS = 32
"""Components of one vehicle on one path; real vehicles with cameras, gimbals and computers have about five."""
MIN_CONFIRMING_FRAMES, MIN_CONFIRMING_S = 5, 0.3
"""A vehicle that sent this many frames over this time, or answered a request, was not one forged heartbeat."""
CONFIRMATION_GRACE_S = 0.6
"""An unconfirmed vehicle keeps its place in a full table for this long."""
DIALECT_HINT_INTERVAL_S = 1.0
"""A differing dialect is reported at most this often per link: noise looks like that, too."""
SILENCE_CHECK_S, PATH_CHECK_S, LOSS_CHECK_S = 0.25, 0.5, 1.0
"""Periods of the checks for lost vehicles, for the freshest path, and for frame loss and delays."""


class SignatureGates(Protocol):
    """The part that decides whether frames of a system are believed: `core/signing/trust.py`."""

    def gate(self, source: Source, system: int) -> Gate | None:
        """Return the check for all frames of a system that come from `source`; None if any frame is believed."""
        ...


class VehicleRegistry:
    """All vehicles that are heard, by station-wide number; routes frames to the parts that decode and judge them."""

    def __init__(
        self,
        clock: Clock,
        events: EventLog,
        frame: LocalFrame,
        own_system: int,
        networks: tuple[str, ...] = ("",),
        gates: SignatureGates | None = None,
    ) -> None:
        """`frame` is the scenario's ENU frame; `own_system` is this station's system id, which no vehicle may use."""
        self.vehicles: dict[int, Vehicle] = {}
        self.dropped = RejectionCounter()
        self.networks = networks
        self.intakes = {network: Intake(network, self) for network in networks}
        self.paths = PathSelector(clock, events, self.dropped, self._place_again)
        self.telemetry = TelemetryDecoder(clock, events, frame, self.dropped, self.paths.check_boot_time)
        self._rejection_reporter = RejectionReporter(events, self.dropped, self.intakes.values())
        self._clock = clock
        self._events = events
        self._own_system = own_system
        self.other_stations = OtherStations(own_system)
        self._gates = gates
        self._on_gone: list[Callable[[Vehicle], None]] = []
        self._on_radio: list[OnRadio] = []
        self._on_component: list[Callable[[Vehicle], None]] = []
        self._on_message: dict[str, list[OnMessage]] = {}
        self._lost: set[int] = set()
        self._full_until_s: dict[str, float] = {}
        """By network: before then the full table is not searched for a place."""
        self._hinted_s: dict[str, float] = {}
        """When a differing dialect was last reported, by link."""
        self.texts = StatusTextReporter(clock, events, self.dropped)
        self.on_message("COMMAND_ACK", self.other_stations.on_ack(clock.now))
        self._on_other_component: dict[str, list[OnComponent]] = {}
        self._unconfirmed = UnconfirmedSystemMonitor(events)
        self._next_look_s = self._next_paths_s = self._next_loss_s = -math.inf

    @property
    def frame(self) -> LocalFrame:
        """The scenario's ENU frame."""
        return self.telemetry.frame

    def in_order(self) -> list[Vehicle]:
        """Return all vehicles by number."""
        return [self.vehicles[i] for i in sorted(self.vehicles)]

    def find(self, network: str, system: int) -> Vehicle | None:
        """Return the vehicle with that system id on that network; None if there is none."""
        return self.vehicles.get(self._number(network, system))

    def on_gone(self, listener: Callable[[Vehicle], None]) -> None:
        """Call `listener` with each vehicle that was never confirmed and is removed."""
        self._on_gone.append(listener)

    def on_component(self, listener: Callable[[Vehicle], None]) -> None:
        """Call `listener` with a vehicle when its autopilot turned out to be another component."""
        self._on_component.append(listener)

    def on_radio(self, listener: OnRadio) -> None:
        """Call `listener` for each RADIO_STATUS of a modem that vehicles are heard through."""
        self._on_radio.append(listener)

    def on_message(self, name: str, listener: OnMessage) -> None:
        """Call `listener` for each message `name` of a known vehicle's autopilot, after telemetry has taken it."""
        self._on_message.setdefault(name, []).append(listener)
        for intake in self.intakes.values():
            for source in intake.sources.values():
                source.forget()

    def on_message_of_any_component(self, name: str, listener: OnComponent) -> None:
        """Call `listener` for each message `name` of a vehicle's autopilot and of its other components."""

        def from_autopilot(vehicle: Vehicle, fields: Fields) -> None:
            listener(vehicle, vehicle.component, fields)

        self.on_message(name, from_autopilot)
        self.on_message_of_other_components(name, listener)

    def on_message_of_other_components(self, name: str, listener: OnComponent) -> None:
        """Call `listener` for each message `name` of cameras, gimbals, receivers and Remote ID transmitters.

        Listeners register before the first frame arrives.
        """
        self._on_other_component.setdefault(name, []).append(listener)

    def newest(self, vehicle: Vehicle, msgid: int) -> MavlinkMessage | None:
        """Decode and return the newest message of that id from a vehicle's autopilot; None if none came."""
        slot = vehicle.path.slots.get(msgid)
        if slot is None or not slot.raw:
            return None
        return MavlinkMessage(label(msgid), msgid, slot.system, slot.component, slot.fields())

    def place(self, slot: Slot, source: Source) -> None:
        """Set what is done with a slot's frames: its gate, owner, route and call. See `mavlink.intake.FrameRouter`."""
        slot.gate = self._gates.gate(source, slot.system) if self._gates is not None else None
        # A key in a frame from a vehicle: nothing may record or forward it.
        if slot.msgid == SETUP_SIGNING:
            self._refuse(slot, "SETUP_SIGNING from a vehicle")
        # A modem may use any system id, so that its message ids come before the look-up of a vehicle.
        elif slot.msgid in RADIO_IDS:
            slot.route, slot.call = CALL, self._radio
            # The frame is the modem's, whatever ids it uses: it is no sign of life of an autopilot.
            slot.stream = Stream(source)
        elif slot.system == 0:
            self._refuse(slot, "system id 0")
        elif slot.system == self._own_system:
            slot.route, slot.call = CALL, self._take_own_id
        else:
            vehicle = self.find(source.network, slot.system)
            if vehicle is None:
                self._place_stranger(slot)
            else:
                self._place_vehicle(vehicle, slot, source)

    def _place_again(self, source: Source, system: int) -> None:
        """Have each slot of a system placed anew with its next frame, because paths changed.

        What it holds and counted stays.
        """
        for slot in (*source.slots.values(), *source.unknown.values()):
            if slot.system == system:
                slot.route, slot.call = CALL, self._replace_slot

    def _replace_slot(self, slot: Slot, now: float) -> bool:
        slot.route, slot.call = KEEP, _nothing
        self.place(slot, slot.stream.source)
        return slot.call(slot, now) is not False

    def must_keep(self, slot: Slot) -> bool:
        """Return whether a slot stays when the table is full: known messages of confirmed vehicles do."""
        return slot.owner is not None and slot.owner.identity.confirmed and slot.layout is not None

    def report_oddity(self, source: Source, what: str) -> None:
        """Report a downgrade, a full table or a differing dialect, each at most every 30 s."""
        # Only a series of refused version 1 frames is worth an event.
        if what == "downgrade" and source.version1_refused < 5:
            return
        now = self._clock.now()
        if what.startswith("dialect differs"):
            if now - self._hinted_s.get(source.link, -math.inf) < DIALECT_HINT_INTERVAL_S:
                return
            self._hinted_s[source.link] = now
        text = {
            "downgrade": "MAVLink 1 frames after MAVLink 2: refused (a downgrade?)",
            "table full": "too many kinds of frames: a flood, new ones are refused",
        }.get(what, f"{what}: frames with another CRC come from {_address_text(source)}; give its XML with --dialect")
        self._events.report(EventClass.CONNECTION, f"link {source.link}", text, WARNING, every_s=30)

    def _place_stranger(self, slot: Slot) -> None:
        """Place frames of an id that is no vehicle yet: only its heartbeat makes it one."""
        slot.route = CALL
        if slot.msgid in (HEARTBEAT, HIGH_LATENCY2):
            slot.call = self._take_first
        else:
            slot.call = self._drop_early

    def _place_vehicle(self, vehicle: Vehicle, slot: Slot, source: Source) -> None:
        path = vehicle.path_of(source) or self.paths.add(vehicle, source)
        if path is None:
            self._refuse(slot, "second source of one system id")
            return
        if slot.stream not in path.streams:
            if len(path.streams) >= MAX_COMPONENTS and slot.component != vehicle.component:
                self._refuse(slot, "too many components of one system")
                return
            path.streams.append(slot.stream)
        slot.owner = vehicle
        if slot.component == vehicle.component:
            path.autopilot_stream = slot.stream
        # Frames of a path that is not accepted are judged, never used.
        if path.state is not PathState.USED:
            slot.route, slot.call = CALL, self.paths.take_unaccepted
            if slot.gate is not None and vehicle.duplicate_filter is not None:
                slot.gate = _pass_copies(slot.gate, path, vehicle.duplicate_filter)
            return
        if slot.component == vehicle.component:
            path.slots[slot.msgid] = slot
            self._place_autopilot(vehicle, slot, path)
        elif slot.msgid == STATUSTEXT:
            slot.route, slot.call = CALL, self._take_each
        elif slot.msgid == HEARTBEAT and path is vehicle.path:
            slot.route, slot.call = CALL, self._take_other_heartbeat
        elif path is vehicle.path and slot.layout is not None and slot.layout.name in self._on_other_component:
            slot.route, slot.call = CALL, self._deliver
        if vehicle.duplicate_filter is not None:
            _filter_duplicates(slot, vehicle, path, vehicle.duplicate_filter, self.dropped)

    def _place_autopilot(self, vehicle: Vehicle, slot: Slot, path: Path) -> None:
        """Place the autopilot's frames: telemetry counts on the path in use, everything else on every accepted path."""
        telemetry = self.telemetry
        heard = slot.layout is not None and slot.layout.name in self._on_message
        if slot.msgid in telemetry.newest:
            if path is vehicle.path:
                slot.route, slot.call = STATE, self._take_newest if heard else telemetry.newest[slot.msgid]
                if vehicle.identity.watched and slot.msgid == GLOBAL_POSITION_INT:
                    slot.route = CALL
            elif vehicle.identity.watched and slot.msgid == GLOBAL_POSITION_INT:
                slot.route, slot.call = CALL, self.paths.check_unused_path
        elif slot.msgid == HEARTBEAT and path is not vehicle.path:
            slot.route = 0
        elif heard or slot.msgid in (AUTOPILOT_VERSION, STATUSTEXT):
            slot.route, slot.call = CALL, self._take_each
        elif slot.msgid in telemetry.every:
            slot.route, slot.call = CALL, telemetry.every[slot.msgid]

    def _refuse(self, slot: Slot, reason: str) -> None:
        dropped = self.dropped

        def refuse(slot: Slot, now: float) -> bool:
            vehicle = self.find(slot.stream.source.network, slot.system)
            dropped.count(reason, vehicle.id if vehicle is not None else None)
            return False

        slot.route, slot.call = CALL, refuse

    def _take_newest(self, slot: Slot, now: float) -> None:
        """Take a message of which only the newest counts and that a listener wants as well."""
        self.telemetry.newest[slot.msgid](slot, now)
        self._notify(slot.owner, slot)

    def _take_each(self, slot: Slot, now: float) -> None:
        """Take a message of which each one counts."""
        vehicle: Vehicle = slot.owner
        handler = self.telemetry.every.get(slot.msgid)
        if slot.msgid == STATUSTEXT:
            if not self.texts.has_room(vehicle, slot.raw):
                return
            self.texts.take_status_text(vehicle, slot.fields())
        if slot.component != vehicle.component:
            return
        if slot.msgid == AUTOPILOT_VERSION:
            self._version(vehicle, slot, now)
        elif handler is not None:
            handler(slot, now)
        self._notify(vehicle, slot)

    def _notify(self, vehicle: Vehicle, slot: Slot) -> None:
        listeners = self._on_message.get(slot.layout.name) if slot.layout is not None else None
        if listeners:
            fields = slot.fields()
            for listener in listeners:
                listener(vehicle, fields)

    def _version(self, vehicle: Vehicle, slot: Slot, now: float) -> None:
        self.paths.take_version(vehicle, slot, now)
        vehicle.identity.identified = True
        self._confirm(vehicle)
        vehicle.identity.firmware_token = bytes(slot.fields()["flight_custom_version"]).hex()

    def _take_own_id(self, slot: Slot, now: float) -> bool:
        self.dropped["our own system id"] += 1
        text = f"another station uses our system id {self._own_system}: change one of them"
        self._events.report(EventClass.CONNECTION, "station", text, ERROR, every_s=30)
        return False

    def _radio(self, slot: Slot, now: float) -> bool:
        """Pass on RADIO_STATUS where confirmed vehicles are heard: a stranger's would throttle the link."""
        source = slot.stream.source
        # RADIO_STATUS sets the rates of a link. A forged one must not throttle it, so the modem needs a vehicle
        # behind it.
        if not any(v.identity.confirmed and v.uses(source) for v in self.vehicles.values()):
            self.dropped["radio status from a stranger"] += 1
            return False
        for listener in self._on_radio:
            listener(source, slot.fields())
        return True

    def _drop_early(self, slot: Slot, now: float) -> bool:
        if slot.layout is not None and slot.layout.name in COMMANDS:
            network, name = slot.stream.source.network, slot.layout.name
            self.other_stations.hear_frame(network, slot.system, name, slot.fields(), now)
        self.dropped["before its first heartbeat"] += 1
        return True

    def _take_first(self, slot: Slot, now: float) -> bool:
        """Make a vehicle of the first HEARTBEAT or HIGH_LATENCY2 of an unknown id, if a flight controller sent it."""
        fields = slot.fields()
        if not is_autopilot(fields, slot.component):
            self.other_stations.hear(slot.stream.source.network, slot.system, fields, now)
            self.dropped["not a vehicle"] += 1
            return True
        source = slot.stream.source
        if not self._has_room(source.network):
            self.dropped["vehicle table full"] += 1
            return False
        vehicle = Vehicle(
            id=self._number(source.network, slot.system),
            system=slot.system,
            network=source.network,
            path=self.paths.first_path(source),
            autopilot=fields["autopilot"],
            type=fields["type"],
            component=slot.component,
            identity=VehicleIdentity(first_heard_s=now, keyed=slot.gate is not None),
        )
        vehicle.paths = [vehicle.path]
        self.vehicles[vehicle.id] = vehicle
        # Slots that came before were placed as those of a stranger.
        source.forget(slot.system)
        self._place_vehicle(vehicle, slot, source)
        self._take_each(slot, now)
        return True

    def _take_other_heartbeat(self, slot: Slot, now: float) -> bool:
        """Take a heartbeat of another component than the chosen autopilot, which may be the real one."""
        vehicle: Vehicle = slot.owner
        if not replaces_autopilot(vehicle, slot.fields(), slot.component, now):
            return self._deliver(slot, now)
        # What was read so far came from another component, and is not continued.
        vehicle.component = slot.component
        vehicle.forget_boot()
        for path in vehicle.paths:
            path.slots.clear()
            path.boot_clock = BootClock()
            self._place_again(path.source, vehicle.system)
        text = f"its autopilot now sends as component {slot.component}"
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, WARNING, every_s=30)
        for listener in self._on_component:
            listener(vehicle)
        self._replace_slot(slot, now)
        return True

    def _deliver(self, slot: Slot, now: float) -> bool:
        """Deliver the newest frame of another component than the autopilot; True: it is recorded and passed on."""
        vehicle: Vehicle = slot.owner
        if slot.layout is not None and slot.component != vehicle.component:
            fields = slot.fields()
            for listener in self._on_other_component.get(slot.layout.name, ()):
                listener(vehicle, slot.component, fields)
        return True

    def _number(self, network: str, system: int) -> int:
        return self.networks.index(network) * IDS_PER_NETWORK + system

    def _has_room(self, network: str) -> bool:
        """Return whether one more vehicle fits; the unconfirmed one that is silent longest is removed for it."""
        now = self._clock.now()
        # A search per frame would make a flood of heartbeats expensive.
        if now < self._full_until_s.get(network, -math.inf):
            return False
        mine = [vehicle for vehicle in self.vehicles.values() if vehicle.network == network]
        unconfirmed = [vehicle for vehicle in mine if not vehicle.identity.confirmed]
        if len(mine) - len(unconfirmed) >= MAX_CONFIRMED:
            return False
        if len(unconfirmed) < MAX_UNCONFIRMED:
            return True
        quietest = min(unconfirmed, key=lambda vehicle: vehicle.last_heard_s)
        # A whole fleet came at once: the others get their turn after this time.
        if now - quietest.last_heard_s < CONFIRMATION_GRACE_S:
            self._full_until_s[network] = quietest.last_heard_s + CONFIRMATION_GRACE_S
            return False
        self._remove(quietest)
        self.dropped.count("unconfirmed vehicle forgotten", quietest.id)
        return True

    def _remove(self, vehicle: Vehicle) -> None:
        del self.vehicles[vehicle.id]
        self._lost.discard(vehicle.id)
        self.paths.forget(vehicle)
        for listener in self._on_gone:
            listener(vehicle)

    def tick(self) -> None:
        """Read the newest telemetry, report lost vehicles and those heard again, check paths, finish chunked texts."""
        now = self._clock.now()
        for intake in self.intakes.values():
            intake.settle()
            intake.tick(now)
        self._rejection_reporter.tick(now)
        if now >= self._next_look_s - 1e-9:
            self._next_look_s = now + SILENCE_CHECK_S
            self._check_vehicles(now)
        if now >= self._next_loss_s - 1e-9:
            self._next_loss_s = now + LOSS_CHECK_S
            for vehicle in self.vehicles.values():
                vehicle.loss_pct = loss_pct(vehicle.path)
            self.telemetry.report_delays(self.vehicles.values(), now)
            for removed in self._unconfirmed.look(self.vehicles.values(), now):
                self._remove(removed)
                self.dropped.count("vehicle of heartbeats only forgotten", removed.id)
        self.texts.tick(self.vehicles)

    def _check_vehicles(self, now: float) -> None:
        """Report vehicles that are lost or heard again, and confirm those that sent enough frames."""
        vehicles, lost = list(self.vehicles.values()), self._lost
        # A position that is newer than the limit shows that the vehicle is heard, and is cheaper to read than
        # `last_heard_s`.
        for vehicle in vehicles:
            if vehicle.id in lost or (
                now - vehicle.telemetry.position_s > LOST_AFTER_S and now - vehicle.last_heard_s > LOST_AFTER_S
            ):
                self._check_silence(vehicle, now)
            if not vehicle.identity.confirmed and now - vehicle.identity.first_heard_s >= MIN_CONFIRMING_S:
                frames = sum(slot.count for slot in vehicle.path.slots.values())
                if frames >= MIN_CONFIRMING_FRAMES:
                    self._confirm(vehicle)
        if now >= self._next_paths_s - 1e-9:
            self._next_paths_s = now + PATH_CHECK_S
            self.paths.tick(vehicles)

    def _confirm(self, vehicle: Vehicle) -> None:
        """Confirm a vehicle and report it. Unconfirmed ones are not reported: forged heartbeats would flood the log."""
        if not vehicle.identity.confirmed:
            vehicle.identity.confirmed = True
            self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", f"heard on {vehicle.link}", INFO)

    def _check_silence(self, vehicle: Vehicle, now: float) -> None:
        """Report when a vehicle is lost and when it is heard again."""
        lost = vehicle.freshness(now) is Freshness.LOST
        if lost and vehicle.id not in self._lost:
            self._lost.add(vehicle.id)
            text = f"LOST: nothing heard for {vehicle.lost_after_s(now):.1f} s"
            self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", text, ERROR)
        elif not lost and vehicle.id in self._lost:
            self._lost.discard(vehicle.id)
            self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", "heard again", NOTICE)

    def reframe(self, frame: LocalFrame) -> None:
        """Use another ENU frame: positions and homes are computed anew."""
        self.telemetry.reframe(frame, list(self.vehicles.values()))


def _nothing(slot: Slot, now: float) -> bool:
    return True


def _filter_duplicates(
    slot: Slot, vehicle: Vehicle, path: Path, duplicates: DuplicateFilter, dropped: Counter[str]
) -> None:
    """Make a slot take each frame once: over whichever of several paths brings it first it is recorded and passed on.

    State is read from the path in use, be it from copies or not.
    """
    gate, route, call = slot.gate, slot.route, slot.call
    # Telemetry and heartbeats of the path in use are read even from copies, or they would cease while another path is
    # faster.
    always = path is vehicle.path and (route == STATE or slot.msgid == HEARTBEAT)

    def once(slot: Slot, now: float) -> bool:
        first = duplicates.is_first(slot.raw, path, now)
        if not first:
            dropped["copy over a second link"] += 1
        accepted = call(slot, now) is not False if route and (first or always) else True
        return accepted and first

    slot.route, slot.call = CALL, once
    if gate is not None:
        slot.gate = _pass_copies(gate, path, duplicates)


def _pass_copies(gate: Gate, path: Path, duplicates: DuplicateFilter) -> Gate:
    """Return a gate that lets copies pass: the original was checked, and a second check would take it for a replay."""
    return lambda raw: duplicates.is_copy(raw, path) or gate(raw)


def frame_counts(path: Path) -> tuple[int, int]:
    """Return how many of the autopilot's frames were received over a path, and how many were lost."""
    streams = {slot.stream for slot in path.slots.values()}
    frames = sum(slot.count for slot in path.slots.values()) + sum(stream.frames for stream in streams)
    return frames, sum(stream.lost for stream in streams)


def loss_pct(path: Path) -> float:
    """Return the share of the autopilot's frames that were lost on a path, 0…100."""
    for stream in path.streams:
        if stream.lost:
            break
    else:
        return 0.0
    frames, lost = frame_counts(path)
    return 100.0 * lost / (frames + lost) if frames + lost else 0.0


def _address_text(source: Source) -> str:
    return f"{source.address[0]}:{source.address[1]}" if isinstance(source.address, tuple) else source.address
