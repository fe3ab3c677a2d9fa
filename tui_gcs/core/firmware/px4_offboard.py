"""PX4's OFFBOARD: a stream of set-points first, then the mode.

On leaving the other mode first, then the end of the stream.

Measured (docs/autopilots.md): without a stream the mode is refused; a stream that stops is a failsafe after 1.3 to 2.1
s; a stream that begins again takes the vehicle back into OFFBOARD by itself. So no stream is left running beside
another mode: a vehicle that leaves OFFBOARD gets stop targets until its heartbeat shows the other mode. And OFFBOARD is
requested once per stream: whatever took the vehicle out of it, its pilot or a failsafe, is not fought.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.firmware.command_encoder import CommandEncoder
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import StopReason
from tui_gcs.core.mavlink import commands as c
from tui_gcs.core.motion.course import stopping_point
from tui_gcs.core.protocol.common import Freshness, Vec3
from tui_gcs.core.uplink.actions import MavCommand, Outcome, RetryClass, VehicleAction
from tui_gcs.core.uplink.commands import CommandService

OFFBOARD = 6 << 16
"""custom_mode: main mode 6."""
ENTER_ACTION = "mode OFFBOARD"
LEAVING = StopReason("brake to leave OFFBOARD")
"""The permission of the position targets on the way out. The order that makes a vehicle leave has its own line in the
journal, with who gave it."""
LEAD_IN_S = 1.0
"""The stream runs this long before the mode is requested."""
SETPOINT_GAP_S = 0.1
"""10 Hz: five in a row may be lost before COM_OF_LOSS_T."""
NEW_AFTER_S = 1.0
"""A stream with a longer pause than this is a new one."""
# OFFBOARD is refused while the stream is younger than about 1 s, so one refusal is no failure (docs/autopilots.md).
MAX_TRIES, TRY_AGAIN_S = 3, 2.0
BACK_WITHIN_S = 3.0
"""After a failsafe it returns to OFFBOARD by itself, with the first set-point; this long that may take to show."""
LEAVES_WITHIN_S = 3.0
"""A mode that was requested shows within this time, or the order was lost."""
BRAKE_M_S2 = 2.5
"""How hard it brakes on its way out: `limits.accel_m_s2` of most scenarios; PX4's own default is 3."""


@dataclass
class _Stream:
    """The stream of one vehicle."""

    began_s: float
    sent_s: float
    tries: int = 0
    next_try_s: float = 0.0
    refused: str = ""
    entered: bool = False
    """Its heartbeat has shown OFFBOARD since the stream began."""
    leaving_until_s: float = -math.inf
    """It took over from a stream that was leaving: until then the other mode may still show, by our own doing."""
    out_s: float = math.inf
    """Since when it has been out of OFFBOARD again."""
    left_s: float = math.inf
    """Since when it is leaving."""
    where: Callable[[], Vec3] | None = None
    """Where it stops while it is leaving."""


