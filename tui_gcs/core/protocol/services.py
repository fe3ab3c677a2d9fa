"""Requests about vehicles' parameters, plans, files, logs, modes and shells, and the rows of their replies.

They extend `core/protocol/common.py`: msgspec structs, unknown fields are errors. Vehicles are named one by one, never
all of them implied, except where something known is only looked at. What takes time becomes one *task* per vehicle: the
reply has its number, `GetTasks` its progress, `GetTaskResult` its result. A client that goes away changes nothing: the
task goes on.
"""

import math
from typing import Literal

from tui_gcs.core.plans.model import PlanWord
from tui_gcs.core.protocol import flight, setup
from tui_gcs.core.protocol.base import Message, Request, Vec3, VehicleRequest, Vehicles
from tui_gcs.core.protocol.common import AnyRequest as StationRequest
from tui_gcs.core.protocol.common import Reply, decode
from tui_gcs.core.protocol.inspection import GetMessages, GetValues, Inspection, SetMessageRate, ValueRow
from tui_gcs.core.protocol.link_report import (
    AddLink,
    AddPartner,
    CloseLink,
    ClosePartner,
    GetLinks,
    LinkReport,
    SetLinkRate,
)
from tui_gcs.core.protocol.people import GetPeople, HandOver, PersonRow, TakeControl
from tui_gcs.core.protocol.planner_log import GetPlannerLog, PlannerLogPiece
from tui_gcs.core.protocol.setup import Number

MAX_VEHICLES = 255
"""How many vehicles one request may name."""
MAX_VALUES = 50
"""Parameters set by one request."""
MEANT = "say that it is meant"
"""How a refusal ends that the same request with `sure` or `in_flight` would not get."""
MEET = "say that it is meant that ways meet"
"""How a refusal ends that the same request with `meet` would not get (of `OnBoardMission`: with `sure`)."""
MAX_FILE_BYTES = 4 << 20
"""Of a file that is to be written."""


class FailsafeRow(Message, frozen=True):
    """What a vehicle does by itself when something is lost."""

    when: str
    does: str
    warning: bool


class ProblemRow(Message, frozen=True):
    """Something that is wrong with a vehicle."""

    text: str
    blocks: bool
    """Whether it keeps the vehicle from arming."""


class Details(Message, frozen=True):
    """The newest telemetry of a vehicle beyond the fleet frame; NaN or empty where nothing was reported lately."""

    roll_deg: float = math.nan
    pitch_deg: float = math.nan
    yaw_deg: float = math.nan
    """Counted from north, 0 to 360."""
    airspeed_m_s: float = math.nan
    throttle_pct: float = math.nan
    battery_a: float = math.nan
    battery_left_s: float = math.nan
    """Flying time by its battery's own word."""
    hdop: float = math.nan
    position_error_m: float = math.nan
    estimator: str = ""
    """The worst of its innovations in parts of what it accepts, and of what: `0.21 compass`."""
    home_m: Vec3 | None = None
    """Its home in the scenario's frame."""


class VehicleInfo(Message, frozen=True):
    """One vehicle, as far as it is known without asking it."""

    id: int
    network: str
    system: int
    autopilot: str
    type: str
    firmware: str
    """The version, e.g. "4.7.0-dev"; empty until it was reported."""
    uid: str
    team: str
    mode: str
    armed: bool
    in_flight: bool
    freshness: str
    heard_age_s: float
    signing: str
    ready: bool
    """It could arm in the mode it is flown in."""
    problems: tuple[ProblemRow, ...]
    failsafes: tuple[FailsafeRow, ...]
    """Empty until they were read (`ReadFailsafes`)."""
    links: tuple[str, ...]
    """The one in use first."""
    loss_pct: float
    rtt_s: float
    """The newest round trip; NaN if none was measured."""
    best_rtt_s: float
    home: tuple[float, float, float] | None
    """Latitude and longitude in degrees, metres above sea level; None if it was not reported."""
    mission_items: int | None
    mission_current: int | None
    """The present item, counted from 0."""
    params_known: int
    params_complete: bool
    busy: str
    """The name of the transfer that runs; empty if none does."""
    details: Details


class ParamRow(Message, frozen=True):
    """One parameter of a vehicle."""

    name: str
    value: Number
    type: str
    default: Number | None = None
    text: str = ""
    """The description, where the vehicle has sent one."""
    units: str = ""


class ParamInfoRow(Message, frozen=True):
    """A vehicle's own description of one of its parameters; None or empty where it gives none."""

    name: str
    text: str = ""
    """The long description, or the short one where there is no other."""
    units: str = ""
    group: str = ""
    least: Number | None = None
    most: Number | None = None
    reboot: bool = False
    """A change takes effect only after a reboot."""
    choices: tuple[tuple[Number, str], ...] = ()
    """Values that have a meaning of their own."""
    bits: tuple[tuple[int, str], ...] = ()
    """Bits that have a meaning of their own, counted from 0."""


class PlanRow(Message, frozen=True):
    """One item of a plan, as `core/plans/model.py` has it."""

    command: int
    frame: int
    params: tuple[float, float, float, float]
    x: int
    y: int
    z: float
    autocontinue: bool = True


