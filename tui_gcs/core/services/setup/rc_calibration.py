"""Calibration of the pilot's transmitter: range, assignment and direction of its channels, written as parameters.

The operator is led through steps (`prompt`, `confirm`). Nothing is written before the end, and then only what was seen
to move and is plausible. The former values are kept and can be restored.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial

from tui_gcs.core.firmware.rc_setup import RcParameters, Stick, rc_parameters
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.parameters.param_change import ParamChange, if_armed
from tui_gcs.core.services.parameters.param_service import ParamService
from tui_gcs.core.services.parameters.param_values import Number

RC_CHANNELS = 65
EVERY_US, AS_BEFORE_US = 100_000, 0
NAME = "radio calibration"
MAX_CHANNELS = 18
MIN_US, MAX_US = 800, 2200
"""The pulses of a receiver; others are noise, or a channel that is not there (0, 65535)."""
MIN_RANGE_US = 200
"""A channel that moved less was not moved to its ends."""
PUSHED_US, CLEAR_FACTOR = 200, 2.0
"""A stick held at its end is at least so far from the middle, and so many times farther than any other."""
MAX_OFF_CENTRE = 0.25
"""How far from the middle a stick that springs back may rest, as a share of its range."""
SILENT_S = 2.0
IDLE_S = 600.0
"""A calibration without a `confirm` for so long is abandoned."""

Done = Callable[["RcCalibration"], None]


class RcStep(StrEnum):
    """The steps of a calibration, in order; the last two are its ends."""

    CENTRE = "centre"
    THROTTLE = "throttle"
    YAW = "yaw"
    ROLL = "roll"
    PITCH = "pitch"
    ENDS = "ends"
    REST = "rest"
    WRITING = "writing"
    DONE = "done"
    FAILED = "failed"


PROMPTS = {
    RcStep.CENTRE: "switch the transmitter on; all sticks in the middle, throttle too; then confirm",
    RcStep.THROTTLE: "push the throttle fully up, hold it there, and confirm",
    RcStep.YAW: "throttle back to the middle; push yaw fully to the right, hold it there, and confirm",
    RcStep.ROLL: "push roll fully to the right, hold it there, and confirm",
    RcStep.PITCH: "push pitch fully forward (away from you), hold it there, and confirm",
    RcStep.ENDS: "move all sticks, switches and knobs to both their ends several times; then confirm",
    RcStep.REST: "let go of the sticks, throttle fully down; then confirm",
}
ORDER = tuple(RcStep)
STICK_STEPS = {RcStep(stick): stick for stick in Stick}
"""The steps of the sticks have the sticks' names."""


@dataclass
class Channel:
    """The pulses of one channel in µs."""

    now_us: int
    least_us: int
    most_us: int
    centre_us: int = 0
    """The pulse with all sticks in the middle, at the beginning."""
    rest_us: int = 0
    """The pulse at the end, with the sticks released and the throttle down."""

    @property
    def range_us(self) -> int:
        """The range that it has covered."""
        return self.most_us - self.least_us


