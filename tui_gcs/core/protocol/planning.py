"""What travels between the station and planners: tasks, tracks, intents, plans. `planner/api.py` re-exports it.

As in `messages.py`: positions are ENU metres about the scenario origin, z above home; times are the station's.
"""

import math
import re
from typing import Literal

from tui_gcs.core.geometry.idleness_bounds import Sweep, sweep_of
from tui_gcs.core.geometry.zone_cells import ZoneCells, reachable_cells
from tui_gcs.core.geometry.zones import Zone
from tui_gcs.core.protocol.base import Message, Vec3
from tui_gcs.core.scenario.model import (
    Communication,
    DensityPeak,
    Instances,
    Limits,
    MovingObstacle,
    OperatingArea,
    VehicleClass,
)


class Track(Message, frozen=True):
    """A sensed target, fused from what vehicles detected."""

    id: int
    position_m: Vec3
    """As estimated for `seen_s`; z above the scenario's ground."""
    velocity_m_s: Vec3
    covariance_m2: tuple[float, float, float]
    """(east-east, east-north, north-north) of the position."""
    first_seen_s: float
    seen_s: float
    """When it was detected last."""
    seen_by: tuple[int, ...]
    """Vehicles that detected it within the last seconds, ordered."""
    confirmed: bool
    """Detected often enough not to be a false alarm."""


MIN_TOUR_POINTS = 3
"""More than so many points make a tour."""
ParamValue = float | int | bool | str
TYPES: dict[str, type] = {"float": float, "int": int, "bool": bool, "str": str}


class ParamInfo(Message, frozen=True):
    """A planner's parameter, as it is declared."""

    name: str
    type: Literal["float", "int", "bool", "str"]
    default: ParamValue
    minimum: float | None = None
    maximum: float | None = None
    unit: str = ""
    help: str = ""
    choices: tuple[str, ...] = ()

    def problem(self, value: object) -> str:
        """Why `value` is not allowed, or "" if it is."""
        allowed: tuple[type, ...] = (int, float) if self.type == "float" else (TYPES[self.type],)
        # `bool` is an `int` in Python, and no number here.
        if not isinstance(value, allowed) or (isinstance(value, bool) and self.type != "bool"):
            return f"{self.name} must be {self.type}, not {type(value).__name__}"
        if self.choices and value not in self.choices:
            return f"{self.name} must be one of {', '.join(self.choices)}"
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            if not math.isfinite(value):
                return f"{self.name} must be a finite number"
            if self.minimum is not None and value < self.minimum:
                return f"{self.name} must be at least {self.minimum:g} {self.unit}".rstrip()
            if self.maximum is not None and value > self.maximum:
                return f"{self.name} must be at most {self.maximum:g} {self.unit}".rstrip()
        return ""


JudgedBy = Literal["idleness", "coverage", "intruders", "tasks", "metrics"]
"""What a flight of a planner is judged by, beside containment, separation and its own metrics, which always count.

idleness: each place is seen again and again. coverage: the zone is seen whole once. intruders: they are met before the
zone. tasks: points of interest are visited. metrics: nothing else.
"""
METRIC_NAME = r"[A-Za-z][A-Za-z0-9_]{0,31}"
"""Pattern of the names of declared metrics: a scenario's gate is that name with `_min` or `_max`."""


class Metric(Message, frozen=True):
    """A number that a planner publishes in `Output.metrics` and is judged by."""

    name: str
    unit: str = ""
    better: Literal["higher", "lower"] = "higher"
    gate: float | None = None
    """The worst value that passes; None: no value fails. A scenario's `[results.metrics]` replaces it."""
    of: Literal["last", "worst", "mean"] = "last"
    """Which value of a round is compared: its last, its worst, or its mean over time."""
    help: str = ""

    def problem(self) -> str:
        """Return what is wrong with this declaration, or ""."""
        if not isinstance(self.name, str) or not re.fullmatch(METRIC_NAME, self.name):
            return f"metric {self.name!r}: a name is letters, digits and _, beginning with a letter, at most 32"
        if self.name.endswith(("_min", "_max")):
            return f"metric {self.name!r}: must not end in _min or _max, which are the ends of a scenario's gates"
        if self.better not in ("higher", "lower"):
            return f"metric {self.name}: better = {self.better!r} must be 'higher' or 'lower'"
        if self.of not in ("last", "worst", "mean"):
            return f"metric {self.name}: of = {self.of!r} must be 'last', 'worst' or 'mean'"
        is_number = isinstance(self.gate, (int, float)) and not isinstance(self.gate, bool)
        if self.gate is not None and not (is_number and math.isfinite(self.gate)):
            return f"metric {self.name}: gate = {self.gate!r} is not a finite number"
        if not isinstance(self.unit, str) or not isinstance(self.help, str):
            return f"metric {self.name}: unit and help must be text"
        return ""


