"""Makes a planner's task from a scenario: for flight, and for previews of what an edit would give. Pure functions."""

import math
from collections.abc import Collection, Mapping
from itertools import count, islice

import msgspec

from tui_gcs.core.flight.flights import places_of, teams_of
from tui_gcs.core.protocol.planning import PlannerTask
from tui_gcs.core.scenario.model import Round, Scenario, TakeOffPlace, Team

Crew = Mapping[int, TakeOffPlace]
"""The vehicles of one team: where each starts, and its layer."""


def task_of(
    scenario: Scenario, round_: Round, team: Team, layers_m: Mapping[int, float], members: tuple[int, ...]
) -> PlannerTask:
    """The task for these vehicles on these layers; revision and time are 0."""
    kinds = {vehicle: scenario.class_of(vehicle) for vehicle in members} if scenario.classes else {}
    # A planner that knows one speed plans with the slowest of its team; one that knows more has `fleet.speed_m_s`.
    limits = msgspec.structs.replace(
        scenario.limits,
        speed_m_s=min((kind.speed_m_s for kind in kinds.values()), default=scenario.limits.speed_m_s),
        accel_m_s2=min((kind.accel_m_s2 for kind in kinds.values()), default=scenario.limits.accel_m_s2),
    )
    return PlannerTask(
        team=team.name,
        revision=0,
        t_s=0.0,
        planner=team.planner,
        zone=next(zone for zone in round_.zones if zone.name == team.zone),
        area=round_.area,
        no_fly=round_.no_fly,
        limits=limits,
        footprint_radius_m=scenario.smallest_footprint_m,
        parameters=dict(team.parameters),
        seed=scenario.seed,
        members=members,
        layers_m=dict(layers_m),
        zones=round_.zones,
        instances=team.instances,
        communication=scenario.communication,
        classes=kinds,
        density=round_.density,
        obstacles=round_.obstacles,
    )


def within_own_speeds(task: PlannerTask, own_m_s: Mapping[int, float]) -> PlannerTask:
    """Return the task with the speeds that its members can fly: theirs is `own_m_s`, inf where it is not known."""
    classes = {
        vehicle: msgspec.structs.replace(kind, speed_m_s=min(kind.speed_m_s, own_m_s.get(vehicle, math.inf)))
        for vehicle, kind in task.classes.items()
    }
    slowest_m_s = min((own_m_s[vehicle] for vehicle in task.members if vehicle in own_m_s), default=math.inf)
    limits = msgspec.structs.replace(task.limits, speed_m_s=min(task.limits.speed_m_s, slowest_m_s))
    return msgspec.structs.replace(task, limits=limits, classes=classes)


def crewed(scenario: Scenario, round_: Round, team: Team, crew: Crew) -> PlannerTask:
    """The task of a team with the crew that the scenario gives it."""
    return task_of(scenario, round_, team, {v: place.layer_m for v, place in crew.items()}, tuple(crew))


def crews(scenario: Scenario, heard: Collection[int] = ()) -> dict[str, Crew]:
    """The crew of every team, by the team's name.

    Teams by count have vehicles that are heard, and where those do not suffice others with the lowest free ids.
    """
    named = {vehicle for team in scenario.teams for vehicle in team.vehicles}
    free = sorted(set(heard) - named)
    counted = sum(team.count for team in scenario.teams)
    more = islice((i for i in count(1) if i not in named and i not in free), max(0, counted - len(free)))
    team_of = teams_of(scenario, [*free, *more])
    places = places_of(scenario, sorted(team_of))
    found: dict[str, dict[int, TakeOffPlace]] = {team.name: {} for team in scenario.teams}
    for vehicle, name in team_of.items():
        if vehicle in places:
            found[name][vehicle] = places[vehicle]
    return dict(found)
