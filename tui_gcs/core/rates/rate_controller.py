"""Rate controller: requests telemetry messages and their rates from each vehicle, within each link's byte budget.

Autopilots send almost nothing unasked (ArduPilot) or far too much (PX4), keep rates per link, and forget them at
reboot. So rates are requested on the link that each vehicle uses, and again while they are not as requested.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.firmware.command_encoder import CommandEncoder
from tui_gcs.core.firmware.streams import unwanted_messages
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.protocol.link_report import RadioRow
from tui_gcs.core.rates.link_budget import CALM_S, LinkMember, LinkRates, RateRequest
from tui_gcs.core.rates.message_sets import FULL, UNASKED
from tui_gcs.core.rates.operator_rates import OperatorRate, OperatorRates
from tui_gcs.core.rates.radio_status import radio_report
from tui_gcs.core.records.event_log import INFO, NOTICE, WARNING, EventLog
from tui_gcs.core.uplink.actions import Outcome, VehicleAction
from tui_gcs.core.uplink.commands import CommandService

REPEAT_S, FREQUENT_REPEATS, MAX_REPEAT_FACTOR = 5.0, 4, 16
"""A request that was not followed is repeated every 5 s, after four times less often, down to 16 times as seldom."""
STABLE_S = 2 * REPEAT_S * MAX_REPEAT_FACTOR
"""A rate that was in order for this long is requested again at once when it is not any more."""
SILENT_S = 2.0
"""A vehicle silent for this long is asked nothing."""
MEMBER_TIMEOUT_S = 30.0
"""A vehicle silent on a link for this long leaves its share of the budget to the others."""
MEMBERS_GAP_S, CHECK_GAP_S = 0.25, 1.0
"""How often the vehicles on each link are counted, and each vehicle is checked while all is well."""
MAX_CHECKS = 25
"""Vehicles checked in one tick, on each link: what a tick does at once delays answers that are waited for."""
PATIENCE_S = 3.0
"""A message counts as missing after this time and two of its intervals; one that was turned off, as still coming after
this time."""
WINDOW_S, MAX_WINDOW_S = 5.0, 10.0
"""Rates are counted over the first; a window longer than the second contained a silence and is ignored."""
OFF_HZ = -1e6
"""As an interval: -1 µs, with which MAVLink turns a message off (common.xml, MAV_CMD_SET_MESSAGE_INTERVAL)."""


class RateController:
    """Requests every vehicle's identity and messages; reading what comes is not its task."""

    def __init__(
        self,
        fleet: VehicleRegistry,
        commands: CommandService,
        command_encoder: CommandEncoder,
        specs: dict[str, LinkSpec],
        clock: Clock,
        events: EventLog,
    ) -> None:
        """Request nothing before the first `tick`.

        Args:
            fleet: The vehicles.
            commands: Runs the requests.
            command_encoder: Encodes them; SET_MESSAGE_INTERVAL and REQUEST_MESSAGE are the same for PX4.
            specs: All links by name; a link without a spec has no budget.
            clock: The station's.
            events: Gets an event when a link's set changes or does not fit.
        """
        self._fleet = fleet
        self._commands = commands
        self._encoder = command_encoder
        self._specs = specs
        self._clock = clock
        self._events = events
        self.operator_rates = OperatorRates()
        self._links: dict[str, LinkRates] = {}
        for name in specs:
            self._link(name)
        self._next_count_s = -math.inf

    def tick(self) -> None:
        """Send the requests that are due."""
        now = self._clock.now()
        if now >= self._next_count_s:
            self._next_count_s = now + MEMBERS_GAP_S
            self._count(now)
        for link in self._links.values():
            if not link.silent:
                self._check_some(link, now)

    def forget(self, vehicle: Vehicle) -> None:
        """The vehicle rebooted, or another one uses its id: request everything again at once, on every link."""
        for link in self._links.values():
            member = link.members.get(vehicle.id)
            if member is not None:
                link.members[vehicle.id] = LinkMember(member.last_heard_s, member.signed)

    def radio_status(self, link: str, fields: dict[str, Any]) -> None:
        """A RADIO_STATUS or RADIO message of that link's radio came."""
        now = self._clock.now()
        link_rates = self._link(link)
        link_rates.radio = (now, fields)
        if link_rates.members and not link_rates.silent:
            steps = link_rates.lowest - link_rates.fit
            link_rates.back_off.on_report(fields["txbuf"], now, steps, requested=self._all_asked(link_rates, now))
            link_rates.plan(now)

    def radio(self, link: str) -> RadioRow | None:
        """The newest report of that link's radio, None if there was none."""
        link_rates = self._links.get(link)
        if link_rates is None or link_rates.radio is None:
            return None
        last_heard_s, fields = link_rates.radio
        return radio_report(fields, self._clock.now() - last_heard_s)

    def plan(self, link: str) -> dict[int, float]:
        """Hz by message id that each vehicle on that link is to send now; empty where nothing is requested."""
        link_rates = self._links.get(link)
        return {} if link_rates is None or link_rates.silent else dict(link_rates.set.hz)

    def set_rate(self, vehicle: Vehicle, message: int, rate: OperatorRate) -> None:
        """Request a message as an operator wants it, at the next tick and again whenever it is not so."""
        self.operator_rates.put(vehicle.id, message, rate)
        self._request_anew(vehicle, message, RateRequest(rate.hz))

    def release_rate(self, vehicle: Vehicle, message: int) -> bool:
        """Let the link's set decide again; returns whether an operator had asked for a rate.

        What the set does not contain is turned off; what an operator had turned off stays so until the vehicle boots.
        """
        was_set = self.operator_rates.drop(vehicle.id, message)
        self._request_anew(vehicle, message, None)
        return was_set

    def set_link(self, spec: LinkSpec) -> None:
        """A link was added, or carries another number of bytes per second."""
        now = self._clock.now()
        self._specs[spec.name] = spec
        link = self._link(spec.name)
        link.silent = spec.high_latency
        link.set_capacity(spec.bytes_per_s, now)
        link.plan(now)

    def rates_of(self, name: str) -> LinkRates:
        """A link by name, with its set and budget."""
        return self._link(name)

    def link_of(self, vehicle: Vehicle) -> LinkRates:
        """The link in use by a vehicle, with its set and budget."""
        return self._link(vehicle.link)

    def _request_anew(self, vehicle: Vehicle, message: int, request: RateRequest | None) -> None:
        for link in self._links.values():
            member = link.members.get(vehicle.id)
            if member is None:
                continue
            member.check_s = -math.inf
            if request is not None:
                member.rate_requests[message] = replace(request)
            elif message in member.rate_requests and member.rate_requests[message].hz == 0.0:
                del member.rate_requests[message]

    def silent(self, link: str) -> bool:
        """Whether nothing but commands may be sent there, not even our heartbeat (HIGH_LATENCY2).

        See docs/autopilots.md C9.
        """
        link_rates = self._links.get(link)
        return link_rates is not None and link_rates.silent

    def _link(self, name: str) -> LinkRates:
        if name not in self._links:
            self._links[name] = LinkRates(name, self._specs.get(name), self._clock.now())
        return self._links[name]

    def _count(self, now: float) -> None:
        """Update which vehicles are on which links, and their sets. A vehicle may load several links at once."""
        for vehicle in self._fleet.vehicles.values():
            for path in vehicle.used_paths():
                last_heard_s = path.last_heard_s
                if now - last_heard_s > MEMBER_TIMEOUT_S:
                    continue
                link = self._link(path.source.link)
                member = link.members.get(vehicle.id)
                heartbeat = path.slots.get(0)
                signed = heartbeat is not None and heartbeat.signed
                if member is None:
                    link.join(vehicle.id, LinkMember(last_heard_s, signed), now)
                else:
                    member.last_heard_s, member.signed = last_heard_s, signed
        for link in self._links.values():
            for vehicle_id, member in list(link.members.items()):
                if now - member.last_heard_s > MEMBER_TIMEOUT_S or vehicle_id not in self._fleet.vehicles:
                    link.leave(vehicle_id, now)
            link.plan(now)
            self._report(link, now)

    def _report(self, link: LinkRates, now: float) -> None:
        """Report a change from the full set, and when not even the poorest set fits."""
        if link.silent or not link.members or now - link.changed_s < CALM_S:
            return
        before, link.reported = link.reported, (link.place, link.too_many)
        if link.reported == before or (before is None and link.budget is None and link.place == FULL):
            return
        needed = f"{link.needed(link.place):.0f}" + ("" if link.budget is None else f" of {link.budget:.0f}") + " B/s"
        text, severity = f"telemetry {link.set.name}: {len(link.members)} vehicles, {needed}", INFO
        if link.too_many:
            text, severity = f"{text}: too many vehicles, positions are old. Use a faster link or fewer", WARNING
        elif link.place > link.fit:
            text, severity = f"{text}: the radio's buffer was full", NOTICE
        self._events.report(EventClass.CONNECTION, f"link {link.name}", text, severity)

    def _check_some(self, link: LinkRates, now: float) -> None:
        """Send as many requests as the link may carry now; vehicles that were not reached are first next time."""
        queue, members, bucket = link.queue, link.members, link.bucket
        checks = 0
        for _ in range(len(queue)):
            member = members[queue[0]]
            if now >= member.check_s:
                if checks >= MAX_CHECKS:
                    return
                checks += 1
                # Requests may not crowd out telemetry on a slow radio.
                if not bucket.has_one(now):
                    return
                vehicle = self._fleet.vehicles.get(queue[0])
                if (
                    vehicle is None
                    or not _is_reachable(link, vehicle, now)
                    or not self._request_one(link, member, vehicle, now)
                ):
                    member.check_s = now + CHECK_GAP_S
            queue.rotate(-1)

    def _request_one(self, link: LinkRates, member: LinkMember, vehicle: Vehicle, now: float) -> bool:
        """Send the most important request that is due for `vehicle`; False if none is."""
        identity_request = member.identity_request
        # Should it have to identify itself again, that is requested at once.
        if vehicle.identity.identified:
            identity_request.asked = 0
        elif not identity_request.under_way and now >= identity_request.next_s:
            self._submit(link, member, identity_request, self._encoder.version(vehicle.id), now)
            return True
        operators = self.operator_rates.of(vehicle.id)
        _bring_up_to_date(link, member, vehicle, now, operators)
        _compare_rates(member, vehicle, now)
        if any(request.under_way for request in member.rate_requests.values()):
            return False  # an ACK names only the command: one interval of a vehicle at a time
        due = [
            (message, request)
            for message, request in member.rate_requests.items()
            if _is_due(message, request, vehicle, now)
        ]
        if not due:
            return False
        # First what an operator waits for, then what is to fall silent.
        message, request = min(due, key=lambda pair: (pair[0] not in operators, pair[1].hz > 0.0))
        hz = request.hz if request.hz > 0.0 else OFF_HZ
        action = self._encoder.interval(vehicle.id, message, hz)

        def answered(why_not: str) -> None:
            # What the vehicle does not know is not asked off either.
            if self.operator_rates.answered(vehicle.id, message, why_not) and why_not:
                member.rate_requests.pop(message, None)

        self._submit(link, member, request, action, now, answered)
        return True

    def _submit(
        self,
        link: LinkRates,
        member: LinkMember,
        request: RateRequest,
        action: VehicleAction,
        now: float,
        on_answer: Callable[[str], None] = lambda why_not: None,
    ) -> None:
        """Send a request; every copy of it is counted. `on_answer` gets "" or why the vehicle does not do it."""
        send = action.send

        def counted(copy: int) -> None:
            link.bucket.take()
            send(copy)

        def ended(_: VehicleAction, outcome: Outcome, why: str) -> None:
            request.under_way = False
            request.settled_s = self._clock.now() if outcome is Outcome.CONFIRMED else math.nan
            member.check_s = self._clock.now()
            if outcome is not Outcome.SUPERSEDED:
                on_answer("" if outcome is Outcome.CONFIRMED else ": ".join(filter(None, (outcome.value, why))))

        action.send, action.on_done = counted, ended
        request.under_way = True
        request.next_s = now + REPEAT_S * min(2 ** max(0, request.asked - FREQUENT_REPEATS), MAX_REPEAT_FACTOR)
        request.asked += 1
        self._commands.submit(action)

    def _all_asked(self, link: LinkRates, now: float) -> bool:
        """Whether every vehicle that can be reached was asked for the link's present set."""
        for vehicle_id, member in link.members.items():
            vehicle = self._fleet.vehicles.get(vehicle_id)
            if vehicle is None or not _is_reachable(link, vehicle, now):
                continue
            _bring_up_to_date(link, member, vehicle, now, self.operator_rates.of(vehicle.id))
            if any(not request.asked for request in member.rate_requests.values()):
                return False
        return True