class PlannerInfo(Message, frozen=True):
    """A planner, as it declares itself."""

    name: str
    version: str
    params: tuple[ParamInfo, ...]
    rate_hz: float
    file: str = ""
    """Where it is, if it was given on the command line."""
    sha256: str = ""
    """Of that file at the start."""
    metrics: tuple[Metric, ...] = ()
    """The metrics that it is judged by."""
    judged_by: JudgedBy = "metrics"

    def problems(self, given: dict[str, ParamValue]) -> list[str]:
        """What is wrong with these parameters."""
        known = {param.name: param for param in self.params}
        unknown = f"is no parameter of it (it has: {', '.join(known) or 'none'})"
        found = [known[key].problem(value) if key in known else f"{key} {unknown}" for key, value in given.items()]
        return [problem for problem in found if problem]


class PlannerTask(Message, frozen=True):
    """What a team's planner is asked to do. A new revision means: configure again."""

    team: str
    revision: int
    t_s: float
    planner: str
    zone: Zone
    area: OperatingArea
    no_fly: tuple[Zone, ...]
    limits: Limits
    footprint_radius_m: float
    parameters: dict[str, float | int | bool | str]
    seed: int
    members: tuple[int, ...]
    """System ids of the whole team, flying or not."""
    layers_m: dict[int, float]
    """Altitude layer of each member, metres above home."""
    zones: tuple[Zone, ...] = ()
    """All zones of the round, the team's among them."""
    instances: Instances | None = None
    """Whether its planner runs once for the team or once on each vehicle; None: as the planner declares."""
    vehicle: int = 0
    """The vehicle that this instance commands, where there is one instance on each; 0: the whole team."""
    communication: Communication = Communication()
    """How instances on vehicles hear each other."""
    classes: dict[int, VehicleClass] = {}
    """What each member can do, where the scenario has classes of vehicles."""
    density: tuple[DensityPeak, ...] = ()
    """How important places are; none: all the same."""
    obstacles: tuple[MovingObstacle, ...] = ()
    """Moving discs to keep away from."""
    asked_m_s: dict[int, float] = {}
    """The speed of each member by the scenario, where its autopilot flies less: `limits` and `classes` have the less.
    Ideal and bound are of these, so that they are the same before, in and after a flight."""
    off_course_m: float = 1.25
    """How far beside a moving course the worst of the team's vehicles may be: their autopilots' measured figure."""

    def class_of(self, vehicle: int) -> VehicleClass:
        """Return what a member can do: its class, or the limits of all."""
        known = self.classes.get(vehicle)
        if known is not None:
            return known
        return VehicleClass("", (), self.limits.speed_m_s, self.limits.accel_m_s2, self.footprint_radius_m)


def sweep_of_task(task: PlannerTask, n: int) -> Sweep:
    """Return how `n` vehicles of the task's team sweep its zone, for `ZoneCells.ideal_s` and `bound_s`."""
    speeds_m_s = [task.asked_m_s.get(vehicle, task.class_of(vehicle).speed_m_s) for vehicle in task.members]
    return sweep_of(speeds_m_s or [task.limits.speed_m_s], n, task.footprint_radius_m)


