"""Cameras and gimbals: found by their heartbeats and what autopilots say of theirs, pointed, triggered.

All orders are MAVLink's own, the same for every autopilot. None of them is shown by telemetry one could rely on, so
the ACK is the result. A camera's address for its definition file (CAMERA_INFORMATION) is shown to nobody and never
fetched (security.md B.6-94).
"""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from tui_gcs.core.components import hear_all
from tui_gcs.core.fleet import Fields
from tui_gcs.core.services.command import Action, Outcome, Retry
from tui_gcs.core.services.context import Context
from tui_gcs.core.text import clean
from tui_gcs.core.vehicle import NAN, Vehicle

TYPE_GIMBAL, TYPE_CAMERA = 26, 30
"""MAV_TYPE."""
STATION_COMPONENT = 190
CAMERA_INFORMATION, REQUEST_MESSAGE = 259, 512
SET_ROI_LOCATION, SET_ROI_NONE, DIGICAM_CONTROL = 195, 197, 203
GIMBAL_PITCH_YAW, GIMBAL_CONFIGURE = 1000, 1001
IMAGE_START_CAPTURE = 2000
UNSUPPORTED = 3
"""MAV_RESULT."""
LEAVE_AS_IT_IS, RELEASE = -1, -3
"""Of GIMBAL_CONFIGURE's four owners: unchanged; nobody, if it was us."""
ROLL_LOCK, PITCH_LOCK, YAW_LOCK = 4, 8, 16
"""GIMBAL_MANAGER_FLAGS: held against the horizon; yaw against north instead of the nose."""
FRAME_AMSL = 0
VIDEO_START_CAPTURE, VIDEO_STOP_CAPTURE = 2500, 2501
COMMANDS = frozenset({195, 197, 203, 1000, 1001, 2000, 2001, 2500, 2501})
"""Whose ACKs a camera or gimbal may send by itself."""
MOST_DEVICES = 8
"""Cameras and gimbals of one vehicle."""
UNKNOWN_ANGLES = (NAN, NAN, NAN)

Done = Callable[[Outcome, str], None]


@dataclass
class Camera:
    """One camera of a vehicle."""

    component: int
    name: str = ""
    """Maker and model, cleaned."""
    images: int = 0
    """Pictures it told of since we listen."""


@dataclass
class Gimbal:
    """One gimbal, as its manager tells of it."""

    component: int
    """Who manages it: itself or the autopilot."""
    controlled_by: int | None = None
    """System id in control; 0 is nobody, None not known."""
    angles_deg: tuple[float, float, float] = UNKNOWN_ANGLES
    """Roll, pitch, yaw; NaN if unknown."""


@dataclass
class _Kit:
    cameras: dict[int, Camera] = field(default_factory=dict)
    gimbals: dict[int, Gimbal] = field(default_factory=dict)
    shots: int = 0
    controls: bool = False
    """We asked for control of its gimbal."""