def _is_reachable(link: LinkRates, vehicle: Vehicle, now: float) -> bool:
    """Whether a request would go over that link and be heard. A vehicle on HIGH_LATENCY2 is asked nothing."""
    silent = now - vehicle.last_heard_s > SILENT_S or vehicle.telemetry.high_latency_s > vehicle.telemetry.heartbeat_s
    return vehicle.link == link.name and not silent


def _bring_up_to_date(
    link: LinkRates, member: LinkMember, vehicle: Vehicle, now: float, operators: Mapping[int, OperatorRate]
) -> None:
    """Make requests for what the link's set or an operator wants, and against what neither does or comes unasked."""
    wanted, rate_requests, useless = link.set.hz, member.rate_requests, unwanted_messages(vehicle)
    if operators:
        wanted = {**wanted, **{message: rate.hz for message, rate in operators.items()}}
        useless = useless.difference(operators)
    for message, hz in wanted.items():
        if message not in useless and (message not in rate_requests or rate_requests[message].hz != hz):
            rate_requests[message] = RateRequest(hz)
    for message, request in rate_requests.items():
        if request.hz > 0.0 and message not in wanted:
            rate_requests[message] = RateRequest()
    if link.budget is not None:
        for message in UNASKED.intersection(vehicle.path.slots).difference(rate_requests):
            if vehicle.silent_s(message, now) < PATIENCE_S:
                rate_requests[message] = RateRequest()


