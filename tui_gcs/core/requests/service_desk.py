"""Requests about vehicles' services: who may ask what, of which vehicles, and what is told of it.

Looking is for everybody. Fetching costs a vehicle's link time, changing changes it: neither is for planner workers.
Every vehicle is judged by itself, and has its own result and its own task; see `core/protocol/services.py`.
"""

import msgspec

from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol import setup
from tui_gcs.core.protocol.common import Freshness, ReplyCode, VehicleResult
from tui_gcs.core.protocol.flight import Flight as FlightRequest
from tui_gcs.core.protocol.flight import Nudge
from tui_gcs.core.requests import flight_requests as flight
from tui_gcs.core.requests.context import RequestContext
from tui_gcs.core.requests.payload_requests import payload_rows, remote_id_rows, traffic_rows
from tui_gcs.core.requests.tasks import TaskTable
from tui_gcs.core.requests.vehicle_requests import ServiceActs, param_rows
from tui_gcs.core.requests.views import on_board, vehicle_info
from tui_gcs.core.services.parameters.param_values import shown

NEVER_HEARD = "never heard"


class VehicleTasks:
    """Answers at once; what takes time is a task."""

    def __init__(self, context: RequestContext) -> None:
        """Serve `station`."""
        parts = self._parts = context.parts
        self.tasks = TaskTable(parts.records.clock)
        self._acts = ServiceActs(parts.services, parts.comms.firmware, parts.comms.command_encoder)
        self._acts.add(flight.FlightActs(context).begin)

    # ---------------------------------------------------------------- looking

    def look(self, request: s.Look) -> s.ServiceReply:
        """What is known."""
        if isinstance(request, s.GetVehicles):
            return self._vehicles(request)
        if isinstance(request, s.GetOnBoard):
            known = self._parts.picture.fleet.vehicles
            rows = tuple(on_board(self._parts, v) for v in request.vehicles[: s.MOST_VEHICLES] if v in known)
            return s.ServiceReply(ok=True, on_board=rows)
        if isinstance(request, s.GetTasks):
            return s.ServiceReply(ok=True, tasks=self.tasks.infos(request.numbers))
        if isinstance(request, s.GetTaskResult):
            task = self.tasks.get(request.number)
            if task is None or not task.over:
                text = f"task {request.number} is " + ("not remembered" if task is None else "under way")
                return s.ServiceReply(ok=False, text=text)
            return s.ServiceReply(ok=True, text=task.text, result=task.result)
        if not isinstance(request, s.GetParams | s.GetModes):
            return self._setup(request)
        vehicle = self._parts.picture.fleet.vehicles.get(request.vehicle)
        if vehicle is None:
            return s.ServiceReply(ok=False, text=f"vehicle {request.vehicle}: {NEVER_HEARD}")
        return self._params(vehicle) if isinstance(request, s.GetParams) else self._modes(vehicle)

    def _vehicles(self, request: s.GetVehicles) -> s.ServiceReply:
        known = self._parts.picture.fleet.vehicles
        ids = request.vehicles or tuple(sorted(known))
        results = tuple(VehicleResult(vehicle=v, ok=False, text=NEVER_HEARD) for v in ids if v not in known)
        found = tuple(vehicle_info(self._parts, known[v]) for v in ids if v in known)
        return s.ServiceReply(ok=not results, results=results, vehicles=found)

    def _setup(self, request: setup.Look) -> s.ServiceReply:
        """What can be set up, what is carried, whom they hear."""
        parts = self._parts
        if isinstance(request, setup.GetTraffic):
            return s.ServiceReply(
                ok=True, traffic=traffic_rows(parts.services, parts.picture.fleet, parts.records.clock)
            )
        known = parts.picture.fleet.vehicles
        results = tuple(
            VehicleResult(vehicle=v, ok=False, text=NEVER_HEARD) for v in request.vehicles if v not in known
        )
        found = [known[v] for v in request.vehicles if v in known]
        reply = s.ServiceReply(ok=not results, results=results)
        if isinstance(request, setup.GetRemoteIds):
            rows = remote_id_rows(parts.services, found, parts.records.clock)
            return msgspec.structs.replace(reply, remote_ids=rows)
        if isinstance(request, setup.GetPayloads):
            return msgspec.structs.replace(reply, payloads=payload_rows(parts.services, found, parts.records.clock))
        if isinstance(request, setup.GetAirframes):
            airframes = tuple(row for vehicle in found for row in self._acts.setup.airframe_rows(vehicle))
            return msgspec.structs.replace(reply, airframes=airframes)
        calibrations = tuple(row for vehicle in found for row in self._acts.setup.calibrations(vehicle))
        return msgspec.structs.replace(reply, calibrations=calibrations)

    def _params(self, vehicle: Vehicle) -> s.ServiceReply:
        params = self._parts.services.params
        rows = tuple(param_rows(params, vehicle.id))
        return s.ServiceReply(ok=True, params=rows, complete=params.table(vehicle.id).complete)

    def _modes(self, vehicle: Vehicle) -> s.ServiceReply:
        modes = self._parts.services.modes
        modes.want(vehicle)
        rows = tuple(s.ModeRow(name=m.name, number=m.number, advanced=m.advanced) for m in modes.list(vehicle))
        return s.ServiceReply(ok=True, text=modes.name(vehicle), modes=rows, complete=not modes.asking(vehicle))

    # ---------------------------------------------------------------- fetching and changing

    def begin(self, principal: str, request: s.Fetch | s.Change) -> s.ServiceReply:
        """Begin it for every vehicle that is named, where it may be."""
        ids = request.vehicles
        if not ids or len(set(ids)) != len(ids) or len(ids) > s.MOST_VEHICLES:
            return s.ServiceReply(ok=False, text="name each vehicle once")
        what = words(request)
        begun = [self._begin_one(principal, number, what, request) for number in ids]
        results = tuple(result for result, _ in begun)
        good = [result.vehicle for result in results if result.ok]
        tasks = self.tasks.infos(tuple(task for _, task in begun if task)) if good else ()
        text = f"{what}: vehicle {', '.join(map(str, good))}" if good else f"{what}: nothing was sent"
        return s.ServiceReply(ok=len(good) == len(ids), text=text, results=results, tasks=tasks)

    def cancel(self, request: s.CancelTask) -> s.ServiceReply:
        """End a task, whoever began it."""
        task = self.tasks.get(request.number)
        why = "it is not remembered" if task is None else task.cancel()
        if task is None or why:
            return s.ServiceReply(ok=False, text=f"task {request.number}: {why}")
        text = f"task {task.number} of {task.who} ends: vehicle {task.vehicle}, {task.what}"
        return s.ServiceReply(ok=True, text=text, tasks=self.tasks.infos((task.number,)))

    def confirm(self, request: setup.ConfirmStep) -> s.ServiceReply:
        """The operator did what a task's prompt says."""
        task = self.tasks.get(request.number)
        if task is None or task.confirm is None:
            why = "it is not remembered" if task is None else "nothing is to be confirmed"
        else:
            why = task.confirm()
        text = f"task {request.number}: {why}" if why else f"vehicle {task.vehicle if task else 0}: confirmed"
        return s.ServiceReply(ok=not why, text=text)

    def _begin_one(
        self, principal: str, number: int, what: str, request: s.Fetch | s.Change
    ) -> tuple[VehicleResult, int]:
        """The result for one vehicle, and the number of its task, 0 where there is none."""
        vehicle = self._parts.picture.fleet.vehicles.get(number)
        why = NEVER_HEARD if vehicle is None else self._why_not(vehicle, request)
        if vehicle is None or why:
            return VehicleResult(vehicle=number, ok=False, text=why), 0
        task = self.tasks.begin(number, what, principal)
        task.changes = isinstance(request, s.Change)
        if task.changes and not isinstance(request, s.SetMode | Nudge):  # these leave nothing half done
            self.tasks.note()
        why = self._acts.begin(vehicle, request, task)
        if why:
            self.tasks.forget(task)
            code = ReplyCode.NOT_CONFIRMED if why.endswith(s.MEANT) else ReplyCode.NONE
            return VehicleResult(vehicle=number, ok=False, text=why, code=code), 0
        if isinstance(request, Nudge):  # key after key: nothing to remember
            self.tasks.forget(task)
            return VehicleResult(vehicle=number, ok=True, text=task.text), 0
        return VehicleResult(vehicle=number, ok=True, text=f"task {task.number}"), task.number

    def _why_not(self, vehicle: Vehicle, request: s.Fetch | s.Change) -> str:
        """Why nothing may be asked of this vehicle now, or ""."""
        now = self._parts.records.clock.now()
        if not self._parts.comms.uplink.is_ours(vehicle):
            return "not one of our simulated vehicles: this station is SIM"
        if vehicle.freshness(now) is Freshness.LOST:
            return f"LOST: last heard {now - vehicle.heard_s:.0f} s ago"
        stops = isinstance(request, s.SetMode)  # may be one: then the guard lets it pass
        return vehicle.why_not_commanded if isinstance(request, s.Change) and not stops else ""


