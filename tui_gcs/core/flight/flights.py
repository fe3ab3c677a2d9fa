"""What the station is doing with each vehicle: phase, step, layer, course; and the table of all flights."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.motion_prediction import MotionModel
from tui_gcs.core.guard.permission import STATION, Verdict
from tui_gcs.core.motion.course import Course, PositionTarget
from tui_gcs.core.motion.orbit import Orbit
from tui_gcs.core.motion.tracking_error import TrackingMonitor
from tui_gcs.core.protocol.common import NOWHERE, Phase, Vec3
from tui_gcs.core.scenario.model import Scenario, TakeOffPlace
from tui_gcs.core.scenario.vehicle_conflicts import Matrix, braking_limits, conflicts, groups, member

IN_THE_AIR = frozenset(
    {Phase.TAKEOFF, Phase.FLYING, Phase.HOLDING, Phase.BY_HAND, Phase.RETURNING, Phase.LANDING, Phase.TAKEN_OUT}
)
OWN_ACTIVITIES = {
    Phase.BY_HAND: "was flown by hand",
    Phase.RETURNING: "was returning",
    Phase.LANDING: "was landing",
    Phase.TAKEN_OUT: "was out of this station's hands",
}
"""What a vehicle does that is no flight for its team: a hold and a resume of all vehicles must not turn it into one."""
COLUMN_M = 6.0
"""Radius of the column above a take-off place in which neither the altitude band nor separation applies."""


class ArmingStep(Enum):
    """What a vehicle in `Phase.ARMING` waits for."""

    SET_MODE = "mode"
    """The mode in which it will be armed."""
    PREARM = "prearm"
    """Its own pre-arm checks."""
    PREARM_REASONS = "ask why"
    """The reasons why its pre-arm checks do not pass: it was asked for them."""
    ARM = "arm"
    """Armed, as its heartbeat will show."""
    TAKE_OFF = "take-off"
    """Off the ground."""
    MANUAL = "by hand"
    """A take-off for manual control; the request that began it runs its steps."""


class HoldStep(Enum):
    """Why a vehicle in `Phase.HOLDING` holds, where that decides what comes next."""

    READY = "ready"
    """It has reached its layer and waits for the others of its start."""
    START_CANCELLED = "cancelled"
    """Its start was interrupted before it left the ground."""
    TOUCHED_DOWN = "touched down"
    """The hold came when its landing had brought it down: it is disarmed, or disarms itself."""
    FOUND = "found"
    """It was in the air when this station began: nothing is sent to it until it is resumed or returned."""


class ReturnStep(Enum):
    """Where a vehicle in `Phase.RETURNING` is on its way home."""

    TO_LAYER = "layer"
    """It climbs or descends to the height at which it returns."""
    BYPASS = "aside"
    """On its way to a column beside a vehicle that is in its way."""
    TO_HOME = "home"
    """It flies along `Flight.route_m` at that height."""
    OVER_HOME = "over home"
    """Above its take-off place, waiting for its turn to land."""


class TakenOut(Enum):
    """Why a vehicle in `Phase.TAKEN_OUT` is not this station's to steer, if it is not LOST."""

    MODE_LEFT = "mode"
    """It left the mode in which this station steers it."""
    REPLACED = "replaced"
    """Another vehicle has its id: it is not taken back."""
    ON_BOARD = "on board"
    """It flies the mission it holds, because the operator asked for that."""
    OWN_MODE = "own mode"
    """It flies in a mode of its own that an operator ordered by name."""
    EMERGENCY = "emergency"
    """It fell, lay over or hit the ground: no order helps it, and its place is given to others."""
    MOTORS_STOPPED = "motors"
    """An operator has stopped its motors: it falls, and no finding about that changes its phase."""


@dataclass(frozen=True)
class Lost:
    """A vehicle in `Phase.TAKEN_OUT` that is LOST, silent about its position, or was found in the air."""

    before: Phase | None
    """The phase it was in; None: it was found in the air, and not brought there by this station."""


@dataclass(frozen=True)
class KeptOrder:
    """An order to a vehicle that could not be carried out at once, and will be as soon as it can."""

    what: str
    """"return", "land" or "hold"."""
    by: str
    by_name: bool
    """Whether the vehicle was named; an order to all leaves some vehicles to their pilots."""
    why: str
    """What was in its way when it was ordered."""


Step = ArmingStep | HoldStep | ReturnStep | TakenOut | Lost | None
"""Where a flight is within its phase."""


