"""How PX4 multicopters are commanded (docs/autopilots.md; measured on 1.17 alpha).

A place to fly to and stay at is DO_REPOSITION: always above mean sea level, whatever frame is given, and with flag 1
and no other. A moving reference is OFFBOARD, see `px4_offboard`. Hold is AUTO LOITER. DO_SET_MODE is acknowledged
twice, and the first ACK is always ACCEPTED: modes are confirmed by the heartbeat.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.firmware.base import is_settled, may_be_flying, stands_still
from tui_gcs.core.firmware.command_encoder import CommandEncoder, Done
from tui_gcs.core.firmware.multicopter import Multicopter
from tui_gcs.core.firmware.px4_offboard import OFFBOARD, SETPOINT_GAP_S, Offboard, home_amsl_m, in_failsafe
from tui_gcs.core.firmware.px4_offboard_loss import OffboardLoss
from tui_gcs.core.fleet.telemetry import struct_reader
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import Order, OrderClass, SetpointPermission, StopReason
from tui_gcs.core.mavlink import commands as c
from tui_gcs.core.motion.course import STILL
from tui_gcs.core.motion.lead_compensation import LeadCompensation
from tui_gcs.core.motion.target_place import home_height
from tui_gcs.core.protocol.common import EventClass, Vec3
from tui_gcs.core.records.event_log import WARNING, EventLog
from tui_gcs.core.uplink.actions import FRAME_AMSL, MavCommand, Outcome, RetryClass, VehicleAction, refused
from tui_gcs.core.uplink.commands import CommandService

# docs/autopilots.md "Modes of PX4": Hold, mission, take-off and landing are sub modes of AUTO.
AUTO = 4
TAKEOFF, HOLD, MISSION, LAND = (AUTO << 16 | sub << 24 for sub in (2, 3, 4, 6))
"""custom_mode: main mode AUTO in bits 16-23, sub mode in bits 24-31."""
CHANGE_MODE = 1.0
"""MAV_DO_REPOSITION_FLAGS_CHANGE_MODE; with any other bit PX4 answers UNSUPPORTED, without it, too."""
# Goals that differ by less are one goal: it is sent once, and again only where it was not taken.
SAME_POSITION_M, SAME_SPEED_M_S = 0.3, 0.1
REPEAT_AFTER_S = 3.0
"""A place that was not taken, or to which the vehicle does not fly, is sent again after this time."""
# A vehicle that stands this near to its goal has arrived: the goal is not sent again.
ARRIVED_M = 2.0
NAN = math.nan
MISSION_CURRENT, _MISSION_PLACE = 42, struct_reader("HH")
"""Its present item, counted from 0, and how many it holds."""
GO_TO = "go to"
"""Name of the action that sends a place."""


@dataclass
class _Goal:
    """The place that it was sent to."""

    point_m: Vec3
    speed_m_s: float
    sent_s: float
    taken: bool = False
    was_well: bool = False
    """A heartbeat since then has shown it without a failsafe."""
    stopped: bool = False
    """A later heartbeat has shown a failsafe: it holds, or does something else, by itself."""


class Px4Multicopter(Multicopter):
    """The `Firmware` of PX4 on multicopters."""

    name = "PX4"
    start_mode, land_mode, mission_mode = HOLD, LAND, MISSION
    setpoint_gap_s = SETPOINT_GAP_S
    lead = LeadCompensation(time_s=0.05, drag_hz=0.5)
    """Measured on the real 1.16.1 on patrol tours: with a lead of 0.05 s it is 0.02 s late, if the drag is right. The
    drag in PX4's own simulator is 1.0 Hz. For real multicopters 0.5 Hz is assumed until theirs is learnt in flight."""
    off_course_m = 1.25
    """Measured on eight real ones in two flights of three rounds (1.9 hours of one vehicle), beside their path: 99 % of
    places within 0.8 m, 99.9 % within 1.1 m, in turns as on straight ways. A cell 1.25 m inside the edge of the
    footprint was never missed in these flights, one 1.2 m inside it would have been missed once."""

    def __init__(
        self, command_encoder: CommandEncoder, commands: CommandService, clock: Clock, events: EventLog
    ) -> None:
        super().__init__(command_encoder, commands)
        self._clock = clock
        self._events = events
        self._offboard = Offboard(command_encoder, commands, clock, frozenset({HOLD, TAKEOFF}))
        self._loss = OffboardLoss(command_encoder, commands, clock)
        self._goals: dict[int, _Goal] = {}

    def start_problem(self, vehicle: Vehicle) -> str:
        """Why it cannot start now, or "": the height of its home is unknown, or a failsafe is not acceptable."""
        # Its system_status is no help: it is 0, as while booting, whenever its checks do not pass in the mode it is
        # in, and after an OFFBOARD flight that mode is OFFBOARD.
        return self._home(vehicle)[1] or self._loss.problem(vehicle)

    def if_silent(self, vehicle: Vehicle) -> str:
        """What it does when our set-points stop; a parameter decides."""
        return self._loss.text(vehicle)

    def hear_parameter(self, vehicle: Vehicle, fields: dict[str, Any]) -> None:
        """A PARAM_VALUE of the vehicle came."""
        self._loss.hear(vehicle, fields)

    def prepare(self, vehicle: Vehicle, on_done: Done | None = None) -> VehicleAction:
        """Change to Hold: after an OFFBOARD flight the mode is OFFBOARD again, in which it does not arm."""
        return self._mode(vehicle, HOLD, "mode HOLD", RetryClass.SET, on_done)

    def take_off(self, vehicle: Vehicle, alt_rel_m: float, on_done: Done) -> VehicleAction:
        """Climb to `alt_rel_m` above home.

        NAV_TAKEOFF's height is above mean sea level; without one it climbs to 2.5 m only.
        """
        home_m, problem = self._home(vehicle)
        # Without the height of home there is no height above sea level to send.
        if problem:
            return refused(vehicle.id, "take-off", problem, on_done)
        # NaN leaves place and heading to PX4: 0 would be a place.
        order = MavCommand(c.CMD_TAKEOFF, (NAN, 0, 0, NAN, NAN, NAN, home_m + alt_rel_m))
        return self._encoder.take_off(vehicle, order, on_done)

    def mode(
        self, vehicle: Vehicle, custom_mode: int, name: str, retry: RetryClass, on_done: Done | None = None
    ) -> VehicleAction:
        """Change mode; done when the heartbeat shows it. A stream or place of ours does not take it back.

        Raises:
            ValueError: a mode that does not fit into main and sub mode.
        """
        if not 0 < custom_mode < 1 << 32 or custom_mode & 0xFFFF:
            raise ValueError(f"PX4 has no mode {custom_mode}")
        # A running stream would pull the vehicle back into OFFBOARD.
        if custom_mode != OFFBOARD:
            self._end_guided(vehicle)
        return self._mode(vehicle, custom_mode, name, retry, on_done)

    def _mode(
        self, vehicle: Vehicle, mode: int, name: str, retry: RetryClass, on_done: Done | None = None
    ) -> VehicleAction:
        order = _mode_order(mode)
        return self._encoder.action(
            vehicle.id, name, retry, order, lambda v: v.telemetry.custom_mode == mode, on_done, double_ack=True
        )

    def hold(self, vehicle: Vehicle, where: Callable[[], Vec3]) -> VehicleAction:
        """Change to AUTO LOITER, which reads no stick; on the ground and armed: disarm (a start was cancelled).

        What a copy sends is decided anew for each, as the vehicle may lift off after the first. In OFFBOARD it also
        gets a position target at `where()`: the first at once, before the first copy, and then every 0.1 s until its
        heartbeat shows another mode (`Offboard.leave`). Done when it hardly moves in Hold, or is disarmed.
        """
        self._end_guided(vehicle, where)
        vehicle_id = vehicle.id

        def send(copy: int) -> None:
            if may_be_flying(vehicle):
                self._encoder.send_command(vehicle_id, action.as_order(), _mode_order(HOLD), copy)
                # In Hold it may be on its way to a place: then the mode alone changes nothing (measured on 1.16: 77
                # m flown on), so it is sent to where it comes to rest.
                if vehicle.telemetry.custom_mode == HOLD and not stands_still(vehicle):
                    self._encoder.send_command(vehicle_id, action.as_order(), self._stop_order(vehicle, where()), copy)
            elif vehicle.telemetry.armed:
                disarm = Order("disarm", OrderClass.STOP, action.by)
                self._encoder.send_command(vehicle_id, disarm, MavCommand(c.CMD_ARM_DISARM, (0,)), copy)

        def stopped(v: Vehicle) -> bool:
            still = v.telemetry.airborne and v.telemetry.custom_mode == HOLD and stands_still(v)
            return is_settled(v, action.first_s) and (not v.telemetry.armed or still)

        action = VehicleAction(
            vehicle_id, "hold", RetryClass.STOP, send=send, confirmed=stopped, command=c.CMD_SET_MODE, double_ack=True
        )
        action.look = lambda: self._encoder.ask(vehicle_id, c.CMD_REQUEST_MESSAGE, c.HEARTBEAT)
        return action

    def _stop_order(self, vehicle: Vehicle, place_m: Vec3) -> MavCommand:
        """DO_REPOSITION to where it comes to rest, with a height relative to where it is, whatever its home."""
        lat_deg, lon_deg = self._encoder.degrees(place_m)
        alt_amsl_m = vehicle.telemetry.alt_amsl_m + place_m[2] - vehicle.telemetry.position_m[2]
        values = (-1, CHANGE_MODE, 0, NAN, lat_deg, lon_deg, alt_amsl_m)
        return MavCommand(c.CMD_DO_REPOSITION, values, as_int=True, is_place=True, frame=FRAME_AMSL)

    def go_to(
        self, vehicle: Vehicle, point_m: Vec3, speed_m_s: float, permission: SetpointPermission, *, anew: bool
    ) -> None:
        """Send DO_REPOSITION once per place; again if it was not taken, or if the vehicle does not fly there."""
        now = self._clock.now()
        goal = self._goals.get(vehicle.id)
        if goal is not None and _is_same(goal, point_m, speed_m_s):
            stuck = (
                stands_still(vehicle)
                and math.dist(vehicle.telemetry.position_m, point_m) > ARRIVED_M
                and not goal.stopped
            )
            due = not goal.taken or stuck or vehicle.telemetry.custom_mode == OFFBOARD
            if not due or now - goal.sent_s < REPEAT_AFTER_S or self._commands.pending(vehicle.id, GO_TO):
                return
        home_m, problem = self._home(vehicle)
        # A stop is never vetoed; but a place for one vehicle must not reach another one that uses its id.
        problem = vehicle.why_not_commanded or problem
        if problem or not permission.ok:
            why = problem or "vetoed"
            self._events.report(
                EventClass.PROCESSING, f"vehicle {vehicle.id}", f"go to NOT SENT: {why}", WARNING, every_s=5
            )
            return
        self._offboard.leave(vehicle)
        self._reposition(vehicle, _Goal(point_m, speed_m_s, now), home_m, permission)

    def _reposition(self, vehicle: Vehicle, goal: _Goal, home_m: float, permission: SetpointPermission) -> None:
        self._goals[vehicle.id] = goal
        x, y, z = goal.point_m
        lat_deg, lon_deg = self._encoder.degrees((x, y, z))
        order = MavCommand(
            c.CMD_DO_REPOSITION,
            (goal.speed_m_s, CHANGE_MODE, 0, NAN, lat_deg, lon_deg, home_m + z),
            as_int=True,
            is_place=True,
            frame=FRAME_AMSL,
        )

        def taken(action: VehicleAction, outcome: Outcome, why: str) -> None:
            goal.taken = outcome is Outcome.CONFIRMED

        action = self._encoder.action(vehicle.id, GO_TO, RetryClass.SET, order, None, taken)
        if isinstance(permission, StopReason):
            action.stop = permission
        self._commands.submit(action)

    def follow(
        self,
        vehicle: Vehicle,
        point_m: Vec3,
        velocity_m_s: Vec3,
        permission: SetpointPermission,
        feed_forward_m_s2: Vec3 = STILL,
    ) -> None:
        """Keep up OFFBOARD with position, velocity and acceleration."""
        self._end_goal(vehicle)
        self._encoder.position_velocity_acceleration(
            vehicle.id, permission, point_m, velocity_m_s, feed_forward_m_s2, home_amsl_m(vehicle)
        )
        self._offboard.follow(vehicle)

    def fly(self, vehicle: Vehicle, velocity_m_s: Vec3, permission: SetpointPermission) -> None:
        """Keep up OFFBOARD with velocity only; it drifts."""
        self._end_goal(vehicle)
        self._encoder.velocity(vehicle.id, permission, velocity_m_s)
        self._offboard.follow(vehicle)

    def mission_start(self, vehicle: Vehicle, on_done: Done | None = None) -> VehicleAction:
        """Change to AUTO MISSION in the air.

        On the ground MISSION_START, which arms by itself where the mission is feasible.
        """
        self._end_guided(vehicle)
        if vehicle.telemetry.airborne:
            return self._mode(vehicle, MISSION, "mission start", RetryClass.START, on_done)
        order = MavCommand(c.CMD_MISSION_START)
        return self._encoder.action(
            vehicle.id,
            "mission start",
            RetryClass.START,
            order,
            lambda v: v.telemetry.custom_mode == MISSION and v.telemetry.armed,
            on_done,
            starts=True,
        )

    def flies_mission(self, vehicle: Vehicle) -> bool:
        """Whether it flies its mission, or holds because that has ended: PX4 then changes to Hold by itself."""
        slot = vehicle.path.slots.get(MISSION_CURRENT)
        seq, total = _MISSION_PLACE(slot) if slot is not None and slot.raw else (0, 0)
        over = vehicle.telemetry.custom_mode == HOLD and 0 < total <= seq + 1
        return over or vehicle.telemetry.custom_mode == MISSION

    def is_steerable(self, vehicle: Vehicle) -> bool:
        """Whether it is in Hold, at the end of a take-off, or in OFFBOARD, and not stopped by its own failsafe."""
        goal = self._goals.get(vehicle.id)
        # Where it should be in OFFBOARD only OFFBOARD counts.
        if self._offboard.is_out(vehicle) or (goal is not None and goal.stopped):
            return False
        return vehicle.telemetry.custom_mode in (HOLD, TAKEOFF, OFFBOARD)

    def acts_by_itself(self, vehicle: Vehicle) -> bool:
        """Whether its own failsafe has stopped it, in Hold before it returns or lands, or returns or lands it."""
        goal = self._goals.get(vehicle.id)
        stopped = self._offboard.is_stopped(vehicle) or (goal is not None and goal.stopped)
        return stopped or (in_failsafe(vehicle) and not self.is_holding(vehicle))

    def is_holding(self, vehicle: Vehicle) -> bool:
        """Whether it is in Hold, or climbing to where a take-off ends in Hold."""
        return vehicle.telemetry.custom_mode in (HOLD, TAKEOFF)

    def tick(self, vehicles: list[Vehicle]) -> None:
        """Keep up the streams of vehicles that leave OFFBOARD, notice failsafes, and read what is missing."""
        self._offboard.tick(vehicles)
        for vehicle in vehicles:
            goal = self._goals.get(vehicle.id)
            if goal is not None and vehicle.telemetry.heartbeat_s > goal.sent_s:
                goal.stopped = goal.was_well and in_failsafe(vehicle)
                goal.was_well = goal.was_well or not in_failsafe(vehicle)
        self._loss.tick(vehicles)

    def release(self, vehicle: Vehicle) -> None:
        """End its stream and its goal: neither may pull it back."""
        self._offboard.drop(vehicle)
        self._goals.pop(vehicle.id, None)

    def forget(self, vehicle: Vehicle) -> None:
        """It rebooted, or is another vehicle: what was read from it is not known any more."""
        self.release(vehicle)
        self._loss.forget(vehicle)

    def _end_goal(self, vehicle: Vehicle) -> None:
        if self._goals.pop(vehicle.id, None) is not None:
            self._commands.cancel(vehicle.id, GO_TO)

    def _end_guided(self, vehicle: Vehicle, where: Callable[[], Vec3] | None = None) -> None:
        """Another mode is requested: neither a place nor a stream may take it back."""
        self._end_goal(vehicle)
        self._offboard.leave(vehicle, where)

    def _home(self, vehicle: Vehicle) -> tuple[float, str]:
        """Height of its home above mean sea level, and why it cannot be relied on, or ""."""
        home = home_height(vehicle)
        return home.amsl_m, home.problem


def _mode_order(mode: int) -> MavCommand:
    return MavCommand(c.CMD_SET_MODE, (c.CUSTOM_MODE_ENABLED, mode >> 16 & 0xFF, mode >> 24 & 0xFF))


def _is_same(goal: _Goal, point_m: Vec3, speed_m_s: float) -> bool:
    near = math.dist(goal.point_m, point_m) < SAME_POSITION_M
    return near and abs(goal.speed_m_s - speed_m_s) < SAME_SPEED_M_S
