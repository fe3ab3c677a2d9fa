"""Cameras and gimbals: found by their heartbeats and what autopilots say of theirs, pointed, triggered.

All orders are MAVLink's own, the same for every autopilot. An ACK says only that one was understood: angles are asked
for and pictures counted to tell what came of it; where nothing is told of that, that is said. A camera's address for
its definition file (CAMERA_INFORMATION) is shown to nobody and never fetched (security.md B.6-94).
"""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import NAN, Vehicle
from tui_gcs.core.services.context import Context
from tui_gcs.core.services.payload.gimbal import AIM_S, Aim, Gimbal
from tui_gcs.core.uplink.orders import Outcome, RetryClass, VehicleAction

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
GIMBAL_MANAGER_INFORMATION, GIMBAL_MANAGER_STATUS, GIMBAL_DEVICE_ATTITUDE_STATUS = 280, 281, 285
CARRIED = (GIMBAL_MANAGER_INFORMATION, GIMBAL_MANAGER_STATUS, GIMBAL_DEVICE_ATTITUDE_STATUS, CAMERA_INFORMATION)
ASKED_S = 1.0
"""So long after it was asked what it carries it may tell."""
PICTURE_S = 1.5
"""So long after an ACK the message that tells of the picture may come: at once on both (measured)."""
TAKES_VIDEOS = 1
"""CAMERA_CAP_FLAGS."""
UNSEEN_GIMBAL = "accepted; it tells no angles: look whether it turned"
UNSEEN_PICTURE = "accepted; it told of no picture: look whether it was taken"

Done = Callable[[Outcome, str], None]
"""How it ended; of one that was carried out what was seen of it, else why not."""


@dataclass
class Camera:
    """One camera of a vehicle."""

    component: int
    name: str = ""
    """Maker and model, cleaned."""
    images: int = 0
    """Pictures it told of since we listen."""
    abilities: int | None = None
    """CAMERA_CAP_FLAGS, None before it told."""


