"""What the author of a planner imports, and all that there is to read. It is small and stable: version 2.

Files written for version 1 run unchanged: nothing was taken away. New in 2: vehicles that differ, density maps, moving
obstacles, and planners that run on each vehicle. `examples/planners` has three of them, to be read in five minutes.

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
`tui-gcs planner watch FILE.py` flies it on simulated ones and reloads it whenever it is saved, and
`tui-gcs fly SCENARIO.toml --planner FILE.py` flies it for the teams whose scenario says `planner = "circle"`.

**The task.** `task.zone.shape` and `task.area.shape` (`polygon_of` makes shapely polygons of them), `alt_min_m`
and `alt_max_m` of both, `task.no_fly` (zones), `task.limits` (`speed_m_s`, `accel_m_s2`, `separation_horizontal_m`,
`separation_vertical_m`, `geofence_margin_m`), `task.footprint_radius_m`, `task.members` (ids of the team). Vehicles
may differ: `fleet.speed_m_s`, `accel_m_s2` and `footprint_radius_m` are each vehicle's own; `task` has the least.
`ctx.density(xy_m)` tells how important places (k, 2) are now, `ctx.obstacles` where moving obstacles are, which the
guard does not know. Both come from the scenario (`[[class]]`, `[[round.density]]`, `[[round.obstacle]]`).
`fleet.battery_left_s` tells how long batteries last, `fleet.home_s` how long the way home takes, and
`ctx.cost_pct(intent)` what an intent takes: by what a `[[class]]` says about capacity and power, corrected in flight by
what was used; without it by the use alone.
`cells_of(task)` are the cells of the zone that can be seen; coverage and idleness count these and no others. Their
`centres_m()` are places (k, 2); `ideal_s(*sweep_of_task(task, n))` and `bound_s(...)` are those of n vehicles.

**Units and frames.** Positions are ENU metres about the scenario's origin: x east, y north, z above the vehicles'
homes. Speeds are m/s over ground. Times are seconds of the station's clock, of which only differences mean something.
Unknown numbers are NaN.

**Life cycle.** Each team has its own planner in a process of its own. It may hang, crash or be killed: vehicles are
safe without it. The station calls, in this order:

1. `configure(task, params, rng)`, once per task (team, zone, round or parameters changed: a new object, a new task).
   It may take up to 20 s; the plan before flies on meanwhile. A `raise ValueError("why")` in your code refuses the
   task; one that comes out of a library counts as a mistake, like any other exception.
2. `start(t_s, fleet)`, or `restore(data)` with what `snapshot` gave if this planner replaces one that died.
3. `step(ctx)`, `rate_hz` times a second, 1 to 20; before it `event(event)` for every change since the last step.
4. `stop(reason)`.

`step` is a pure function of the planner's state and `ctx`, which holds time, fleet, tracks, wind and random numbers. A
planner never reads a clock, never uses an unseeded generator, opens no files and starts no threads. Then a flight can
be replayed bit by bit, and a rehearsal predicts it. `fleet` is ordered by id, but nothing should depend on which id a
vehicle has (where an operator gives orders by number, declare `ids_matter = True`). Any vehicle may be lost, be held or
join between two steps: what `fleet` shows counts, events only announce it. A team may have 0 vehicles.

**Per vehicle.** With `instances = "per_vehicle"` each vehicle has its own instance, with `task.vehicle` and its own
`rng`. Its `fleet` holds the vehicle itself (`fleet.own`) and the neighbours that it hears: as they were `age_s` ago,
gone 3 s after they were heard last. Its `tracks` are targets that its own sensors detect, its events its own, and
intents count for itself only. `ctx.send(vehicle, payload)` and `ctx.broadcast(payload)` send what msgspec can encode;
`ctx.messages` holds what has arrived (`sender`, `sent_s`, `payload`), in the next step at the soonest. The scenario's
`[communication]` gives `range_m`, `loss`, `delay_s`, `rate_hz` (messages of a vehicle) and `message_bytes`; what is too
large, too often or to a vehicle that is not in the team is dropped and counted. Write for `fleet.own`, and the same
file runs both ways: `instances = "per_team"` in a scenario's `[[team]]` runs it once for all (all are `own`, nothing is
sent). A published metric is the mean of the instances. An instance that fails twice holds its own vehicle only; 0.8 s
of CPU time in one step is a failure. All instances run on the ground, in one worker: share nothing but messages.

**Intents.** An `Intent` is what a planner wants of one vehicle; it holds until the next one for this vehicle:

* `hold`: stop here.
* `goto`: fly straight to `position_m`, no faster than `speed_m_s`, and stay.
* `velocity`: fly with `velocity_m_s` for `valid_s` (30 at most) from the time of the frame, then brake.
* `trajectory`: be at `positions_m[k]` with `velocities_m_s[k]` at `t0_s + k * dt_s`; after the last sample stay there.
  This is the most exact kind: send 2 to 5 s with every step, 600 samples at most. Delays of vehicles are compensated.
* `orbit`: circle round `position_m` with `radius_m` at `speed_m_s`; a repeated orbit continues where it is.
* `return`: fly home and land; only the operator starts the vehicle again.

Only `active` vehicles take intents. Stay within `task.limits` (the vertical speed is part of the speed; at most 3 m/s
up and 1.5 m/s down), and keep a reserve for catching up: plan with 0.95 of the speed and 0.9 of the acceleration. Keep
each vehicle on `fleet.layer_m` unless there is a reason. Numpy arrays and scalars are accepted like tuples and numbers.

**The guard** stands behind every planner. It passes or vetoes, and does nothing else: operating area and no-fly zones
with their margins, altitude band, speed, and closest approach in the next seconds. A vetoed vehicle brakes and holds
until an intent passes; the operator sees the reason. It is a wall, not a tool: plan so that it never vetoes.

**Separation.** On their layers vehicles may cross each other's ways: a scenario's layers are at least the vertical
limit apart. Where vehicles share a height, `avoid(position_m, velocity_m_s, wanted_m_s, task.limits)` changes the
velocities (n, 3) wanted for the next step so that all vehicles keep apart. Use it for `velocity` intents, in every
step, each valid for two steps (`valid_s`): the guard checks where a velocity leads for as long as it is valid. Pass all
vehicles of `ctx.fleet` with a finite position, lost and held ones too (wanted velocity 0), and use the rows of active
ones. Keep farther from lost vehicles: for the guard one may be anywhere that it can have reached since.

`ctx.keep_out` holds the volumes where lost vehicles may be by then (`vehicle`, `begin_m`, `end_m`, `radius_m`, `low_m`,
`high_m`), also on their way home and down. `at_heights(ctx.keep_out, layers_m)` are those that vehicles on these layers
would meet, `as_no_fly` makes them zones to fly round. Each comes with its full size and stays until it is over.

**Time.** A step may take `ctx.deadline_s`. After three steps in a row longer than the period, or 2 s without a plan,
the vehicles hold, the operator is notified, and the process is killed and started again. A rehearsal waits for every
step; there three in a row that take more than 2 s of CPU time are a failure. So divide long work into `iterations`:
declare `iterations_per_s`, do `ctx.iterations` of them in each step (granted by mission time, the same in a rehearsal
as in flight; fewer in flight while the computer is so busy that steps come late), and adopt their results at the
beginning of a step.

**Failure.** When a step raises, its traceback is shown and the planner is restarted once from its last snapshot. After
the second time it stays stopped until the operator changes something, and its vehicles hold. `snapshot` is called every
2 s: bytes, 1 MB at most, complete. `restore` of them on a newly configured object must give the same plans, bit by bit;
the state of `rng` and of the events is kept for you. b"" means: start anew.

**Display.** `Output.metrics` are numbers by name. `Output.annotations` are drawn on the map: `Annotation(kind,
points_m, text)`, kind polyline, polygon, marker or text, points (x, y). `Intent.slot` (a text) names a vehicle's place,
`joined` marks that it is there (for a `hold`: that it is to wait there), `reason` explains the intent. `Output.notes`
are short texts that the operator reads as events, five in a step at most. A preview of an edit shows the metrics of the
first step: put expected values there, as `predicted_…`. A rehearsal measures a round from the time when all vehicles
have `joined` and the zone was seen whole. A planner that flies from one place to the next sets `joined` with every
`goto`, without a `slot`: then a vehicle counts wherever it is. With the metric `period_s`, the time of one round trip
of a tour, the measurement waits until each of n vehicles has flown 2 n-ths of it.

**Judgement.** Every flight is judged by containment, separation and vetoes. `judged_by` adds what the planner is for:
"idleness" (every place is seen again and again), "coverage" (the zone is seen whole once), "intruders" (they are met
before the zone), "tasks" (points of interest are visited), or nothing ("metrics"). `metrics` declares numbers of
`Output.metrics` by which it is judged, too:

    metrics = (Metric("reward", "points", better="higher", gate=10.0, of="last", help="of all visits"),)

`of` says which value of a round is compared with the gate: its "last", its "worst" or its "mean". A scenario may set
other gates: `[results.metrics]` with `reward_min = 20.0`, or `reward_max`. A gate whose metric is never published, or
is NaN, fails. All metrics are kept over time in results, reports and the journal.

**Points of interest** (`ctx.points`) are tasks from outside: places with a priority and perhaps a deadline. They come
and go while the planner flies. One is done when a vehicle of the team has had it within its footprint.

**Tracks** (`ctx.tracks`) are targets where sensors detect them, also outside the operating area, where you must not
follow.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tui_gcs.core.geometry.idleness_bounds import ideal_idleness_s
from tui_gcs.core.geometry.idleness_grid import IdlenessGrid, cell_centres_m
from tui_gcs.core.geometry.zone_cells import ZoneCells, permitted_region, reachable_cells
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Shape, Zone, area_m2, polygon_of
from tui_gcs.core.protocol.common import Annotation, Intent, KeepOut, ParamInfo, ParamValue, PlannerTask
from tui_gcs.core.protocol.planning import JudgedBy, Metric, cells_of, sweep_of_task
from tui_gcs.core.scenario.model import (
    Communication,
    DensityPeak,
    Instances,
    Limits,
    MovingObstacle,
    OperatingArea,
    VehicleClass,
)
from tui_gcs.planner.avoidance import avoid
from tui_gcs.planner.energy_cost import Energy
from tui_gcs.planner.keep_clear import as_no_fly, at_heights
from tui_gcs.planner.radio import Radio, Received
from tui_gcs.planner.surroundings import Obstacles, density_at, obstacles_at

__all__ = [
    "API_VERSION",
    "LOW_BATTERY_PCT",
    "Annotation",
    "Circle",
    "Communication",
    "Context",
    "DensityPeak",
    "Event",
    "Fleet",
    "IdlenessGrid",
    "Instances",
    "Intent",
    "JudgedBy",
    "KeepOut",
    "Limits",
    "Metric",
    "MovingObstacle",
    "Obstacles",
    "OperatingArea",
    "Output",
    "Param",
    "ParamValue",
    "Planner",
    "PlannerTask",
    "Points",
    "Polygon",
    "Radio",
    "Received",
    "Rectangle",
    "Role",
    "Shape",
    "Tracks",
    "VehicleClass",
    "Zone",
    "ZoneCells",
    "area_m2",
    "as_no_fly",
    "at_heights",
    "avoid",
    "cell_centres_m",
    "cells_of",
    "density_at",
    "ideal_idleness_s",
    "permitted_region",
    "polygon_of",
    "reachable_cells",
    "sweep_bound_s",
    "sweep_of_task",
]

sweep_bound_s = ideal_idleness_s
"""The former name of `ideal_idleness_s`, which is no bound; planners that were written for it still run."""

API_VERSION = 2


@dataclass(frozen=True)
class Param:
    """A declared parameter. The plan screen draws its form from it."""

    name: str
    type: type
    default: ParamValue
    minimum: float | None = None
    maximum: float | None = None
    unit: str = ""
    help: str = ""
    choices: tuple[str, ...] = ()

    def info(self) -> ParamInfo:
        """Return the declaration as a bus message."""
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
        """Return why `value` is not allowed, or "" if it is."""
        return self.info().problem(value)


@dataclass(frozen=True)
class Fleet:
    """The team as struct of arrays of n vehicles, ordered by id, read only."""

    id: NDArray[np.int64]
    """(n,) system ids of the vehicles, ascending."""
    active: NDArray[np.bool_]
    """(n,) True: airborne and following this planner. Only active vehicles may get intents."""
    position_m: NDArray[np.float64]
    """(n, 3) ENU; NaN while it was never known."""
    velocity_m_s: NDArray[np.float64]
    """(n, 3) ENU over ground."""
    heading_deg: NDArray[np.float64]
    age_s: NDArray[np.float64]
    """(n,) age of the position."""
    layer_m: NDArray[np.float64]
    """(n,) each vehicle's own altitude layer."""
    battery_pct: NDArray[np.float64]
    """(n,) remaining charge; NaN when unknown."""
    held: NDArray[np.bool_]
    """(n,) True: airborne but held by the operator or because its planner was silent; it may become active again."""
    own: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    """(n,) True: this planner instance commands it. All of the team, or the one vehicle that it runs on."""
    speed_m_s: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """(n,) speed limit of each vehicle, by its class."""
    accel_m_s2: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """(n,) acceleration limit of each vehicle."""
    footprint_radius_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """(n,) radius of what each vehicle sees."""
    battery_left_s: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """(n,) flight time until each battery is empty, in hover or at the speed limit, where it uses more; NaN: unknown,
    as it is of other vehicles where there is one instance on each."""
    home_s: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """(n,) how long each vehicle's way home and landing take; NaN while it is unknown, as `battery_left_s`."""