class Offboard:
    """The streams of all PX4 vehicles."""

    def __init__(
        self, command_encoder: CommandEncoder, commands: CommandService, clock: Clock, ready_modes: frozenset[int]
    ) -> None:
        """OFFBOARD is requested in `ready_modes` only: modes that orders of ours leave a vehicle in."""
        self._encoder = command_encoder
        self._commands = commands
        self._clock = clock
        self._ready_modes = ready_modes
        self._streams: dict[int, _Stream] = {}

    def follow(self, vehicle: Vehicle) -> None:
        """A set-point is sent now: begin a stream or keep it up, and enter the mode when it has run long enough."""
        now = self._clock.now()
        stream = self._streams.get(vehicle.id)
        paused = stream is not None and now - stream.sent_s > NEW_AFTER_S and not self.is_stopped(vehicle)
        if stream is None or stream.where is not None or paused:
            leaving = stream is not None and stream.where is not None
            stream = self._streams[vehicle.id] = _Stream(now, now, leaving_until_s=now + LEAVES_WITHIN_S * leaving)
        stream.sent_s = now
        if vehicle.telemetry.custom_mode == OFFBOARD and not stream.tries and now < stream.leaving_until_s:
            # The mode order that ended the previous stream may still arrive, and take it out of OFFBOARD.
            return
        if vehicle.telemetry.custom_mode == OFFBOARD:
            stream.entered, stream.out_s = True, math.inf
        elif stream.entered:
            stream.out_s = min(stream.out_s, now)
        elif vehicle.telemetry.custom_mode in self._ready_modes and now - stream.began_s >= LEAD_IN_S - 1e-9:
            self._enter(vehicle, stream, now)

    def leave(self, vehicle: Vehicle, where: Callable[[], Vec3] | None = None) -> None:
        """Another mode is requested now: until it shows, the vehicle gets stop targets at `where()`."""
        self._commands.cancel(vehicle.id, ENTER_ACTION)
        stream = self._streams.get(vehicle.id)
        if stream is None and vehicle.telemetry.custom_mode != OFFBOARD:
            return
        now = self._clock.now()
        if stream is None or stream.where is None:
            self._streams[vehicle.id] = stream = _Stream(now, now, left_s=now)
        place = stopping_point(vehicle.telemetry.position_m, vehicle.telemetry.velocity_m_s, BRAKE_M_S2)
        stream.where = where or (lambda: place)
        self._stop(vehicle, stream, now)

    def drop(self, vehicle: Vehicle) -> None:
        """Send nothing more: the vehicle is not ours, or not heard."""
        self._commands.cancel(vehicle.id, ENTER_ACTION)
        self._streams.pop(vehicle.id, None)

    def is_out(self, vehicle: Vehicle) -> bool:
        """Whether it left OFFBOARD, or never got there, and not by our doing."""
        stream = self._streams.get(vehicle.id)
        if stream is None or stream.where is not None:
            return False
        if stream.entered and vehicle.telemetry.custom_mode != OFFBOARD:
            return not in_failsafe(vehicle) or self._clock.now() - stream.out_s > BACK_WITHIN_S
        return stream.tries >= MAX_TRIES and bool(stream.refused)

    def is_stopped(self, vehicle: Vehicle) -> bool:
        """Whether a failsafe of its own took it out of OFFBOARD: any order would end that, as a pilot's does.

        Measured on 1.16.1, which holds for COM_FAIL_ACT_T before it returns: "Pilot took over using sticks", and it
        stayed, outside of its fence. Set-points alone change nothing, or bring it back where they were what it missed.
        """
        stream = self._streams.get(vehicle.id)
        return stream is not None and stream.where is None and stream.entered and in_failsafe(vehicle)

    def follows(self, vehicle: Vehicle) -> bool:
        """Whether a stream of set-points is under way."""
        stream = self._streams.get(vehicle.id)
        return stream is not None and stream.where is None

    def tick(self, vehicles: list[Vehicle]) -> None:
        """Keep up the streams of vehicles that are leaving, until they have left."""
        now = self._clock.now()
        for vehicle in vehicles:
            stream = self._streams.get(vehicle.id)
            if stream is not None and self.is_stopped(vehicle):
                stream.out_s = min(stream.out_s, now)
            if stream is None or stream.where is None:
                continue
            # Only a heartbeat newer than the order shows its effect.
            left = vehicle.telemetry.custom_mode != OFFBOARD and vehicle.telemetry.heartbeat_s > stream.left_s
            if left or not vehicle.telemetry.armed or vehicle.freshness(now) is not Freshness.OK:
                del self._streams[vehicle.id]
            elif now - stream.sent_s >= SETPOINT_GAP_S - 1e-9:
                self._stop(vehicle, stream, now)

    def _stop(self, vehicle: Vehicle, stream: _Stream, now: float) -> None:
        if stream.where is not None and not vehicle.why_not_commanded:
            stream.sent_s = now
            self._encoder.position(vehicle.id, LEAVING, stream.where(), home_amsl_m(vehicle))

    def _enter(self, vehicle: Vehicle, stream: _Stream, now: float) -> None:
        if stream.tries >= MAX_TRIES or now < stream.next_try_s or self._commands.pending(vehicle.id, ENTER_ACTION):
            return
        stream.tries += 1

        def ended(action: VehicleAction, outcome: Outcome, why: str) -> None:
            stream.next_try_s = self._clock.now() + TRY_AGAIN_S
            if outcome not in (Outcome.CONFIRMED, Outcome.SUPERSEDED):
                stream.refused = why or outcome.value

        order = MavCommand(c.CMD_SET_MODE, (c.CUSTOM_MODE_ENABLED, OFFBOARD >> 16))
        self._commands.submit(
            self._encoder.action(
                vehicle.id,
                ENTER_ACTION,
                RetryClass.SET,
                order,
                lambda v: v.telemetry.custom_mode == OFFBOARD,
                ended,
                double_ack=True,
            )
        )


def in_failsafe(vehicle: Vehicle) -> bool:
    """Whether a failsafe of its own chose its mode (measured: one that only warns does not show)."""
    return vehicle.telemetry.system_status == c.STATUS_CRITICAL and vehicle.telemetry.custom_mode != OFFBOARD


def home_amsl_m(vehicle: Vehicle) -> float:
    """The height that its heights above home are counted from: both heights come in one message."""
    # Set-points are sent above mean sea level. Above home, PX4 1.16.1 takes the height of home above its
    # estimator's origin with the wrong sign: measured, 1.3 m too low where home was 0.6 m below that.
    return vehicle.telemetry.alt_amsl_m - vehicle.telemetry.alt_rel_m