@dataclass
class RcCalibration:
    """The calibration of one vehicle's transmitter."""

    vehicle: int
    parameters: RcParameters
    on_done: Done | None = None
    step: RcStep = RcStep.CENTRE
    channels: dict[int, Channel] = field(default_factory=dict)
    """The channels by number, from 1."""
    sticks: dict[Stick, int] = field(default_factory=dict)
    reversed: dict[Stick, bool] = field(default_factory=dict)
    received_s: float = 0.0
    confirmed_s: float = 0.0
    change: ParamChange | None = None
    """What was written, with the former values."""
    error: str = ""
    cancelled: bool = False
    needs_reboot: bool = False

    @property
    def prompt(self) -> str:
        """What the operator has to do now."""
        return PROMPTS.get(self.step, "")

    @property
    def over(self) -> bool:
        """Whether it has ended, with or without success."""
        return self.step in (RcStep.DONE, RcStep.FAILED)

    def lines(self) -> tuple[str, ...]:
        """One line for each channel: its smallest, present and largest pulse."""
        if not self.channels:
            return ("no channel is heard: is a receiver connected, and the transmitter on?",)
        found = {number: stick for stick, number in self.sticks.items()}
        head = f"channel {'':<8}  least   now  most  (pulses, µs)"
        rows = (
            f"{n:>7} {found.get(n, ''):<8} {c.least_us:>6} {c.now_us:>5} {c.most_us:>5}"
            + ("  reversed" if n in found and self.reversed[found[n]] else "")
            for n, c in sorted(self.channels.items())
        )
        return (head, *rows)

    def on_pulses(self, pulses: list[int]) -> None:
        """Take the present pulses, µs."""
        for number, us in enumerate(pulses[:MAX_CHANNELS], 1):
            if not MIN_US <= us <= MAX_US:
                continue
            channel = self.channels.setdefault(number, Channel(us, us, us))
            channel.now_us = us
            channel.least_us, channel.most_us = min(us, channel.least_us), max(us, channel.most_us)

    def confirm(self) -> str:
        """Check the step after the operator has followed the prompt; returns "" or why it must be repeated."""
        if self.step is RcStep.CENTRE:
            why = self._centre()
        elif self.step in STICK_STEPS:
            why = self._stick(STICK_STEPS[self.step])
        elif self.step is RcStep.ENDS:
            why = self._ends()
        elif self.step is RcStep.REST:
            why = self._rest()
        else:
            return "nothing is to be confirmed"
        if not why:
            self.step = ORDER[ORDER.index(self.step) + 1]
        return why

    def _centre(self) -> str:
        if len(self.channels) < len(Stick):
            return f"only {len(self.channels)} channels come: is the transmitter on?"
        for channel in self.channels.values():
            channel.centre_us = channel.least_us = channel.most_us = channel.now_us
        return ""

    def _stick(self, stick: Stick) -> str:
        taken = set(self.sticks.values())
        free = [(abs(c.now_us - c.centre_us), number) for number, c in self.channels.items() if number not in taken]
        free.sort(reverse=True)
        if not free or free[0][0] < PUSHED_US:
            return "no channel moved far enough: hold the stick at its end while you confirm"
        if len(free) > 1 and free[1][0] * CLEAR_FACTOR > free[0][0]:
            return f"channels {free[0][1]} and {free[1][1]} moved both: move this stick only"
        number = free[0][1]
        high = self.channels[number].now_us > self.channels[number].centre_us
        self.sticks[stick] = number
        # PX4 and ArduPilot differ in which way forward pitch counts.
        self.reversed[stick] = high is not (stick is not Stick.PITCH or self.parameters.forward_is_high)
        return ""

    def _ends(self) -> str:
        for stick, number in self.sticks.items():
            channel = self.channels[number]
            short = min(channel.centre_us - channel.least_us, channel.most_us - channel.centre_us)
            if channel.range_us < MIN_RANGE_US or short < MIN_RANGE_US / 2:
                return f"{stick} (channel {number}) went from {channel.least_us} to {channel.most_us} only"
        return ""

    def _rest(self) -> str:
        for stick, number in self.sticks.items():
            channel = self.channels[number]
            if stick is Stick.THROTTLE:
                low = channel.most_us if self.reversed[stick] else channel.least_us
                if abs(channel.now_us - low) > MAX_OFF_CENTRE * channel.range_us:
                    return "the throttle is not fully down"
            elif abs(channel.now_us - (channel.least_us + channel.most_us) / 2) > MAX_OFF_CENTRE * channel.range_us:
                return f"{stick} (channel {number}) does not rest near its middle"
        for channel in self.channels.values():
            channel.rest_us = channel.now_us
        return ""

    def wanted(self) -> dict[str, Number]:
        """Return the parameters to be written. Channels that never moved are left as they are."""
        found = {number: stick for stick, number in self.sticks.items()}
        wanted: dict[str, Number] = {}
        for number, channel in sorted(self.channels.items()):
            stick = found.get(number)
            if channel.range_us < MIN_RANGE_US:
                continue
            wanted[f"RC{number}_MIN"], wanted[f"RC{number}_MAX"] = channel.least_us, channel.most_us
            wanted[f"RC{number}_TRIM"] = self._trim_us(channel, stick)
            if stick is not None:
                reverse = self.reversed[stick]
                name = self.parameters.reversed_param.format(n=number)
                wanted[name] = self.parameters.reverse if reverse else self.parameters.normal
        wanted |= {self.parameters.maps[stick]: number for stick, number in self.sticks.items()}
        if self.parameters.count_param:
            wanted[self.parameters.count_param] = max(self.channels)
        return wanted

    def _trim_us(self, channel: Channel, stick: Stick | None) -> int:
        """The trim: where a stick rests, the low end of the throttle, the middle of a switch."""
        if stick is Stick.THROTTLE:
            return channel.most_us if self.reversed[stick] else channel.least_us
        if stick is not None:
            return min(channel.most_us, max(channel.least_us, channel.rest_us))
        return (channel.least_us + channel.most_us) // 2


