"""The scenario: rounds, zones, teams, take-off places and limits. One TOML file is one `Scenario` value."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from tui_gcs.core.geometry.idleness_bounds import Sweep, sweep_of
from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.geometry.loops import Loop
from tui_gcs.core.geometry.zone_cells import ZoneCells, reachable_cells
from tui_gcs.core.geometry.zones import Role, Shape, Zone


class Limits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The limits that no vehicle may exceed and that the guard enforces. The ranges are those of the file format."""

    speed_m_s: Annotated[float, Meta(gt=0, le=100)] = 8.0
    accel_m_s2: Annotated[float, Meta(gt=0, le=100)] = 2.5
    separation_horizontal_m: Annotated[float, Meta(ge=0, le=1000)] = 10.0
    separation_vertical_m: Annotated[float, Meta(ge=0, le=1000)] = 5.0
    geofence_margin_m: Annotated[float, Meta(ge=0, le=1000)] = 5.0
    home_spread_m: Annotated[float, Meta(ge=0, le=1000)] = 3.0
    """How much the heights of the vehicles' homes may differ. Heights are above each vehicle's own home, and GPS
    heights alone differ by metres."""


Instances = Literal["per_team", "per_vehicle"]
"""per_team: one planner instance sees and commands the team. per_vehicle: each vehicle has its own instance."""


