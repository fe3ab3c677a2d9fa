"""ArduCopter's way of saying things (facts/ardupilot.md; measured on 4.7-dev).

Flying is GUIDED: position, or position and velocity targets in frame 6 (relative altitude), which are never
acknowledged. Modes are believed from the heartbeat, not from the ACK.
"""

import math
from collections.abc import Callable

from tui_gcs.core.door import Door
from tui_gcs.core.geo import LocalFrame
from tui_gcs.core.messages import Vec3
from tui_gcs.core.services.command import Action, Outcome, Retry
from tui_gcs.core.vehicle import Vehicle
from tui_gcs.core.wire.mavlink import AUTOPILOT_ARDUPILOT

GUIDED, RTL, LAND, BRAKE = 4, 6, 9, 17
"""ArduCopter custom_mode."""
COPTER_TYPES = frozenset({2, 3, 4, 13, 14, 15, 29, 35})
"""MAV_TYPE of what ArduCopter flies: quad-, coaxial, heli-, hexa-, octo-, tri-, dodeca-, decarotor."""
FRAME_RELATIVE_ALT_INT = 6
POSITION_ONLY = 0xDF8
"""SET_POSITION_TARGET type_mask: use x, y, z."""
POSITION_AND_VELOCITY = 0xDC0
"""SET_POSITION_TARGET type_mask: use x, y, z, vx, vy, vz."""
CMD_LAND, CMD_TAKEOFF = 21, 22
CMD_SET_MODE, CMD_CHANGE_SPEED = 176, 178
CMD_RUN_PREARM_CHECKS = 401
CMD_ARM_DISARM, CMD_SET_MESSAGE_INTERVAL, CMD_REQUEST_MESSAGE = 400, 511, 512
CUSTOM_MODE_ENABLED = 1
LANDED_IN_AIR, LANDED_TAKEOFF = 2, 3
"""MAV_LANDED_STATE."""
BLIND_S = 1.0
"""A heartbeat this much newer than the position: whether it left the ground since is not known."""
HOLD_SETTLES_S = 0.8
"""A vehicle that did not get the hold and begins to move is faster than 0.5 m/s after this time."""

AUTOPILOT_VERSION = 148

Done = Callable[[Action, Outcome, str], None]


def supports(vehicle: Vehicle) -> str:
    """Why this vehicle cannot be flown by this module, or ""."""
    if vehicle.autopilot != AUTOPILOT_ARDUPILOT or vehicle.type not in COPTER_TYPES:
        return "only ArduCopter can be flown so far"
    return ""