@dataclass
class Flight:
    """The part of one vehicle in the mission."""

    vehicle: int
    team: str
    layer_m: float
    phase: Phase = Phase.GROUND
    step: Step = None
    since_s: float = 0.0
    """When phase or step last changed."""
    group: int = 0
    """Vehicles of different groups never come near each other: none waits for one of another group."""
    home_m: Vec3 | None = None
    """Where it took off: it lands there."""
    course: Course | None = None
    manual_alt_m: float = math.nan
    """Height of a take-off for manual control; NaN: it takes off to its layer, for its planner."""
    route_m: list[tuple[float, float]] = field(default_factory=list)
    """Turning points of a return that are still ahead; the last one is above home."""
    next_setpoint_s: float = 0.0
    passed: Course | None = None
    """The course that the guard passed last, and when."""
    passed_s: float = -math.inf
    verdict: Verdict | None = None
    """The guard's verdict on that course: the permission of its set-points until it is judged again."""
    ordered_by: str = STATION
    """Who ordered what it does now, for the journal."""
    tracking: TrackingMonitor | None = None
    """How well it keeps to moving courses; None before the first."""
    lift_m: float = 0.0
    """How much higher than its layer it returns: its own height may be wrong, and the vehicle lower than it reports."""
    limited_m_s: float = math.nan
    """The speed limit sent to it on the way to its present place; NaN since it did something else."""
    slot: str = ""
    """Name of its place in the planner's formation or tour, empty without one."""
    joined: bool = False
    """Its planner reports that it has reached its slot."""
    waits: bool = False
    """Its planner has it wait in the air where it is, in reserve."""
    vetoed: str = ""
    """Why the guard vetoed its newest set-point; empty if it passed."""
    last_goal_m: Vec3 | None = None
    """Where a vehicle that was taken out was flying to: without a link it goes on to there."""
    stays: str = ""
    """Why a holding vehicle does not go on when all are resumed; empty if it does."""
    left_reason: str = ""
    """Why a vehicle that left its mode did so, in the words of its own status texts; empty if it gave no reason."""
    kept: KeptOrder | None = None
    """A return, landing or hold that waits until it can be carried out."""
    ordered_mode: int | None = None
    """The mode that an operator ordered by name last, until another order: it is no surprise."""
    held_by_station: bool = False
    """The station itself made it hold, no operator did: its own failsafe then takes precedence."""

    def enter(self, phase: Phase, now: float, step: Step = None) -> None:
        """Change phase; the course and what else belonged to the last phase end."""
        going = self.course.point_m if isinstance(self.course, PositionTarget) else None
        self.last_goal_m = going if phase is Phase.TAKEN_OUT else None
        self.phase, self.step, self.since_s = phase, step, now
        self.course, self.passed, self.verdict, self.limited_m_s = None, None, None, math.nan
        self.held_by_station, self.left_reason, self.ordered_mode = False, "", None
        if not isinstance(step, Lost):  # any other order takes the place of one that waits
            self.kept = None
        if self.tracking is not None:
            self.tracking.pause()
        if phase not in (Phase.ARMING, Phase.TAKEOFF):
            self.manual_alt_m = math.nan
        if phase not in (Phase.HOLDING, Phase.TAKEN_OUT):
            self.stays = ""
        if phase is not Phase.FLYING:
            self.slot, self.joined, self.waits, self.vetoed = "", False, False, ""

    @property
    def home_layer_m(self) -> float:
        """The height at which it returns."""
        return self.layer_m + self.lift_m

    @property
    def roams(self) -> bool:
        """Whether its planner sends it from place to place: it is then on no slot that it could miss."""
        return self.joined and not self.slot and isinstance(self.course, PositionTarget)

    def go_to_step(self, step: Step, now: float) -> None:
        """Begin the next step of the same phase."""
        self.step, self.since_s = step, now

    @property
    def goal(self) -> tuple[Vec3, float]:
        """Where its course leads, and the radius of the circle it flies there (0 for none); NaN without a place."""
        if isinstance(self.course, PositionTarget):
            return self.course.point_m, 0.0
        return (self.course.centre_m, self.course.radius_m) if isinstance(self.course, Orbit) else (NOWHERE, 0.0)

    def own_activity(self) -> str:
        """What it does, or did when it was lost or stopped, that is no flight for its team; "" if it flew for that."""
        before = self.step.before if isinstance(self.step, Lost) else self.phase
        if before is None or before is Phase.HOLDING:
            return self.stays
        by_hand = self.step is ArmingStep.MANUAL or math.isfinite(self.manual_alt_m)
        return OWN_ACTIVITIES[Phase.BY_HAND] if by_hand else OWN_ACTIVITIES.get(before, "")

    def in_own_column(self, vehicle: Vehicle) -> bool:
        """Whether it climbs from, or lands at, its own take-off place: band and separation do not apply there."""
        climbs = self.phase is Phase.ARMING or (self.phase is Phase.TAKEOFF and self.course is None)
        if self.home_m is None or not (climbs or self.phase is Phase.LANDING):
            return False
        return math.dist(vehicle.telemetry.position_m[:2], self.home_m[:2]) <= COLUMN_M

    def motion(self) -> tuple[MotionModel, Course | None]:
        """What the vehicle is doing as far as the station knows.

        It follows the course that the guard passed last, as long as that is still its course; or it brakes, or it
        drifts.
        """
        if self.phase is Phase.RETURNING:
            # A returning vehicle's targets carry a stop reason instead of a verdict: its course counts as it is.
            return MotionModel.FOLLOWS, self.course  # never judged
        if self.phase is Phase.HOLDING:
            return MotionModel.STOPS, None
        if self.phase in (Phase.FLYING, Phase.BY_HAND) or (self.phase is Phase.TAKEOFF and self.course is not None):
            passed = self.passed if self.course is not None else None
            return (MotionModel.STOPS, None) if passed is None else (MotionModel.FOLLOWS, passed)
        return MotionModel.DRIFTS, None


