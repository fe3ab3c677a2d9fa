"""Autopilots that this station cannot fly: every order is refused, with the reason."""

from collections.abc import Callable

from tui_gcs.core.firmware.base import UNKNOWN_OFF_COURSE_M
from tui_gcs.core.firmware.command_encoder import Done
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import SetpointPermission
from tui_gcs.core.motion.course import STILL
from tui_gcs.core.motion.lead_compensation import LeadCompensation
from tui_gcs.core.protocol.common import Vec3
from tui_gcs.core.uplink.actions import RetryClass, VehicleAction, refused

WHY = "only ArduCopter and PX4 multicopters can be flown so far"


class Unsupported:
    """The `Firmware` of vehicles that are shown and never steered."""

    name = ""
    setpoint_gap_s = 0.2
    lead = LeadCompensation()
    off_course_m = UNKNOWN_OFF_COURSE_M

    def why_not(self, vehicle: Vehicle) -> str:
        """The reason why it cannot be commanded."""
        return WHY

    start_problem = if_silent = why_not

    def prepare(self, vehicle: Vehicle, on_done: Done) -> VehicleAction:
        """Refuse, as all orders that follow."""
        return refused(vehicle.id, "mode", WHY, on_done)

    def is_prepared(self, vehicle: Vehicle) -> bool:
        """False: it is never steerable, nor holding or landing by our orders."""
        return False

    is_steerable = is_holding = is_landing = acts_by_itself = is_prepared

    def request_prearm_reasons(self, vehicle: Vehicle) -> VehicleAction | None:
        """Send nothing, and return None."""
        return None

    engage = request_prearm_reasons

    def arm(self, vehicle: Vehicle, on_done: Done) -> VehicleAction:
        """Refuse the order to arm."""
        return refused(vehicle.id, "arm", WHY, on_done)

    def disarm(self, vehicle: Vehicle) -> VehicleAction:
        """Refuse the order to disarm."""
        return refused(vehicle.id, "disarm", WHY, None)

    def take_off(self, vehicle: Vehicle, alt_rel_m: float, on_done: Done) -> VehicleAction:
        """Refuse the order to take off."""
        return refused(vehicle.id, "take-off", WHY, on_done)

    def land(self, vehicle: Vehicle) -> VehicleAction:
        """Refuse the order to land."""
        return refused(vehicle.id, "land", WHY, None)

    def rtl(self, vehicle: Vehicle) -> VehicleAction:
        """Refuse the order to return."""
        return refused(vehicle.id, "return", WHY, None)

    def mode(
        self, vehicle: Vehicle, custom_mode: int, name: str, retry: RetryClass, on_done: Done | None = None
    ) -> VehicleAction:
        """Refuse to change the mode."""
        return refused(vehicle.id, name, WHY, on_done)

    def hold(self, vehicle: Vehicle, where: Callable[[], Vec3]) -> VehicleAction:
        """Refuse the order to hold."""
        return refused(vehicle.id, "hold", WHY, None)

    def go_to(
        self, vehicle: Vehicle, point_m: Vec3, speed_m_s: float, permission: SetpointPermission, *, anew: bool
    ) -> None:
        """Send nothing: callers check first that a vehicle is steerable."""

    def follow(
        self,
        vehicle: Vehicle,
        point_m: Vec3,
        velocity_m_s: Vec3,
        permission: SetpointPermission,
        feed_forward_m_s2: Vec3 = STILL,
    ) -> None:
        """Send nothing, as `go_to` does."""

    def fly(self, vehicle: Vehicle, velocity_m_s: Vec3, permission: SetpointPermission) -> None:
        """Send nothing, as `go_to` does."""

    def change_speed(self, vehicle: Vehicle, speed_m_s: float) -> VehicleAction:
        """Refuse to change the speed."""
        return refused(vehicle.id, "speed", WHY, None)

    def mission_start(self, vehicle: Vehicle, on_done: Done | None = None) -> VehicleAction:
        """Refuse to start a mission."""
        return refused(vehicle.id, "mission start", WHY, on_done)

    def mission_pause(self, vehicle: Vehicle) -> VehicleAction:
        """Refuse to pause a mission."""
        return refused(vehicle.id, "hold", WHY, None)

    def mission_continue(self, vehicle: Vehicle) -> VehicleAction:
        """Refuse to continue a mission."""
        return refused(vehicle.id, "mission continue", WHY, None)

    def tick(self, vehicles: list[Vehicle]) -> None:
        """Do nothing: nothing is ever due."""

    def release(self, vehicle: Vehicle) -> None:
        """Do nothing: nothing was ever sent."""