class PayloadService:
    """What vehicles carry, and how it is told what to do."""

    def __init__(self, context: Context) -> None:
        """Listen; nothing is asked before a camera is heard."""
        self._context = context
        self._kits: dict[int, _Kit] = {}
        self.ignored: Counter[str] = Counter()
        fleet = context.fleet
        fleet.components.on("HEARTBEAT", self._heartbeat)
        fleet.components.on("COMMAND_ACK", self._ack)
        handlers = {
            "CAMERA_INFORMATION": self._information,
            "CAMERA_IMAGE_CAPTURED": self._captured,
            "CAMERA_FEEDBACK": self._captured,
            "GIMBAL_MANAGER_INFORMATION": self._manager,
            "GIMBAL_MANAGER_STATUS": self._manager_status,
            "GIMBAL_DEVICE_ATTITUDE_STATUS": self._attitude,
        }
        for name, handler in handlers.items():
            hear_all(fleet, name, handler)
        fleet.on_gone(self._forget)
        fleet.paths.on_replace.append(self._forget)

    # ---------------------------------------------------------------- for others

    def cameras(self, vehicle: Vehicle) -> tuple[Camera, ...]:
        """Its cameras that were heard."""
        kit = self._kits.get(vehicle.id)
        return tuple(kit.cameras.values()) if kit is not None else ()

    def gimbals(self, vehicle: Vehicle) -> tuple[Gimbal, ...]:
        """Its gimbals that were heard."""
        kit = self._kits.get(vehicle.id)
        return tuple(kit.gimbals.values()) if kit is not None else ()

    def trigger(self, vehicle: Vehicle, on_done: Done | None = None) -> None:
        """Take one picture. Copies of the order carry its number, so that a lost ACK takes no second one.

        Autopilots that do not know IMAGE_START_CAPTURE are told the old way (DO_DIGICAM_CONTROL), once.
        """
        kit = self._kit(vehicle)
        kit.shots += 1
        component = self._camera_component(vehicle)

        def done(action: Action, outcome: Outcome, why: str) -> None:
            if action.result == UNSUPPORTED and component == vehicle.component:
                self._submit(vehicle, "old camera trigger", DIGICAM_CONTROL, (0, 0, 0, 0, 1), on_done, once=True)
            elif on_done is not None:
                on_done(outcome, why)

        shot = (0, 0, 1, kit.shots)
        self._submit(vehicle, "camera trigger", IMAGE_START_CAPTURE, shot, done=done, start=True, component=component)

    def record(self, vehicle: Vehicle, on_done: Done | None = None, *, stop: bool = False) -> None:
        """Start or stop a video; either may be said twice."""
        name, command = ("video stop", VIDEO_STOP_CAPTURE) if stop else ("video start", VIDEO_START_CAPTURE)
        self._submit(vehicle, name, command, (), on_done, component=self._camera_component(vehicle))

    def point(
        self,
        vehicle: Vehicle,
        pitch_deg: float,
        yaw_deg: float,
        *,
        to_north: bool = False,
        on_done: Done | None = None,
    ) -> None:
        """Point its gimbal, taking control of it first.

        Args:
            vehicle: Whose.
            pitch_deg: Up is positive, -90…90.
            yaw_deg: Right of the nose, or of north; -180…180.
            to_north: Whether yaw is counted from north, and kept while the vehicle turns.
            on_done: Told how it ended.
        """
        if not (-90 <= pitch_deg <= 90 and -180 <= yaw_deg <= 360):
            if on_done is not None:
                on_done(Outcome.REFUSED, "pitch or yaw is beyond what any gimbal can do")
            return
        flags = ROLL_LOCK | PITCH_LOCK | (YAW_LOCK if to_north else 0)
        angles = (pitch_deg, yaw_deg, NAN, NAN, flags, 0, 0)
        component = self._gimbal_component(vehicle)
        kit = self._kit(vehicle)

        def turn(action: Action | None, outcome: Outcome, why: str) -> None:
            kit.controls = kit.controls or outcome is Outcome.CONFIRMED
            if outcome in (Outcome.EXPIRED, Outcome.SUPERSEDED):
                if on_done is not None:
                    on_done(outcome, why)
                return
            self._submit(vehicle, "gimbal", GIMBAL_PITCH_YAW, angles, on_done, component=component)

        if kit.controls and self._controlled_by_us(vehicle):
            turn(None, Outcome.CONFIRMED, "")
        else:
            mine = (self._context.own_system, STATION_COMPONENT, LEAVE_AS_IT_IS, LEAVE_AS_IT_IS, 0, 0, 0)
            self._submit(vehicle, "gimbal control", GIMBAL_CONFIGURE, mine, done=turn, component=component)

    def release(self, vehicle: Vehicle, on_done: Done | None = None) -> None:
        """Give control of its gimbal back."""
        self._kit(vehicle).controls = False
        nobody = (RELEASE, RELEASE, LEAVE_AS_IT_IS, LEAVE_AS_IT_IS, 0, 0, 0)
        component = self._gimbal_component(vehicle)
        self._submit(vehicle, "gimbal release", GIMBAL_CONFIGURE, nobody, on_done, component=component)

    def look_at(
        self, vehicle: Vehicle, lat_deg: float, lon_deg: float, alt_amsl_m: float, on_done: Done | None = None
    ) -> None:
        """Keep gimbal (or nose) on a place. Heights are above mean sea level: the one frame both autopilots read."""
        if not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180 and math.isfinite(alt_amsl_m)):
            if on_done is not None:
                on_done(Outcome.REFUSED, "this is no place")
            return
        place = {
            "frame": FRAME_AMSL,
            "x": round(lat_deg * 1e7),
            "y": round(lon_deg * 1e7),
            "z": float(alt_amsl_m),
            "current": 0,
            "autocontinue": 0,
        } | {f"param{i}": 0.0 for i in range(1, 5)}
        self._send_action(
            vehicle,
            "region of interest",
            SET_ROI_LOCATION,
            lambda copy: self._context.door.action(
                vehicle.id, "region of interest", "COMMAND_INT", command=SET_ROI_LOCATION, **place
            ),
            _plainly(on_done),
        )

    def look_ahead(self, vehicle: Vehicle, on_done: Done | None = None) -> None:
        """No region of interest any more."""
        self._submit(vehicle, "no region of interest", SET_ROI_NONE, (), on_done)

    # ---------------------------------------------------------------- orders

    def _submit(
        self,
        vehicle: Vehicle,
        name: str,
        command: int,
        params: tuple[float, ...],
        on_done: Done | None = None,
        *,
        done: Callable[[Action, Outcome, str], None] | None = None,
        start: bool = False,
        once: bool = False,
        component: int | None = None,
    ) -> None:
        """`start`: nothing later than 2 s. `once`: a second copy would do it twice."""
        values = {f"param{i}": float(value) for i, value in enumerate((*params, *([0.0] * 7))[:7], start=1)}
        target = vehicle.component if component is None else component

        def send(copy: int) -> None:
            if not (once and copy):
                fields = {"command": command, "confirmation": min(copy, 255), "target_component": target} | values
                self._context.door.action(vehicle.id, name, "COMMAND_LONG", **fields)

        self._send_action(vehicle, name, command, send, done or _plainly(on_done), start=start or once)

    def _send_action(
        self,
        vehicle: Vehicle,
        name: str,
        command: int,
        send: Callable[[int], object],
        done: Callable[[Action, Outcome, str], None] | None,
        *,
        start: bool = False,
    ) -> None:
        action = Action(
            vehicle.id,
            name,
            Retry.START if start else Retry.SET,
            send=send,
            confirmed=lambda _: action.acked_s is not None,
            command=command,
            on_done=done,
        )
        self._context.commands.submit(action)

    def _ack(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        """A camera or gimbal answers for itself; only to what concerns it."""
        if fields["command"] in COMMANDS and self._is_device(vehicle, component) and self._context.is_for_us(fields):
            self._context.commands.on_ack(vehicle, fields["command"], fields["result"])
        elif fields["command"] != REQUEST_MESSAGE:
            self.ignored["ack of a component for what is not its business"] += 1

    # ---------------------------------------------------------------- what is there

    def _kit(self, vehicle: Vehicle) -> _Kit:
        return self._kits.setdefault(vehicle.id, _Kit())

    def _forget(self, vehicle: Vehicle) -> None:
        self._kits.pop(vehicle.id, None)

    def _is_device(self, vehicle: Vehicle, component: int) -> bool:
        kit = self._kits.get(vehicle.id)
        return kit is not None and (component in kit.cameras or component in kit.gimbals)

    def _camera_component(self, vehicle: Vehicle) -> int:
        """The camera that speaks for itself, else the autopilot that has one on a servo."""
        return next((camera.component for camera in self.cameras(vehicle)), vehicle.component)

    def _gimbal_component(self, vehicle: Vehicle) -> int:
        return next((gimbal.component for gimbal in self.gimbals(vehicle)), vehicle.component)

    def _controlled_by_us(self, vehicle: Vehicle) -> bool:
        return any(gimbal.controlled_by in (None, self._context.own_system) for gimbal in self.gimbals(vehicle))

    def _camera(self, vehicle: Vehicle, component: int) -> Camera | None:
        kit = self._kit(vehicle)
        if component not in kit.cameras:
            if len(kit.cameras) >= MOST_DEVICES:
                self.ignored["too many cameras"] += 1
                return None
            kit.cameras[component] = Camera(component)
        return kit.cameras[component]

    def _gimbal(self, vehicle: Vehicle, component: int) -> Gimbal | None:
        kit = self._kit(vehicle)
        if component not in kit.gimbals:
            if len(kit.gimbals) >= MOST_DEVICES:
                self.ignored["too many gimbals"] += 1
                return None
            kit.gimbals[component] = Gimbal(component)
        return kit.gimbals[component]

    def _heartbeat(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        if fields["type"] == TYPE_GIMBAL:
            self._gimbal(vehicle, component)
        elif fields["type"] == TYPE_CAMERA:
            is_new = component not in self._kit(vehicle).cameras
            if self._camera(vehicle, component) is not None and is_new and self._context.door.is_ours(vehicle):
                self._ask_who(vehicle, component)

    def _ask_who(self, vehicle: Vehicle, component: int) -> None:
        """Once: a name is nice to have."""
        fields = {"command": REQUEST_MESSAGE, "confirmation": 0, "param1": CAMERA_INFORMATION}
        fields |= {f"param{i}": 0 for i in range(2, 8)} | {"target_component": component}
        self._context.door.ask(vehicle.id, "COMMAND_LONG", **fields)

    def _information(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        camera = self._camera(vehicle, component)
        if camera is not None:
            words = [clean(bytes(fields[name]).split(b"\0")[0], 32) for name in ("vendor_name", "model_name")]
            camera.name = clean(" ".join(word for word in words if word), 65)
        if fields["cam_definition_uri"]:
            self.ignored["address of a camera's definition, never fetched"] += 1

    def _captured(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        camera = self._camera(vehicle, component)
        if camera is not None and fields.get("capture_result", 1) == 1:
            camera.images += 1

    def _manager(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        self._gimbal(vehicle, component)

    def _manager_status(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        gimbal = self._gimbal(vehicle, component)
        if gimbal is not None:
            gimbal.controlled_by = fields["primary_control_sysid"]

    def _attitude(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        gimbal = self._gimbal(vehicle, component)
        if gimbal is not None:
            gimbal.angles_deg = angles_deg(fields["q"])


def angles_deg(q: tuple[float, ...]) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a quaternion (w, x, y, z); NaN if it is none."""
    length = math.hypot(*q)
    if not (math.isfinite(length) and 0.5 < length < 2.0):
        return UNKNOWN_ANGLES
    w, x, y, z = (value / length for value in q)
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return math.degrees(roll), math.degrees(pitch), math.degrees(yaw)


def _plainly(on_done: Done | None) -> Callable[[Action, Outcome, str], None] | None:
    return None if on_done is None else lambda action, outcome, why: on_done(outcome, why)