@dataclass(frozen=True)
class Tracks:
    """Detected targets as struct of arrays of k targets, ordered by id, read only."""

    id: NDArray[np.int64]
    position_m: NDArray[np.float64]
    """(k, 3) ENU, extrapolated to the time of the step."""
    velocity_m_s: NDArray[np.float64]
    """(k, 3) velocities over ground, ENU m/s."""
    sigma_m: NDArray[np.float64]
    """(k,) standard deviation of the position along its worse axis."""
    age_s: NDArray[np.float64]
    """(k,) time since the last detection."""
    confirmed: NDArray[np.bool_]
    seen_by: tuple[tuple[int, ...], ...]
    """Vehicles that detected each target within the last seconds."""


@dataclass(frozen=True)
class Points:
    """Open tasks from outside as struct of arrays of k points of interest, in the order in which they came; read only.

    A point is done when a vehicle of the team has it within its footprint; the station sees that, and takes it away.
    """

    name: tuple[str, ...] = ()
    position_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    """(k, 2) ENU."""
    priority: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """(k,) above 0; a larger one matters more."""
    left_s: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """(k,) time until the deadline; infinite without one."""


@dataclass(frozen=True)
class Event:
    """A change since the step before; it is delivered before the step that sees it."""

    kind: Literal["joined", "lost", "held", "returned", "low battery", "resumed"]
    """joined: became active. lost: no frames are received, or its position is unknown. held: see `Fleet.held`. resumed:
    active again after it was held. returned: flies home, has landed or is flown by another pilot. low battery: under
    `LOW_BATTERY_PCT`, once a flight. States at the start are no events, except low batteries."""
    t_s: float
    vehicle: int


