"""The scenario: rounds, zones, teams, take-off places and limits; one TOML file, one `Scenario` value."""

import msgspec

from tui_gcs.core.geometry.local_frame import Origin
from tui_gcs.core.geometry.zones import Role, Shape, Zone


class Limits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What no vehicle may exceed, and what the guard keeps."""

    speed_m_s: float = 8.0
    accel_m_s2: float = 2.5
    separation_horizontal_m: float = 10.0
    separation_vertical_m: float = 5.0
    geofence_margin_m: float = 5.0
    home_spread_m: float = 3.0
    """Heights are above each vehicle's own home: homes may differ by this much (GPS heights alone do, by metres)."""


class ResultLimits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a run must reach to be called good."""

    worst_ratio_max: float = 2.0
    coverage_min: float = 1.0
    on_slot_max_s: float = 120.0
    measured_s: float = 180.0
    landing_error_max_m: float = 10.0
    slot_error_max_m: float = 2.0
    """A fleet keeps its slots when in the measured time no vehicle is farther from its plan,"""
    slot_lag_max_s: float = 0.5
    """nor earlier or later."""


class OperatingArea(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where a round may be flown: a shape and an altitude band above ground."""

    shape: Shape
    alt_min_m: float
    alt_max_m: float


def band_m(zone: Zone, area: OperatingArea) -> tuple[float, float]:
    """The altitude band to serve `zone` in: its own, where it has none the operating area's."""
    low = area.alt_min_m if zone.alt_min_m is None else zone.alt_min_m
    high = area.alt_max_m if zone.alt_max_m is None else zone.alt_max_m
    return low, high


class Round(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A named set of zones and the operating area around them."""

    name: str
    duration_s: float
    area: OperatingArea
    zones: tuple[Zone, ...]

    @property
    def no_fly(self) -> tuple[Zone, ...]:
        """Its no-fly zones."""
        return tuple(zone for zone in self.zones if zone.role is Role.NO_FLY)


class Team(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Vehicles, the zone they serve (by name, in every round) and their planner.

    Either `vehicles` names system ids or `count` takes the lowest free ids at start and keeps them.
    """

    name: str
    zone: str
    planner: str
    vehicles: tuple[int, ...] = ()
    count: int = 0
    parameters: dict[str, float | int | bool | str] = {}

    @property
    def size(self) -> int:
        """How many vehicles it wants."""
        return len(self.vehicles) or self.count


class TakeOffPlace(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A spot on the ground and the altitude layer of the vehicle that starts there.

    `vehicle` is a system id, or None: then ids without a place of their own take the free places in order.
    """

    place_m: tuple[float, float]
    layer_m: float
    vehicle: int | None = None


class LinkLoss(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What happens when links, planners or the station are lost (the safe hold of the scenario)."""

    planner: str = "hold"
    vehicle: str = "respace"
    resume: bool = False


class OperatorId(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What Remote ID tells of the operator, and the numbers of the aircraft. What is empty is not sent."""

    operator_id: str = ""
    """As registered, without the secret part."""
    lat_deg: float | None = None
    lon_deg: float | None = None
    """Where the operator stands; nobody sees whether this is still so."""
    alt_m: float | None = None
    """Above the WGS-84 ellipsoid, not above mean sea level; None: unknown."""
    description: str = ""
    """Of the flight."""
    uas_ids: dict[int, str] = {}
    """Serial numbers by vehicle, of those that do not know their own."""


class Scenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything about one mission. Built by `load`; immutable."""

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
    remote_id: OperatorId | None = None
    """None: nothing is sent."""

    @property
    def vehicle_count(self) -> int:
        """How many vehicles all teams want together."""
        return sum(team.size for team in self.teams)
