"""Makes a planner's task from a scenario: for flight, and for previews of what an edit would give. Pure functions."""

import math
from collections.abc import Collection, Mapping
from itertools import count, islice
from typing import TypeVar

import msgspec

from tui_gcs.core.firmware.own_limits import OwnLimits
from tui_gcs.core.flight.flights import places_of, teams_of
from tui_gcs.core.protocol.planning import PlannerTask
from tui_gcs.core.scenario.model import Limits, Round, Scenario, TakeOffPlace, Team, VehicleClass

_Asked = TypeVar("_Asked", Limits, VehicleClass)
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
        asked_m_s={vehicle: scenario.class_of(vehicle).speed_m_s for vehicle in members},
        density=round_.density,
        obstacles=round_.obstacles,
    )


def within_own_limits(task: PlannerTask, own: Mapping[int, OwnLimits]) -> PlannerTask:
    """Return the task with the speeds and accelerations that its members fly: `own` is what each flies at most."""
    classes = {
        vehicle: _within(kind, [own[vehicle]] if vehicle in own else []) for vehicle, kind in task.classes.items()
    }
    limits = _within(task.limits, [own[vehicle] for vehicle in task.members if vehicle in own])
    return msgspec.structs.replace(task, limits=limits, classes=classes)


def _within(asked: _Asked, own: list[OwnLimits]) -> _Asked:
    return msgspec.structs.replace(
        asked,
        speed_m_s=min(asked.speed_m_s, *(each.speed_m_s for each in own), math.inf),
        accel_m_s2=min(asked.accel_m_s2, *(each.accel_m_s2 for each in own), math.inf),
    )


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
