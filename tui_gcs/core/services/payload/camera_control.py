"""Taking pictures and videos. An ACK only means that an order was understood, so pictures are counted."""

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.payload.devices import PayloadDevices
from tui_gcs.core.services.payload.payload_commands import Done, PayloadCommands, ignore
from tui_gcs.core.uplink.actions import Outcome, VehicleAction

# MAV_CMD. 203 is ArduPilot's older trigger, for autopilots without a camera that speaks MAVLink.
DIGICAM_CONTROL, IMAGE_START_CAPTURE = 203, 2000
VIDEO_START_CAPTURE, VIDEO_STOP_CAPTURE = 2500, 2501
UNSUPPORTED = 3
"""A value of MAV_RESULT."""
TAKES_VIDEOS = 1
"""A value of CAMERA_CAP_FLAGS."""
PICTURE_TIMEOUT_S = 1.5
"""How long after an ACK the report of the picture may come: ArduPilot and PX4 send it at once (measured)."""
UNSEEN_PICTURE = "accepted; the camera reported no picture: check whether it was taken"


class CameraControl:
    """Triggers the cameras of vehicles."""

    def __init__(self, context: ServiceContext, devices: PayloadDevices, commands: PayloadCommands) -> None:
        self._context = context
        self._devices = devices
        self._commands = commands

    def trigger(self, vehicle: Vehicle, on_done: Done = ignore) -> None:
        """Take one picture. An autopilot without IMAGE_START_CAPTURE gets the old DO_DIGICAM_CONTROL instead."""
        payload = self._devices.of(vehicle)
        payload.shots += 1
        component = self._devices.camera_component(vehicle)
        # A camera knows copies of the order by the picture's number. Autopilots do not look at it (ArduPilot's
        # source): a repeated order would be a second picture, so they get only one.
        is_autopilot = component == vehicle.component
        before = self._devices.images(vehicle)

        def taken(action: VehicleAction, outcome: Outcome, why: str) -> None:
            seen = "the camera reported the picture" if self._devices.images(vehicle) > before else UNSEEN_PICTURE
            on_done(outcome, seen if outcome is Outcome.CONFIRMED else why)

        def done(action: VehicleAction, outcome: Outcome, why: str) -> None:
            if is_autopilot and action.result == UNSUPPORTED:
                shoot = (0, 0, 0, 0, 1)
                self._commands.submit(
                    vehicle, "old camera trigger", DIGICAM_CONTROL, shoot, taken, once=True, shows=shows
                )
            else:
                taken(action, outcome, why)

        def shows(action: VehicleAction) -> bool:
            late = action.acked_s is not None and self._context.clock.now() > action.acked_s + PICTURE_TIMEOUT_S
            return late or (action.acked_s is not None and self._devices.images(vehicle) > before)

        self._commands.submit(
            vehicle,
            "camera trigger",
            IMAGE_START_CAPTURE,
            (0, 0, 1, payload.shots),
            done,
            start=True,
            once=is_autopilot,
            component=component,
            shows=shows,
        )

    def record(self, vehicle: Vehicle, on_done: Done = ignore, *, stop: bool = False) -> None:
        """Start or stop a video; copies of either order do no harm."""
        name, command = ("video stop", VIDEO_STOP_CAPTURE) if stop else ("video start", VIDEO_START_CAPTURE)
        cameras = self._devices.cameras(vehicle)
        only_pictures = any(c.abilities is not None and not c.abilities & TAKES_VIDEOS for c in cameras)

        def done(_: VehicleAction, outcome: Outcome, why: str) -> None:
            hint = "its camera takes pictures only" * (outcome is Outcome.REFUSED and only_pictures)
            on_done(outcome, ": ".join(part for part in (why, hint) if part))

        self._commands.submit(vehicle, name, command, (), done, component=self._devices.camera_component(vehicle))
