"""What the author of a planner imports, and all he has to read. Small and stable.

A planner is one class in one file. This one keeps its team circling over its zone, each vehicle on its own layer:

    from tui_gcs.planner.api import Intent, Output, Param, Planner, polygon_of

    class Circle(Planner):
        name = "circle"
        params = (Param("radius_m", float, 30.0, minimum=5.0, maximum=200.0, unit="m", help="of the circle"),)
        def configure(self, task, params, rng):
            self.radius_m, (west, south, east, north) = params["radius_m"], polygon_of(task.zone.shape).bounds
            self.middle = ((west + east) / 2, (south + north) / 2)
        def step(self, ctx):
            active = zip(ctx.fleet.id[ctx.fleet.active], ctx.fleet.layer_m[ctx.fleet.active])
            orbits = [Intent(i, "orbit", position_m=(*self.middle, z), radius_m=self.radius_m) for i, z in active]
            return Output(orbits)

`tui-gcs planner new NAME` writes such a file, `tui-gcs planner check FILE.py` tries it without vehicles,
`tui-gcs planner watch FILE.py` flies it on simulated ones and takes it in again whenever it is saved, and
`tui-gcs fly SCENARIO.toml --planner FILE.py` flies it for the teams whose scenario says `planner = "circle"`.

**What is asked.** `task.zone.shape` and `task.area.shape` (`polygon_of` makes shapely polygons of them), `alt_min_m`
and `alt_max_m` of both, `task.no_fly` (zones), `task.limits` (`speed_m_s`, `accel_m_s2`, `separation_horizontal_m`,
`separation_vertical_m`, `geofence_margin_m`), `task.footprint_radius_m`, `task.members` (ids of the team).

**Where.** Positions are ENU metres about the scenario's origin: x east, y north, z above the vehicles' homes. Speeds
are m/s over ground, times seconds of the station's clock: only differences mean something. Unknown numbers are NaN.

**Life.** Each team has its own planner in a process of its own, which may hang, crash or be killed: vehicles are safe
without it. The station calls, in this order:

1. `configure(task, params, rng)`: once per task (team, zone, round or parameters changed: a new object, a new task).
   May be slow, 20 s at most; what flew before flies on meanwhile. A `raise ValueError("why")` of yours says that
   the task cannot be done; one that comes out of a library is a mistake as any other exception.
2. `start(t_s, fleet)`, or `restore(data)` with what `snapshot` gave if this planner goes on where one died.
3. `step(ctx)`, `rate_hz` times a second, 1 to 20; before it `event(event)` for everything that changed since the last.
4. `stop(reason)`.

`step` is a pure function of the planner's state and `ctx`: time, fleet, tracks, wind and random numbers come with it. A
planner never asks a clock, never draws from an unseeded generator, opens no files and starts no threads: then a flight
can be replayed bit by bit, and a rehearsal is worth something. The order of `fleet` is by id, but nothing should depend
on which id a vehicle has (where an operator gives orders by number, declare `ids_matter = True`). Anybody may be lost,
held or join between any two steps: what `fleet` shows counts, events only say it sooner. A team may have 0 vehicles.

**What is wanted** of a vehicle is an `Intent`; it stays until the next one for this vehicle:

* `hold`: stop here.
* `goto`: fly straight to `position_m`, no faster than `speed_m_s`, and stay.
* `velocity`: fly with `velocity_m_s` for `valid_s` (30 at most) from the time of the frame, then brake.
* `trajectory`: be at `positions_m[k]` with `velocities_m_s[k]` at `t0_s + k * dt_s`; after the last sample stay there.
  The most exact: send 2 to 5 s with every step, 600 samples at most. What a vehicle is late is taken care of.
* `orbit`: round `position_m` with `radius_m` at `speed_m_s`; saying it again goes on where it is.
* `return`: fly home and land; only the operator starts it again.

Only what is `active` takes intents. Stay within `task.limits` (the speed upwards is part of the speed; at most 3 m/s
up and 1.5 m/s down), and keep some of them for catching up: plan with 0.95 of the speed and 0.9 of the acceleration.
Keep each vehicle on `fleet.layer_m` unless there is a reason. Numpy's arrays and numbers are as good as tuples.

**The guard** stands behind every planner and passes or vetoes, nothing else: operating area and no-fly zones with
their margins, altitude band, speed, and closest approach in the next seconds. A vetoed vehicle brakes and stands until
an intent passes; the operator sees the reason. It is a wall, not a tool: plan so that it never speaks.

**Keeping apart.** On their layers vehicles may cross each other's ways: a scenario's layers are at least the vertical
limit apart. Where they share a height, `avoid(position_m, velocity_m_s, wanted_m_s, task.limits)` makes of the
velocities (n, 3) that are wanted for the next step such as keep everybody apart: for `velocity` intents, in every step,
each for two steps (`valid_s`): the guard looks at where it leads as long as it is valid. Give it all of
`ctx.fleet` whose position is finite, also who is lost or held (they want to stand), and take the rows of the active.
Keep farther from the lost: for the guard one may be anywhere on the way that it may have come since.

**Time.** `ctx.deadline_s` is what a step may take. Three steps in a row longer than the period, or 2 s without a plan:
the vehicles hold, the operator is told, the process is killed and begun anew. So long work is cut into `iterations`:
declare `iterations_per_s`, do `ctx.iterations` of them in each step (granted by mission time, the same in a rehearsal
as in the air; fewer there while the computer is so busy that steps come late), and take over what they found at the
beginning of a step.

**Failure.** An exception in a step: its traceback is shown, and the planner begun anew from its last snapshot, once.
The second time it is left alone until the operator changes something, and its vehicles hold. `snapshot` is asked for
every 2 s: bytes, 1 MB at most, complete (what `restore` takes on a freshly configured object must give the same plans,
bit by bit; the state of `rng` and what was told by events is kept for you). b"" means: begin anew.

**Showing.** `Output.metrics` are numbers by name, `Output.annotations` are drawn on the map: `Annotation(kind,
points_m, text)`, kind polyline, polygon, marker or text, points (x, y). `Intent.slot` (a text) and `joined` say which
place a vehicle has and that it is there (of a `hold`: that it is to wait there), `reason` why. `Output.notes` are a
few words each that the operator is told as an event, five in a step at most. A preview of an edit
shows the metrics of the first step: say there what is to be expected, as `predicted_…`. A rehearsal measures a round
from when all have `joined` (who hops from one place to the next says so with every `goto`, without a `slot`: then it
counts wherever it is) and the zone was seen whole; with the metric `period_s`, the time of one round trip of a
tour, not before each of n vehicles has flown 2 n-ths of it.

**Tracks** (`ctx.tracks`) are where sensors see somebody: also outside the operating area, where you must not follow.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.geometry.idleness_grid import cell_centres_m, sweep_bound_s
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Shape, Zone, area_m2, polygon_of
from tui_gcs.core.protocol.common import Annotation, Intent, ParamInfo, ParamValue, PlannerTask
from tui_gcs.core.scenario.model import Limits, OperatingArea
from tui_gcs.planner.avoidance import avoid

__all__ = [
    "API_VERSION",
    "LOW_BATTERY_PCT",
    "Annotation",
    "Circle",
    "Context",
    "Event",
    "Fleet",
    "Intent",
    "Limits",
    "OperatingArea",
    "Output",
    "Param",
    "ParamValue",
    "Planner",
    "PlannerTask",
    "Polygon",
    "Rectangle",
    "Role",
    "Shape",
    "Tracks",
    "Zone",
    "area_m2",
    "avoid",
    "cell_centres_m",
    "polygon_of",
    "sweep_bound_s",
]

API_VERSION = 1


@dataclass(frozen=True)
class Param:
    """A declared parameter; the plan screen draws its form from it."""

    name: str
    type: type
    default: ParamValue
    minimum: float | None = None
    maximum: float | None = None
    unit: str = ""
    help: str = ""
    choices: tuple[str, ...] = ()

    def info(self) -> ParamInfo:
        """As it travels."""
        kind = self.type.__name__
        return ParamInfo(
            self.name,
            kind,  # type: ignore[arg-type]  # checked when its planner is loaded
            self.default,
            self.minimum,
            self.maximum,
            self.unit,
            self.help,
            tuple(self.choices),
        )

    def problem(self, value: object) -> str:
        """Why `value` is not allowed, or "" if it is."""
        return self.info().problem(value)


@dataclass(frozen=True)
class Fleet:
    """The team as struct of arrays, ordered by id; read only. n vehicles."""

    id: NDArray[np.int64]
    """(n,) system ids."""
    active: NDArray[np.bool_]
    """(n,) True: airborne and following this planner. Only these may get intents."""
    position_m: NDArray[np.float64]
    """(n, 3) ENU; NaN when never known."""
    velocity_m_s: NDArray[np.float64]
    """(n, 3) ENU."""
    heading_deg: NDArray[np.float64]
    age_s: NDArray[np.float64]
    """(n,) age of the position."""
    layer_m: NDArray[np.float64]
    """(n,) each vehicle's own altitude layer."""
    battery_pct: NDArray[np.float64]
    """(n,) what is left; NaN when unknown."""
    held: NDArray[np.bool_]
    """(n,) True: airborne but held, by the operator or because its planner was silent; it may become active again."""


