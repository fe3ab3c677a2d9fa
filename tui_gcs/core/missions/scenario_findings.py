"""Findings about a valid scenario and its previews: where zones lie, what teams can reach at best.

The plan screen and `tui-gcs check` show the same list. What cannot be flown at all is reported by `core/scenario/load`.
"""

import math
from math import isfinite
from typing import NamedTuple

import numpy as np
import shapely

from tui_gcs.core.firmware.own_limits import shipped_problems
from tui_gcs.core.geometry.idleness_bounds import gate_reference
from tui_gcs.core.geometry.zone_cells import part_for, permitted_parts
from tui_gcs.core.geometry.zones import Role, Zone, area_m2, polygon_of
from tui_gcs.core.missions.mission_findings import FindingLevel
from tui_gcs.core.protocol.alarms import id_ranges
from tui_gcs.core.protocol.common import PreviewResult
from tui_gcs.core.scenario.layer_assignment import layers_needed
from tui_gcs.core.scenario.model import OperatingArea, Round, Scenario, Team, band_m, team_sweep, zone_cells
from tui_gcs.core.scenario.vehicle_conflicts import (
    STAY_OVER_ZONE,
    Matrix,
    braking_limits,
    groups,
    place_conflicts,
    possible_teams,
)

HEIGHT_HELD_M = 0.5
"""How far vehicles are above or below their layer (barometers drift); two of them are off by twice that."""


class ScenarioFinding(NamedTuple):
    """One finding, and how it was computed."""

    level: FindingLevel
    text: str
    detail: str = ""
    is_ok: bool = False
    """The finding is that a zone or an area is as it should be."""


def _caution(text: str, detail: str = "") -> ScenarioFinding:
    return ScenarioFinding(FindingLevel.CAUTION, text, detail)


def _error(text: str, detail: str = "") -> ScenarioFinding:
    """A finding that no flight can go well with, whatever the planner does."""
    return ScenarioFinding(FindingLevel.ERROR, text, detail)


def _note(text: str, detail: str = "", *, is_ok: bool = False) -> ScenarioFinding:
    return ScenarioFinding(FindingLevel.NOTE, text, detail, is_ok)


def findings(scenario: Scenario) -> list[tuple[str, ScenarioFinding]]:
    """Return (round and zone or team, finding) for the whole scenario, in the order of the file."""
    found = [(scenario.name, layers_finding(scenario))]
    asked = scenario.limits
    found += [(scenario.name, _caution(each)) for each in shipped_problems(asked.speed_m_s, asked.accel_m_s2)]
    found += [(scenario.name, each) for each in [*classes_of_nobody(scenario), *unreachable_tasks(scenario)]]
    for round_ in scenario.rounds:
        found.append((round_.name, area_finding(round_)))
        for zone in round_.zones:
            where = f"{round_.name}, {zone.name}"
            found += [(where, zone_finding(zone, round_.area)), *((where, each) for each in unserved(scenario, zone))]
        for team in scenario.teams:
            found += [(f"{round_.name}, team {team.name}", each) for each in team_findings(scenario, round_, team)]
    return found


def classes_of_nobody(scenario: Scenario) -> list[ScenarioFinding]:
    """Find vehicles of classes that are in no team: a number was probably mistyped."""
    if any(team.count for team in scenario.teams):
        return []  # who is in a team by count is known at the start
    named = {vehicle for team in scenario.teams for vehicle in team.vehicles}
    strangers = {kind.name: sorted(set(kind.vehicles) - named) for kind in scenario.classes}
    return [_caution(f"class {name}: {id_ranges(ids)} in no team") for name, ids in strangers.items() if ids]


def unreachable_tasks(scenario: Scenario) -> list[ScenarioFinding]:
    """Find tasks that no vehicle can have within its footprint in the first round, in which they begin."""
    if not scenario.tasks:
        return []
    first = scenario.rounds[0]
    parts = permitted_parts(first.area.shape, first.no_fly, scenario.limits.geofence_margin_m)
    named = [vehicle for team in scenario.teams for vehicle in team.vehicles]
    seen_m = [scenario.class_of(vehicle).footprint_radius_m for vehicle in named]
    radius_m = max(seen_m, default=scenario.footprint_radius_m)
    found = []
    for task in scenario.tasks:
        away_m = min((part.distance(shapely.Point(task.place_m)) for part in parts), default=math.inf)
        if away_m > radius_m:
            text = f"task {task.name}: {away_m:.0f} m from where vehicles may fly, and they see {radius_m:g} m"
            found.append(_caution(text, "no vehicle can do it: move it, or the no-fly zones and the margin"))
        away_m = min((math.dist(place.place_m, task.place_m) for place in scenario.places), default=0.0)
        least_s = max(0.0, away_m - radius_m) / scenario.limits.speed_m_s
        if task.deadline_s is not None and least_s > task.deadline_s:
            way = f"the nearest take-off place is {least_s:.0f} s away"
            text = f"task {task.name}: {way}, its deadline {task.deadline_s:g} s"
            found.append(_caution(text, "no vehicle can do it in time: give it a later one"))
    return found


