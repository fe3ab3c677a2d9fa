"""How ArduCopter is commanded (docs/autopilots.md; measured on 4.7-dev).

Flying is GUIDED: position, or position and velocity targets in frame 6 (relative altitude), which are never
acknowledged. Modes are confirmed by the heartbeat, not by the ACK. Outside GUIDED set-points are dropped silently.
LOITER, ALT_HOLD, POSHOLD and CIRCLE are never used: without a pilot their throttle stick is down, and they sink.
"""

import math
from collections.abc import Callable

from tui_gcs.core.firmware.base import is_settled, may_be_flying, stands_still
from tui_gcs.core.firmware.command_encoder import Done
from tui_gcs.core.firmware.multicopter import Multicopter
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import Order, OrderClass, SetpointPermission, StopReason
from tui_gcs.core.mavlink import commands as c
from tui_gcs.core.motion.course import STILL
from tui_gcs.core.motion.lead_compensation import LeadCompensation
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.uplink.actions import MavCommand, RetryClass, VehicleAction

AUTO, GUIDED, LAND, BRAKE = 3, 4, 9, 17
"""ArduCopter custom_mode."""
COPTER_TYPES = frozenset({2, 3, 4, 13, 14, 15, 29, 35})
"""MAV_TYPE of what ArduCopter flies: quad-, coaxial, heli-, hexa-, octo-, tri-, dodeca-, decarotor."""
MODE_BITS = 8
"""DO_SET_MODE's mode is silently cut to this many bits: 262 is taken as 6, RTL."""


