"""Which messages each vehicle is asked for, and how often, from each link's byte budget.

Autopilots send almost nothing unasked (ArduPilot) or far too much (PX4), keep rates per link, and forget them at
reboot. So each vehicle is told its rates on the link it uses, and told again while they are not what they should be.
"""

import math
from typing import Any

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.firmware.command_encoder import CommandEncoder
from tui_gcs.core.firmware.streams import unwanted_messages
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.links.spec import LinkSpec
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.rates.link_budget import CALM_S, LinkMember, LinkRates, RateRequest
from tui_gcs.core.rates.message_sets import FULL, UNASKED
from tui_gcs.core.rates.radio_status import RadioReport, radio_report
from tui_gcs.core.records.event_log import INFO, NOTICE, WARNING, EventLog
from tui_gcs.core.uplink.actions import Outcome, VehicleAction
from tui_gcs.core.uplink.commands import CommandService

ASK_AGAIN_S, ASK_OFTEN, ASK_SELDOM = 5.0, 4, 16
"""What is not as asked is asked again every 5 s, after four times less often, down to 16 times as seldom."""
FORGIVEN_S = 2 * ASK_AGAIN_S * ASK_SELDOM
"""What was in order for so long is asked again at once when it is not any more."""
SILENT_S = 2.0
"""A vehicle that said nothing for this long is asked nothing."""
LEFT_S = 30.0
"""A vehicle silent on a link for this long leaves its share of the budget to the others."""
COUNT_GAP_S, LOOK_GAP_S = 0.25, 1.0
"""How often it is counted who is on which link, and each vehicle is looked at while all is well."""
MAX_LOOKS = 25
"""Vehicles looked at in one tick, on each link: what a tick does at once delays who waits for an answer."""
PATIENCE_S = 3.0
"""A message does not come if it is missing for this long and two of its intervals; one that was turned off and still
comes after this long was not."""
WINDOW_S, LONGEST_WINDOW_S = 5.0, 10.0
"""Rates are counted over the first; a window that became longer than the second had a silence in it, says nothing."""
OFF_HZ = -1e6
"""As an interval: -1 µs, MAVLink's word for "do not send" (common.xml, MAV_CMD_SET_MESSAGE_INTERVAL)."""