def _ways_to_zone_s(scenario: Scenario, zone: Zone, team: Team) -> dict[int, float]:
    """Return the least time from each vehicle's own take-off place until it sees a first bit of the zone."""
    outline, ways_s = polygon_of(zone.shape), {}
    for place in scenario.places:
        if place.vehicle is not None and place.vehicle in team.vehicles:
            away_m = shapely.Point(place.place_m).distance(outline) - scenario.footprint_radius_m
            ways_s[place.vehicle] = max(0.0, away_m) / scenario.class_of(place.vehicle).speed_m_s
    return ways_s


def unreachable_gates(scenario: Scenario, current: Round, zone: Zone, team: Team) -> list[ScenarioFinding]:
    """Find gates of `[results]` that no flight of this team can pass, whatever its planner plans."""
    gates, found = scenario.results, []
    cells, sweep = zone_cells(scenario, current, zone), team_sweep(scenario, team)
    ideal_s, bound_s = cells.ideal_s(*sweep), cells.bound_s(*sweep)
    allowed_s = gates.worst_ratio_max * gate_reference(ideal_s, bound_s)[0]
    if allowed_s < bound_s:
        text = f"{team.name}: worst_ratio_max {gates.worst_ratio_max:g} allows a worst idleness of {allowed_s:.1f} s"
        found.append(_caution(text, f"no plan is under {bound_s:.1f} s (bound): raise it in [results]"))
    # Only these planners have slots over the zone, and only in the first round do vehicles come from their places.
    ways_s = _ways_to_zone_s(scenario, zone, team)
    if team.planner in STAY_OVER_ZONE and current is scenario.rounds[0] and ways_s:
        # All must be on their slots; which vehicles wait in reserve is not known.
        vehicle = (min if team.parameters.get("reserve") else max)(ways_s, key=lambda each: ways_s[each])
        if ways_s[vehicle] > gates.on_slot_max_s:
            text = f"{team.name}: on_slot_max_s {gates.on_slot_max_s:g} is shorter than the way of vehicle {vehicle}"
            found.append(_caution(text, f"{ways_s[vehicle]:.0f} s to {zone.name} at its speed: raise it in [results]"))
    return found


def zone_finding(zone: Zone, area: OperatingArea) -> ScenarioFinding:
    """Return where a valid zone lies relative to the operating area."""
    outline, border = polygon_of(zone.shape), polygon_of(area.shape)
    if not border.covers(outline):
        text = f"ok: {area_m2(zone.shape):.0f} m2, reaches beyond the operating area"
        return _note(text, is_ok=True)
    to_edge_m = shapely.distance(outline, border.exterior)
    return _note(f"ok: {to_edge_m:.0f} m inside the operating area", is_ok=True)


def unserved(scenario: Scenario, zone: Zone) -> list[ScenarioFinding]:
    """Find a zone to defend or attack that no team serves: a team was probably forgotten."""
    if zone.role is Role.NO_FLY or any(team.zone == zone.name for team in scenario.teams):
        return []
    return [_caution(f"no team serves {zone.name}: no vehicle flies there")]


def area_finding(current: Round) -> ScenarioFinding:
    """Return size and number of zones of a valid operating area."""
    zones = len(current.zones)
    size_ha = area_m2(current.area.shape) / 1e4
    return _note(f"ok: {size_ha:.1f} ha around {zones} zone{'s' * (zones != 1)}", is_ok=True)


