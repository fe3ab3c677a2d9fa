"""Everything that travels on the bus: msgspec structs, msgpack on the wire, each declared once.

This module holds the status, the requests about the station as a whole, and the reply; the modules beside it hold the
rest by subject, and most of their names can be imported from here. Unknown fields and wrong types are errors. Positions
are ENU metres about the scenario origin (x east, y north, z up above home), times `*_s` are the station's monotonic
seconds unless the name has `wall` in it. Unknown numbers are NaN.
"""

import math
from enum import StrEnum
from typing import Any, Literal, TypeVar

import msgspec

from tui_gcs.core.base.run_kind import RunKind as RunKind
from tui_gcs.core.protocol.alarms import Acknowledge as Acknowledge
from tui_gcs.core.protocol.alarms import Alarm as Alarm
from tui_gcs.core.protocol.alarms import Shelve as Shelve
from tui_gcs.core.protocol.alarms import Unshelve as Unshelve
from tui_gcs.core.protocol.alarms import action_words
from tui_gcs.core.protocol.base import Message as Message
from tui_gcs.core.protocol.base import Request as Request
from tui_gcs.core.protocol.base import StopRequest as StopRequest
from tui_gcs.core.protocol.base import Vec3 as Vec3
from tui_gcs.core.protocol.fleet import NOWHERE as NOWHERE
from tui_gcs.core.protocol.fleet import AnyFrame as AnyFrame
from tui_gcs.core.protocol.fleet import FleetFrame as FleetFrame
from tui_gcs.core.protocol.fleet import Freshness as Freshness
from tui_gcs.core.protocol.fleet import KeepOut as KeepOut
from tui_gcs.core.protocol.fleet import Phase as Phase
from tui_gcs.core.protocol.fleet import PlannerFrame as PlannerFrame
from tui_gcs.core.protocol.fleet import VehicleRow as VehicleRow
from tui_gcs.core.protocol.journal import EventClass as EventClass
from tui_gcs.core.protocol.journal import GetEvents as GetEvents
from tui_gcs.core.protocol.journal import GetJournal as GetJournal
from tui_gcs.core.protocol.journal import JournalEvent as JournalEvent
from tui_gcs.core.protocol.journal import Note as Note
from tui_gcs.core.protocol.links import LinkStatus as LinkStatus
from tui_gcs.core.protocol.planning import Annotation as Annotation
from tui_gcs.core.protocol.planning import FlownWays as FlownWays
from tui_gcs.core.protocol.planning import Intent as Intent
from tui_gcs.core.protocol.planning import ParamInfo as ParamInfo
from tui_gcs.core.protocol.planning import ParamValue as ParamValue
from tui_gcs.core.protocol.planning import PlannerInfo as PlannerInfo
from tui_gcs.core.protocol.planning import PlannerTask as PlannerTask
from tui_gcs.core.protocol.planning import TeamPlan as TeamPlan
from tui_gcs.core.protocol.planning import Track as Track
from tui_gcs.core.protocol.points import AddPoints as AddPoints
from tui_gcs.core.protocol.points import CancelPoints as CancelPoints
from tui_gcs.core.protocol.points import PointOfInterest as PointOfInterest
from tui_gcs.core.protocol.preflight import AcknowledgeCheck, Check, ReadChecks, SignOff, TickItem
from tui_gcs.core.protocol.replay import ReplayStatus
from tui_gcs.core.scenario.model import Scenario

PROTOCOL = 38
"""Version of everything that is declared in `core/protocol`; consoles and workers send it first (`Hello`)."""


class RunPhase(StrEnum):
    """What the station is doing with the fleet."""

    IDLE = "idle"
    STARTING = "starting"
    RUNNING = "running"
    HOLD = "hold"
    RETURNING = "returning"


