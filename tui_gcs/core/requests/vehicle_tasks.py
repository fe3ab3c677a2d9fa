"""Requests about vehicles' services: looking at what is known, and tasks that fetch or change something.

Any principal may look. Fetching costs a vehicle's link time, changing changes it: planner workers may do neither. Every
vehicle is checked by itself, and has its own result and its own task; see `core/protocol/services.py`.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, get_args

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol import services as s
from tui_gcs.core.protocol import setup
from tui_gcs.core.protocol.base import VehicleRequest
from tui_gcs.core.protocol.common import Freshness, ReplyCode, VehicleResult
from tui_gcs.core.protocol.flight import Nudge
from tui_gcs.core.requests.context import RequestContext
from tui_gcs.core.requests.flight_requests import FlightRequests
from tui_gcs.core.requests.handler import Access, NotConfirmedError, RequestHandler, VehicleAct
from tui_gcs.core.requests.inspection_requests import InspectionRequests
from tui_gcs.core.requests.mission_comparison import MissionComparison
from tui_gcs.core.requests.payload_requests import PayloadRequests, payload_rows, remote_id_rows, traffic_rows
from tui_gcs.core.requests.plan_rows import plan_of
from tui_gcs.core.requests.setup_overview import SetupOverview
from tui_gcs.core.requests.setup_requests import SetupRequests
from tui_gcs.core.requests.tasks import TaskTable
from tui_gcs.core.requests.vehicle_requests import VehicleRequests, param_info_rows, param_rows
from tui_gcs.core.requests.views import on_board, vehicle_info

NEVER_HEARD = "never heard"


class VehicleTasks:
    """Answers requests about vehicles: at once what is known, by a task what takes time."""

    def __init__(self, context: RequestContext) -> None:
        parts = self._parts = context.parts
        self.tasks = TaskTable(parts.records.clock)
        self._setup = SetupRequests(parts.services)
        self._overview = SetupOverview(parts.services)
        self._inspection = InspectionRequests(parts)
        firmware = parts.comms.firmware
        comparison = self._comparison = MissionComparison(parts)
        self._acts: dict[type, VehicleAct] = {
            **VehicleRequests(parts, comparison).acts,
            **self._setup.acts,
            **self._overview.acts,
            **PayloadRequests(parts.services, firmware, comparison).acts,
            **FlightRequests(context, comparison).acts,
            **self._inspection.acts,
        }

    def handlers(self) -> dict[type, RequestHandler]:
        """The entries of the request table that this class answers."""
        services, clock = self._parts.services, self._parts.records.clock
        looks: dict[type, Callable[[Any], s.ServiceReply]] = {
            s.GetVehicles: self._vehicles,
            s.GetOnBoard: self._on_board,
            s.CompareMission: self._compare_mission,
            s.GetTasks: lambda request: s.ServiceReply(ok=True, tasks=self.tasks.infos(request.numbers)),
            s.GetTaskResult: self._task_result,
            s.GetParams: self._params,
            s.GetParamInfos: self._param_infos,
            s.GetModes: self._modes,
            setup.GetSetup: self._setup_sections,
            setup.GetTraffic: lambda request: self._traffic(),
            setup.GetRemoteIds: partial(self._rows_of, "remote_ids", lambda v: remote_id_rows(services, v, clock)),
            setup.GetPayloads: partial(self._rows_of, "payloads", lambda v: payload_rows(services, v, clock)),
            setup.GetAirframes: partial(self._rows_of, "airframes", self._setup.airframe_rows),
            setup.GetCalibrations: partial(self._rows_of, "calibrations", self._setup.calibrations),
        }
        return {
            **{kind: RequestHandler(Access.LOOK, partial(_answered, look)) for kind, look in looks.items()},
            **self._inspection.handlers(),
            **{kind: RequestHandler(_access(kind), self.begin) for kind in self._acts},
            s.CancelTask: RequestHandler(Access.COMMAND, lambda _, request: self.cancel(request)),
            setup.ConfirmStep: RequestHandler(Access.COMMAND, lambda _, request: self.confirm(request)),
        }

    def _vehicles(self, request: s.GetVehicles) -> s.ServiceReply:
        known = self._parts.picture.fleet.vehicles
        ids = request.vehicles or tuple(sorted(known))
        results = tuple(VehicleResult(vehicle=v, ok=False, text=NEVER_HEARD) for v in ids if v not in known)
        found = tuple(vehicle_info(self._parts, known[v]) for v in ids if v in known)
        return s.ServiceReply(ok=not results, results=results, vehicles=found)

    def _on_board(self, request: s.GetOnBoard) -> s.ServiceReply:
        known = self._parts.picture.fleet.vehicles
        rows = tuple(on_board(self._parts, v) for v in request.vehicles[: s.MAX_VEHICLES] if v in known)
        return s.ServiceReply(ok=True, on_board=rows)

    def _compare_mission(self, request: s.CompareMission) -> s.ServiceReply:
        known, ids = self._parts.picture.fleet.vehicles, request.vehicles[: s.MAX_VEHICLES]
        replaced = request.replaced[: s.MAX_VEHICLES]
        plan, compare = plan_of(PlanKind.MISSION, request.items), self._comparison.conflict_of_upload
        found = {v: compare(known[v], plan, ids, replaced) for v in ids if v in known}
        results = tuple(VehicleResult(v, not why, why) for v, why in found.items())
        unread = self._comparison.unread_words(but=(*ids, *replaced))
        return s.ServiceReply(ok=not any(found.values()), text=unread, results=results)

    def _task_result(self, request: s.GetTaskResult) -> s.ServiceReply:
        task = self.tasks.get(request.number)
        if task is None or not task.over:
            text = f"task {request.number} is " + ("not remembered" if task is None else "under way")
            return s.ServiceReply(ok=False, text=text)
        return s.ServiceReply(ok=True, text=task.text, result=task.result)

    def _setup_sections(self, request: setup.GetSetup) -> s.ServiceReply:
        rows_of = partial(self._overview.rows, wanted=request.section, only=request.only)
        return self._rows_of("setup_sections", rows_of, request)

    def _traffic(self) -> s.ServiceReply:
        parts = self._parts
        rows = traffic_rows(parts.services, parts.picture.fleet, parts.records.clock)
        return s.ServiceReply(ok=True, traffic=rows)

    def _rows_of(
        self, name: str, rows_of: Callable[[list[Vehicle]], tuple[Any, ...]], request: VehicleRequest
    ) -> s.ServiceReply:
        """A reply with rows of the known vehicles in its field `name`, and a result for each that is not known."""
        known, ids = self._parts.picture.fleet.vehicles, request.vehicles
        results = tuple(VehicleResult(vehicle=v, ok=False, text=NEVER_HEARD) for v in ids if v not in known)
        rows: dict[str, Any] = {name: rows_of([known[v] for v in ids if v in known])}
        return s.ServiceReply(ok=not results, results=results, **rows)

    def _param_infos(self, request: s.GetParamInfos) -> s.ServiceReply:
        names = request.names[: s.MAX_VALUES]
        return s.ServiceReply(
            ok=True, param_infos=tuple(param_info_rows(self._parts.services.params, request.vehicle, names))
        )

    def _params(self, request: s.GetParams) -> s.ServiceReply:
        vehicle = self._parts.picture.fleet.vehicles.get(request.vehicle)
        if vehicle is None:
            return _never_heard(request.vehicle)
        params = self._parts.services.params
        rows = tuple(param_rows(params, vehicle.id))
        return s.ServiceReply(ok=True, params=rows, complete=params.table(vehicle.id).complete)

    def _modes(self, request: s.GetModes) -> s.ServiceReply:
        vehicle = self._parts.picture.fleet.vehicles.get(request.vehicle)
        if vehicle is None:
            return _never_heard(request.vehicle)
        modes = self._parts.services.modes
        modes.want(vehicle)
        rows = tuple(s.ModeRow(name=m.name, number=m.number, advanced=m.advanced) for m in modes.list(vehicle))
        return s.ServiceReply(ok=True, text=modes.name(vehicle), modes=rows, complete=not modes.asking(vehicle))

    def begin(self, principal: str, request: s.Fetch | s.Change) -> s.ServiceReply:
        """Begin a task for every vehicle that is named, where it is allowed."""
        ids = request.vehicles
        if not ids or len(set(ids)) != len(ids) or len(ids) > s.MAX_VEHICLES:
            return s.ServiceReply(ok=False, text="name each vehicle once")
        act = self._acts[type(request)]
        what = act.words(request)
        begun = [self._begin_one(principal, number, what, act, request) for number in ids]
        results = tuple(result for result, _ in begun)
        good = [result.vehicle for result in results if result.ok]
        tasks = self.tasks.infos(tuple(task for _, task in begun if task)) if good else ()
        text = f"{what}: vehicle {', '.join(map(str, good))}" if good else f"{what}: nothing was sent"
        return s.ServiceReply(ok=len(good) == len(ids), text=text, results=results, tasks=tasks)

    def cancel(self, request: s.CancelTask) -> s.ServiceReply:
        """End a task, also that of another principal."""
        task = self.tasks.get(request.number)
        why = "it is not remembered" if task is None else task.cancel()
        if task is None or why:
            return s.ServiceReply(ok=False, text=f"task {request.number}: {why}")
        text = f"task {task.number} of {task.who} ends: vehicle {task.vehicle}, {task.what}"
        return s.ServiceReply(ok=True, text=text, tasks=self.tasks.infos((task.number,)))

    def confirm(self, request: setup.ConfirmStep) -> s.ServiceReply:
        """Pass on that the operator has done what a task's prompt asks for."""
        task = self.tasks.get(request.number)
        if task is None or task.confirm is None:
            why = "it is not remembered" if task is None else "nothing is to be confirmed"
        else:
            why = task.confirm()
        text = f"task {request.number}: {why}" if why else f"vehicle {task.vehicle if task else 0}: confirmed"
        return s.ServiceReply(ok=not why, text=text)

    def _begin_one(
        self, principal: str, number: int, what: str, act: VehicleAct, request: s.Fetch | s.Change
    ) -> tuple[VehicleResult, int]:
        """The result for one vehicle, and the number of its task; 0 without one."""
        vehicle = self._parts.picture.fleet.vehicles.get(number)
        why = NEVER_HEARD if vehicle is None else self._why_not(vehicle, request)
        if vehicle is None or why:
            return VehicleResult(vehicle=number, ok=False, text=why), 0
        task = self.tasks.begin(number, what, principal)
        task.changes = isinstance(request, s.Change)
        # Written to disk first: should this process die now, the next one reports that the vehicle may hold a part.
        if task.changes and not isinstance(request, s.SetMode | Nudge):
            self.tasks.note()
        code = ReplyCode.NONE
        try:
            why = act.begin(vehicle, request, task)
        except NotConfirmedError as error:
            why, code = str(error), ReplyCode.NOT_CONFIRMED
        if why:
            self.tasks.forget(task)
            return VehicleResult(vehicle=number, ok=False, text=why, code=code), 0
        # A held key nudges several times a second; as tasks these would push all others out of the table.
        if isinstance(request, Nudge):
            self.tasks.forget(task)
            return VehicleResult(vehicle=number, ok=True, text=task.text), 0
        return VehicleResult(vehicle=number, ok=True, text=f"task {task.number}"), task.number

    def _why_not(self, vehicle: Vehicle, request: s.Fetch | s.Change) -> str:
        """Why nothing may be asked of this vehicle now; "" if it may."""
        now = self._parts.records.clock.now()
        if not self._parts.comms.uplink.is_ours(vehicle):
            return "not one of our simulated vehicles: this station is SIM"
        if vehicle.freshness(now) is Freshness.LOST:
            return f"LOST: last heard {now - vehicle.last_heard_s:.0f} s ago"
        # A mode may be a stop (hold, return, land); `_set_mode` refuses the others.
        stops = isinstance(request, s.SetMode)
        return vehicle.why_not_commanded if isinstance(request, s.Change) and not stops else ""


def _access(kind: type) -> Access:
    """Fetching costs a vehicle's link time and changes nothing; any other request about a vehicle is a command."""
    return Access.ASSIST if kind in get_args(s.Fetch) else Access.COMMAND


def _answered(look: Callable[[Any], s.ServiceReply], principal: str, request: s.Look) -> s.ServiceReply:
    return look(request)


def _never_heard(vehicle: int) -> s.ServiceReply:
    return s.ServiceReply(ok=False, text=f"vehicle {vehicle}: {NEVER_HEARD}")