def team_findings(scenario: Scenario, current: Round, team: Team, times: str = "x") -> list[ScenarioFinding]:
    """Return what a team's vehicles can achieve in its zone at best."""
    zone = next((zone for zone in current.zones if zone.name == team.zone), None)
    vehicles = team.size
    if zone is None or zone.role is Role.NO_FLY or not vehicles:
        return []
    sweep = team_sweep(scenario, team)
    speed_m_s, radius_m = sweep.speed_m_s, sweep.footprint_radius_m
    cells = zone_cells(scenario, current, zone)
    size_m2 = cells.reachable_m2
    ideal_s, bound_s = cells.ideal_s(*sweep), cells.bound_s(*sweep)
    flown_km = speed_m_s * current.duration_s / 1000.0
    speed = f"{vehicles} {times} {speed_m_s:.3g} m/s {times} 2 {times} {radius_m:g} m"
    reckoned = f"worst idleness; ideal = {size_m2:.0f} m2 / ({speed})"
    found = [
        _note(f"{team.name}: ideal {ideal_s:.1f} s, bound {bound_s:.1f} s", reckoned),
        _note(f"{flown_km:.1f} km per vehicle in {current.duration_s:g} s"),
    ]
    found += [
        *(crowded(scenario, zone, team, size_m2) if cells.count else ()),
        *wrong_layers(scenario, current, zone, team),
    ]
    found += [*tight_layers(scenario, team), *cut_off(scenario, current, zone, team)]
    found += [_caution(f"{team.name}: {part.area_m2:.0f} m2 {part.why}", "never seen") for part in cells.unreachable]
    if not cells.count:
        found.append(_error(f"{team.name}: nothing of {zone.name} can be seen from where vehicles may fly"))
    found += [*short_of_battery(scenario, current, team), *unreachable_gates(scenario, current, zone, team)]
    if ideal_s > current.duration_s:
        text = (
            f"{team.name}: cannot see all of {zone.name} once: {ideal_s:.0f} s at best, {current.duration_s:g} s flown"
        )
        found.append(_caution(text))
    return found


def cut_off(scenario: Scenario, current: Round, zone: Zone, team: Team) -> list[ScenarioFinding]:
    """Find take-off places from which no way leads to the team's zone: no-fly zones may close it off altogether."""
    no_fly = [each for each in current.zones if each.role is Role.NO_FLY]
    margin_m = scenario.limits.geofence_margin_m
    parts = permitted_parts(current.area.shape, no_fly, margin_m)
    if len(parts) < 2:
        return []
    there = part_for(zone.shape, parts)
    starts = [p for p in scenario.places if team in possible_teams(p, scenario.teams, scenario.places)]
    closed = [place for place in starts if min(parts, key=shapely.Point(place.place_m).distance) is not there]
    if not closed:
        return []
    numbers = [place.vehicle for place in closed if place.vehicle is not None]
    who = id_ranges(numbers) or f"{len(closed)} vehicles"
    names = ", ".join(each.name for each in no_fly) or "the border"
    text = f"{team.name}: no way leads from the take-off places of {who} to {zone.name}"
    return [_error(text, f"{names} and the margin of {margin_m:g} m leave none: move it, or the places")]


def short_of_battery(scenario: Scenario, current: Round, team: Team) -> list[ScenarioFinding]:
    """Find classes whose full batteries are used up before the round is over: their vehicles return."""
    found = []
    usable = 1.0 - scenario.battery.return_pct / 100.0
    for kind in scenario.classes:
        members = sorted(set(kind.vehicles) & set(team.vehicles))
        if kind.power is None or not members:
            continue
        lasts_s = usable * kind.power.capacity_wh * 3600.0 / max(kind.power.hover_w, kind.power.cruise_w)
        if lasts_s < current.duration_s:
            text = f"{team.name}: {id_ranges(members)} of class {kind.name} return before the round is over"
            why = f"a battery lasts {lasts_s:.0f} s until return_pct, the round {current.duration_s:g} s"
            found.append(_caution(text, why))
    return found


def crowded(scenario: Scenario, zone: Zone, team: Team, size_m2: float) -> list[ScenarioFinding]:
    """Find a zone that is too small: on one path over it the vehicles would follow each other too closely."""
    apart_m, swath_m = scenario.limits.separation_horizontal_m, 2.0 * scenario.footprint_radius_m
    # The length of one path over the zone, divided by the required separation.
    most = max(1, int(size_m2 / swath_m / apart_m)) if apart_m > 0.0 else team.size
    if team.size <= most:
        return []
    room = f"{most} can follow each other {apart_m:g} m apart" if most > 1 else "one path has room for 1"
    text = f"{zone.name} is too small for {team.size} vehicles: {room}"
    return [_caution(f"{team.name}: {text}", "the others are kept apart by their layers alone")]


def wrong_layers(scenario: Scenario, current: Round, zone: Zone, team: Team) -> list[ScenarioFinding]:
    """Find altitude layers outside of the zone's altitude band: vehicles keep their layers."""
    low_m, high_m = band_m(zone, current.area)
    named = [place for place in scenario.places if place.vehicle in team.vehicles]
    outside = sorted(place.vehicle or 0 for place in named if not low_m <= place.layer_m <= high_m)
    if not outside:
        return []
    who = ", ".join(map(str, outside))
    text = f"layers of {who} are outside the {low_m:g} to {high_m:g} m of {zone.name}"
    return [_caution(f"{team.name}: {text}", "change the zone's altitude, or their take-off places")]


