"""The cameras and gimbals of every vehicle, found by their heartbeats and by what autopilots report of their own.

A camera's address of its definition file (CAMERA_INFORMATION.cam_definition_uri) is never fetched and never shown: an
address from the network must not cause a request (docs/threats.md B.6-94).
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.commands import CMD_REQUEST_MESSAGE
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.services.payload.gimbal_state import GimbalState

TYPE_GIMBAL, TYPE_CAMERA = 26, 30
"""Values of MAV_TYPE."""
CAMERA_INFORMATION = 259
DEVICE_COMMANDS = frozenset({195, 197, 203, 1000, 1001, 2000, 2001, 2500, 2501})
"""The MAV_CMDs that a camera or gimbal may acknowledge itself."""
MAX_DEVICES = 8
"""The most cameras, and the most gimbals, that are kept for one vehicle."""


D = TypeVar("D")


@dataclass
class Camera:
    """One camera of a vehicle."""

    component: int
    name: str = ""
    """Maker and model, cleaned."""
    images: int = 0
    """Pictures that it has reported since this station listens."""
    abilities: int | None = None
    """CAMERA_CAP_FLAGS; None before CAMERA_INFORMATION was received."""


@dataclass
class VehiclePayload:
    """What one vehicle carries, and what this station has done with it."""

    cameras: dict[int, Camera] = field(default_factory=dict)
    """By component id."""
    gimbals: dict[int, GimbalState] = field(default_factory=dict)
    """By component id."""
    shots: int = 0
    """Pictures ordered so far: the number that IMAGE_START_CAPTURE carries."""
    gimbal_claimed: bool = False
    """This station has taken control of the gimbal."""
    was_asked: bool = False
    """The autopilot was asked what it carries and has had its time to answer."""


class PayloadDevices:
    """Keeps the cameras and gimbals of all vehicles up to date."""

    def __init__(self, context: ServiceContext) -> None:
        self._context = context
        self._payloads: dict[int, VehiclePayload] = {}
        self.ignored: Counter[str] = Counter()
        """Messages that were of no use, counted by reason."""
        handlers = {
            "CAMERA_INFORMATION": self._on_camera_information,
            "CAMERA_IMAGE_CAPTURED": self._on_image,
            "CAMERA_FEEDBACK": self._on_image,
            "GIMBAL_MANAGER_INFORMATION": self._on_manager,
            "GIMBAL_MANAGER_STATUS": self._on_manager_status,
            "GIMBAL_DEVICE_ATTITUDE_STATUS": self._on_attitude,
        }
        fleet = context.fleet
        fleet.on_message_of_other_components("HEARTBEAT", self._on_heartbeat)
        fleet.on_message_of_other_components("COMMAND_ACK", self._on_ack)
        for name, handler in handlers.items():
            fleet.on_message_of_any_component(name, handler)
        context.forget_with(self._forget, reboot=False)
        fleet.paths.on_reboot.append(self._on_reboot)

    def cameras(self, vehicle: Vehicle) -> tuple[Camera, ...]:
        """The cameras of a vehicle that were received."""
        found = self._payloads.get(vehicle.id)
        return tuple(found.cameras.values()) if found is not None else ()

    def gimbals(self, vehicle: Vehicle) -> tuple[GimbalState, ...]:
        """The gimbals of a vehicle that were received."""
        found = self._payloads.get(vehicle.id)
        return tuple(found.gimbals.values()) if found is not None else ()

    def has_camera(self, vehicle: Vehicle) -> bool | None:
        """Whether a camera was received; False if none although it was asked for, None if it was not asked for.

        False is no proof: PX4 takes pictures by a trigger pin and reports none before the first (measured), other
        autopilots do not answer the question, and frames get lost. So a camera order is discouraged, never forbidden.
        """
        return self._is_present(vehicle, bool(self.cameras(vehicle)))

    def has_gimbal(self, vehicle: Vehicle) -> bool | None:
        """Whether a gimbal was received; the values mean what they mean in `has_camera`."""
        return self._is_present(vehicle, bool(self.gimbals(vehicle)))

    def images(self, vehicle: Vehicle) -> int:
        """How many pictures its cameras have reported."""
        return sum(camera.images for camera in self.cameras(vehicle))

    def camera_component(self, vehicle: Vehicle) -> int:
        """The component id of its first camera, else of the autopilot, which may have one on a servo output."""
        return next((camera.component for camera in self.cameras(vehicle)), vehicle.component)

    def gimbal_component(self, vehicle: Vehicle) -> int:
        """The component id of its first gimbal manager, else of the autopilot."""
        return next((gimbal.component for gimbal in self.gimbals(vehicle)), vehicle.component)

    def of(self, vehicle: Vehicle) -> VehiclePayload:
        """The record of one vehicle, made empty when it is first asked for."""
        return self._payloads.setdefault(vehicle.id, VehiclePayload())

    def request(self, vehicle: Vehicle, message: int, component: int | None = None) -> None:
        """Ask a component (the autopilot by default) for one message, once."""
        target = vehicle.component if component is None else component
        self._context.commands.question(vehicle.id, CMD_REQUEST_MESSAGE)
        self._context.request_message(vehicle.id, message, target_component=target)

    def _is_present(self, vehicle: Vehicle, found: bool) -> bool | None:
        payload = self._payloads.get(vehicle.id)
        return True if found else False if payload is not None and payload.was_asked else None

    def _forget(self, vehicle: Vehicle) -> None:
        self._payloads.pop(vehicle.id, None)

    def _on_reboot(self, vehicle: Vehicle) -> None:
        # What the autopilot itself carries is set up by parameters that take effect at a boot: look again.
        payload = self.of(vehicle)
        payload.gimbal_claimed = payload.was_asked = False
        payload.cameras.pop(vehicle.component, None)
        payload.gimbals.pop(vehicle.component, None)

    def _is_device(self, vehicle: Vehicle, component: int) -> bool:
        payload = self._payloads.get(vehicle.id)
        return payload is not None and (component in payload.cameras or component in payload.gimbals)

    def _camera(self, vehicle: Vehicle, component: int) -> Camera | None:
        return self._device(self.of(vehicle).cameras, component, Camera, "too many cameras")

    def _gimbal(self, vehicle: Vehicle, component: int) -> GimbalState | None:
        return self._device(self.of(vehicle).gimbals, component, GimbalState, "too many gimbals")

    def _device(self, known: dict[int, D], component: int, make: Callable[[int], D], full: str) -> D | None:
        """Return the device with that component id, a new one if it is the first time; None if there is no room."""
        if component not in known and len(known) >= MAX_DEVICES:
            self.ignored[full] += 1
            return None
        return known.setdefault(component, make(component))

    def _on_ack(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        # A component may acknowledge only what concerns it: its ACK must not confirm another one's order.
        if (
            fields["command"] in DEVICE_COMMANDS
            and self._is_device(vehicle, component)
            and self._context.is_for_us(fields)
        ):
            self._context.commands.on_ack(vehicle, fields["command"], fields["result"])
        elif fields["command"] != CMD_REQUEST_MESSAGE:
            self.ignored["ack of a component for what is not its business"] += 1

    def _on_heartbeat(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        if fields["type"] == TYPE_GIMBAL:
            self._gimbal(vehicle, component)
        elif fields["type"] == TYPE_CAMERA:
            is_new = component not in self.of(vehicle).cameras
            if self._camera(vehicle, component) is not None and is_new and self._context.uplink.is_ours(vehicle):
                # Once: it works without its name, too.
                self.request(vehicle, CAMERA_INFORMATION, component)

    def _on_camera_information(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        camera = self._camera(vehicle, component)
        if camera is not None:
            words = [clean(bytes(fields[name]).split(b"\0")[0], 32) for name in ("vendor_name", "model_name")]
            camera.name = clean(" ".join(word for word in words if word), 65)
            camera.abilities = fields["flags"]
        if fields["cam_definition_uri"]:
            self.ignored["address of a camera's definition, never fetched"] += 1

    def _on_image(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        camera = self._camera(vehicle, component)
        if camera is not None and fields.get("capture_result", 1) == 1:
            camera.images += 1

    def _on_manager(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        self._gimbal(vehicle, component)

    def _on_manager_status(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        gimbal = self._gimbal(vehicle, component)
        if gimbal is not None:
            gimbal.controlled_by = fields["primary_control_sysid"]

    def _on_attitude(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        gimbal = self._gimbal(vehicle, component)
        if gimbal is not None:
            gimbal.on_attitude(fields, self._context.clock.now())