@dataclass
class _Kit:
    cameras: dict[int, Camera] = field(default_factory=dict)
    gimbals: dict[int, Gimbal] = field(default_factory=dict)
    shots: int = 0
    controls: bool = False
    """We asked for control of its gimbal."""
    asked: bool = False
    """Its autopilot was asked what it carries, and had its time to tell."""


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
            fleet.on_message_of_any_component(name, handler)
        fleet.on_gone(self._forget)
        fleet.paths.on_replace.append(self._forget)
        fleet.paths.on_reboot.append(self._rebooted)

    # ---------------------------------------------------------------- for others

    def cameras(self, vehicle: Vehicle) -> tuple[Camera, ...]:
        """Its cameras that were heard."""
        kit = self._kits.get(vehicle.id)
        return tuple(kit.cameras.values()) if kit is not None else ()

    def gimbals(self, vehicle: Vehicle) -> tuple[Gimbal, ...]:
        """Its gimbals that were heard."""
        kit = self._kits.get(vehicle.id)
        return tuple(kit.gimbals.values()) if kit is not None else ()

    def has_camera(self, vehicle: Vehicle) -> bool | None:
        """Whether one showed; False: not when asked, None: nobody asked.

        False is no proof: PX4 takes pictures by a trigger pin and tells of none before the first (measured), other
        autopilots answer no such question, and frames get lost. So an order for one is discouraged, never forbidden.
        """
        return self._shows(vehicle, bool(self.cameras(vehicle)))

    def has_gimbal(self, vehicle: Vehicle) -> bool | None:
        """As `has_camera`."""
        return self._shows(vehicle, bool(self.gimbals(vehicle)))

    def _shows(self, vehicle: Vehicle, shown: bool) -> bool | None:
        kit = self._kits.get(vehicle.id)
        return True if shown else False if kit is not None and kit.asked else None

    def ask(self, vehicle: Vehicle, on_done: Done | None = None) -> None:
        """Have its autopilot tell of a gimbal and a camera it manages itself, which it does not unasked."""
        now = self._context.clock.now()

        def send(copy: int) -> None:
            for message in CARRIED:
                self._request(vehicle, message)

        def done(_: VehicleAction, outcome: Outcome, why: str) -> None:
            kit = self._kit(vehicle)
            kit.asked = kit.asked or outcome is Outcome.CONFIRMED
            if on_done is not None:
                on_done(outcome, why)

        action = VehicleAction(
            vehicle.id,
            "what it carries",
            RetryClass.SET,
            send=send,
            confirmed=lambda _: self._context.clock.now() >= now + ASKED_S and vehicle.heard_s > now,
            on_done=done,
            housekeeping=True,
        )
        self._context.commands.submit(action)

    def trigger(self, vehicle: Vehicle, on_done: Done | None = None) -> None:
        """Take one picture. Copies of the order carry its number, by which a camera knows them for copies.

        Autopilots do not look at it (ArduPilot's source): to them it is said once. Those that do not know
        IMAGE_START_CAPTURE are told the old way (DO_DIGICAM_CONTROL), once.
        """
        kit = self._kit(vehicle)
        kit.shots += 1
        component = self._camera_component(vehicle)
        own = component == vehicle.component
        before = self._images(vehicle)

        def taken(outcome: Outcome, why: str) -> None:
            if on_done is not None:
                seen = "it told of the picture" if self._images(vehicle) > before else UNSEEN_PICTURE
                on_done(outcome, seen if outcome is Outcome.CONFIRMED else why)

        def done(action: VehicleAction, outcome: Outcome, why: str) -> None:
            if own and action.result == UNSUPPORTED:
                old = (0, 0, 0, 0, 1)
                self._submit(vehicle, "old camera trigger", DIGICAM_CONTROL, old, taken, once=True, shows=shows)
            else:
                taken(outcome, why)

        def shows(action: VehicleAction) -> bool:
            late = action.acked_s is not None and self._context.clock.now() > action.acked_s + PICTURE_S
            return late or (action.acked_s is not None and self._images(vehicle) > before)

        self._submit(
            vehicle,
            "camera trigger",
            IMAGE_START_CAPTURE,
            (0, 0, 1, kit.shots),
            done=done,
            start=True,
            once=own,
            component=component,
            shows=shows,
        )

    def record(self, vehicle: Vehicle, on_done: Done | None = None, *, stop: bool = False) -> None:
        """Start or stop a video; either may be said twice."""
        name, command = ("video stop", VIDEO_STOP_CAPTURE) if stop else ("video start", VIDEO_START_CAPTURE)
        only_pictures = any(c.abilities is not None and not c.abilities & TAKES_VIDEOS for c in self.cameras(vehicle))

        def done(_: VehicleAction, outcome: Outcome, why: str) -> None:
            if on_done is not None:
                hint = "its camera takes pictures only" * (outcome is Outcome.REFUSED and only_pictures)
                on_done(outcome, ": ".join(part for part in (why, hint) if part))

        self._submit(vehicle, name, command, (), done=done, component=self._camera_component(vehicle))

    def point(
        self,
        vehicle: Vehicle,
        pitch_deg: float,
        yaw_deg: float,
        *,
        to_north: bool = False,
        on_done: Done | None = None,
    ) -> None:
        """Point its gimbal, taking control of it first; then see where it points.

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
        aim = Aim(pitch_deg, yaw_deg, to_north)

        def turn(action: VehicleAction | None, outcome: Outcome, why: str) -> None:
            kit.controls = kit.controls or outcome is Outcome.CONFIRMED
            if outcome in (Outcome.EXPIRED, Outcome.SUPERSEDED):
                if on_done is not None:
                    on_done(outcome, why)
                return
            self._submit(
                vehicle,
                "gimbal",
                GIMBAL_PITCH_YAW,
                angles,
                done=partial(self._pointed, vehicle, aim, on_done),
                component=component,
                shows=partial(self._points, vehicle, aim),
                look=partial(self._request, vehicle, GIMBAL_DEVICE_ATTITUDE_STATUS, component),
            )

        if kit.controls and self._controlled_by_us(vehicle):
            turn(None, Outcome.CONFIRMED, "")
        else:
            mine = (self._context.own_system, STATION_COMPONENT, LEAVE_AS_IT_IS, LEAVE_AS_IT_IS, 0, 0, 0)
            self._submit(vehicle, "gimbal control", GIMBAL_CONFIGURE, mine, done=turn, component=component)

    def _points(self, vehicle: Vehicle, aim: Aim, action: VehicleAction) -> bool:
        """Whether it points there, by what it told after the ACK, or had its time to."""
        if action.acked_s is None:
            return False
        if self._context.clock.now() > action.acked_s + AIM_S:
            return True
        told = self._told_since(vehicle, action.acked_s)
        return told is not None and aim.is_reached(told, vehicle.heading_deg)

    def _pointed(
        self, vehicle: Vehicle, aim: Aim, on_done: Done | None, action: VehicleAction, outcome: Outcome, why: str
    ) -> None:
        """Leaning in flight, a gimbal without sensors tells its servos' angles (ArduPilot): that is no failure."""
        told = self._told_since(vehicle, action.acked_s) if action.acked_s is not None else None
        if outcome is Outcome.CONFIRMED:
            why = f"it is at {told.words()}" if told is not None else UNSEEN_GIMBAL
            if told is not None and not aim.is_reached(told, vehicle.heading_deg) and not vehicle.airborne:
                outcome = Outcome.NOT_CONFIRMED
        if on_done is not None:
            on_done(outcome, why)

    def _told_since(self, vehicle: Vehicle, since_s: float) -> Gimbal | None:
        return next((g for g in self.gimbals(vehicle) if g.told_s >= since_s and g.knows_angles()), None)

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
            lambda copy: self._context.uplink.action(
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
        done: Callable[[VehicleAction, Outcome, str], None] | None = None,
        start: bool = False,
        once: bool = False,
        component: int | None = None,
        shows: Callable[[VehicleAction], bool] | None = None,
        look: Callable[[], None] | None = None,
    ) -> None:
        """Submit a command; `shows` and `look` are those of `VehicleAction`.

        `start`: nothing later than 2 s. `once`: a second copy would do it twice.
        """
        values = {f"param{i}": float(value) for i, value in enumerate((*params, *([0.0] * 7))[:7], start=1)}
        target = vehicle.component if component is None else component

        def send(copy: int) -> None:
            if not (once and copy):
                fields = {"command": command, "confirmation": min(copy, 255), "target_component": target} | values
                self._context.uplink.action(vehicle.id, name, "COMMAND_LONG", **fields)

        how = done or _plainly(on_done)
        self._send_action(vehicle, name, command, send, how, start=start or once, shows=shows, look=look)

    def _send_action(
        self,
        vehicle: Vehicle,
        name: str,
        command: int,
        send: Callable[[int], object],
        done: Callable[[VehicleAction, Outcome, str], None] | None,
        *,
        start: bool = False,
        shows: Callable[[VehicleAction], bool] | None = None,
        look: Callable[[], None] | None = None,
    ) -> None:
        """Without `shows` the ACK is all there is."""
        action = VehicleAction(
            vehicle.id,
            name,
            RetryClass.START if start else RetryClass.SET,
            send=send,
            confirmed=lambda _: shows(action) if shows is not None else action.acked_s is not None,
            command=command,
            on_done=done,
            look=look,
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

    def _rebooted(self, vehicle: Vehicle) -> None:
        """What its autopilot carries itself is set up by parameters that count from a boot on."""
        kit = self._kit(vehicle)
        kit.controls = kit.asked = False
        kit.cameras.pop(vehicle.component, None)
        kit.gimbals.pop(vehicle.component, None)

    def _is_device(self, vehicle: Vehicle, component: int) -> bool:
        kit = self._kits.get(vehicle.id)
        return kit is not None and (component in kit.cameras or component in kit.gimbals)

    def _images(self, vehicle: Vehicle) -> int:
        return sum(camera.images for camera in self.cameras(vehicle))

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
            if self._camera(vehicle, component) is not None and is_new and self._context.uplink.is_ours(vehicle):
                self._ask_who(vehicle, component)

    def _ask_who(self, vehicle: Vehicle, component: int) -> None:
        """Once: a name is nice to have."""
        self._request(vehicle, CAMERA_INFORMATION, component)

    def _request(self, vehicle: Vehicle, message: int, component: int | None = None) -> None:
        target = vehicle.component if component is None else component
        fields = {"command": REQUEST_MESSAGE, "confirmation": 0, "param1": message, "target_component": target}
        self._context.commands.question(vehicle.id, REQUEST_MESSAGE)
        self._context.uplink.ask(vehicle.id, "COMMAND_LONG", **fields, **{f"param{i}": 0 for i in range(2, 8)})

    def _information(self, vehicle: Vehicle, component: int, fields: Fields) -> None:
        camera = self._camera(vehicle, component)
        if camera is not None:
            words = [clean(bytes(fields[name]).split(b"\0")[0], 32) for name in ("vendor_name", "model_name")]
            camera.name = clean(" ".join(word for word in words if word), 65)
            camera.abilities = fields["flags"]
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
            gimbal.hear(fields, self._context.clock.now())


def _plainly(on_done: Done | None) -> Callable[[VehicleAction, Outcome, str], None] | None:
    return None if on_done is None else lambda action, outcome, why: on_done(outcome, why)