@dataclass(frozen=True)
class Tracks:
    """Sensed targets as struct of arrays, ordered by id; read only. k targets."""

    id: NDArray[np.int64]
    position_m: NDArray[np.float64]
    """(k, 3) ENU, carried forward to the time of the step."""
    velocity_m_s: NDArray[np.float64]
    """(k, 3) ENU."""
    sigma_m: NDArray[np.float64]
    """(k,) standard deviation of the position along its worse axis."""
    age_s: NDArray[np.float64]
    """(k,) since it was detected last."""
    confirmed: NDArray[np.bool_]
    seen_by: tuple[tuple[int, ...], ...]
    """Vehicles that detected each within the last seconds."""


@dataclass(frozen=True)
class Event:
    """Something that changed since the step before; told before the step that sees it."""

    kind: Literal["joined", "lost", "held", "returned", "low battery", "resumed"]
    """joined: became active. lost: nothing is heard of it, or its position is not known. held: see `Fleet.held`.
    resumed: active again after it was held. returned: flies home, landed or is in somebody else's hands. low battery:
    under `LOW_BATTERY_PCT`, once a flight. What is so at the start is no event, but for low batteries."""
    t_s: float
    vehicle: int


LOW_BATTERY_PCT = 25.0


@dataclass(frozen=True)
class Context:
    """What a step may know."""

    t_s: float
    """Time of the fleet view, seconds; only differences mean something."""
    fleet: Fleet
    rng: np.random.Generator
    """Seeded by the host."""
    iterations: int
    """Units of background work granted for this step (per mission second: `Planner.iterations_per_s`)."""
    deadline_s: float
    """Advisory: seconds this step may take."""
    tracks: Tracks
    """What the vehicles' sensors have found."""
    wind_m_s: tuple[float, float] | None = None
    """Where the air moves to (east, north); None when nobody knows."""