class ArduCopter(Multicopter):
    """The `Firmware` of ArduCopter, which flies in GUIDED."""

    name = "ArduCopter"
    start_mode, land_mode, mission_mode = GUIDED, LAND, AUTO
    setpoint_gap_s = 0.2
    """Velocities expire after 3 s (GUID_TIMEOUT); a patrol slot moves 1.6 m between two."""
    lead = LeadCompensation(0.03, 1.0)
    """Measured on the real one on patrol tours at 7.6 m/s whose acceleration it can follow: 0.2 m off on average and
    0.7 m at most in three rounds; 4 to 5 m in the sharpest corners of tours that it cannot follow. Its position gain is
    1/s, and it takes no acceleration along with a place in frame 6 (tried: no difference). In a wind of 3 m/s tours at
    8 m/s take all the 30 degrees it may lean, and it is up to 8 m off; at 6 m/s 0.6 m."""
    off_course_m = 1.1
    """Measured on four real ones in two flights of three rounds: 95 % of places within 0.5 m, all within 0.8 m. The
    simulated one: all within 0.5 m; in a wind of 3 m/s with a GPS that wanders by 0.5 m 95 % within 0.7 m, all within
    1.2 m. Planned with 0.9 m, a place in two zones of six was missed once there, and waited twice as long."""

    def start_problem(self, vehicle: Vehicle) -> str:
        """Why it cannot start a flight now, or ""."""
        # Before "ArduPilot Ready" commands are acknowledged and lost.
        return "still booting" if vehicle.telemetry.system_status <= c.STATUS_BOOT else ""

    def if_silent(self, vehicle: Vehicle) -> str:
        """What it does when our set-points stop; GUIDED has no failsafe of its own."""
        return "brakes after 3 s and holds; on its way to a place flies there first"

    def prepare(self, vehicle: Vehicle, on_done: Done | None = None) -> VehicleAction:
        """Change to GUIDED: pre-arm checks are those of the present mode."""
        return self.mode(vehicle, GUIDED, "mode GUIDED", RetryClass.SET, on_done)

    def request_prearm_reasons(self, vehicle: Vehicle) -> VehicleAction:
        """Have the pre-arm checks run and their problems sent as status texts; unasked they come every 30 s only."""
        order = MavCommand(c.CMD_RUN_PREARM_CHECKS)
        return self._encoder.action(vehicle.id, "pre-arm checks", RetryClass.SET, order, None)

    def take_off(self, vehicle: Vehicle, alt_rel_m: float, on_done: Done) -> VehicleAction:
        """Climb to a height above home, which NAV_TAKEOFF's is here."""
        order = MavCommand(c.CMD_TAKEOFF, (0, 0, 0, 0, 0, 0, alt_rel_m))
        return self._encoder.take_off(vehicle, order, on_done)

    def mode(
        self, vehicle: Vehicle, custom_mode: int, name: str, retry: RetryClass, on_done: Done | None = None
    ) -> VehicleAction:
        """Change mode; done when the heartbeat shows it.

        Raises:
            ValueError: a mode that would be cut to another one.
        """
        if not 0 <= custom_mode < 1 << MODE_BITS:
            raise ValueError(f"ArduCopter has no mode {custom_mode}")
        order = MavCommand(c.CMD_SET_MODE, (c.CUSTOM_MODE_ENABLED, custom_mode))
        return self._encoder.action(
            vehicle.id, name, retry, order, lambda v: v.telemetry.custom_mode == custom_mode, on_done
        )

    def hold(self, vehicle: Vehicle, where: Callable[[], Vec3]) -> VehicleAction:
        """Stop `vehicle`, whatever it does; what that takes is decided again for every copy.

        In the air: in GUIDED a position target at `where()`, in any other mode BRAKE; BRAKE, too, where another vehicle
        may use this id. On the ground and armed: disarm (a start was cancelled). Armed without a position: BRAKE, which
        ends a climb and does no harm on the ground.
        """
        vehicle_id, encoder = vehicle.id, self._encoder
        seen_s = math.inf
        """Time of its newest heartbeat when the first copy for a vehicle in the air was sent."""

        def send(copy: int) -> None:
            nonlocal seen_s
            if may_be_flying(vehicle):
                seen_s = min(seen_s, vehicle.telemetry.heartbeat_s)
            if vehicle.telemetry.airborne and vehicle.telemetry.custom_mode == GUIDED and not vehicle.why_not_commanded:
                encoder.position(vehicle_id, StopReason("hold", action.by), where())
            elif may_be_flying(vehicle):
                brake = MavCommand(c.CMD_SET_MODE, (c.CUSTOM_MODE_ENABLED, BRAKE))
                encoder.send_command(vehicle_id, action.as_order(), brake, copy)
            elif vehicle.telemetry.armed:
                disarm = Order("disarm", OrderClass.STOP, action.by)
                encoder.send_command(vehicle_id, disarm, MavCommand(c.CMD_ARM_DISARM, (0,)), copy)

        def stopped(v: Vehicle) -> bool:
            # Its mode may change between two heartbeats, and it may lift off after the first copy. So it must stand
            # for a while: a climb begins slowly, too, and GUIDED is also the mode of a take-off.
            still = v.telemetry.airborne and self.is_holding(v) and stands_still(v) and is_settled(v, seen_s)
            return is_settled(v, action.first_s) and (not v.telemetry.armed or still)

        action = VehicleAction(vehicle_id, "hold", RetryClass.STOP, send=send, confirmed=stopped)
        action.look = lambda: encoder.ask(vehicle_id, c.CMD_REQUEST_MESSAGE, c.HEARTBEAT)
        return action

    def go_to(
        self, vehicle: Vehicle, point_m: Vec3, speed_m_s: float, permission: SetpointPermission, *, anew: bool
    ) -> None:
        """Send a position target. One is enough, and has no time-out; further ones do no harm."""
        self._encoder.position(vehicle.id, permission, point_m)
        # ArduCopter takes its own speed again whenever it begins to fly to a place: so the limit goes after the
        # target.
        if anew:
            self._commands.submit(self.change_speed(vehicle, speed_m_s))

    def follow(
        self,
        vehicle: Vehicle,
        point_m: Vec3,
        velocity_m_s: Vec3,
        permission: SetpointPermission,
        feed_forward_m_s2: Vec3 = STILL,
    ) -> None:
        """Send a position and velocity target. After 3 s without another it brakes (GUID_TIMEOUT)."""
        self._encoder.position_velocity(vehicle.id, permission, point_m, velocity_m_s)

    def fly(self, vehicle: Vehicle, velocity_m_s: Vec3, permission: SetpointPermission) -> None:
        """Send a velocity target. ArduCopter's own limits of climb and descent do not apply to it: the caller's do."""
        self._encoder.velocity(vehicle.id, permission, velocity_m_s)

    def mission_start(self, vehicle: Vehicle, on_done: Done | None = None) -> VehicleAction:
        """Change to AUTO in the air; on the ground it is not armable in AUTO (AUTO_OPTIONS)."""
        action = self.mode(vehicle, AUTO, "mission start", RetryClass.START, on_done)
        action.starts = True
        return action

    def is_steerable(self, vehicle: Vehicle) -> bool:
        """Whether it is in GUIDED."""
        return vehicle.telemetry.custom_mode == GUIDED

    def is_holding(self, vehicle: Vehicle) -> bool:
        """Whether it is in GUIDED or BRAKE."""
        return vehicle.telemetry.custom_mode in (GUIDED, BRAKE)

    def acts_by_itself(self, vehicle: Vehicle) -> bool:
        """Whether a failsafe has changed its mode to one in which no order of ours leaves it."""
        return vehicle.telemetry.system_status == c.STATUS_CRITICAL and not self.is_holding(vehicle)