class TeamStatus(Message, frozen=True):
    """How a team and its planner are doing."""

    name: str
    zone: str
    role: str
    planner: str
    members: tuple[int, ...]
    worker: Literal["absent", "ready", "running", "late", "dead", "quarantined"]
    """quarantined: its planner failed twice, and is left alone until the operator changes something."""
    plan_age_s: float
    rate_hz: float
    on_slot: int
    slots: int
    worst_idleness_s: float
    average_idleness_s: float
    coverage: float
    """0…1 of the cells of the zone that can be seen, seen since the round began."""
    ideal_s: float
    """A / (n v 2r): worst idleness of the n vehicles that serve without overlap and turns. A is the area that can be
    seen; those in reserve do not count."""
    bound_s: float
    """Worst idleness that no plan of these n vehicles beats."""
    ratio: float
    """Worst idleness over the ideal; NaN until every cell was seen."""
    metrics: dict[str, float] = {}
    error: str = ""
    """Why the planner cannot plan, or failed last: a line, or a traceback of several."""
    reserve: int = 0
    """How many of `slots` and `on_slot` wait in reserve where their planner wants them, and serve no zone yet."""


class StationStatus(Message, frozen=True):
    """The station in one message: published at 2 Hz and on every change."""

    seq: int
    t_s: float
    wall_s: float
    kind: RunKind
    scenario: str
    revision: int
    run: RunPhase
    round_index: int
    rounds: tuple[str, ...]
    mission_time_s: float
    heard: int
    vehicles: int
    armed: int
    in_control: str
    teams: tuple[TeamStatus, ...] = ()
    links: tuple[LinkStatus, ...] = ()
    forward: tuple[LinkStatus, ...] = ()
    """Other stations that hear the vehicles."""
    min_separation_m: float = float("nan")
    outside_area_m: float = 0.0
    vetoes: dict[str, int] = {}
    """Guard vetoes since start, by reason."""
    not_ready: dict[int, str] = {}
    """Vehicles of teams that could not be started now, and why."""
    preflight: tuple[Check, ...] = ()
    """What is checked of the vehicles on the ground before a start, the worst first; none when all are in the air."""
    if_silent: dict[int, str] = {}
    """What each vehicle of a team does when our set-points stop: to be seen before a start."""
    faults: dict[str, int] = {}
    """What should never happen, counted since start: "planner", "unanswered commands", "refused on slot", "link", and
    "too close", the samples in which two vehicles were closer than both limits of separation."""
    dropped: dict[str, int] = {}
    """What was received and not used, by reason."""
    homes: dict[int, tuple[float, float]] = {}
    """East and north of the place to which each vehicle's return leads: its take-off place, or the home that it
    reports."""
    recording: str = ""
    ending: bool = False
    """An operator has ended the station: this is its last status, and none is started again."""
    planner_files: dict[str, str] = {}
    """Planners given on the command line: path and sha256 at the start, by name."""
    alarms: tuple[Alarm, ...] = ()
    """What the operator must act on, the worst first; shelved ones last."""

    points: tuple[PointOfInterest, ...] = ()
    """Tasks from outside, also those that are closed, in the order in which they came."""
    replay: ReplayStatus | None = None
    """Where the player stands; None unless a recording is played."""

    @property
    def alarm(self) -> str:
        """The first of `alarms` in words; empty if none."""
        first = self.alarms[0] if self.alarms else None
        if first is None or first.state == "shelved":
            return ""
        return f"{first.words()}   ({first.state}) → {action_words(first.action, {})}"


class ScenarioChanged(Message, frozen=True):
    """The scenario the station flies: parsed, and the text it came from."""

    revision: int
    path: str
    toml: str
    scenario: Scenario


class PreviewTask(Message, frozen=True):
    """To a worker: look at this task with vehicles as in this frame; None: stop looking."""

    number: int
    task: PlannerTask | None
    frame: FleetFrame | None
    idleness_s: float = 0.0
    """Above 0: with as many vehicles as it takes for this worst idleness."""
    starts_m: dict[int, tuple[float, float]] = {}
    """Take-off places, for vehicles that are not in the frame."""
    snapshot: bytes = b""
    """Of the team's planner: what it learnt is known to the next one of its kind."""