class OnBoardRow(Message, frozen=True):
    """What one vehicle holds, as far as the station knows it for sure: read, or put there. None: not known."""

    vehicle: int
    mission: tuple[PlanRow, ...] | None = None
    fence: tuple[PlanRow, ...] | None = None
    rally: tuple[PlanRow, ...] | None = None


class FileRow(Message, frozen=True):
    """One entry of a vehicle's directory."""

    name: str
    is_directory: bool
    size: int | None
    exact: bool
    """`name` is what the vehicle calls it."""


class LogRow(Message, frozen=True):
    """One log on a vehicle."""

    id: int
    size: int
    time_utc: int
    """Unix time in seconds; 0 if it is not known."""


class ModeRow(Message, frozen=True):
    """One mode that may be set."""

    name: str
    number: int
    advanced: bool


class TaskInfo(Message, frozen=True):
    """Something that takes time, with one vehicle."""

    number: int
    vehicle: int
    what: str
    who: str
    """The principal that asked for it."""
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    done: int
    total: int
    """The number of steps in all; 0 if it is not known."""
    text: str
    """Why it failed, a remark on its success, or what must be over before it begins."""
    age_s: float
    prompt: str = ""
    """What the operator does now, of a task that is led."""
    waits: bool = False
    """Whether the task waits for `ConfirmStep`."""
    lines: tuple[str, ...] = ()
    """The present readings for the operator: each channel of a transmitter, each compass."""
    notes: tuple[str, ...] = ()
    """Texts that the vehicle sent about it, oldest first."""

    @property
    def over(self) -> bool:
        """Whether the task has ended."""
        return self.state not in ("queued", "running")


class TaskResult(Message, frozen=True):
    """What came of a task."""

    params: tuple[ParamRow, ...] = ()
    missing: dict[str, str] = {}
    """Parameters that were asked for and not had, and why."""
    out_of_range: tuple[str, ...] = ()
    """Parameters that were not set, because the vehicle's own description excludes the value."""
    plan: tuple[PlanRow, ...] | None = None
    files: tuple[FileRow, ...] = ()
    logs: tuple[LogRow, ...] = ()
    path: str = ""
    """Of a downloaded file, below the station's state directory."""
    lines: tuple[str, ...] = ()
    failsafes: tuple[FailsafeRow, ...] = ()
    gains: tuple[setup.GainRow, ...] = ()
    airframe: tuple[setup.AirframeRow, ...] = ()


class ServiceReply(Reply, frozen=True):
    """The answer to every request of this module."""

    tasks: tuple[TaskInfo, ...] = ()
    """Those that were begun, or asked for."""
    vehicles: tuple[VehicleInfo, ...] = ()
    params: tuple[ParamRow, ...] = ()
    param_infos: tuple[ParamInfoRow, ...] = ()
    modes: tuple[ModeRow, ...] = ()
    complete: bool = False
    """`params`: all were fetched since the vehicle booted. `modes`: it has listed all of them, or has no list of its
    own."""
    result: TaskResult | None = None
    calibrations: tuple[setup.CalibrationRow, ...] = ()
    airframes: tuple[setup.AirframeRow, ...] = ()
    setup_sections: tuple[setup.SetupSectionRow, ...] = ()
    traffic: tuple[setup.TrafficRow, ...] = ()
    remote_ids: tuple[setup.RemoteIdRow, ...] = ()
    payloads: tuple[setup.PayloadRow, ...] = ()
    on_board: tuple[OnBoardRow, ...] = ()
    inspection: Inspection | None = None
    link_report: LinkReport | None = None
    planner_log: PlannerLogPiece | None = None
    people: tuple[PersonRow, ...] = ()
    values: tuple[ValueRow, ...] = ()


class GetVehicles(Request, frozen=True, tag="get-vehicles"):
    """What is known of these vehicles, or of all (`ServiceReply.vehicles`)."""

    vehicles: Vehicles = ()


class CompareMission(VehicleRequest, frozen=True, tag="compare-mission"):
    """Where these vehicles would come too close, to each other or to others, with this mission on board.

    `Reply.results` names each vehicle, with the reason where it would; `Reply.text` is what was not compared.
    """

    items: tuple[PlanRow, ...]
    replaced: Vehicles = ()
    """Vehicles that get missions of their own at the same time: what they hold now is not compared."""


class GetOnBoard(VehicleRequest, frozen=True, tag="get-on-board"):
    """The plans of these vehicles that are known (`ServiceReply.on_board`)."""


class GetParams(Request, frozen=True, tag="get-params"):
    """The parameters of a vehicle that are known (`ServiceReply.params`)."""

    vehicle: int


class GetParamInfos(Request, frozen=True, tag="get-param-infos"):
    """A vehicle's own descriptions of these parameters, as far as fetched (`ServiceReply.param_infos`)."""

    vehicle: int
    names: tuple[str, ...]


class GetModes(Request, frozen=True, tag="get-modes"):
    """The modes a vehicle can be set to; it is asked for its list, once (`ServiceReply.modes`, `.complete`)."""

    vehicle: int