LOW_BATTERY_PCT = 25.0
"""Charge under which the event "low battery" is sent."""


@dataclass(frozen=True)
class Context:
    """What a step may use."""

    t_s: float
    """Time of the fleet view in seconds; only differences mean something."""
    fleet: Fleet
    rng: np.random.Generator
    """Random generator, seeded by the host."""
    iterations: int
    """Units of background work granted for this step (`Planner.iterations_per_s` of mission time)."""
    deadline_s: float
    """Advisory: seconds that this step may take."""
    tracks: Tracks
    """Targets that the vehicles' sensors have detected."""
    wind_m_s: tuple[float, float] | None = None
    """Velocity of the air (east, north); None while it is unknown."""
    task: PlannerTask | None = None
    points: Points = Points()
    """Points of interest that this team is to visit, given by the scenario, an operator or another program."""
    keep_out: tuple[KeepOut, ...] = ()
    """Where lost vehicles may be, of all teams, for as long as they may be there."""
    messages: tuple[Received, ...] = ()
    """What other vehicles' instances have sent to this one since the step before, ordered by time and sender."""
    radio: Radio | None = None

    def send(self, vehicle: int, payload: object) -> bool:
        """Send a message to another vehicle's instance. False: it was dropped, which is counted and shown.

        True does not mean that it arrives. With one instance for the team there is no other one, and nothing is sent.

        Raises:
            TypeError: msgspec cannot encode the payload.
        """
        return self.radio is not None and self.radio.send(int(vehicle), payload)

    def broadcast(self, payload: object) -> bool:
        """Send a message to every vehicle within range. As `send`."""
        return self.radio is not None and self.radio.send(0, payload)

    def cost_pct(self, intent: Intent, duration_s: float | None = None) -> float:
        """Return which share of its battery, in percent, a vehicle uses to do this intent; NaN while it is unknown.

        `duration_s` is how long the intent is to hold. Without it, it holds until its end: the place of a `goto`, the
        last sample of a `trajectory`, the landing of a `return`.

        Raises:
            ValueError: the vehicle is not in `fleet`, or the intent has no end and no duration was given.
        """
        fleet, rows = self.fleet, np.flatnonzero(self.fleet.id == intent.vehicle)
        if self.task is None or not len(rows):
            raise ValueError(f"vehicle {intent.vehicle} is not in the fleet")
        row = int(rows[0])
        battery = (float(column[row]) for column in (fleet.battery_pct, fleet.battery_left_s, fleet.home_s))
        energy = Energy(self.task.class_of(intent.vehicle), *battery)
        return energy.cost_pct(intent, fleet.position_m[row], self.t_s, duration_s)

    def density(self, xy_m: ArrayLike) -> NDArray[np.float64]:
        """Return (k,) the importance of places (k, 2) now, by the scenario's density map; 1 everywhere without one."""
        return density_at(self.task.density if self.task is not None else (), xy_m, self.t_s)

    @property
    def obstacles(self) -> Obstacles:
        """The scenario's moving obstacles now. The guard does not know them: keep away yourself."""
        return obstacles_at(self.task.obstacles if self.task is not None else (), self.t_s)


