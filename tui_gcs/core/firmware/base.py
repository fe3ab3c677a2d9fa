"""What the station needs from any autopilot. What differs between autopilots is behind this interface only.

Actions are for the caller to submit to the command service; set-points leave at once.
"""

import math
from collections.abc import Callable

from tui_gcs.core.firmware.command_encoder import Done
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import SetpointPermission
from tui_gcs.core.motion.course import STILL
from tui_gcs.core.motion.lead_compensation import LeadCompensation
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.uplink.actions import RetryClass, VehicleAction, refused

PILOT_MODES = frozenset(
    {
        *("ACRO", "ALTCTL", "ALTITUDE_CRUISE", "ALT_HOLD", "AUTOTUNE", "CIRCLE", "DRIFT", "FLIP", "FLOWHOLD", "LOITER"),
        *("MANUAL", "POSCTL", "POSHOLD", "RATE_ACRO", "SLOW", "SPORT", "STABILIZE", "STABILIZED", "TURTLE", "ZIGZAG"),
    }
)
"""Modes of ArduCopter and PX4 in which the sticks of a remote control fly a multicopter."""
WHY = "only ArduCopter and PX4 multicopters can be flown so far"
HOLD_SETTLES_S = 0.8
"""A vehicle that did not get the hold and begins to move is faster than `HOLD_SPEED_M_S` after this time."""
# A vehicle that holds in wind of 4 m/s wanders by 0.6 m, much slower than this.
HOLD_SPEED_M_S = 0.5
BLIND_S = 1.0
"""A heartbeat newer than the position by this much: whether the vehicle has left the ground since is not known."""
UNKNOWN_OFF_COURSE_M = 1.25
"""`Firmware.off_course_m` of a vehicle that was never heard: the worst of those that planners steer."""