@dataclass
class FlightTable:
    """The flights of all vehicles in a team, by vehicle id."""

    by_id: dict[int, Flight] = field(default_factory=dict)
    scenario: Scenario | None = None
    """The scenario that the teams were last put together for."""
    sent: set[int] = field(default_factory=set)
    """Vehicles of no team that this station sent on the mission they hold, until they land or are held."""

    def __iter__(self) -> Iterator[Flight]:
        """Iterate over the flights in order of vehicle id."""
        return iter([self.by_id[i] for i in sorted(self.by_id)])

    def get(self, vehicle: int) -> Flight | None:
        """The flight of `vehicle`, or None if it is in no team."""
        return self.by_id.get(vehicle)

    def home_m(self, vehicle: Vehicle) -> Vec3 | None:
        """Where the vehicle took off, or else the home that it reports; None if neither is known."""
        flight = self.by_id.get(vehicle.id)
        return (flight.home_m if flight is not None else None) or vehicle.telemetry.home_m

    def in_phase(self, *phases: Phase) -> list[Flight]:
        """Flights in one of `phases`, in order of vehicle id."""
        return [flight for flight in self if flight.phase in phases]

    def of_team(self, team: str) -> list[Flight]:
        """Flights of a team, in order of vehicle id."""
        # Each of 20 teams asks this many times a second: of all 250 only its own are sorted.
        return sorted([f for f in self.by_id.values() if f.team == team], key=lambda flight: flight.vehicle)

    def flying_for(self, team: str) -> list[Flight]:
        """Flights of a team that fly for its planner, in order of vehicle id."""
        return [flight for flight in self.of_team(team) if flight.phase is Phase.FLYING]

    def any_in_the_air(self) -> bool:
        """Whether any flight is arming or in the air."""
        return any(flight.phase in IN_THE_AIR or flight.phase is Phase.ARMING for flight in self)

    def members(self, team: str) -> tuple[int, ...]:
        """Vehicle ids of a team."""
        return tuple([flight.vehicle for flight in self.of_team(team)])

    def why_not_reassigned(self, now: Scenario, new: Scenario) -> str:
        """Why the teams cannot become those of `new` while a vehicle is in the air, or ""."""
        if [team.name for team in new.teams] != [team.name for team in now.teams]:
            return "teams cannot be added, removed or renamed in flight"
        if [team.count for team in new.teams] != [team.count for team in now.teams]:
            return "how many vehicles a team has cannot change in flight: name them"
        teams = self.teams_in_flight(new)
        for flight in self:
            if flight.vehicle not in teams and flight.phase is not Phase.GROUND:
                return f"vehicle {flight.vehicle} would be in no team, and is not on the ground"
        own = {place.vehicle for place in new.places}
        if strange := sorted(set(teams) - set(self.by_id) - own):
            return f"vehicle {strange[0]} has no take-off place of its own"
        return ""

    def reassign(self, scenario: Scenario) -> None:
        """Take over other teams in flight (see `why_not_reassigned`).

        Every vehicle keeps its layer, state and course.
        """
        own = {place.vehicle: place.layer_m for place in scenario.places}
        flights = {}
        for vehicle, team in self.teams_in_flight(scenario).items():
            flight = self.by_id.get(vehicle)
            if flight is None and vehicle in own:
                flight = Flight(vehicle, team, own[vehicle])
            if flight is not None:
                flight.team = team
                flights[vehicle] = flight
        self.by_id, self.scenario = flights, scenario
        self.group_by({})

    def teams_in_flight(self, scenario: Scenario) -> dict[int, str]:
        """The team of each vehicle under another scenario, in flight.

        Named vehicles go to the team that names them; those of a team by count stay in it.
        """
        counted = {team.name for team in scenario.teams if team.count}
        stay = {flight.vehicle: flight.team for flight in self if flight.team in counted}
        return stay | {vehicle: team.name for team in scenario.teams for vehicle in team.vehicles}

    def assign(self, scenario: Scenario, heard: list[int]) -> None:
        """Give every vehicle its team and layer; flights that exist keep their state.

        Teams that name vehicles have those, heard or not. Teams by count take the lowest free ids of `heard`.
        """
        teams = teams_of(scenario, heard)
        layers = {vehicle: place.layer_m for vehicle, place in places_of(scenario, sorted(teams)).items()}
        self.by_id = {
            vehicle: self.by_id.get(vehicle) or Flight(vehicle, team, layers[vehicle])
            for vehicle, team in teams.items()
            if vehicle in layers
        }
        for vehicle, flight in self.by_id.items():
            flight.team = teams[vehicle]
            flight.layer_m = layers[vehicle]
        self.scenario = scenario
        self.group_by({})

    def group_by(self, vehicles: Mapping[int, Vehicle]) -> None:
        """Put those that can come near each other into one group.

        A flight starts at its home, else where its vehicle stands, if it is among `vehicles`, else at its place.
        """
        if self.scenario is None:
            return
        near = self.conflicts(vehicles)
        for flight, group in zip(self, groups(near), strict=True):
            flight.group = group

    def conflicts(self, vehicles: Mapping[int, Vehicle]) -> Matrix:
        """Return (n, n), in order of vehicle id, which flights can come near each other (see `group_by`)."""
        scenario = self.scenario
        if scenario is None:
            return ~np.eye(len(self.by_id), dtype=bool)
        teams = {team.name: team for team in scenario.teams}
        places = places_of(scenario, sorted(self.by_id))
        crew = [
            member(
                [teams[flight.team]] if flight.team in teams else scenario.teams,
                self._start_m(flight, vehicles, places),
            )
            for flight in self
        ]
        return conflicts(scenario.rounds, braking_limits(scenario.limits, scenario.classes), tuple(crew))

    @staticmethod
    def _start_m(
        flight: Flight, vehicles: Mapping[int, Vehicle], places: Mapping[int, TakeOffPlace]
    ) -> tuple[float, float]:
        vehicle, place = vehicles.get(flight.vehicle), places.get(flight.vehicle)
        if flight.home_m is not None and flight.phase is not Phase.GROUND:
            return flight.home_m[0], flight.home_m[1]
        unknown = vehicle is None or not vehicle.telemetry.has_position()
        # At its place it counts as exactly there: its position is noisy, and conflicts are kept for the same places.
        if place is not None and (
            unknown or (vehicle is not None and math.dist(vehicle.telemetry.position_m[:2], place.place_m) <= COLUMN_M)
        ):
            return place.place_m
        x, y, _ = vehicle.telemetry.position_m if vehicle is not None else (0.0, 0.0, 0.0)
        return x, y


def teams_of(scenario: Scenario, heard: list[int]) -> dict[int, str]:
    """The team's name for each vehicle: those that teams name, and the lowest others of `heard` for teams by count."""
    teams = {vehicle: team.name for team in scenario.teams for vehicle in team.vehicles}
    free = [vehicle for vehicle in sorted(heard) if vehicle not in teams]
    for team in scenario.teams:
        taken, free = free[: team.count], free[team.count :]
        teams |= dict.fromkeys(taken, team.name)
    return teams


def places_of(scenario: Scenario, vehicles: list[int]) -> dict[int, TakeOffPlace]:
    """The take-off place of each vehicle.

    Places that name a vehicle are its own; the other places go to the remaining vehicles in order.
    """
    own = {place.vehicle: place for place in scenario.places if place.vehicle is not None}
    free = [place for place in scenario.places if place.vehicle is None]
    rest = [vehicle for vehicle in vehicles if vehicle not in own]
    return own | dict(zip(rest, free, strict=False))