@dataclass
class Output:
    """What one step of a planner returns."""

    intents: list[Intent] = field(default_factory=list)
    annotations: list[Annotation] | None = None
    """None keeps the annotations before."""
    metrics: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    """Texts for the operator, each logged once as an event; the same text again after a minute at the soonest."""


class Planner:
    """Base class of planners. Override what you need; the top of this file describes what is called when."""

    name: ClassVar[str] = ""
    """The name in scenarios: letters, digits, `_` and `-`."""
    version: ClassVar[str] = "1"
    """Change it when older snapshots can no longer be restored."""
    params: ClassVar[tuple[Param, ...]] = ()
    """Parameters of the plan screen's form; values are checked before `configure` gets them."""
    rate_hz: ClassVar[float] = 5.0
    """Steps a second, 1 to 20. Fleet frames come at 10 Hz, or at 20 Hz if a planner needs it."""
    iterations_per_s: ClassVar[float] = 0.0
    """Units of background work granted per second of mission time."""
    metrics: ClassVar[tuple[Metric, ...]] = ()
    """Numbers of `Output.metrics` by which its flights are judged; others may be published, too."""
    judged_by: ClassVar[JudgedBy] = "metrics"
    """What its flights are judged by, beside its metrics."""
    instances: ClassVar[Instances] = "per_team"
    """per_team: one instance for the team. per_vehicle: one on each vehicle, with what this vehicle knows."""
    message_type: ClassVar[Any] = Any
    """Type of the payloads that instances send each other, as `msgspec.msgpack.decode` takes it; others are dropped."""
    ids_matter: ClassVar[bool] = False
    """True: what a vehicle flies depends on its id on purpose, because an operator gives orders by number."""

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        """Take zone, limits and all parameters, validated. `rng` is the generator that `Context.rng` is, too.

        Raises:
            ValueError: this task cannot be done; the operator reads the text.
        """
        self.task = task

    def learnt(self) -> bytes:
        """Return what is still true in another zone, of vehicles or of the air; b"" for nothing.

        It is kept for the next task, also when this process or the station dies (16 kB at most).
        """
        return b""

    def inherit(self, learnt: bytes) -> None:
        """Take what the planner of the task before has `learnt`; it had the same name and version.

        This is called after `configure`, and not if the planner is restored. Raise an error for damaged data: then the
        planner is configured anew without it.
        """

    def start(self, t_s: float, fleet: Fleet) -> None:
        """Prepare for the first step, which follows."""

    def step(self, ctx: Context) -> Output:
        """Return intents for active vehicles."""
        raise NotImplementedError

    def event(self, event: Event) -> None:
        """Take note of a change. The step that follows sees it in the fleet, too, so this is optional."""

    def ahead(self, go_on: Callable[[], bool]) -> None:
        """Do background work before it is granted, while `go_on()` is true; steps adopt what they are granted.

        A rehearsal calls this after `configure` on a thread, while the round before is flown, but not for planners in
        files. Such a planner must not use the task's time and revision, which are not known yet.
        """

    def stop(self, reason: str) -> None:
        """Clean up; no step follows."""

    def snapshot(self) -> bytes:
        """Return everything that `restore` needs so that this planner continues; b"" to start anew instead."""
        return b""

    def restore(self, data: bytes) -> None:
        """Take over what `snapshot` of the same version gave for the same task. Called after `configure`."""
