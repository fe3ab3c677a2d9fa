"""Command encoder: orders, questions and set-points as MAVLink messages of any autopilot, sent through the uplink."""

import math
from collections.abc import Callable
from functools import partial

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.guard.permission import Order, SetpointPermission
from tui_gcs.core.mavlink import commands as c
from tui_gcs.core.motion.course import STILL
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.uplink.actions import MavCommand, Outcome, RetryClass, VehicleAction
from tui_gcs.core.uplink.uplink import Uplink

Done = Callable[[VehicleAction, Outcome, str], None]
ConfirmedBy = Callable[[Vehicle], bool]
LIFTED_OFF_M = 1.0
"""A vehicle this much higher than it stood is in the air, whatever it reports."""


class CommandEncoder:
    """Encodes commands; which command an order needs is decided by each firmware."""

    def __init__(self, uplink: Uplink, frame: LocalFrame) -> None:
        """`frame` turns ENU metres into degrees."""
        self._uplink = uplink
        self.frame = frame

    def action(
        self,
        vehicle: int,
        name: str,
        retry: RetryClass,
        order: MavCommand,
        confirmed: ConfirmedBy | None,
        on_done: Done | None = None,
        *,
        confirm_s: float = 5.0,
        double_ack: bool = False,
        confirmed_by: int | None = c.HEARTBEAT,
        starts: bool = False,
    ) -> VehicleAction:
        """An action that sends `order`. It is done when `confirmed` shows it, or else when it is acknowledged.

        `confirmed_by` is the message that shows it, which is requested instead of waited for; None: not worth
        requesting.
        """
        look = (
            None
            if confirmed is None or confirmed_by is None
            else partial(self.ask, vehicle, c.CMD_REQUEST_MESSAGE, confirmed_by)
        )

        def send(copy: int) -> None:
            why = self.send_command(vehicle, action.as_order(), action.order or order, copy)
            # A refused start ends at once; of other orders the next copy may pass.
            if retry is RetryClass.START:
                action.refusal = why

        action = VehicleAction(
            vehicle,
            name,
            retry,
            send=send,
            confirmed=confirmed or (lambda v: action.acked_s is not None and not action.in_progress),
            command=order.command,
            confirm_s=confirm_s,
            on_done=on_done,
            double_ack=double_ack,
            order=order,
            look=look,
            starts=starts,
        )
        return action

    def arm(self, vehicle: int, on_done: Done) -> VehicleAction:
        """Arm; done when the heartbeat shows it."""
        order = MavCommand(c.CMD_ARM_DISARM, (1,))
        return self.action(
            vehicle,
            "arm",
            RetryClass.START,
            order,
            lambda v: v.telemetry.armed,
            on_done,
            confirm_s=3.0,
            starts=True,
        )

    def disarm(self, vehicle: int) -> VehicleAction:
        """Disarm; done when the heartbeat shows it."""
        order = MavCommand(c.CMD_ARM_DISARM, (0,))
        return self.action(vehicle, "disarm", RetryClass.STOP, order, lambda v: not v.telemetry.armed)

    def take_off(self, vehicle: Vehicle, order: MavCommand, on_done: Done) -> VehicleAction:
        """Take off; done when the vehicle shows that it left the ground."""
        # The height on the ground need not read zero.
        left, ground_m = (c.LANDED_IN_AIR, c.LANDED_TAKEOFF), vehicle.telemetry.alt_rel_m
        return self.action(
            vehicle.id,
            "take-off",
            RetryClass.START,
            order,
            lambda v: (
                v.telemetry.armed
                and (v.telemetry.alt_rel_m > ground_m + LIFTED_OFF_M or v.telemetry.landed_state in left)
            ),
            on_done,
            confirm_s=8.0,
            confirmed_by=c.EXTENDED_SYS_STATE,
            starts=True,
        )

    def send_command(self, vehicle: int, order: Order, command: MavCommand, copy: int) -> str:
        """Send one copy of the command of an order; "" or why it does not leave."""
        return self._uplink.action(vehicle, order, command.message, **command.fields(copy))

    def ask(self, vehicle: int, command: int, *params: float, copy: int = 0) -> None:
        """Send a command that only requests something."""
        self._uplink.ask(vehicle, "COMMAND_LONG", **MavCommand(command, params).fields(copy))

    def is_ours(self, vehicle: Vehicle) -> bool:
        """Whether this station may command the vehicle at all."""
        return self._uplink.is_ours(vehicle)

    def interval(self, vehicle: int, message: int, hz: float) -> VehicleAction:
        """Request a message at a rate; the ACK is the only confirmation."""
        action = VehicleAction(
            vehicle,
            f"interval {message}",
            RetryClass.SET,
            send=lambda copy: self.ask(vehicle, c.CMD_SET_MESSAGE_INTERVAL, message, 1e6 / hz, copy=copy),
            confirmed=lambda v: action.acked_s is not None,
            command=c.CMD_SET_MESSAGE_INTERVAL,
            housekeeping=True,
        )
        return action

    def version(self, vehicle: int) -> VehicleAction:
        """Request the vehicle's identity (AUTOPILOT_VERSION)."""
        return VehicleAction(
            vehicle,
            "identify",
            RetryClass.SET,
            send=lambda copy: self.ask(vehicle, c.CMD_REQUEST_MESSAGE, c.AUTOPILOT_VERSION, copy=copy),
            confirmed=lambda v: v.identity.identified,
            command=c.CMD_REQUEST_MESSAGE,
            ack_ends=False,
            housekeeping=True,
        )

    def read_parameter(self, vehicle: int, name: str) -> None:
        """Request one parameter by name; a PARAM_VALUE answers."""
        self._uplink.ask(vehicle, "PARAM_REQUEST_READ", param_id=name, param_index=-1)

    def position(
        self, vehicle: int, permission: SetpointPermission, point_m: Vec3, home_amsl_m: float = math.nan
    ) -> None:
        """Set-point: be at `point_m` (ENU, z above home). With `home_amsl_m` it is sent as above mean sea level."""
        target = self._target(c.POSITION_ONLY, point_m, STILL, home_amsl_m=home_amsl_m)
        self._uplink.setpoint(vehicle, permission, **target)

    def position_velocity(
        self, vehicle: int, permission: SetpointPermission, point_m: Vec3, velocity_m_s: Vec3
    ) -> None:
        """Set-point: be at `point_m`, moving with `velocity_m_s` (east, north, up)."""
        target = self._target(c.POSITION_AND_VELOCITY, point_m, velocity_m_s)
        self._uplink.setpoint(vehicle, permission, **target)

    def position_velocity_acceleration(
        self,
        vehicle: int,
        permission: SetpointPermission,
        point_m: Vec3,
        velocity_m_s: Vec3,
        feed_forward_m_s2: Vec3,
        home_amsl_m: float = math.nan,
    ) -> None:
        """Set-point: as `position_velocity`, with the acceleration (east, north, up) of its motors."""
        target = self._target(c.ALL_BUT_YAW, point_m, velocity_m_s, feed_forward_m_s2, home_amsl_m=home_amsl_m)
        self._uplink.setpoint(vehicle, permission, **target)

    def velocity(self, vehicle: int, permission: SetpointPermission, velocity_m_s: Vec3) -> None:
        """Set-point: move with `velocity_m_s` (east, north, up)."""
        self._uplink.setpoint(vehicle, permission, **self._target(c.VELOCITY_ONLY, (0.0, 0.0, 0.0), velocity_m_s))

    def degrees(self, point_m: Vec3) -> tuple[float, float]:
        """Latitude and longitude of an ENU place."""
        lat_deg, lon_deg = self.frame.to_geodetic(point_m[0], point_m[1])
        return float(lat_deg), float(lon_deg)

    def _target(
        self,
        type_mask: int,
        point_m: Vec3,
        velocity_m_s: Vec3,
        feed_forward_m_s2: Vec3 = STILL,
        home_amsl_m: float = math.nan,
    ) -> dict[str, float]:
        """The fields of a SET_POSITION_TARGET_GLOBAL_INT."""
        lat_deg, lon_deg = self.degrees(point_m)
        above_sea = math.isfinite(home_amsl_m)
        east, north, up = velocity_m_s
        return {
            "time_boot_ms": 0,
            "coordinate_frame": c.FRAME_GLOBAL_INT if above_sea else c.FRAME_RELATIVE_ALT_INT,
            "type_mask": type_mask,
            "lat_int": round(lat_deg * 1e7),
            "lon_int": round(lon_deg * 1e7),
            "alt": point_m[2] + home_amsl_m if above_sea else point_m[2],
            "vx": north,
            "vy": east,
            "vz": -up,
            "afx": feed_forward_m_s2[1],
            "afy": feed_forward_m_s2[0],
            "afz": -feed_forward_m_s2[2],
            "yaw": 0,
            "yaw_rate": 0,
        }
