"""Which vehicles would fly if the operator started now: by team, from the scenario and the vehicles present."""

from dataclasses import dataclass

from tui_gcs.core.protocol.common import FleetFrame, Freshness, StationStatus
from tui_gcs.core.scenario.model import Round, Scenario
from tui_gcs.feed.feed import Feed


@dataclass(frozen=True)
class TeamStart:
    """One team in the start dialog."""

    name: str
    role: str
    zone: str
    planner: str
    vehicles: tuple[int, ...]
    """Present and ready: these will fly."""
    not_ready: tuple[tuple[int, str], ...]
    """Present, but left out: (vehicle, reason)."""
    missing: tuple[int, ...]
    """Named in the scenario or counted, but not present; id 0 stands for a place without a vehicle."""


@dataclass(frozen=True)
class StartPlan:
    """What the start dialog asks about."""

    round_name: str
    teams: tuple[TeamStart, ...]

    @property
    def vehicles(self) -> tuple[int, ...]:
        """All vehicles that will fly, by id."""
        return tuple(sorted(vehicle for team in self.teams for vehicle in team.vehicles))


def start_plan(scenario: Scenario, status: StationStatus, frame: FleetFrame) -> StartPlan:
    """Return the vehicles of each team: those it names, else those the station gave it, else the lowest free ids."""
    heard = {row.id for row in frame.rows() if row.freshness is not Freshness.LOST}
    current = scenario.rounds[status.round_index] if status.round_index < len(scenario.rounds) else None
    given = {team.name: team.members for team in status.teams}
    # A vehicle that one team names is never counted into another.
    taken = {vehicle for team in scenario.teams for vehicle in team.vehicles or given.get(team.name, ())}
    free = [vehicle for vehicle in sorted(heard) if vehicle not in taken]
    teams = []
    for team in scenario.teams:
        members = team.vehicles or given.get(team.name, ())
        if not members:
            members, free = tuple(free[: team.count]), free[team.count :]
        present = [vehicle for vehicle in members if vehicle in heard]
        vehicles = tuple(vehicle for vehicle in present if vehicle not in status.not_ready)
        not_ready = tuple((vehicle, status.not_ready[vehicle]) for vehicle in present if vehicle in status.not_ready)
        missing = tuple(vehicle for vehicle in members if vehicle not in heard)
        missing += (0,) * (max(team.count, len(members)) - len(members))
        role = _role(current, team.zone)
        teams.append(TeamStart(team.name, role, team.zone, team.planner, vehicles, not_ready, missing))
    return StartPlan(current.name if current is not None else "", tuple(teams))


def _role(current: Round | None, zone: str) -> str:
    zones = current.zones if current is not None else ()
    return next((str(z.role) for z in zones if z.name == zone), "")


def fingerprint(feed: Feed) -> tuple[object, ...]:
    """Return a value that changes when a confirmation of the start is void."""
    frame, status = feed.frame, feed.status
    # Positions and figures are left out: they change with every frame, and nothing was asked about them.
    fleet = (frame.ids, frame.armed, frame.freshness) if frame is not None else ()
    station: tuple[object, ...] = ()
    if status is not None:
        links = tuple((link.name, link.up) for link in status.links)
        ready = tuple(sorted(status.not_ready))
        silent = tuple(sorted(status.if_silent.items()))
        station = (status.kind, status.run, status.round_index, status.revision, links, ready, silent)
    return (fleet, station, feed.station_lost, feed.requests.read_only)