class Communication(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How instances of a planner that runs per vehicle hear each other. The defaults are a radio without faults."""

    range_m: Annotated[float, Meta(ge=0, le=100_000)] = 100_000.0
    """The greatest distance between two vehicles that hear each other; with 0 no vehicle hears another one."""
    loss: Annotated[float, Meta(ge=0, le=1)] = 0.0
    """The share of messages that are lost, drawn for each receiver."""
    delay_s: Annotated[float, Meta(ge=0, le=10)] = 0.0
    rate_hz: Annotated[float, Meta(gt=0, le=100)] = 20.0
    """How many messages a vehicle may send per second; a broadcast counts once."""
    message_bytes: Annotated[float, Meta(gt=0, le=100_000)] = 1000.0
    """The largest message, as it is encoded."""


class PowerModel(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a full battery of a vehicle holds, and what flying takes of it."""

    capacity_wh: float
    hover_w: float
    cruise_w: float
    """At the class's speed limit."""


class VehicleClass(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What vehicles of one kind can do: never more than the scenario's limits and footprint."""

    name: str
    vehicles: tuple[int, ...]
    """Ids of the vehicles of this class."""
    speed_m_s: float
    accel_m_s2: float
    footprint_radius_m: float
    power: PowerModel | None = None
    """None: how long a battery lasts is known from its use in flight only."""


class ResultLimits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The gates that a run must pass to be called good. The ranges are those of the file format."""

    worst_ratio_max: Annotated[float, Meta(gt=0, le=1000)] = 2.0
    coverage_min: Annotated[float, Meta(ge=0, le=1)] = 1.0
    on_slot_max_s: Annotated[float, Meta(gt=0, le=86_400)] = 120.0
    measured_s: Annotated[float, Meta(gt=0, le=86_400)] = 180.0
    landing_error_max_m: Annotated[float, Meta(gt=0, le=1000)] = 10.0
    slot_error_max_m: Annotated[float, Meta(gt=0, le=1000)] = 2.0
    """The greatest distance of a vehicle from its slot in the measured time."""
    slot_lag_max_s: Annotated[float, Meta(gt=0, le=60)] = 0.5
    """The greatest time by which a vehicle may be ahead of its slot or behind it in the measured time."""
    cover_ratio_max: Annotated[float, Meta(gt=0, le=1000)] = 3.0
    """Of planners that see a zone once: the time until all of it was seen, over the least time that it can take."""
    intruders_met_min: Annotated[float, Meta(ge=0, le=1)] = 0.75
    """Of planners that meet intruders: the share of all that came which were met before they were in the zone."""
    tasks_done_min: Annotated[float, Meta(ge=0, le=1)] = 1.0
    """Of planners that visit points of interest: the share of them that was visited in time."""
    metrics: dict[str, float] = {}
    """Gates of planners' own metrics: a metric's name with `_min` or `_max`, and the worst value that passes."""


class OperatingArea(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The region in which a round is flown: a shape and an altitude band in metres above ground."""

    shape: Shape
    alt_min_m: float
    alt_max_m: float


def band_m(zone: Zone, area: OperatingArea) -> tuple[float, float]:
    """Return the lowest and highest altitude for `zone`: its own limits, else those of the operating area."""
    low = area.alt_min_m if zone.alt_min_m is None else zone.alt_min_m
    high = area.alt_max_m if zone.alt_max_m is None else zone.alt_max_m
    return low, high


class DensityPeak(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One Gaussian of a density map: how important places are to planners that cover by importance."""

    sigma_m: float
    weight: float
    """Height at the centre."""
    loop: Loop
    """Where the centre is, or the way that it moves on."""


class MovingObstacle(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A disc that planners keep away from. Planners are informed of it; the guard does not know it."""

    name: str
    radius_m: float
    loop: Loop


class Round(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A round of the mission: a named set of zones and the operating area around them."""

    name: str
    duration_s: float
    area: OperatingArea
    zones: tuple[Zone, ...]
    density: tuple[DensityPeak, ...] = ()
    """The density map: the sum of these peaks. Empty: all places count the same."""
    obstacles: tuple[MovingObstacle, ...] = ()

    @property
    def no_fly(self) -> tuple[Zone, ...]:
        """The zones of this round that no vehicle may enter."""
        return tuple(zone for zone in self.zones if zone.role is Role.NO_FLY)


class Team(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A team: its vehicles, the name of the zone that they serve in every round, and their planner.

    Either `vehicles` names system ids, or `count` takes the lowest free ids at the start and keeps them.
    """

    name: str
    zone: str
    planner: str
    vehicles: tuple[int, ...] = ()
    count: int = 0
    parameters: dict[str, float | int | bool | str] = {}
    instances: Instances | None = None
    """Whether the planner runs once for the team or once on each vehicle; None: as the planner declares."""

    @property
    def size(self) -> int:
        """The number of vehicles that the team asks for."""
        return len(self.vehicles) or self.count


class TakeOffPlace(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A place on the ground, and the altitude layer of the vehicle that takes off there.

    `vehicle` is a system id. Places without one are given in order to the vehicles that have no place of their own.
    Vehicles that cannot come near each other may share a layer. A file may leave `layer_m` out: `load` then finds one.
    """

    place_m: tuple[float, float]
    layer_m: float
    vehicle: int | None = None


class LinkLoss(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What happens when a link, a planner or the station is lost: the scenario's safe hold."""

    planner: Literal["hold"] = "hold"
    """What vehicles do whose planner has died."""
    vehicle: Literal["respace"] = "respace"
    """What the others of a team do when one of its vehicles is lost."""
    resume: bool = False
    """Whether a restarted station flies on without an operator's order."""


class BatteryLimits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """When a vehicle that flies for its planner returns and lands for its battery. The ranges are the file format's."""

    return_pct: Annotated[float, Meta(ge=0, le=90)] = 15.0
    """At this charge, percent, or less; 0: no vehicle returns for its battery. The default is where the alarm `battery
    CRITICAL` begins."""
    reserve_s: Annotated[float, Meta(ge=0, le=3600)] = 60.0
    """Earlier, where the present drain would leave less than this flight time after the way home and the landing."""

    @property
    def words(self) -> str:
        """What is done at a low battery, for the start."""
        if self.return_pct <= 0.0:
            return "nothing is done (return_pct is 0)"
        return f"returns at {self.return_pct:g} %, or with {self.reserve_s:g} s to spare"


class OperatorId(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What Remote ID broadcasts about the operator, and the serial numbers of aircraft. Empty fields are not sent."""

    operator_id: str = ""
    """The registration number of the operator, without its secret part."""
    lat_deg: float | None = None
    lon_deg: float | None = None
    """The place where the operator stands. Nothing checks whether it is still true later in the flight."""
    alt_m: float | None = None
    """The operator's height above the WGS-84 ellipsoid, not above mean sea level; None where it is unknown."""
    description: str = ""
    """A description of the flight."""
    uas_ids: dict[int, str] = {}
    """Serial numbers by vehicle, for vehicles that do not know their own."""


class ScenarioTask(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A task from outside: a point of interest that a vehicle is to have within its footprint."""

    name: str
    place_m: tuple[float, float]
    priority: float = 1.0
    deadline_s: float | None = None
    """Seconds from the beginning of the first round; None: at any time."""
    team: str = ""
    """The team that is to do it; "": any."""


class Scenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything that is known about one mission before it is flown. Built by `load`."""

    name: str
    seed: int
    origin: Origin
    footprint_radius_m: float
    limits: Limits
    results: ResultLimits
    link_loss: LinkLoss
    rounds: tuple[Round, ...]
    teams: tuple[Team, ...]
    places: tuple[TakeOffPlace, ...]
    communication: Communication = Communication()
    classes: tuple[VehicleClass, ...] = ()
    """Kinds of vehicles that differ from the rest of the fleet."""
    remote_id: OperatorId | None = None
    """None where the station sends no Remote ID of the operator."""
    battery: BatteryLimits = BatteryLimits()
    tasks: tuple[ScenarioTask, ...] = ()
    checklist: tuple[str, ...] = ()
    """What operators tick before each start, beside the checks of the station; each text stands once."""

    @property
    def vehicle_count(self) -> int:
        """The number of vehicles that all teams ask for together."""
        return sum(team.size for team in self.teams)

    @property
    def smallest_footprint_m(self) -> float:
        """The footprint of the vehicle that sees least: what no vehicle is to miss counts as seen by no more."""
        return min((kind.footprint_radius_m for kind in self.classes), default=self.footprint_radius_m)

    def class_of(self, vehicle: int) -> VehicleClass:
        """Return the vehicle's class; where it has none, one without a name with the scenario's limits."""
        for kind in self.classes:
            if vehicle in kind.vehicles:
                return kind
        return VehicleClass("", (), self.limits.speed_m_s, self.limits.accel_m_s2, self.footprint_radius_m)


def team_sweep(scenario: Scenario, team: Team, n: int | None = None) -> Sweep:
    """Return how `n` vehicles of a team, or all of it, sweep its zone: each with the speed of its class."""
    speeds_m_s = [scenario.class_of(vehicle).speed_m_s for vehicle in team.vehicles]
    speeds_m_s = speeds_m_s or [scenario.limits.speed_m_s] * team.count
    return sweep_of(speeds_m_s, team.size if n is None else n, scenario.smallest_footprint_m)


def zone_cells(scenario: Scenario, round_: Round, zone: Zone) -> ZoneCells:
    """Return the cells of a zone of `round_` that vehicles of the scenario can see: what all figures count."""
    margin_m = scenario.limits.geofence_margin_m
    return reachable_cells(zone.shape, round_.area.shape, round_.no_fly, margin_m, scenario.smallest_footprint_m)
