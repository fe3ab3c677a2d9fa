"""Forwarder: telemetry out to other stations and, where the operator allowed it, their commands in through our guard.

Out go the bytes as they came, by MAVLink's routing rules (https://mavlink.io/en/guide/routing.html): broadcasts to
every partner, addressed frames only to where that system was heard, nothing back to the link it came from, no keys. In
come only frames on the allow-list of `command_rules`, each for one named vehicle, and only through the uplink;
heartbeats of other stations, set-points and keys never. Missions go to the vehicle whole or not at all
(`mission_relay`). What is refused is answered as the vehicle would (`refusal_answers`).
"""

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import IDS_PER_NETWORK, Vehicle
from tui_gcs.core.forward.command_rules import KEYS, MESSAGES, STEERING, judge, may_stop
from tui_gcs.core.forward.foreign_missions import ForeignMission
from tui_gcs.core.forward.mission_relay import VEHICLE_FRAMES, MissionRelay, MissionUpload
from tui_gcs.core.forward.ports import MAX_FRAMES_PER_S, MAX_PARTNERS, Port
from tui_gcs.core.forward.refusal_answers import refusal_answer, status_texts
from tui_gcs.core.forward.request_checks import (
    MISSION_DENIED,
    MISSION_INVALID_SEQUENCE,
    ForeignRequest,
    ParameterCheck,
    Ruling,
    no_parameter_problem,
)
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.permission import Order, OrderClass
from tui_gcs.core.links import Link, LinkError
from tui_gcs.core.mavlink.dialect import MavlinkMessage, is_known, layout, message_name
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import MAGIC_V2, Frame, cut_datagram, decode
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import NOTICE, WARNING, EventLog
from tui_gcs.core.uplink.commands import DENIED, TEMPORARILY_REJECTED
from tui_gcs.core.uplink.uplink import Uplink

MAX_CLOSED = 16
"""Closed endpoints whose counts are kept."""
ANSWER_GAP_S = 1.0
"""The same refused request is answered at most this often (docs/threats.md B.6-49)."""
# Message id.
MISSION_CURRENT = 42
MISSION_FRAMES = VEHICLE_FRAMES | {MISSION_CURRENT}
ITEMS = frozenset({"MISSION_ITEM", "MISSION_ITEM_INT"})
# A program that keeps sending what is refused must not fill the journal.
EVENT_GAP_S = 1.0
EVENT_REPEAT_S = 30.0
"""Shortest time between events of the same cause per endpoint: of requests, and of what is wrong with a partner."""


@dataclass(frozen=True)
class Endpoint:
    """Another station, or many: `--forward X`, with commands in `--forward-commands X`. Serves `link.spec.network`."""

    link: Link
    commands: bool


@dataclass(frozen=True)
class ForeignFrame:
    """One frame of another station, and where it came in."""

    port: Port
    frame: Frame
    address: Address

    @property
    def sender(self) -> str:
        """Address, system and component, in words."""
        return f"{_place(self.address)} {self.frame.system}/{self.frame.component}"