class Firmware:
    """One kind of autopilot. Heights are above each vehicle's own home, places are ENU metres.

    The class itself stands for vehicles that are shown and never flown: it refuses every order and sends nothing.
    """

    name = ""
    """The operator's name for it, e.g. "ArduCopter"."""
    setpoint_gap_s = 0.2
    """A moving reference is sent this often."""
    lead = LeadCompensation()
    """A vehicle's lead compensation before its own was measured."""
    off_course_m = UNKNOWN_OFF_COURSE_M
    """How far beside a moving course it may be, whatever its height and lag, nearly always: planners leave this much of
    the footprint."""

    def why_not(self, vehicle: Vehicle) -> str:
        """Why this vehicle cannot be commanded at all, or ""."""
        return WHY

    def start_problem(self, vehicle: Vehicle) -> str:
        """Why this autopilot cannot start a flight now, or ""."""
        return WHY

    def if_silent(self, vehicle: Vehicle) -> str:
        """What it does when our set-points stop, in words; shown before a start."""
        return WHY

    def prepare(self, vehicle: Vehicle, on_done: Done | None = None) -> VehicleAction:
        """Set the mode in which it is armed."""
        return refused(vehicle.id, "mode", WHY, on_done)

    def is_prepared(self, vehicle: Vehicle) -> bool:
        """Whether it is in that mode."""
        return False

    def request_prearm_reasons(self, vehicle: Vehicle) -> VehicleAction | None:
        """Ask why it cannot arm, to be answered by status texts or events; None where it reports that unasked."""
        return None

    def arm(self, vehicle: Vehicle, on_done: Done) -> VehicleAction:
        """Arm; done when the heartbeat shows it."""
        return refused(vehicle.id, "arm", WHY, on_done)

    def disarm(self, vehicle: Vehicle) -> VehicleAction:
        """Disarm a vehicle on the ground."""
        return refused(vehicle.id, "disarm", WHY, None)

    def take_off(self, vehicle: Vehicle, alt_rel_m: float, on_done: Done) -> VehicleAction:
        """Climb vertically to `alt_rel_m` above home; done when it has left the ground."""
        return refused(vehicle.id, "take-off", WHY, on_done)

    def land(self, vehicle: Vehicle) -> VehicleAction:
        """Land the vehicle where it is."""
        return refused(vehicle.id, "land", WHY, None)

    def mode(
        self, vehicle: Vehicle, custom_mode: int, name: str, retry: RetryClass, on_done: Done | None = None
    ) -> VehicleAction:
        """Change to one of the vehicle's own modes; done when the heartbeat shows it. `name` is the operator's word.

        Raises:
            ValueError: a number that this autopilot would take for another mode.
        """
        return refused(vehicle.id, name, WHY, on_done)

    def hold(self, vehicle: Vehicle, where: Callable[[], Vec3]) -> VehicleAction:
        """Stop, whatever it does. `where()` is the place where it comes to rest. Every copy leaves over every path.

        An absent pilot's sticks are never read.
        """
        return refused(vehicle.id, "hold", WHY, None)

    def engage(self, vehicle: Vehicle) -> VehicleAction | None:
        """Put it into a mode in which it takes set-points; None if it is in one."""
        return None

    def go_to(
        self, vehicle: Vehicle, point_m: Vec3, speed_m_s: float, permission: SetpointPermission, *, anew: bool
    ) -> None:
        """Fly to a place and stay there, no faster than `speed_m_s`; may be sent again and again.

        `anew`: it did something else before, so that its speed limit must be set.

        `permission` is the guard's verdict on the course, or the reason of a stop.
        """

    def follow(
        self,
        vehicle: Vehicle,
        point_m: Vec3,
        velocity_m_s: Vec3,
        permission: SetpointPermission,
        feed_forward_m_s2: Vec3 = STILL,
    ) -> None:
        """Be at `point_m` now, moving with `velocity_m_s`: to be sent every `setpoint_gap_s`.

        `feed_forward_m_s2` is the acceleration that its motors must make for that, see
        `LeadCompensatedCourse.feed_forward`; it is not sent where the lead has no drag.
        """

    def fly(self, vehicle: Vehicle, velocity_m_s: Vec3, permission: SetpointPermission) -> None:
        """Move with `velocity_m_s` (east, north, up): to be sent every `setpoint_gap_s`."""

    def change_speed(self, vehicle: Vehicle, speed_m_s: float) -> VehicleAction:
        """Limit the speed of flights to a place."""
        return refused(vehicle.id, "speed", WHY, None)

    def mission_start(self, vehicle: Vehicle, on_done: Done | None = None) -> VehicleAction:
        """Fly the mission on board from its present item."""
        return refused(vehicle.id, "mission start", WHY, on_done)

    def mission_continue(self, vehicle: Vehicle) -> VehicleAction:
        """Go on with a paused mission."""
        return refused(vehicle.id, "mission continue", WHY, None)

    def is_steerable(self, vehicle: Vehicle) -> bool:
        """Whether it is in a mode in which our set-points work."""
        return False

    def is_holding(self, vehicle: Vehicle) -> bool:
        """Whether it is in a mode in which a hold of ours leaves it."""
        return False

    def is_landing(self, vehicle: Vehicle) -> bool:
        """Whether it is in a mode that ends on the ground where it is."""
        return False

    def flies_mission(self, vehicle: Vehicle) -> bool:
        """Whether it flies the mission on board, or has ended it."""
        return False

    def acts_by_itself(self, vehicle: Vehicle) -> bool:
        """Whether its own failsafe flies it, perhaps in a mode that we use as well: an order would end that."""
        return False

    def tick(self, vehicles: list[Vehicle]) -> None:
        """Do what is due by itself for `vehicles`, which are of this kind."""

    def release(self, vehicle: Vehicle) -> None:
        """The vehicle is not ours to steer any more, or is another one: nothing more is sent by itself."""


def flown_by_pilot(vehicle: Vehicle) -> bool:
    """Whether it is in a mode that a pilot flies by remote control."""
    return vehicle.mode_name in PILOT_MODES


def stands_still(vehicle: Vehicle) -> bool:
    """Whether it hardly moves; False where its velocity is not known."""
    return math.hypot(*vehicle.telemetry.velocity_m_s) < HOLD_SPEED_M_S


def is_settled(vehicle: Vehicle, sent_s: float) -> bool:
    """Whether its newest position and heartbeat show the effect of an order, not only the moment it was sent."""
    return min(vehicle.telemetry.position_s, vehicle.telemetry.heartbeat_s) > sent_s + HOLD_SETTLES_S


def may_be_flying(vehicle: Vehicle) -> bool:
    """Whether it is in the air, or armed without a position since its heartbeat."""
    return vehicle.telemetry.airborne or (
        vehicle.telemetry.armed and vehicle.telemetry.heartbeat_s - vehicle.telemetry.position_s > BLIND_S
    )
