"""Cameras and gimbals of vehicles: what is there, and the two controllers that use them."""

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.payload.camera_control import CameraControl
from tui_gcs.core.services.payload.devices import CAMERA_INFORMATION, PayloadDevices
from tui_gcs.core.services.payload.gimbal_control import GIMBAL_DEVICE_ATTITUDE_STATUS, GimbalControl
from tui_gcs.core.services.payload.payload_commands import Done, PayloadCommands, ignore
from tui_gcs.core.uplink.actions import Outcome, RetryClass, VehicleAction

GIMBAL_MANAGER_INFORMATION, GIMBAL_MANAGER_STATUS = 280, 281
PAYLOAD_MESSAGES = (
    GIMBAL_MANAGER_INFORMATION,
    GIMBAL_MANAGER_STATUS,
    GIMBAL_DEVICE_ATTITUDE_STATUS,
    CAMERA_INFORMATION,
)
ANSWER_TIMEOUT_S = 1.0
"""How long after the question an autopilot may report what it carries."""


class PayloadService:
    """The devices of all vehicles, with a controller for cameras and one for gimbals."""

    def __init__(self, context: ServiceContext) -> None:
        self._context = context
        self.devices = PayloadDevices(context)
        self.ignored = self.devices.ignored
        commands = PayloadCommands(context)
        self.camera = CameraControl(context, self.devices, commands)
        self.gimbal = GimbalControl(context, self.devices, commands)

    def ask(self, vehicle: Vehicle, on_done: Done = ignore) -> None:
        """Ask an autopilot for the gimbal and the camera that it manages itself: it does not report them unasked."""
        now = self._context.clock.now()

        def send(copy: int) -> None:
            for message in PAYLOAD_MESSAGES:
                self.devices.request(vehicle, message)

        def done(_: VehicleAction, outcome: Outcome, why: str) -> None:
            payload = self.devices.of(vehicle)
            payload.was_asked = payload.was_asked or outcome is Outcome.CONFIRMED
            on_done(outcome, why)

        action = VehicleAction(
            vehicle.id,
            "what it carries",
            RetryClass.SET,
            send=send,
            confirmed=lambda _: self._context.clock.now() >= now + ANSWER_TIMEOUT_S and vehicle.last_heard_s > now,
            on_done=done,
            housekeeping=True,
        )
        self._context.commands.submit(action)