class RcCalibrationService:
    """Leads the calibrations of transmitters, at most one for each vehicle."""

    def __init__(self, context: ServiceContext, params: ParamService) -> None:
        self._context = context
        self._params = params
        self._sessions: dict[int, RcCalibration] = {}
        self._written_last: dict[int, ParamChange] = {}
        """What the last calibration of a vehicle that wrote anything has changed; it outlives a reboot."""
        self.ignored: Counter[str] = Counter()
        context.fleet.on_message("RC_CHANNELS", self._on_channels)
        context.forget_with(self._forget, reboot=False)
        context.fleet.paths.on_reboot.append(self._rebooted)

    def of(self, vehicle_id: int) -> RcCalibration | None:
        """The vehicle's calibration, or its last one."""
        return self._sessions.get(vehicle_id)

    def start(self, vehicle_id: int, on_done: Done | None = None) -> RcCalibration | str:
        """Begin a calibration, or return why not."""
        vehicle = self._context.fleet.vehicles.get(vehicle_id)
        if vehicle is None:
            return "unknown vehicle"
        parameters = rc_parameters(vehicle)
        if parameters is None:
            return "how this autopilot keeps its radio's calibration is not known"
        if vehicle.telemetry.armed:
            return "it is armed"
        session = self._sessions.get(vehicle_id)
        if session is not None and not session.over:
            return "its radio is being calibrated already"
        session = self._sessions[vehicle_id] = RcCalibration(vehicle_id, parameters, on_done)
        session.confirmed_s = self._context.clock.now()
        # The rate controller leaves this message alone meanwhile.
        vehicle.rate_overrides.add(RC_CHANNELS)
        vehicle.set_up.add(NAME)
        self._interval(vehicle_id, EVERY_US)
        return session

    def confirm(self, vehicle_id: int) -> str:
        """Check the step after the operator has followed the prompt; returns "" or why it must be repeated."""
        session, vehicle = self._sessions.get(vehicle_id), self._context.fleet.vehicles.get(vehicle_id)
        if session is None or session.over or vehicle is None:
            return "no radio is being calibrated"
        if vehicle.telemetry.armed:
            self._end(session, "it was armed meanwhile")
            return session.error
        if self._context.clock.now() - session.received_s > SILENT_S and session.step is not RcStep.WRITING:
            return "the vehicle reports no channels: is a receiver connected, and the transmitter on?"
        session.confirmed_s = self._context.clock.now()
        why = session.confirm()
        if session.step is RcStep.WRITING and session.change is None:
            optional = frozenset((session.parameters.count_param,))
            done = partial(self._written, session)
            session.change = ParamChange(vehicle_id, session.wanted(), optional, done, forbidden=if_armed)
            session.change.run(self._params)
        return why

    def cancel(self, vehicle_id: int) -> str:
        """Cancel the calibration; returns "" or why not. Once parameters are being written it cannot be cancelled."""
        session = self._sessions.get(vehicle_id)
        if session is None or session.over:
            return "no radio is being calibrated"
        if session.step is RcStep.WRITING:
            return "it is being written; undo it afterwards"
        session.cancelled = True
        self._end(session, "cancelled")
        return ""

    def undo(self, vehicle_id: int, on_done: Callable[[ParamChange], None] | None = None) -> ParamChange | str:
        """Restore the parameters that the last calibration wrote."""
        change, vehicle = self._written_last.get(vehicle_id), self._context.fleet.vehicles.get(vehicle_id)
        if change is None:
            return "nothing was written"
        if vehicle is None or vehicle.telemetry.armed:
            return "it is armed" if vehicle is not None else "unknown vehicle"
        return change.undo(self._params, on_done)

    def _on_channels(self, vehicle: Vehicle, fields: Fields) -> None:
        session = self._sessions.get(vehicle.id)
        if session is not None and not session.over and session.step is not RcStep.WRITING:
            session.received_s = self._context.clock.now()
            count = min(fields["chancount"], MAX_CHANNELS)
            if session.received_s - session.confirmed_s > IDLE_S:
                self._end(session, "ended: nothing was confirmed for 10 min")
                return
            session.on_pulses([fields[f"chan{n}_raw"] for n in range(1, count + 1)])

    def _written(self, session: RcCalibration, change: ParamChange) -> None:
        maps = session.parameters.maps.values()
        if change.changed:
            self._written_last[session.vehicle] = change
        session.needs_reboot = session.parameters.map_needs_reboot and any(name in maps for name in change.changed)
        self._end(session, change.error)

    def _end(self, session: RcCalibration, error: str) -> None:
        session.error = error
        session.step = RcStep.FAILED if error else RcStep.DONE
        vehicle = self._context.fleet.vehicles.get(session.vehicle)
        if vehicle is not None:
            vehicle.rate_overrides.discard(RC_CHANNELS)
            vehicle.set_up.discard(NAME)
            vehicle.reboot_first = "channels mapped" if session.needs_reboot else vehicle.reboot_first
        self._interval(session.vehicle, AS_BEFORE_US)
        text = f"{NAME}: {error or 'done'}"
        if session.needs_reboot:
            text += "; reboot the vehicle before it flies"
        severity = WARNING if error else NOTICE
        self._context.events.report(EventClass.SENSOR, f"vehicle {session.vehicle}", text, severity)
        if session.on_done is not None:
            session.on_done(session)

    def _forget(self, vehicle: Vehicle) -> None:
        self._written_last.pop(vehicle.id, None)
        self._rebooted(vehicle)

    def _rebooted(self, vehicle: Vehicle) -> None:
        session = self._sessions.pop(vehicle.id, None)
        if session is not None and not session.over:
            self._end(session, "it rebooted, or is gone")

    def _interval(self, vehicle_id: int, every_us: int) -> None:
        """Request RC_CHANNELS often enough to see a stick at its end; `AS_BEFORE_US` restores the former rate."""
        self._context.set_interval(vehicle_id, f"interval {RC_CHANNELS} for the radio", RC_CHANNELS, every_us)
