"""What ArduCopter and PX4 multicopters have in common: the orders that differ in a mode's number only."""

from tui_gcs.core.firmware.base import Firmware
from tui_gcs.core.firmware.command_encoder import CommandEncoder, Done
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink import commands as c
from tui_gcs.core.uplink.actions import MavCommand, RetryClass, VehicleAction
from tui_gcs.core.uplink.commands import CommandService


class Multicopter(Firmware):
    """A multicopter that is commanded by set-points and MAV_CMDs; its modes have other numbers in each autopilot."""

    start_mode: int
    """The custom_mode in which it is armed and takes set-points or places."""
    land_mode: int
    mission_mode: int

    def __init__(self, command_encoder: CommandEncoder, commands: CommandService) -> None:
        """`commands` runs the orders that go along with a set-point."""
        self._encoder = command_encoder
        self._commands = commands

    def why_not(self, vehicle: Vehicle) -> str:
        """Return "": it can always be commanded."""
        return ""

    def is_prepared(self, vehicle: Vehicle) -> bool:
        """Whether it is in the mode in which it is armed."""
        return vehicle.telemetry.custom_mode == self.start_mode

    def arm(self, vehicle: Vehicle, on_done: Done) -> VehicleAction:
        """Arm. A take-off must follow within 10 s, or it disarms itself. Arming by force skips no check of PX4."""
        return self._encoder.arm(vehicle.id, on_done)

    def disarm(self, vehicle: Vehicle) -> VehicleAction:
        """Disarm on the ground; in the air it refuses."""
        return self._encoder.disarm(vehicle.id)

    def land(self, vehicle: Vehicle) -> VehicleAction:
        """Change to the mode that lands where it is."""
        return self.mode(vehicle, self.land_mode, "land", RetryClass.STOP)

    def mission_continue(self, vehicle: Vehicle) -> VehicleAction:
        """Change to the mission's mode, which goes on at the same item (ArduCopter: MIS_RESTART 0)."""
        return self.mode(vehicle, self.mission_mode, "mission continue", RetryClass.START)

    def engage(self, vehicle: Vehicle) -> VehicleAction | None:
        """Change to the mode in which it takes set-points or places; None if it is steerable."""
        return None if self.is_steerable(vehicle) else self.prepare(vehicle)

    def change_speed(self, vehicle: Vehicle, speed_m_s: float) -> VehicleAction:
        """Limit the speed: ArduCopter's to a place, PX4's of missions. No telemetry shows it: the ACK is all."""
        order = MavCommand(c.CMD_CHANGE_SPEED, (1, speed_m_s, -1))
        return self._encoder.action(vehicle.id, "speed", RetryClass.SET, order, None)

    def flies_mission(self, vehicle: Vehicle) -> bool:
        """Whether it is in the mission's mode."""
        return vehicle.telemetry.custom_mode == self.mission_mode

    def is_landing(self, vehicle: Vehicle) -> bool:
        """Whether it is in the mode that lands where it is."""
        return vehicle.telemetry.custom_mode == self.land_mode
