"""What the author of a planner imports. Small and stable.

A planner is one class in one file:

    class Circle(Planner):
        name = "circle"
        params = (Param("speed_m_s", float, 5.0, minimum=1.0, maximum=8.0, unit="m/s", help="ground speed"),)

        def step(self, ctx):
            return Output(intents=[...])

`step` is a pure function of the planner's state and `ctx`: time, fleet and random numbers come with it, a
planner asks for none of them. Positions are ENU metres about the scenario origin, z above home.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from tui_gcs.core.idleness import cell_centres_m, sweep_bound_s
from tui_gcs.core.messages import Annotation, Intent, ParamInfo, ParamValue, PlannerTask
from tui_gcs.core.scenario import Limits, OperatingArea
from tui_gcs.core.zones import Circle, Polygon, Rectangle, Role, Shape, Zone, area_m2, polygon_of

__all__ = [
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
    """(n,) True: airborne but held by the operator or the guard; it may become active again where it is."""


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
    """joined: became active. lost: nothing is heard of it. held: holds, by operator or guard. returned: flies home or
    is taken out. low battery: under `LOW_BATTERY_PCT`. resumed: active again after it was held."""
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


class Planner:
    """Base class. `configure` may be slow; `step` is called `rate_hz` times a second."""

    name: ClassVar[str] = ""
    version: ClassVar[str] = "1"
    params: ClassVar[tuple[Param, ...]] = ()
    rate_hz: ClassVar[float] = 5.0
    iterations_per_s: ClassVar[float] = 0.0

    def configure(self, task: PlannerTask, params: Mapping[str, ParamValue], rng: np.random.Generator) -> None:
        """Take zone, limits and validated parameters. Called before `start` and again for each new task revision."""
        self.task = task

    def start(self, t_s: float, fleet: Fleet) -> None:
        """The first step follows."""

    def step(self, ctx: Context) -> Output:
        """Intents for active vehicles."""
        raise NotImplementedError

    def event(self, event: Event) -> None:
        """Something changed; the step that follows sees it, too, so that nobody must listen."""

    def stop(self, reason: str) -> None:
        """No more steps."""

    def snapshot(self) -> bytes:
        """State for `restore`, so that a restarted worker goes on where this one was."""
        return b""

    def restore(self, data: bytes) -> None:
        """Take over a snapshot of the same version."""