class RateController:
    """Asks every vehicle who it is and for its messages; what comes is not its matter."""

    def __init__(
        self,
        fleet: VehicleRegistry,
        commands: CommandService,
        command_encoder: CommandEncoder,
        specs: dict[str, LinkSpec],
        clock: Clock,
        events: EventLog,
    ) -> None:
        """Nothing is asked before the first `tick`.

        Args:
            fleet: Whose vehicles are asked.
            commands: Runs the requests.
            command_encoder: Encodes them; SET_MESSAGE_INTERVAL and REQUEST_MESSAGE are the same for PX4.
            specs: All links by name; one that is not there has no budget.
            clock: The station's.
            events: Told when a link's set changes or does not fit.
        """
        self._fleet = fleet
        self._commands = commands
        self._encoder = command_encoder
        self._specs = specs
        self._clock = clock
        self._events = events
        self._links: dict[str, LinkRates] = {}
        for name in specs:
            self._link(name)
        self._next_count_s = -math.inf

    # ---------------------------------------------------------------- for the station

    def tick(self) -> None:
        """Ask what is due."""
        now = self._clock.now()
        if now >= self._next_count_s:
            self._next_count_s = now + COUNT_GAP_S
            self._count(now)
        for link in self._links.values():
            if not link.silent:
                self._ask_some(link, now)

    def forget(self, vehicle: Vehicle) -> None:
        """It rebooted, or somebody else has its id now: ask for everything again at once, on whatever link."""
        for link in self._links.values():
            member = link.members.get(vehicle.id)
            if member is not None:
                link.members[vehicle.id] = LinkMember(member.heard_s, member.signed)

    def radio_status(self, link: str, fields: dict[str, Any]) -> None:
        """A RADIO_STATUS or RADIO message of that link's radio came."""
        now = self._clock.now()
        desk = self._link(link)
        desk.radio = (now, fields)
        if desk.members and not desk.silent:
            steps = desk.lowest - desk.fit
            desk.back_off.hear(fields["txbuf"], now, steps, asked=self._all_asked(desk, now))
            desk.plan(now)

    def radio(self, link: str) -> RadioReport | None:
        """The newest report of that link's radio, None if there was none."""
        desk = self._links.get(link)
        if desk is None or desk.radio is None:
            return None
        heard_s, fields = desk.radio
        return radio_report(fields, self._clock.now() - heard_s)

    def plan(self, link: str) -> dict[int, float]:
        """Hz by message id that each vehicle on that link is to send now; empty where nothing is asked."""
        desk = self._links.get(link)
        return {} if desk is None or desk.silent else dict(desk.set.hz)

    def silent(self, link: str) -> bool:
        """Whether nothing but commands may be sent there, not even our heartbeat (HIGH_LATENCY2; docs/autopilots.md C9)."""
        desk = self._links.get(link)
        return desk is not None and desk.silent

    # ---------------------------------------------------------------- who is where

    def _link(self, name: str) -> LinkRates:
        if name not in self._links:
            self._links[name] = LinkRates(name, self._specs.get(name), self._clock.now())
        return self._links[name]

    def _count(self, now: float) -> None:
        """Who is on which links, and what that means for their sets. A vehicle may load several at once."""
        for vehicle in self._fleet.vehicles.values():
            for path in vehicle.used_paths():
                heard_s = path.heard_s
                if now - heard_s > LEFT_S:
                    continue
                link = self._link(path.source.link)
                member = link.members.get(vehicle.id)
                heartbeat = path.slots.get(0)
                signed = heartbeat is not None and heartbeat.signed
                if member is None:
                    link.join(vehicle.id, LinkMember(heard_s, signed), now)
                else:
                    member.heard_s, member.signed = heard_s, signed
        for link in self._links.values():
            for vehicle_id, member in list(link.members.items()):
                if now - member.heard_s > LEFT_S or vehicle_id not in self._fleet.vehicles:
                    link.leave(vehicle_id, now)
            link.plan(now)
            self._tell(link, now)

    def _tell(self, link: LinkRates, now: float) -> None:
        """Say which set is asked where that is not the full one as ever, and when not even the poorest fits."""
        if link.silent or not link.members or now - link.changed_s < CALM_S:
            return
        before, link.told = link.told, (link.place, link.too_many)
        if link.told == before or (before is None and link.budget is None and link.place == FULL):
            return
        needed = f"{link.needed(link.place):.0f}" + ("" if link.budget is None else f" of {link.budget:.0f}") + " B/s"
        text, severity = f"telemetry {link.set.name}: {len(link.members)} vehicles, {needed}", INFO
        if link.too_many:
            text, severity = f"{text}: too many vehicles, positions are old. Use a faster link or fewer", WARNING
        elif link.place > link.fit:
            text, severity = f"{text}: the radio's buffer was full", NOTICE
        self._events.report(EventClass.CONNECTION, f"link {link.name}", text, severity)

    # ---------------------------------------------------------------- asking

    def _ask_some(self, link: LinkRates, now: float) -> None:
        """As many requests as the link may carry now; who was not reached is first next time."""
        turns, members, bucket = link.turns, link.members, link.bucket
        looks = 0
        for _ in range(len(turns)):
            member = members[turns[0]]
            if now >= member.look_s:
                if looks >= MAX_LOOKS:
                    return
                looks += 1
                if not bucket.has_one(now):
                    return
                vehicle = self._fleet.vehicles.get(turns[0])
                if (
                    vehicle is None
                    or not _is_reachable(link, vehicle, now)
                    or not self._ask_one(link, member, vehicle, now)
                ):
                    member.look_s = now + LOOK_GAP_S
            turns.rotate(-1)

    def _ask_one(self, link: LinkRates, member: LinkMember, vehicle: Vehicle, now: float) -> bool:
        """Ask `vehicle` for the most important thing that is due; False if nothing is."""
        who = member.who
        if vehicle.identity.identified:
            who.asked = 0
        elif not who.under_way and now >= who.next_s:
            self._submit(link, member, who, self._encoder.version(vehicle.id), now)
            return True
        _bring_up_to_date(link, member, vehicle, now)
        _judge_rates(member, vehicle, now)
        if any(wish.under_way for wish in member.wishes.values()):
            return False  # an ACK names only the command: one interval of a vehicle at a time
        due = [(message, wish) for message, wish in member.wishes.items() if _is_due(message, wish, vehicle, now)]
        if not due:
            return False
        message, wish = min(due, key=lambda pair: pair[1].hz > 0.0)  # first what is to fall silent
        hz = wish.hz if wish.hz > 0.0 else OFF_HZ
        self._submit(link, member, wish, self._encoder.interval(vehicle.id, message, hz), now)
        return True

    def _submit(
        self, link: LinkRates, member: LinkMember, wish: RateRequest, action: VehicleAction, now: float
    ) -> None:
        """Send a request; every copy of it is counted."""
        send = action.send

        def counted(copy: int) -> None:
            link.bucket.take()
            send(copy)

        def ended(_: VehicleAction, outcome: Outcome, why: str) -> None:
            wish.under_way = False
            wish.settled_s = self._clock.now() if outcome is Outcome.CONFIRMED else math.nan
            member.look_s = self._clock.now()

        action.send, action.on_done = counted, ended
        wish.under_way = True
        wish.next_s = now + ASK_AGAIN_S * min(2 ** max(0, wish.asked - ASK_OFTEN), ASK_SELDOM)
        wish.asked += 1
        self._commands.submit(action)

    def _all_asked(self, link: LinkRates, now: float) -> bool:
        """Whether every vehicle that can be reached was asked for the link's present set."""
        for vehicle_id, member in link.members.items():
            vehicle = self._fleet.vehicles.get(vehicle_id)
            if vehicle is None or not _is_reachable(link, vehicle, now):
                continue
            _bring_up_to_date(link, member, vehicle, now)
            if any(not wish.asked for wish in member.wishes.values()):
                return False
        return True