def _is_due(message: int, request: RateRequest, vehicle: Vehicle, now: float) -> bool:
    """Whether a vehicle is to be asked (again) for a message, or to stop sending it."""
    if now < request.next_s or message in vehicle.rate_overrides:
        return False
    if math.isnan(request.settled_s):
        return True
    if now - request.settled_s > STABLE_S:
        request.asked = 0
    silent_s = vehicle.silent_s(message, now)
    if request.hz > 0.0:
        patience_s = PATIENCE_S + 2 / request.hz
        return silent_s > patience_s and now - request.settled_s > patience_s
    return silent_s < now - request.settled_s - PATIENCE_S


def _compare_rates(member: LinkMember, vehicle: Vehicle, now: float) -> None:
    """Have requested again what came at a much different rate than agreed, once in a window."""
    window_s = now - member.window_s
    if window_s < WINDOW_S:
        return
    slots = vehicle.path.slots
    for message, (slot, count) in member.frame_counts.items():
        request = member.rate_requests.get(message)
        if request is None or window_s > MAX_WINDOW_S or slots.get(message) is not slot:
            continue
        if request.settled_s < member.window_s and is_wrong_rate((slot.count - count) / window_s, request.hz):
            request.settled_s = math.nan
    member.window_s = now
    member.frame_counts = {
        message: (slots[message], slots[message].count) for message in member.rate_requests if message in slots
    }


def is_wrong_rate(measured_hz: float, wanted_hz: float) -> bool:
    """Whether a message comes at a much different rate than wanted."""
    # Generous to slower ones: autopilots slow their streams down when their radio is full, and frames are lost.
    # Below 1 Hz a window cannot tell slow from silent, which has a rule of its own.
    return measured_hz > 1.5 * wanted_hz + 0.5 or (wanted_hz >= 1.0 and measured_hz < wanted_hz / 4)