class GetTasks(Request, frozen=True, tag="get-tasks"):
    """These tasks, or all that are remembered."""

    numbers: tuple[int, ...] = ()


class GetTaskResult(Request, frozen=True, tag="get-task-result"):
    """What came of a task; there as long as it is remembered (`ServiceReply.result`)."""

    number: int


class ReadParams(VehicleRequest, frozen=True, tag="read-params"):
    """Ask for parameters by name (`TaskResult.params`, `.missing`)."""

    names: tuple[str, ...]


class FetchParams(VehicleRequest, frozen=True, tag="fetch-params"):
    """Fetch all parameters; then `GetParams`."""

    meanings: bool = False
    """Fetch what they mean, too, from a vehicle that says so (PX4) and has not been asked yet."""


class ReadFailsafes(VehicleRequest, frozen=True, tag="read-failsafes"):
    """Read what vehicles do by themselves (`TaskResult.failsafes`)."""


class DownloadPlan(VehicleRequest, frozen=True, tag="download-plan"):
    """Read what vehicles hold (`TaskResult.plan`)."""

    kind: PlanWord


class ListFiles(VehicleRequest, frozen=True, tag="list-files"):
    """List a directory of vehicles (`TaskResult.files`)."""

    path: str


class DownloadFile(VehicleRequest, frozen=True, tag="download-file"):
    """Read a file into the station's state directory (`TaskResult.path`)."""

    path: str


class ListLogs(VehicleRequest, frozen=True, tag="list-logs"):
    """List the logs on vehicles (`TaskResult.logs`)."""


class DownloadLog(VehicleRequest, frozen=True, tag="download-log"):
    """Read a log into the station's state directory (`TaskResult.path`); what an earlier try brought is used."""

    log: int


class SetParams(VehicleRequest, frozen=True, tag="set-params"):
    """Set parameters; each is confirmed by the value that the vehicle then reports."""

    values: dict[str, Number]
    in_flight: bool = False
    """It is meant for vehicles in the air, too."""
    beyond_range: bool = False
    """Set it also if the vehicle's own description of the parameter excludes the value."""


class UploadPlan(VehicleRequest, frozen=True, tag="upload-plan"):
    """Put a plan on vehicles; done when each was asked and holds it."""

    kind: PlanWord
    items: tuple[PlanRow, ...]
    in_flight: bool = False
    """Also while it flies its mission, which then changes item by item."""


class ClearPlan(VehicleRequest, frozen=True, tag="clear-plan"):
    """Delete one kind of plan."""

    kind: PlanWord


class SetMode(VehicleRequest, frozen=True, tag="set-mode"):
    """Change to a mode by name."""

    mode: str
    sure: bool = False
    """Set it also if the vehicle then takes off, flies by itself, or obeys sticks that no pilot holds."""
    meet: bool = False
    """Set it also if the mission that it then flies comes too close to other vehicles."""


class WriteFile(VehicleRequest, frozen=True, tag="write-file"):
    """Write a file on vehicles that are not armed; proven by its checksum where the vehicle has one."""

    path: str
    data: bytes


class RemoveFile(VehicleRequest, frozen=True, tag="remove-file"):
    """Remove a file on vehicles that are not armed."""

    path: str


class EraseLogs(VehicleRequest, frozen=True, tag="erase-logs"):
    """Erase all logs on vehicles that are not armed."""


class TypeShell(VehicleRequest, frozen=True, tag="type-shell"):
    """Type one line into the command line of vehicles that are not armed (`TaskResult.lines`)."""

    line: str


class Reboot(VehicleRequest, frozen=True, tag="reboot"):
    """Reboot the autopilots of vehicles that are not armed."""


class CancelTask(Request, frozen=True, tag="cancel-task"):
    """End a task, also that of another principal."""

    number: int


Look = (
    GetVehicles
    | GetOnBoard
    | CompareMission
    | GetParams
    | GetParamInfos
    | GetModes
    | GetTasks
    | GetTaskResult
    | setup.Look
    | GetMessages
    | GetValues
    | GetLinks
    | GetPeople
    | GetPlannerLog
)
Fetch = (
    ReadParams
    | FetchParams
    | ReadFailsafes
    | DownloadPlan
    | ListFiles
    | DownloadFile
    | ListLogs
    | DownloadLog
    | setup.Fetch
)
Change = (
    SetParams
    | UploadPlan
    | ClearPlan
    | SetMode
    | WriteFile
    | RemoveFile
    | EraseLogs
    | TypeShell
    | Reboot
    | setup.Change
    | SetMessageRate
    | flight.Flight
)
LinkChange = AddLink | CloseLink | SetLinkRate | AddPartner | ClosePartner
ControlChange = HandOver | TakeControl
ServiceRequest = Look | Fetch | Change | flight.Land | CancelTask | setup.ConfirmStep | LinkChange | ControlChange


def decode_request(data: bytes) -> StationRequest | ServiceRequest:
    """The request in `data`, of this module or of `common`; raises `msgspec.MsgspecError` if it is none."""
    request: StationRequest | ServiceRequest = decode(data, StationRequest | ServiceRequest)  # type: ignore[arg-type]
    return request