def cells_of(task: PlannerTask) -> ZoneCells:
    """Return the cells of the task's zone that its vehicles can see: what all figures count."""
    margin_m = task.limits.geofence_margin_m
    return reachable_cells(task.zone.shape, task.area.shape, task.no_fly, margin_m, task.footprint_radius_m)


class Intent(Message, frozen=True):
    """What a planner wants of one vehicle.

    hold: stop here. goto: fly to `position_m` at `speed_m_s` and stay. velocity: fly with `velocity_m_s` for `valid_s`
    from the time of the plan, then brake. trajectory: be at `positions_m[i]` with `velocities_m_s[i]` at time
    `t0_s + i * dt_s`; after the last sample the vehicle holds there. orbit: circle about `position_m` with `radius_m`
    at `speed_m_s`. return: fly home and land.
    """

    vehicle: int
    kind: Literal["hold", "goto", "velocity", "trajectory", "orbit", "return"]
    position_m: Vec3 | None = None
    velocity_m_s: Vec3 | None = None
    valid_s: float = 1.0
    speed_m_s: float | None = None
    """None: the speed limit of the scenario."""
    radius_m: float = 0.0
    clockwise: bool = True
    """Of an orbit, seen from above."""
    t0_s: float = 0.0
    dt_s: float = 0.0
    positions_m: tuple[Vec3, ...] = ()
    velocities_m_s: tuple[Vec3, ...] = ()
    slot: str = ""
    joined: bool = False
    """True once the vehicle is on its slot by the planner's own judgement."""
    reason: str = ""


class Annotation(Message, frozen=True):
    """Something a planner draws on the map. Points are ENU metres."""

    kind: Literal["polyline", "polygon", "marker", "text"]
    points_m: tuple[tuple[float, float], ...]
    text: str = ""

    @property
    def is_loop(self) -> bool:
        """Whether it is a line that ends where it begins: a tour."""
        points = self.points_m
        return self.kind == "polyline" and len(points) > MIN_TOUR_POINTS and points[0] == points[-1]


class FlownWays(Message, frozen=True):
    """Where a team's vehicles would be, from the beginning of a preview on, and on which tours."""

    ids: tuple[int, ...]
    step_s: float
    places_m: tuple[tuple[Vec3, ...], ...]
    """Of each vehicle, one every `step_s`."""
    loops_m: tuple[tuple[tuple[float, float], ...], ...] = ()
    """Closed lines that its planner draws: each may be flown by any of them."""

    @property
    def is_sound(self) -> bool:
        """Whether every vehicle has a place at every moment, and all numbers are finite."""
        moments = {len(places) for places in self.places_m}
        whole = len(self.ids) == len(self.places_m) and len(moments) == 1 and self.step_s > 0.0
        lines = (*self.places_m, *self.loops_m)
        return whole and all(math.isfinite(value) for line in lines for place in line for value in place)


class TeamPlan(Message, frozen=True):
    """A planner's answer for one step: intents for its team, drawings and named numbers."""

    team: str
    revision: int
    seq: int
    t_s: float
    """`t_s` of the fleet frame this plan was made from."""
    intents: tuple[Intent, ...] = ()
    annotations: tuple[Annotation, ...] | None = None
    """None: the annotations stay as they were."""
    metrics: dict[str, float] = {}
    step_ms: float = 0.0
    rate_hz: float = 5.0
    """How often this planner steps."""
    error: str = ""
    """Traceback of a step that failed, or why it cannot plan; then there are no intents."""
    fate: Literal["", "restarts", "quarantined"] = ""
    """Of a planner that failed: it is begun anew from its snapshot, or not before the operator changes something."""
    snapshot: bytes | None = None
    """State for the next worker in case this one dies; None: it stays as it was."""
    learnt: bytes | None = None
    """What the next planner of this kind may use, also for another task or station; None: it stays as it was."""
    notes: tuple[str, ...] = ()
    """Further lines for the operator; each is shown once a minute at most."""
    news: tuple[tuple[str, bool], ...] = ()
    """What became of a file that was saved, and whether it is good (`tui-gcs planner watch`); always shown."""
    declares: PlannerInfo | None = None
    """What its file declares since it was saved (`tui-gcs planner watch`)."""