def tight_layers(scenario: Scenario, team: Team) -> list[ScenarioFinding]:
    """Find layers without a margin to those of vehicles that may come near."""
    # A vehicle that crosses another layer a little too high or too low is held by the guard again and again.
    least_m = scenario.limits.separation_vertical_m
    apart_m = least_m + 2.0 * HEIGHT_HELD_M
    layers_m = np.array([place.layer_m for place in scenario.places])
    close = np.abs(layers_m[:, None] - layers_m[None, :]) < apart_m
    close &= _near(scenario)
    tight = sorted(place.vehicle or 0 for i, place in enumerate(scenario.places) if close[i].any())
    tight = [vehicle for vehicle in tight if vehicle in team.vehicles]
    if not tight:
        return []
    text = f"{team.name}: layers of {id_ranges(tight)} are less than {apart_m:g} m from another one"
    why = f"{least_m:g} m are allowed and heights are off by up to {HEIGHT_HELD_M:g} m: the guard will hold who crosses"
    return [_caution(text, why)]


def _near(scenario: Scenario) -> Matrix:
    """Return (n, n) whether the vehicles of each two places can come near each other."""
    limits = braking_limits(scenario.limits, scenario.classes)
    return place_conflicts(scenario.rounds, limits, scenario.teams, scenario.places)


def layers_finding(scenario: Scenario) -> ScenarioFinding:
    """Return how many layers the fleet has, and in how many groups that never come near each other it flies."""
    layers_m = sorted({place.layer_m for place in scenario.places})
    near = _near(scenario)
    apart = len(set(groups(near)))
    count, layers = len(scenario.places), len(layers_m)
    if count == 1:
        return _note(f"1 vehicle, at {layers_m[0]:g} m")
    on = f"{layers} layers, {layers_m[0]:g} to {layers_m[-1]:g} m" if layers > 1 else f"1 layer, {layers_m[0]:g} m"
    together = "all may come near each other" if apart == 1 else f"{apart} groups that stay apart share them"
    needed = layers_needed(near)
    least = f"at least {needed} layers are needed" if needed > 1 else "1 layer is enough"
    return _note(f"{count} vehicles on {on}", f"{least}: {together}")


def _searched(found: PreviewResult) -> str:
    """Return how much of its planner's search a preview had time for, where that was not all of it."""
    share = found.metrics.get("searched", 1.0)
    return "" if share >= 1.0 else f", after {share:.0%} of the search: a flight may be better"


def gate_findings(scenario: Scenario, round_: Round, found: PreviewResult) -> list[ScenarioFinding]:
    """Return which gates of idleness the planned figures would fail: what a rehearsal says after it, said before."""
    lines, limits, team = [], scenario.results, found.team
    if found.state != "done":
        return []
    reference_s, name = gate_reference(found.ideal_s, found.bound_s)
    ratio, gate = found.worst_s / reference_s if reference_s > 0.0 else 0.0, limits.worst_ratio_max
    if ratio > gate:
        text = f"^ {team}: {ratio:.2f} x {name} fails the gate worst_ratio_max {gate:g}"
        lines.append(_caution(text, "raise it in [results], or change zone, vehicles or classes"))
    slots_s = 2.0 * found.metrics.get("period_s", 0.0) / max(found.metrics.get("slots", found.vehicles), 1.0)
    if slots_s > round_.duration_s:
        text = f"^ {team}: duration_s {round_.duration_s:g} is too short to be measured"
        enough = f"{limits.on_slot_max_s + slots_s + limits.measured_s:.0f} s are enough"
        lines.append(_caution(text, f"{enough}; a rehearsal flies on until then, a real flight does not"))
    return lines


def preview_findings(found: PreviewResult) -> list[ScenarioFinding]:
    """Return the findings about the finished preview of one team: idleness, separation."""
    team = found.team
    if found.state == "failed":
        return [_caution(f"{team}: no plan: {found.text}")]
    seen = f"{found.worst_s:.1f} s worst, {found.ratio:.2f} x ideal" if isfinite(found.worst_s) else "not all is seen"
    if isfinite(found.worst_s) and found.bound_s > found.ideal_s:
        seen += f", {found.worst_s / found.bound_s:.2f} x bound"
    apart = f", separation {found.separation:.2f} x" if isfinite(found.separation) else ""
    lines = [_note(f"{team}: {found.vehicles} planned: {seen}{apart}{_searched(found)}")]
    if found.unreachable:
        lines.append(_caution(f"^ {team}: {found.unreachable}"))
    if found.separation < 1.0:
        lines.append(_caution(f"^ {team}: two would come too near; the guard would stop them"))
    return lines
