"""Reads what a mission has beside zones: vehicle classes, density maps, moving obstacles, tasks, the checklist."""

from collections.abc import Collection

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.geometry.loops import Loop
from tui_gcs.core.scenario.fields import MAX_DISTANCE_M, Point, Table, in_metres, kind_of, nearest, one_of, shown
from tui_gcs.core.scenario.model import DensityPeak, Limits, MovingObstacle, PowerModel, ScenarioTask, VehicleClass

MAX_PEAKS, MAX_OBSTACLES, MAX_CLASSES, MAX_LOOP_POINTS = 64, 64, 32, 100
MAX_WEIGHT, MAX_PERIOD_S = 1e6, 86_400.0
MAX_CAPACITY_WH, MAX_POWER_W = 1e6, 1e6
MAX_ITEMS, MAX_ITEM_CHARS = 30, 80
"""The checklist: as many items as two screens show, each of one line."""


def read_peak(table: Table, frame: LocalFrame | None) -> DensityPeak | None:
    """Return one `[[round.density]]`, or None where it has a problem, which is noted."""
    sigma_m = table.number("sigma_m", above=0, high=MAX_DISTANCE_M)
    weight = table.number("weight", 1.0, above=0, high=MAX_WEIGHT)
    loop = _loop(table, frame)
    table.done()
    return DensityPeak(sigma_m, weight, loop) if table.ok and loop is not None else None


def read_obstacle(table: Table, frame: LocalFrame | None) -> MovingObstacle | None:
    """Return one `[[round.obstacle]]`, or None where it has a problem, which is noted."""
    name, radius_m = table.name("name"), table.number("radius_m", above=0, high=MAX_DISTANCE_M)
    loop = _loop(table, frame)
    table.done()
    return MovingObstacle(name, radius_m, loop) if table.ok and loop is not None else None


def read_task(table: Table, frame: LocalFrame | None) -> ScenarioTask | None:
    """Return one `[[task]]`, or None where it has a problem, which is noted."""
    name, priority = table.name("name"), table.number("priority", 1.0, above=0, high=MAX_WEIGHT)
    deadline_s = table.number("deadline_s", above=0, high=MAX_PERIOD_S) if table.has("deadline_s") else None
    team = table.name("team") if table.has("team") else ""
    keys = [key for key in ("place_m", "place_deg") if table.has(key)]
    if len(keys) != 1:
        table.wrong("", "place_m or place_deg must be given", "metres east and north of the origin, or degrees")
        return None
    point = table.pair(keys[0])
    place_m = in_metres(table, keys[0], point, frame) if point is not None else None
    table.done()
    return ScenarioTask(name, place_m, priority, deadline_s, team) if table.ok and place_m is not None else None


def check_tasks(table: Table, tasks: list[ScenarioTask], teams: Collection[str]) -> None:
    """Note names that stand twice and teams that are not there."""
    names = [task.name for task in tasks]
    for i, task in enumerate(tasks):
        if names.index(task.name) != i:
            table.wrong(f"task[{i + 1}].name", f"{shown(task.name)} is a task already", "each has its own name")
        if task.team and task.team not in teams:
            wrong = f"there is no team {shown(task.team)}{nearest(task.team, teams)}"
            table.wrong(f"task[{i + 1}].team", wrong, f"must be {one_of(sorted(teams))}")


def read_checklist(root: Table) -> tuple[str, ...]:
    """Return the texts of all `[[checklist]]`; problems are noted."""
    texts: list[str] = []
    for table in root.tables("checklist", MAX_ITEMS, least=0):
        text = table.name("text", MAX_ITEM_CHARS)
        if text in texts:
            table.wrong("text", f"{shown(text)} is an item already", "each item stands once")
        table.done()
        texts.append(text)
    return tuple(texts)


def read_class(table: Table, limits: Limits, footprint_radius_m: float) -> VehicleClass | None:
    """Return one `[[class]]`, or None where it has a problem, which is noted. It can only tighten the limits."""
    name, vehicles = table.simple_name("name"), _vehicles(table)
    speed_m_s = table.number("speed_m_s", limits.speed_m_s, above=0, high=limits.speed_m_s)
    accel_m_s2 = table.number("accel_m_s2", limits.accel_m_s2, above=0, high=limits.accel_m_s2)
    footprint_m = table.number("footprint_radius_m", footprint_radius_m, above=0, high=footprint_radius_m)
    power = _power(table)
    table.done()
    return VehicleClass(name, vehicles, speed_m_s, accel_m_s2, footprint_m, power) if table.ok else None


def _power(table: Table) -> PowerModel | None:
    """Return what the battery of a class holds and what flying takes; None where nothing is said about it."""
    keys = ("capacity_wh", "hover_w", "cruise_w")
    if not any(table.has(key) for key in keys):
        return None
    capacity_wh = table.number("capacity_wh", above=0, high=MAX_CAPACITY_WH)
    hover_w, cruise_w = (table.number(key, above=0, high=MAX_POWER_W) for key in keys[1:])
    return PowerModel(capacity_wh, hover_w, cruise_w)


def _vehicles(table: Table) -> tuple[int, ...]:
    value = table.data["vehicles"] if table.has("vehicles") else None
    if not (isinstance(value, list) and value):
        what = "an empty list" if isinstance(value, list) else kind_of(value)
        table.wrong("vehicles", f"{what} is not allowed here", "must be a list of vehicle numbers")
        return ()
    for i, item in enumerate(value):
        if not isinstance(item, int) or isinstance(item, bool) or item < 1:
            table.wrong(f"vehicles[{i + 1}]", f"{shown(item)} is not a vehicle's number", "as a team names it")
            return ()
    return tuple(value)


def _loop(table: Table, frame: LocalFrame | None) -> Loop | None:
    """Return a place that stays (`place_m`) or moves on a closed way (`path_m`, `period_s`), in metres or degrees."""
    keys = [key for key in ("place_m", "place_deg", "path_m", "path_deg") if table.has(key)]
    if len(keys) != 1:
        table.wrong("", "place_m or path_m must be given", "one of place_m, place_deg, path_m, path_deg")
        return None
    key = keys[0]
    if key.startswith("place"):
        point = table.pair(key)
        points = [point] if point is not None else []
        period_s = 0.0
    else:
        points = table.pairs(key, MAX_LOOP_POINTS)
        period_s = table.number("period_s", above=0, high=MAX_PERIOD_S)
        if table.ok and len(points) < 2:
            table.wrong(key, f"{len(points)} points", "a closed way has at least 2")
    found: list[Point | None] = [in_metres(table, key, point, frame) for point in points]
    good = tuple(point for point in found if point is not None)
    return Loop(good, period_s) if table.ok and good else None