def words(request: s.Fetch | s.Change) -> str:
    """What is asked, for people; what came from the asker is cleaned."""
    if isinstance(request, s.SetParams):
        return "set " + ", ".join(f"{clean(name, 20)} = {shown(value)}" for name, value in request.values.items())
    if isinstance(request, s.ReadParams):
        return "read " + clean(", ".join(request.names), 60)
    if isinstance(request, s.DownloadPlan | s.ClearPlan):
        return f"{'download' if isinstance(request, s.DownloadPlan) else 'clear'} {request.kind}"
    if isinstance(request, s.UploadPlan):
        return f"upload {request.kind} of {len(request.items)} items"
    if isinstance(request, s.SetMode):
        return f"mode {clean(request.mode, 30)}"
    if isinstance(request, s.TypeShell):
        return f"shell: {clean(request.line, 60)}"
    if isinstance(request, s.DownloadLog):
        return f"download log {request.log}"
    if isinstance(request, s.ListFiles | s.DownloadFile | s.WriteFile | s.RemoveFile):
        return f"{_FILE_WORDS[type(request)]} {clean(request.path, 60)}"
    if isinstance(request, FlightRequest):
        return flight.words(request)
    return _setup_words(request) or _WORDS[type(request)]


def _setup_words(request: s.Fetch | s.Change) -> str:
    """As `words`, of what is set up and carried."""
    if isinstance(request, setup.Calibrate):
        return f"calibrate {request.sensor}"
    if isinstance(request, setup.ReadGains):
        return f"read gains {clean(request.group, 20)}".strip()
    if isinstance(request, setup.SetGain):
        return f"set {clean(request.name, 20)} = {shown(request.value)}"
    if isinstance(request, setup.UndoGains):
        return f"undo {clean(request.name, 20) or 'all gains'}"
    if isinstance(request, setup.ChooseAirframe):
        return f"airframe {clean(' '.join(request.words), 60)}"
    if isinstance(request, setup.TestMotor):
        return f"test of motor {request.motor}: {100 * request.throttle:.0f} %, {request.seconds:g} s"
    if isinstance(request, setup.PointGimbal):
        return f"gimbal: pitch {request.pitch_deg:g}, yaw {request.yaw_deg:g}" + " of north" * request.to_north
    if isinstance(request, setup.UseCamera):
        return f"camera: {request.act}"
    if isinstance(request, setup.LookAt):
        return f"look at {request.lat_deg:.7f} {request.lon_deg:.7f} {request.alt_m:g} m above {request.above}"
    return f"mission item {request.item}" if isinstance(request, setup.SetCurrentItem) else ""


_FILE_WORDS: dict[type, str] = {
    s.ListFiles: "list",
    s.DownloadFile: "download",
    s.WriteFile: "write",
    s.RemoveFile: "remove",
}
_WORDS: dict[type, str] = {
    s.FetchParams: "fetch parameters",
    s.ReadFailsafes: "read failsafes",
    s.ListLogs: "list logs",
    s.EraseLogs: "erase logs",
    s.Reboot: "reboot",
    setup.ReadAirframe: "read airframe",
    setup.HearTraffic: "hear traffic",
    setup.AskPayloads: "ask what it carries",
    setup.CancelCalibration: "cancel calibration",
    setup.UndoRadio: "undo rc",
    setup.ReleaseGimbal: "release gimbal",
    setup.LookAhead: "look at no place",
}
