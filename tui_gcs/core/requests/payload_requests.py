"""Requests about cameras, gimbals, received aircraft, and the present item of a mission; and the rows of replies."""

import math
from collections.abc import Callable

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.firmware.base import may_be_flying
from tui_gcs.core.firmware.registry import FirmwareRegistry
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import NAN, Vehicle
from tui_gcs.core.motion.target_place import AltitudeReference, PlaceError, TargetPlace
from tui_gcs.core.protocol import setup as s
from tui_gcs.core.requests.handler import NotConfirmedError, VehicleAct, named
from tui_gcs.core.requests.mission_comparison import MissionComparison
from tui_gcs.core.requests.setup_requests import IN_THE_AIR
from tui_gcs.core.requests.tasks import Task
from tui_gcs.core.services.all_services import Services
from tui_gcs.core.services.payload.payload_commands import Done
from tui_gcs.core.services.payload.remote_id import RemoteId
from tui_gcs.core.services.payload.traffic import AdsbTrack
from tui_gcs.core.uplink.actions import Outcome, VehicleAction

NONE_SUCH = "failed"
"""The text of MAV_RESULT_FAILED, with which ArduPilot answers if there is no such device."""


class PayloadRequests:
    """Begins requests about payload and traffic, one method for each."""

    def __init__(self, services: Services, firmware: FirmwareRegistry, comparison: MissionComparison) -> None:
        self._comparison = comparison
        self._services = services
        self._payload = services.payload
        self._firmware = firmware
        self.acts: dict[type, VehicleAct] = {
            s.HearTraffic: VehicleAct(self._hear_traffic, named("hear traffic")),
            s.AskPayloads: VehicleAct(self._ask_payloads, named("ask what it carries")),
            s.PointGimbal: VehicleAct(self._point_gimbal, _gimbal_words),
            s.ReleaseGimbal: VehicleAct(self._release_gimbal, named("release gimbal")),
            s.UseCamera: VehicleAct(self._use_camera, lambda r: f"camera: {r.act}"),
            s.LookAt: VehicleAct(self._look_at, _look_at_words),
            s.LookAhead: VehicleAct(self._look_ahead, named("look at no place")),
            s.SetCurrentItem: VehicleAct(self._set_current, lambda r: f"mission item {r.item}"),
        }

    def _hear_traffic(self, vehicle: Vehicle, request: s.HearTraffic, task: Task) -> str:
        self._services.traffic.listen(vehicle.id, _action_ended(task, "it reports what it hears"))
        return ""

    def _ask_payloads(self, vehicle: Vehicle, request: s.AskPayloads, task: Task) -> str:
        self._payload.ask(vehicle, _ended(task, ""))
        return ""

    def _point_gimbal(self, vehicle: Vehicle, request: s.PointGimbal, task: Task) -> str:
        self._payload.gimbal.point(
            vehicle,
            request.pitch_deg,
            request.yaw_deg,
            to_north=request.to_north,
            on_done=self._of_gimbal(vehicle, _ended(task)),
        )
        return ""

    def _of_gimbal(self, vehicle: Vehicle, done: Done) -> Done:
        return _unless_heard("gimbal", lambda: bool(self._payload.devices.gimbals(vehicle)), done)

    def _of_camera(self, vehicle: Vehicle, done: Done) -> Done:
        return _unless_heard("camera", lambda: bool(self._payload.devices.cameras(vehicle)), done)

    def _release_gimbal(self, vehicle: Vehicle, request: s.ReleaseGimbal, task: Task) -> str:
        self._payload.gimbal.release(vehicle, self._of_gimbal(vehicle, _ended(task, "released")))
        return ""

    def _use_camera(self, vehicle: Vehicle, request: s.UseCamera, task: Task) -> str:
        if request.act == "photo":
            self._payload.camera.trigger(vehicle, self._of_camera(vehicle, _ended(task)))
        else:
            stop = request.act == "stop"
            done = self._of_camera(vehicle, _ended(task, "video stopped" if stop else "video started"))
            self._payload.camera.record(vehicle, done, stop=stop)
        return ""

    def _look_at(self, vehicle: Vehicle, request: s.LookAt, task: Task) -> str:
        try:
            place = TargetPlace(request.lat_deg, request.lon_deg, request.alt_m, AltitudeReference(request.above))
            amsl_m = place.amsl_m(self._firmware.home(vehicle))
        except PlaceError as error:
            return str(error)
        text = f"ordered to look at {place.lat_deg:.7f} {place.lon_deg:.7f}, {amsl_m:.1f} m above the sea"
        if not self._payload.devices.gimbals(vehicle):
            text += "; no gimbal was heard: its nose may turn there in flight, or nothing"
        self._payload.gimbal.look_at(vehicle, place.lat_deg, place.lon_deg, amsl_m, _ended(task, text))
        return ""

    def _look_ahead(self, vehicle: Vehicle, request: s.LookAhead, task: Task) -> str:
        self._payload.gimbal.look_ahead(vehicle, _ended(task, "looks at no place"))
        return ""

    def _set_current(self, vehicle: Vehicle, request: s.SetCurrentItem, task: Task) -> str:
        if may_be_flying(vehicle) and not request.sure:
            raise NotConfirmedError(IN_THE_AIR)
        refused: list[str] = []

        def go_on(remark: str) -> None:
            done = _action_ended(task, "; ".join(filter(None, (f"at item {request.item}", remark))))
            if why := self._services.missions.set_current(vehicle.id, request.item - 1, done):
                refused.append(why)
                task.end(why)

        # On the ground it only chooses where the mission begins, which is compared then.
        if request.meet or not self._firmware.of(vehicle).flies_mission(vehicle) or not vehicle.telemetry.airborne:
            go_on("")
        else:
            self._comparison.begin(vehicle, (), task, go_on, first=request.item - 1)
        return refused[0] if refused else ""