class ArduCopter:
    """Builds actions and set-points; all of them leave through the door."""

    def __init__(self, door: Door, frame: LocalFrame) -> None:
        """`frame` turns ENU metres into degrees."""
        self._door = door
        self.frame = frame

    def mode(self, vehicle: int, mode: int, name: str, retry: Retry, on_done: Done | None = None) -> Action:
        """Change mode; done when the heartbeat says so."""
        return Action(
            vehicle,
            name,
            retry,
            send=lambda copy: self._long(vehicle, name, CMD_SET_MODE, copy, CUSTOM_MODE_ENABLED, mode),
            confirmed=lambda v: v.custom_mode == mode,
            command=CMD_SET_MODE,
            on_done=on_done,
        )

    def land(self, vehicle: int, on_done: Done | None = None) -> Action:
        """LAND where it is."""
        return self.mode(vehicle, LAND, "land", Retry.STOP, on_done)

    def guided(self, vehicle: int, on_done: Done | None = None) -> Action:
        """GUIDED mode."""
        return self.mode(vehicle, GUIDED, "mode GUIDED", Retry.SET, on_done)

    def arm(self, vehicle: int, on_done: Done) -> Action:
        """Arm; done when the heartbeat shows it."""
        return Action(
            vehicle,
            "arm",
            Retry.START,
            send=lambda copy: self._long(vehicle, "arm", CMD_ARM_DISARM, copy, 1),
            confirmed=lambda v: v.armed,
            command=CMD_ARM_DISARM,
            confirm_s=3.0,
            on_done=on_done,
        )

    def say_prearm(self, vehicle: int) -> Action:
        """Have the pre-arm checks run and their problems told as status texts."""
        action = Action(
            vehicle,
            "pre-arm checks",
            Retry.SET,
            send=lambda copy: self._long(vehicle, "pre-arm checks", CMD_RUN_PREARM_CHECKS, copy),
            confirmed=lambda v: action.acked_s is not None,
            command=CMD_RUN_PREARM_CHECKS,
        )
        return action

    def take_off(self, vehicle: int, alt_rel_m: float, on_done: Done) -> Action:
        """Climb vertically to `alt_rel_m` above home; done when it has left the ground."""
        return Action(
            vehicle,
            "take-off",
            Retry.START,
            send=lambda copy: self._long(vehicle, "take-off", CMD_TAKEOFF, copy, 0, 0, 0, 0, 0, 0, alt_rel_m),
            confirmed=lambda v: v.armed and (v.alt_rel_m > 1.0 or v.landed_state in (LANDED_IN_AIR, LANDED_TAKEOFF)),
            command=CMD_TAKEOFF,
            confirm_s=8.0,
            on_done=on_done,
        )

    def speed(self, vehicle: int, speed_m_s: float) -> Action:
        """Limit the speed of flights to a place. There is no telemetry of it: the ACK is all."""
        action = Action(
            vehicle,
            "speed",
            Retry.SET,
            send=lambda copy: self._long(vehicle, "speed", CMD_CHANGE_SPEED, copy, 1, speed_m_s, -1),
            confirmed=lambda v: action.acked_s is not None,
            command=CMD_CHANGE_SPEED,
        )
        return action

    def hold(self, vehicle: Vehicle, where: Callable[[], Vec3]) -> Action:
        """Stop `vehicle`, whatever it does: what that takes is decided anew for every copy.

        In the air: in GUIDED a position target at `where()`, in any other mode BRAKE; BRAKE, too, where it is not sure
        who would fly to that place. On the ground and armed: disarm
        (a start was cancelled). Armed, but no position tells where it is: BRAKE, which ends a climb and harms nobody on
        the ground. Its mode may change between two heartbeats, and it may lift off after the first copy.
        Done when it hardly moves, and not only in the moment the hold was sent, or when it is disarmed.
        """
        name = vehicle.id

        def send(copy: int) -> None:
            if vehicle.airborne and vehicle.custom_mode == GUIDED and not vehicle.no_commands:
                self.position(name, where())
            elif vehicle.airborne or (vehicle.armed and vehicle.heartbeat_s - vehicle.position_s > BLIND_S):
                self._long(name, "hold", CMD_SET_MODE, copy, CUSTOM_MODE_ENABLED, BRAKE)
            elif vehicle.armed:
                self._long(name, "disarm", CMD_ARM_DISARM, copy, 0)

        def stopped(v: Vehicle) -> bool:
            settled = min(v.position_s, v.heartbeat_s) > action.first_s + HOLD_SETTLES_S
            still = v.airborne and v.custom_mode in (GUIDED, BRAKE) and math.hypot(*v.velocity_m_s) < 0.5
            return settled and (not v.armed or still)

        action = Action(name, "hold", Retry.STOP, send=send, confirmed=stopped)
        return action

    def interval(self, vehicle: int, message: int, hz: float) -> Action:
        """Ask for a message at a rate; the ACK is all the confirmation there is."""
        action = Action(
            vehicle,
            f"interval {message}",
            Retry.SET,
            send=lambda copy: self._ask(vehicle, CMD_SET_MESSAGE_INTERVAL, copy, message, 1e6 / hz),
            confirmed=lambda v: action.acked_s is not None,
            command=CMD_SET_MESSAGE_INTERVAL,
            housekeeping=True,
        )
        return action

    def version(self, vehicle: int) -> Action:
        """Ask who it is."""
        return Action(
            vehicle,
            "identify",
            Retry.SET,
            send=lambda copy: self._ask(vehicle, CMD_REQUEST_MESSAGE, copy, AUTOPILOT_VERSION),
            confirmed=lambda v: v.identified,
            command=CMD_REQUEST_MESSAGE,
            ack_ends=False,
            housekeeping=True,
        )

    def position(self, vehicle: int, point_m: Vec3) -> None:
        """Fly to a point and stay; one message is enough, it has no time-out."""
        self._target(vehicle, POSITION_ONLY, point_m, (0.0, 0.0, 0.0))

    def moving(self, vehicle: int, point_m: Vec3, velocity_m_s: Vec3) -> None:
        """Be at `point_m` moving with `velocity_m_s`; after 3 s without another it brakes (GUID_TIMEOUT)."""
        self._target(vehicle, POSITION_AND_VELOCITY, point_m, velocity_m_s)

    def _target(self, vehicle: int, type_mask: int, point_m: Vec3, velocity_m_s: Vec3) -> None:
        lat_deg, lon_deg = self.frame.to_geodetic(point_m[0], point_m[1])
        east, north, up = velocity_m_s
        self._door.setpoint(
            vehicle,
            time_boot_ms=0,
            coordinate_frame=FRAME_RELATIVE_ALT_INT,
            type_mask=type_mask,
            lat_int=round(float(lat_deg) * 1e7),
            lon_int=round(float(lon_deg) * 1e7),
            alt=point_m[2],
            vx=north,
            vy=east,
            vz=-up,
            afx=0,
            afy=0,
            afz=0,
            yaw=0,
            yaw_rate=0,
        )

    def _long(self, vehicle: int, what: str, command: int, copy: int, *params: float) -> None:
        self._door.action(vehicle, what, "COMMAND_LONG", **_command_long(command, copy, params))

    def _ask(self, vehicle: int, command: int, copy: int, *params: float) -> None:
        self._door.ask(vehicle, "COMMAND_LONG", **_command_long(command, copy, params))


def _command_long(command: int, copy: int, params: tuple[float, ...]) -> dict[str, float]:
    padded = (*params, *([0.0] * 7))[:7]
    values = {f"param{i}": float(value) for i, value in enumerate(padded, start=1)}
    return {"command": command, "confirmation": min(copy, 255), **values}