class PreviewResult(Message, frozen=True):
    """What a planner would make of a task."""

    team: str
    number: int
    state: Literal["running", "done", "failed"]
    metrics: dict[str, float] = {}
    annotations: tuple[Annotation, ...] = ()
    text: str = ""
    """The reason of a failure."""
    worst_s: float = math.nan
    """Predicted worst idleness; NaN: not all of the zone would be seen."""
    ratio: float = math.nan
    """Of it to the ideal."""
    separation: float = math.nan
    """The least within the team, as a multiple of the allowed one."""
    vehicles: int = 0
    """The number of vehicles that the forecast was made with."""
    ideal_s: float = math.nan
    """A / (n v 2r) of the area that can be seen."""
    bound_s: float = math.nan
    """Worst idleness that no plan beats."""
    unreachable: str = ""
    """What of the zone no vehicle can see, and why; "" if all can be seen."""
    ways: FlownWays | None = None
    """As they were foretold, to be compared with those of other teams (`core/judging/team_separation.py`)."""


class Hello(Request, frozen=True, tag="hello"):
    """The first exchange: the asker's protocol version and name. `Reply.status` lets a console paint at once."""

    protocol: int
    who: str


class GetScenario(Request, frozen=True, tag="get-scenario"):
    """Get the scenario that is flown now (`Reply.scenario`)."""


class GetTask(Request, frozen=True, tag="get-task"):
    """Get a team's planner task (`Reply.task`, `Reply.snapshot`); there is none while its planner is quarantined."""

    team: str


class GetPlan(Request, frozen=True, tag="get-plan"):
    """Get the newest annotations of every team (`Reply.annotations`)."""


class GetPlanners(Request, frozen=True, tag="get-planners"):
    """Get all known planners with what they declare (`Reply.planners`)."""


class Start(Request, frozen=True, tag="start"):
    """Arm, take off and run the present round with exactly these vehicles (what the operator saw and confirmed)."""

    vehicles: tuple[int, ...]
    overrides: tuple[str, ...] = ()
    """Names of checks that refuse this start and are overridden for it."""
    operator: str = ""
    """The operator who starts, and signs the list of checks with it; needed for an override, and if no operator has
    signed."""


class Hold(StopRequest, frozen=True, tag="hold"):
    """Hold at once."""


class Resume(Request, frozen=True, tag="resume"):
    """Go on with the planner after a hold or by hand: these; or all that hold and flew for their team before."""

    vehicles: tuple[int, ...] = ()


class Return(StopRequest, frozen=True, tag="return"):
    """Return and land."""


class SwitchRound(Request, frozen=True, tag="switch-round"):
    """Make another round the present one, on the ground or in flight."""

    index: int


class ApplyScenario(Request, frozen=True, tag="apply-scenario"):
    """Replace the scenario by this TOML text, edited from `base_revision`."""

    base_revision: int
    toml: str


class SetParameters(Request, frozen=True, tag="set-parameters"):
    """Change parameters of a team's planner, on the ground or in flight; the others stay as they are."""

    team: str
    parameters: dict[str, ParamValue]


class Preview(Request, frozen=True, tag="preview"):
    """What this TOML text, edited from `base_revision`, would give; planners compute it on the side (`GetPreviews`)."""

    base_revision: int
    toml: str
    round_index: int = 0
    """The index of the round within the edited scenario."""
    team: str = ""
    """Only this team; "" for all teams."""
    idleness_s: float = 0.0
    """Above 0: find out how many vehicles it takes for this worst idleness."""


class CancelPreview(Request, frozen=True, tag="cancel-preview"):
    """End the newest preview: no result is wanted any more."""


class GetPreviews(Request, frozen=True, tag="get-previews"):
    """Get the newest preview, by team (`Reply.previews`)."""


class Shutdown(Request, frozen=True, tag="shutdown"):
    """End the station; refused while anything is armed.

    `lost` names vehicles that were armed when last heard and are LOST: the operator knows what became of them.
    """

    lost: tuple[int, ...] = ()