def _is_reachable(link: LinkRates, vehicle: Vehicle, now: float) -> bool:
    """Whether a request would go over that link and be heard. Who speaks HIGH_LATENCY2 is left alone."""
    silent = now - vehicle.heard_s > SILENT_S or vehicle.telemetry.high_latency_s > vehicle.telemetry.heartbeat_s
    return vehicle.link == link.name and not silent


def _bring_up_to_date(link: LinkRates, member: LinkMember, vehicle: Vehicle, now: float) -> None:
    """Wish for what the link's set has, and against what it has no more or what comes unasked."""
    wanted, wishes, useless = link.set.hz, member.wishes, unwanted_messages(vehicle)
    for message, hz in wanted.items():
        if message not in useless and (message not in wishes or wishes[message].hz != hz):
            wishes[message] = RateRequest(hz)
    for message, wish in wishes.items():
        if wish.hz > 0.0 and message not in wanted:
            wishes[message] = RateRequest()
    if link.budget is not None:
        for message in UNASKED.intersection(vehicle.path.slots).difference(wishes):
            if vehicle.silent_s(message, now) < PATIENCE_S:
                wishes[message] = RateRequest()


def _is_due(message: int, wish: RateRequest, vehicle: Vehicle, now: float) -> bool:
    """Whether a vehicle is to be asked (again) for a message, or to stop sending it."""
    if now < wish.next_s or message in vehicle.rate_overrides:
        return False
    if math.isnan(wish.settled_s):
        return True
    if now - wish.settled_s > FORGIVEN_S:
        wish.asked = 0
    silent_s = vehicle.silent_s(message, now)
    if wish.hz > 0.0:
        patience_s = PATIENCE_S + 2 / wish.hz
        return silent_s > patience_s and now - wish.settled_s > patience_s
    return silent_s < now - wish.settled_s - PATIENCE_S


def _judge_rates(member: LinkMember, vehicle: Vehicle, now: float) -> None:
    """Have asked again what came at a much different rate than agreed, once in a window."""
    window_s = now - member.window_s
    if window_s < WINDOW_S:
        return
    slots = vehicle.path.slots
    for message, (slot, count) in member.counts.items():
        wish = member.wishes.get(message)
        if wish is None or window_s > LONGEST_WINDOW_S or slots.get(message) is not slot:
            continue
        if wish.settled_s < member.window_s and is_odd((slot.count - count) / window_s, wish.hz):
            wish.settled_s = math.nan
    member.window_s = now
    member.counts = {message: (slots[message], slots[message].count) for message in member.wishes if message in slots}


def is_odd(measured_hz: float, wanted_hz: float) -> bool:
    """Whether a message comes at a much different rate than wanted.

    Generous to slower ones: autopilots slow their streams down themselves when their radio is full, and frames are
    lost. Below 1 Hz a window cannot tell slow from silent, which has a rule of its own.
    """
    return measured_hz > 1.5 * wanted_hz + 0.5 or (wanted_hz >= 1.0 and measured_hz < wanted_hz / 4)