class Forwarder:
    """Reads and serves all endpoints; the caller hands over what vehicles sent."""

    def __init__(
        self,
        endpoints: list[Endpoint],
        fleet: VehicleRegistry,
        uplink: Uplink,
        guard: Guard,
        networks: Mapping[str, int],
        own_system: int,
        own_component: int,
        clock: Clock,
        events: EventLog,
    ) -> None:
        """`networks`: number of each network by name; `own_system`/`own_component` sign our refusals.

        Raises:
            LinkError: an endpoint serves a network that no link has.
        """
        self._fleet = fleet
        self._uplink = uplink
        self._guard = guard
        self._networks = networks
        self._own_system = own_system
        self._clock = clock
        self._events = events
        self._own_component = own_component
        self.ports: list[Port] = []
        """All endpoints; those that an operator has closed stay for their counts until there are too many."""
        self._plans: defaultdict[int, ForeignMission] = defaultdict(ForeignMission)
        """The mission of each vehicle, by number."""
        self._relay = MissionRelay(clock, self._pass_upload, self._end_upload)
        self.on_passed: list[Callable[[Vehicle, Ruling, str], None]] = []
        """Called with the vehicle that got something, the ruling by which it passed, and its sender."""
        self.parameter_problem: ParameterCheck = no_parameter_problem
        """Set by the station to the check of its own parameter service."""
        self._texts = 0
        """Number of the last STATUSTEXT in a vehicle's name, which joins its chunks."""
        self.forwarded = 0
        """Frames out, once per partner."""
        self.passed = 0
        """Frames of other stations that went to a vehicle."""
        self.refused: Counter[str] = Counter()
        """Frames of other stations that ask for what is not allowed, or are not what they seem, by reason."""
        self.dropped: Counter[str] = Counter()
        """Frames without any fault that no system here or at an endpoint is to get, both ways, by reason."""
        for endpoint in endpoints:
            self.open(endpoint)

    def open(self, endpoint: Endpoint) -> None:
        """Begin to serve an endpoint; one of the same name that was closed makes room for it.

        Raises:
            LinkError: it serves a network that no link has.
        """
        link = endpoint.link
        if link.spec.network not in self._networks:
            known = ", ".join(name or "(default)" for name in self._networks)
            raise LinkError(f"{link.name}: no link has network {link.spec.network!r}; there is {known}")
        encoder = Encoder(self._own_system, self._own_component)
        self.ports = [port for port in self.ports if port.link.name != link.name]
        self.ports.append(Port(link, endpoint.commands, encoder, self._clock.now()))

    def close(self, name: str, by: str) -> None:
        """Close the endpoint of this name, which is open; what it sent and was refused stays known.

        A mission that is being collected of it is dropped. One that is being handed to its vehicle goes to the end,
        because ArduPilot has cut its old mission at the announcement: half of a mission would stay on board.
        """
        for port in self.ports:
            if port.link.name == name and not port.is_closed:
                port.close(by)
                self._relay.drop_collected(port)
        closed = [port for port in self.ports if port.is_closed]
        for port in closed[: max(0, len(closed) - MAX_CLOSED)]:
            self.ports.remove(port)

    def filenos(self) -> list[int]:
        """Return descriptors for select: one of them is readable when another station has sent something."""
        return [number for port in self.ports for number in port.link.filenos()]

    def feed(self, network: str, link: str, raws: list[bytes]) -> None:
        """Send on frames that vehicles of `network` sent over `link`, in order.

        Unknown message ids go to every partner.
        """
        targets = [
            (port, partner)
            for port in self.ports
            if port.link.spec.network == network and port.link.name != link and not port.is_closed
            for partner in port.partners.values()
        ]
        if not targets:
            self._note_missions(network, raws)
            return
        for raw in raws:
            msgid, system, component = _routing(raw)
            # Keys never leave, not even to a trusted partner.
            if msgid in KEYS:
                self.refused["key"] += 1
                continue
            if msgid in MISSION_FRAMES and self._note_mission(network, raw):
                continue
            sent = self.forwarded
            for port, partner in targets:
                if system == 0 or partner.is_for(system, component):
                    port.put(partner, raw)
                    self.forwarded += 1
            if self.forwarded == sent:
                self.dropped["for no system at an endpoint"] += 1
        for port, partner in targets:
            port.send_waiting(partner)

    def _note_missions(self, network: str, raws: list[bytes]) -> None:
        """Note what vehicles send of their missions while nobody hears them, if a mission of a partner is known.

        A vehicle may still be taking it; and when it is replaced meanwhile, it must not be started by who comes back.
        """
        if self._relay.is_busy or any(plan.sender is not None for plan in self._plans.values()):
            for raw in raws:
                if _routing(raw)[0] in MISSION_FRAMES:
                    self._note_mission(network, raw)

    def _note_mission(self, network: str, raw: bytes) -> bool:
        """Note what an autopilot sent of its mission; whether it belongs to an upload that this station hands over."""
        taken = False
        for frame in cut_datagram(raw).frames:
            number, message = self._networks[network] * IDS_PER_NETWORK + frame.system, decode(frame)
            vehicle = self._fleet.vehicles.get(number)
            if message is None or vehicle is None or vehicle.component != frame.component:
                continue
            plan = self._plans[number]
            if message.msgid == MISSION_CURRENT:
                plan.on_current(message.fields["seq"], self._clock.now())
            else:
                taken = self._relay.on_vehicle(vehicle, message, plan)
        return taken

    def tick(self) -> None:
        """Read all endpoints and pass on what may be passed on; forget partners that fell silent."""
        now = self._clock.now()
        for port in self.ports:
            if port.is_closed:
                continue
            for data, address in port.link.receive():
                self._take_all(port, *port.cut(data, address, now), address)
            for frames, bad_crc, address in port.flush(now):
                self._take_all(port, frames, bad_crc, address)
            port.keep_partners(now)
        self._relay.tick()

    def _take_all(self, port: Port, frames: list[Frame], bad_crc: int, address: Address) -> None:
        if bad_crc:
            self._count_refused(port, address, "bad CRC", bad_crc)
            self._report(port, "bad CRC", f"{_place(address)} sends frames with a wrong CRC: not used", EVENT_REPEAT_S)
        for frame in frames:
            self._take(ForeignFrame(port, frame, address))

    def _take(self, foreign: ForeignFrame) -> None:
        """Handle one frame of another station."""
        port, frame, now = foreign.port, foreign.frame, self._clock.now()
        if not is_known(frame.msgid):  # its CRC cannot be checked: anything may be in it
            self.dropped["unknown message id"] += 1
            return
        # System 0 is the address of all systems, and never a sender.
        if frame.system == 0:
            self._turn_away(foreign, "system id 0", "uses system id 0: not used")
            return
        # A frame with a vehicle's id would be taken for that vehicle's telemetry by every other partner.
        if self._vehicle(port, frame.system) is not None:
            self._turn_away(foreign, "a vehicle's system id", "uses a vehicle's system id: not used")
            return
        partner = port.partner(foreign.address, now)
        if partner is None:
            self._turn_away(foreign, "too many partners", f"gets nothing: {MAX_PARTNERS} partners are served already")
        elif frame.system == self._own_system:
            partner.last_heard_s = now  # may listen, but what is for us is not for it
            text = f"uses our own system id {self._own_system}: give that station another one"
            self._turn_away(foreign, "our own system id", text)
        else:
            partner.heard(frame.system, frame.component, now)
            if port.commands and (message := decode(frame)) is not None:
                self._dispatch(foreign, message)
            elif not port.commands and message_name(frame.msgid) in MESSAGES:
                # Without an event: programs that only show vehicles ask for a lot.
                self._count_refused(port, foreign.address, "it only listens")
            else:
                self.dropped["endpoint takes no commands"] += 1

    def _dispatch(self, foreign: ForeignFrame, message: MavlinkMessage) -> None:
        """Pass on a message of another station, refuse it, or drop it as addressed to no vehicle here."""
        name, target = message.name, message.fields.get("target_system", 0)
        vehicle = self._vehicle(foreign.port, target)
        if message.msgid in KEYS or name in STEERING:
            self._turn_away(foreign, name, f"sends {name}: never passed on", vehicle)
        elif name in MESSAGES and _is_longer(foreign.frame):
            text = f"sends {name} with more in it than we can read"
            self._turn_away(foreign, "longer than its message", text, vehicle)
        elif name in MESSAGES and vehicle is not None:
            self._request(foreign, message, vehicle)
        elif name in MESSAGES:
            why = f"there is no system {target} here" if target else "not addressed to one vehicle by its id"
            self._refuse(foreign, message, "no such vehicle", why)
        elif vehicle is not None:
            self._turn_away(
                foreign, "not on the list", f"sends {name} for vehicle {vehicle.id}: not passed on", vehicle
            )
        else:
            self.dropped["not for a vehicle"] += 1

    def _request(self, foreign: ForeignFrame, message: MavlinkMessage, vehicle: Vehicle) -> None:
        """Have a request to a vehicle checked; if it may pass, hand it on."""
        fleet, plan, now = self._fleet, self._plans[vehicle.id], self._clock.now()
        others, upload = fleet.vehicles.values(), self._relay.collected(vehicle, message)
        request = ForeignRequest(
            message, vehicle, self._guard, fleet.frame, others, now, plan, upload, self.parameter_problem
        )
        ruling = self._ruling(foreign.port, request)
        if ruling is None:
            why = f"more than {MAX_FRAMES_PER_S:.0f} frames a second"
            self._refuse(foreign, message, "too many", why, vehicle, TEMPORARILY_REJECTED)
        elif ruling.why_not:
            self._refuse(
                foreign, message, "by the rules", ruling.why_not, vehicle, mission_result=ruling.mission_result
            )
            if message.name in ITEMS and ruling.mission_result != MISSION_INVALID_SEQUENCE:
                self._relay.cancel(vehicle, message)
        # The frame keeps its sender, so it cannot be signed here in that one's name.
        elif vehicle.identity.keyed and not foreign.frame.signed:
            why = "takes signed frames only, and what others send is not signed for it"
            self._refuse(foreign, message, "not signed", why, vehicle)
        else:
            self._hand_on(foreign, request, ruling)

    @staticmethod
    def _ruling(port: Port, request: ForeignRequest) -> Ruling | None:
        """The ruling on a request, None if there are too many."""
        upload = request.upload
        # The station asked for this item, and nothing leaves for it: no limit but that of the requests.
        if upload is not None and request.name in ITEMS and request.fields["seq"] == len(upload.steps):
            return judge(request)
        # Stops are checked even when the limit of other frames is reached.
        urgent = may_stop(request)
        ruling = judge(request) if urgent or port.ordinary.has_one(request.now) else None
        bucket = port.stops if ruling is not None and ruling.order_class is OrderClass.STOP else port.ordinary
        # A stop has a bucket of its own: an upload of 50 frames a second must not keep a hold waiting.
        if ruling is None or not bucket.has_one(request.now):
            return None
        bucket.take()
        return ruling

    def _hand_on(self, foreign: ForeignFrame, request: ForeignRequest, ruling: Ruling) -> None:
        """Collect what belongs to an upload, and hand all else to the uplink."""
        message, vehicle, raw = request.message, request.vehicle, foreign.frame.raw
        port = foreign.port
        if message.name in ITEMS:
            self._relay.add(request, raw)
        elif message.name == "MISSION_COUNT" and message.fields["count"]:
            why = self._relay.announce(request, port, foreign.address, foreign.sender, raw)
            if why:
                self._refuse(foreign, message, "by the rules", why, vehicle)
        elif message.name == "MISSION_ACK" and request.upload is not None:
            self._relay.cancel(vehicle, message)
        elif message.name in ("MISSION_COUNT", "MISSION_CLEAR_ALL") and (why := self._relay.busy(vehicle)):
            self._refuse(foreign, message, "by the rules", why, vehicle)
        elif why := self._pass_on(foreign, vehicle, ruling):
            self._refuse(foreign, message, "by the uplink", why, vehicle)
        elif message.name in ("MISSION_COUNT", "MISSION_CLEAR_ALL") and message.fields["mission_type"] == 0:
            self._plans[vehicle.id].forget()

    def _pass_on(self, foreign: ForeignFrame, vehicle: Vehicle, ruling: Ruling) -> str:
        """Have the uplink send a frame of another station to the vehicle; "" or why not."""
        port, raw, sender = foreign.port, foreign.frame.raw, foreign.sender
        source = f"{port.link.name} {sender}"
        why = self._uplink.foreign(vehicle.id, raw, Order(ruling.what, ruling.order_class, source))
        if why:
            return why
        self.passed += 1
        port.count_passed(foreign.address)
        for listener in self.on_passed:
            listener(vehicle, ruling, source)
        if not ruling.quiet:
            self._report(port, "passed on", f"{sender}: {ruling.what}, vehicle {vehicle.id}", EVENT_GAP_S, NOTICE)
        return ""

    def _pass_upload(self, upload: MissionUpload, raw: bytes, what: str) -> str:
        """Hand a frame of a collected upload to the vehicle; "" or why not."""
        if raw == upload.announcement and upload.kind == 0:
            self._plans[upload.vehicle.id].forget()
        (frame,) = cut_datagram(raw).frames
        return self._pass_on(ForeignFrame(upload.port, frame, upload.address), upload.vehicle, Ruling(what))

    def _end_upload(self, upload: MissionUpload, result: int, why: str) -> None:
        """Report to operator and station that an upload ended without the vehicle's MISSION_ACK."""
        port, vehicle = upload.port, upload.vehicle
        self._count_refused(port, upload.address, "upload ended")
        text = f"{upload.station}: mission refused: vehicle {vehicle.id}: {why}"
        self._report(port, "refused upload ended", text, EVENT_GAP_S)
        system, component = upload.sender
        port.send_as(
            vehicle,
            upload.address,
            "MISSION_ACK",
            target_system=system,
            target_component=component,
            type=result,
            mission_type=upload.kind,
        )
        self._send_text(port, vehicle, upload.address, why)

    def _count_refused(self, port: Port, address: Address, reason: str, frames: int = 1) -> None:
        self.refused[reason] += frames
        port.count_refused(address, reason, frames)

    def _turn_away(self, foreign: ForeignFrame, reason: str, text: str, vehicle: Vehicle | None = None) -> None:
        """Count what is wrong with a partner, and report it now and then; to it, too, if it was for a `vehicle`."""
        self._count_refused(foreign.port, foreign.address, reason)
        self._report(foreign.port, reason, f"{foreign.sender} {text}", EVENT_REPEAT_S)
        if vehicle is not None and foreign.port.may_answer((vehicle.id, reason), EVENT_REPEAT_S, self._clock.now()):
            self._send_text(foreign.port, vehicle, foreign.address, f"{reason}: not passed on")

    def _refuse(
        self,
        foreign: ForeignFrame,
        message: MavlinkMessage,
        reason: str,
        why: str,
        vehicle: Vehicle | None = None,
        result: int = DENIED,
        mission_result: int = MISSION_DENIED,
    ) -> None:
        """Count, report and answer that something is not passed on.

        The answers are those of `vehicle`; a command to a system that is not here is answered by this station.
        """
        port, now = foreign.port, self._clock.now()
        self._count_refused(foreign.port, foreign.address, reason)
        text = why if vehicle is None else f"vehicle {vehicle.id}: {why}"
        self._report(port, f"refused {reason}", f"{foreign.sender}: {message.name} refused: {text}", EVENT_GAP_S)
        fields = message.fields
        subject = fields.get("command", fields.get("param_id", fields.get("seq", 0)))
        request = (message.system, message.component, vehicle and vehicle.id, message.name, subject)
        if not port.may_answer(request, ANSWER_GAP_S, now):
            return
        if vehicle is not None:
            self._answer_as(vehicle, foreign, message, why, result, mission_result)
        elif message.name in ("COMMAND_LONG", "COMMAND_INT"):
            sender = {"target_system": message.system, "target_component": message.component}
            answer = {"command": fields["command"], "result": DENIED, "progress": 0, "result_param2": 0}
            port.send_own(foreign.address, "COMMAND_ACK", **answer, **sender)

    def _answer_as(
        self,
        vehicle: Vehicle,
        foreign: ForeignFrame,
        message: MavlinkMessage,
        why: str,
        result: int,
        mission_result: int,
    ) -> None:
        """Answer a refused request as its vehicle would, with the reason as text."""
        if answer := refusal_answer(vehicle, message, result, mission_result):
            name, fields = answer
            component = message.fields.get("target_component", 0)
            foreign.port.send_as(vehicle, foreign.address, name, component=component, **fields)
        elif message.name == "PARAM_SET":  # answered with the value as it is, which every station hears
            parameter = {"param_id": message.fields["param_id"], "param_index": -1}
            self._uplink.ask(vehicle.id, "PARAM_REQUEST_READ", **parameter)
        self._send_text(foreign.port, vehicle, foreign.address, why)

    def _send_text(self, port: Port, vehicle: Vehicle, address: Address, why: str) -> None:
        """Send a station the reason of a refusal as a STATUSTEXT of the vehicle."""
        self._texts = self._texts % 0xFFFF + 1
        for fields in status_texts(f"Station {self._own_system}: {why}", self._texts):
            port.send_as(vehicle, address, "STATUSTEXT", **fields)

    def _vehicle(self, port: Port, system: int) -> Vehicle | None:
        """The vehicle with MAVLink's id `system` in the network that `port` serves."""
        number = self._networks[port.link.spec.network]
        return self._fleet.vehicles.get(number * IDS_PER_NETWORK + system)

    def _report(self, port: Port, cause: str, text: str, every_s: float, severity: int = WARNING) -> None:
        """Make an event: the same cause at most every `every_s` per endpoint, the same text even less often."""
        now = self._clock.now()
        reported_s, reported_text = port.reported.get(cause, (-math.inf, ""))
        if now - reported_s < (EVENT_REPEAT_S if text == reported_text else every_s):
            port.suppressed[cause] += 1
            return
        port.reported[cause] = (now, text)
        more = port.suppressed.pop(cause, 0)
        since = f" ({more} more since the last such line)" if more else ""
        self._events.report(EventClass.OPERATOR, f"forward {port.link.name}", text + since, severity)


def _routing(raw: bytes) -> tuple[int, int, int]:
    """(message id, addressed system, addressed component) of a whole frame; system 0: all systems."""
    if raw[0] == MAGIC_V2:
        msgid, body = raw[7] | raw[8] << 8 | raw[9] << 16, 10
    else:
        msgid, body = raw[5], 6
    known = layout(msgid)
    if known is None or known.target_system_at < 0:
        return msgid, 0, 0
    length = raw[1]  # what lies beyond is zero, and was not sent
    system_at, component_at = known.target_system_at, known.target_component_at
    system = raw[body + system_at] if system_at < length else 0
    component = raw[body + component_at] if 0 <= component_at < length else 0
    return msgid, system, component


def _is_longer(frame: Frame) -> bool:
    """Whether a frame holds fields newer than our dialect."""
    known = layout(frame.msgid)
    return known is None or len(frame.payload) > known.size


def _place(address: Address) -> str:
    """An address in words, for events."""
    return address if isinstance(address, str) else f"{address[0]}:{address[1]}"