class ProvisionKey(Request, frozen=True, tag="provision-key"):
    """Give a vehicle the signing key of this name, in two steps.

    With an empty `confirm` nothing is sent: the reply describes what would be sent and holds a code of 6 characters.
    With that code the key is sent.
    """

    vehicle: int
    key: str
    """Its name in the key store; keys themselves never travel on the bus."""
    confirm: str = ""


AnyRequest = (
    Hello
    | GetScenario
    | GetEvents
    | GetTask
    | GetPlan
    | GetPlanners
    | GetPreviews
    | Preview
    | CancelPreview
    | Start
    | Hold
    | Resume
    | Return
    | SwitchRound
    | ApplyScenario
    | SetParameters
    | AddPoints
    | CancelPoints
    | Shutdown
    | ProvisionKey
    | Acknowledge
    | Shelve
    | Unshelve
    | Note
    | GetJournal
    | AcknowledgeCheck
    | SignOff
    | TickItem
    | ReadChecks
)


class ReplyCode(StrEnum):
    """Why a request was answered as it was, for programs: they decide by this, and never by the text beside it."""

    NONE = ""
    """`ok` and the fields of the reply hold all there is to decide by."""
    NO_ANSWER = "no answer"
    """Set by clients, never by the station: no answer came, so the request may or may not have been carried out."""
    UNREADABLE = "unreadable"
    """Set by clients, never by the station: an answer came that this version cannot decode."""
    OTHER_PROTOCOL = "other protocol"
    """`Hello` named another protocol version than the station's."""
    NOT_UNDERSTOOD = "not understood"
    """The station could not decode the request."""
    NOT_CONFIRMED = "not confirmed"
    """Refused only because it may do harm: the same request with `sure` or `in_flight` would be carried out."""


class VehicleResult(Message, frozen=True):
    """What became of a request for one vehicle."""

    vehicle: int
    ok: bool
    text: str
    code: ReplyCode = ReplyCode.NONE


class Reply(Message, frozen=True):
    """The station's answer: accepted or why not, with a result for each vehicle that the request concerns.

    Accepted means begun; events and telemetry report how it ends.
    """

    ok: bool
    text: str = ""
    results: tuple[VehicleResult, ...] = ()
    scenario: ScenarioChanged | None = None
    status: StationStatus | None = None
    """`Hello`: as it was published last, or would be now."""
    events: tuple[JournalEvent, ...] = ()
    refused_by: tuple[Check, ...] = ()
    """`Start`: the checks that refuse it and were not overridden."""
    journal_at: int = 0
    """`GetJournal`: where the answer before this one begins."""
    task: PlannerTask | None = None
    snapshot: bytes = b""
    """Of the planner of that task, for a worker that goes on from there."""
    annotations: dict[str, tuple[Annotation, ...]] = {}
    planners: tuple[PlannerInfo, ...] = ()
    previews: dict[str, PreviewResult] = {}
    code: ReplyCode = ReplyCode.NONE


T = TypeVar("T")
_encoder = msgspec.msgpack.Encoder()
_decoders: dict[Any, msgspec.msgpack.Decoder[Any]] = {}


def encode(message: Message) -> bytes:
    """Encode a message for the bus."""
    return _encoder.encode(message)


def decode(data: bytes, kind: type[T]) -> T:
    """The message in `data`.

    Raises:
        msgspec.MsgspecError: not such a message (unknown field, wrong type, not msgpack).
    """
    # Decoders are kept: building one for a large union costs far more than decoding.
    decoder = _decoders.get(kind)
    if decoder is None:
        decoder = _decoders[kind] = msgspec.msgpack.Decoder(kind)
    result: T = decoder.decode(data)
    return result


def decode_request(data: bytes) -> AnyRequest:
    """The request in `data`; raises `msgspec.MsgspecError` if it is none."""
    return decode(data, AnyRequest)  # type: ignore[arg-type]