@dataclass
class Output:
    """What a step wants."""

    intents: list[Intent] = field(default_factory=list)
    annotations: list[Annotation] | None = None
    """None: as before."""
    metrics: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    """What the operator should know, each told once as an event; the same again after a minute at the soonest."""


class Planner:
    """Base class; what is not needed is not overridden. See the top of this file for what is called when."""

    name: ClassVar[str] = ""
    """As a scenario names it: letters, digits, `_` and `-`."""
    version: ClassVar[str] = "1"
    """Change it when snapshots of before are of no use any more."""
    params: ClassVar[tuple[Param, ...]] = ()
    """The plan screen draws its form from them; values are checked before `configure` sees them."""
    rate_hz: ClassVar[float] = 5.0
    """Steps a second, 1 to 20. Fleet frames come at 10 Hz, at 20 Hz if a planner wants it."""
    iterations_per_s: ClassVar[float] = 0.0
    """Units of background work granted per second of mission time."""
    ids_matter: ClassVar[bool] = False
    """True: what a vehicle flies depends on its number, on purpose, because an operator says so by number."""

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        """Take zone, limits and validated parameters, all of them. `rng` is the one that `Context.rng` is, too.

        Raises:
            ValueError: this task cannot be done; the text is what the operator reads.
        """
        self.task = task

    def learnt(self) -> bytes:
        """What is still true in another zone: of vehicles, of the air; b"" is nothing.

        Kept for the next task, also over the death of this process and of the station (16 kB at most).
        """
        return b""

    def inherit(self, learnt: bytes) -> None:
        """What the planner of the task before this one has `learnt`, which had the same name and version.

        Called after `configure`, and not if it is restored. What is damaged must be an error: it begins anew without.
        """

    def start(self, t_s: float, fleet: Fleet) -> None:
        """The first step follows."""

    def step(self, ctx: Context) -> Output:
        """Intents for active vehicles."""
        raise NotImplementedError

    def event(self, event: Event) -> None:
        """Something changed; the step that follows sees it, too, so that nobody must listen."""

    def ahead(self, go_on: Callable[[], bool]) -> None:
        """Do background work before it is granted, as long as `go_on()` says so; steps take over what they are granted.

        A rehearsal calls this after `configure` on a thread, while the round before is flown, but not of planners in
        files. Who has it must not look at the task's time and revision, which are not known yet.
        """

    def stop(self, reason: str) -> None:
        """No more steps."""

    def snapshot(self) -> bytes:
        """Everything that `restore` needs so that this planner goes on; b"" to begin anew instead."""
        return b""

    def restore(self, data: bytes) -> None:
        """Take over what `snapshot` of the same version gave for the same task. Called after `configure`."""