def _gimbal_words(request: s.PointGimbal) -> str:
    return f"gimbal: pitch {request.pitch_deg:g}, yaw {request.yaw_deg:g}" + " of north" * request.to_north


def _look_at_words(request: s.LookAt) -> str:
    return f"look at {request.lat_deg:.7f} {request.lon_deg:.7f} {request.alt_m:g} m above {request.above}"


def _unless_heard(what: str, heard: Callable[[], bool], done: Done) -> Done:
    """Add that no such device was heard to a refusal without a reason: that may be the reason."""

    def done_with_reason(outcome: Outcome, why: str) -> None:
        silent = outcome is not Outcome.CONFIRMED and not heard()
        reason = "" if silent and why == NONE_SUCH else why
        done(outcome, ": ".join(part for part in (reason, f"no {what} was heard" * silent) if part))

    return done_with_reason


def _ended(task: Task, text: str = "") -> Done:
    """End the task with `text`, or else with what was observed of the vehicle."""

    def done(outcome: Outcome, why: str) -> None:
        ok = outcome is Outcome.CONFIRMED
        task.end("" if ok else ": ".join(part for part in (outcome.value, why) if part), text=text or why)

    return done


def _action_ended(task: Task, text: str) -> Callable[[VehicleAction, Outcome, str], None]:
    done = _ended(task, text)
    return lambda action, outcome, why: done(outcome, why)


def traffic_rows(services: Services, fleet: VehicleRegistry, clock: Clock) -> tuple[s.TrafficRow, ...]:
    """All aircraft received lately; those nearest to the vehicle that received them come first."""
    rows = [_traffic_row(track, fleet.vehicles.get(track.heard_by), clock.now()) for track in services.traffic.tracks()]
    return tuple(sorted(rows, key=lambda row: (math.isnan(row.distance_m), row.distance_m, row.icao)))


def _traffic_row(track: AdsbTrack, hearer: Vehicle | None, now: float) -> s.TrafficRow:
    known = hearer is not None and hearer.telemetry.has_position()
    return s.TrafficRow(
        icao=track.icao,
        callsign=track.callsign,
        lat_deg=track.lat_deg,
        lon_deg=track.lon_deg,
        alt_m=track.alt_m,
        is_geometric=track.is_geometric,
        heading_deg=track.heading_deg,
        speed_m_s=track.speed_m_s,
        climb_m_s=track.climb_m_s,
        simulated=track.simulated,
        heard_by=track.heard_by,
        age_s=now - track.seen_s,
        distance_m=math.dist(track.position_m[:2], hearer.telemetry.position_m[:2])
        if hearer is not None and known
        else NAN,
        above_m=track.alt_m - hearer.telemetry.alt_amsl_m if hearer is not None and track.is_geometric else NAN,
    )


def remote_id_rows(services: Services, vehicles: list[Vehicle], clock: Clock) -> tuple[s.RemoteIdRow, ...]:
    """Remote IDs that these vehicles broadcast, then those received from other aircraft."""
    own = [(vehicle.id, services.remote_id.of(vehicle)) for vehicle in vehicles]
    known = [(number, entry) for number, entry in own if entry is not None]
    others = [(0, entry) for entry in services.remote_id.others()]
    return tuple(_remote_id_row(number, entry, clock.now()) for number, entry in (*known, *others))


def _remote_id_row(vehicle: int, entry: RemoteId, now: float) -> s.RemoteIdRow:
    return s.RemoteIdRow(
        vehicle=vehicle,
        heard_by=entry.heard_by,
        uas_id=entry.uas_id,
        operator_id=entry.operator_id,
        description=entry.description,
        lat_deg=entry.lat_deg,
        lon_deg=entry.lon_deg,
        alt_m=entry.alt_m,
        operator_lat_deg=entry.operator_lat_deg,
        operator_lon_deg=entry.operator_lon_deg,
        may_arm=entry.may_arm,
        arm_error=entry.arm_error,
        component=entry.component,
        age_s=now - entry.seen_s,
    )


def payload_rows(services: Services, vehicles: list[Vehicle], clock: Clock) -> tuple[s.PayloadRow, ...]:
    """The cameras and gimbals of these vehicles that answered."""
    rows: list[s.PayloadRow] = []
    for vehicle in vehicles:
        rows += [
            s.PayloadRow(vehicle.id, "camera", camera.component, camera.name, camera.images)
            for camera in services.payload.devices.cameras(vehicle)
        ]
        rows += [
            s.PayloadRow(
                vehicle.id,
                "gimbal",
                gimbal.component,
                controlled_by=gimbal.controlled_by,
                angles_deg=gimbal.angles_deg if gimbal.knows_angles() else None,
                to_north=gimbal.to_north,
                age_s=clock.now() - gimbal.reported_s if gimbal.knows_angles() else 0.0,
            )
            for gimbal in services.payload.devices.gimbals(vehicle)
        ]
    return tuple(rows)
