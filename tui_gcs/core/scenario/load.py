"""Reads scenario files: TOML text becomes a `Scenario`, or every problem of the file is reported on a line of its own.

    FILE: KEYPATH (line N): what is wrong; what is allowed

Each key is read, and its value checked, by a getter of `fields.Table`. Ranges are arguments of the getters, or stand in
the structs of `model` that `Table.struct` fills. A key that no getter asked for is unknown (`Table.done`). A problem
gets its line in `fields.Problems.add`, from `lines.find_line`. Whether values fit together is checked in `check`.
"""

import math
import re
import tomllib
from collections.abc import Collection
from pathlib import Path
from typing import Any, cast, get_args

import msgspec

from tui_gcs.core.base.regular_file import open_plain
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Role, Shape, Zone
from tui_gcs.core.scenario.check import ScenarioParts, check, check_classes
from tui_gcs.core.scenario.fields import (
    MAX_DISTANCE_M,
    Point,
    Problems,
    Table,
    in_metres,
    kind_of,
    printable,
    shown,
    shown_key,
)
from tui_gcs.core.scenario.layer_assignment import LayerError, with_layers
from tui_gcs.core.scenario.lines import map_lines
from tui_gcs.core.scenario.mission_inputs import (
    MAX_CLASSES,
    MAX_OBSTACLES,
    MAX_PEAKS,
    check_tasks,
    read_checklist,
    read_class,
    read_obstacle,
    read_peak,
    read_task,
)
from tui_gcs.core.scenario.model import (
    BatteryLimits,
    Communication,
    Instances,
    Limits,
    LinkLoss,
    OperatingArea,
    ResultLimits,
    Round,
    Scenario,
    TakeOffPlace,
    Team,
)
from tui_gcs.core.scenario.remote_id import read_remote_id
from tui_gcs.core.scenario.vehicle_conflicts import braking_limits

FORMAT = 1
"""The version of the file format, which is the file's `format` key."""
# Limits of a file that may come from anywhere: a mistake is one line within a second, never a hang.
MAX_BYTES = 256 * 1024
MAX_LINE_CHARS = 8192
MAX_PROBLEMS_LISTED = 50
MAX_ALTITUDE_M = 10_000.0
GATE_NAME = r"[A-Za-z][A-Za-z0-9_]{0,31}_(min|max)"
"""Pattern of a gate in `[results.metrics]`: the name of a planner's metric with `_min` or `_max`."""
MAX_GATE = 1e12
MAX_TASKS = 200
# 254 is all that one network can hold: system id 255 is the station, 0 is all systems.
MAX_ROUNDS, MAX_ZONES, MAX_TEAMS, MAX_VEHICLES, MAX_VERTICES = 64, 64, 32, 254, 1000
MAX_SYSTEM_ID = 254
"""The highest system id of a vehicle: by MAVLink convention 255 is a ground station."""
VEHICLES_ALLOWED = f"must be a whole number from 1 to {MAX_SYSTEM_ID} (on a second network from 1001, and so on)"
MAX_VEHICLE_ID = 9254
"""The highest number of a vehicle. It is the system id, plus 1000 n on the station's n-th further network."""


class ScenarioError(ValueError):
    """Raised for a scenario that cannot be used. `problems` holds one line for each problem."""

    def __init__(self, problems: list[str]) -> None:
        listed = problems[:MAX_PROBLEMS_LISTED]
        if len(problems) > len(listed):
            listed = [*listed, f"... and {len(problems) - len(listed)} more problems"]
        super().__init__("\n".join(listed))
        self.problems = problems


def load(path: Path | str, known_planners: Collection[str] | None = None) -> Scenario:
    """Read and parse a file. Raises `ScenarioError`, also where there is no such file."""
    return parse(read_text(path), str(path), known_planners)


def read_text(path: Path | str) -> str:
    """Return a scenario file's text with its line ends unchanged. Raises `ScenarioError`."""
    where = printable(str(path), 200)
    try:
        with open_plain(Path(path)) as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise ScenarioError([f"{where}: no such file; give the path of a scenario (TOML)"]) from None
    except IsADirectoryError:
        raise ScenarioError([f"{where}: is a directory; give the path of a scenario (TOML)"]) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise ScenarioError([f"{where}: cannot be read: {reason}"]) from None
    if len(data) > MAX_BYTES:
        raise ScenarioError([f"{where}: is larger than {MAX_BYTES // 1024} KiB; a scenario is a small text file"])
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise ScenarioError([f"{where}: line {line}: is not UTF-8 text; save the file as UTF-8"]) from None


def _small_enough(text: str, where: str) -> None:
    # Parsing an overlong text would stall the reader, which may be a station with vehicles in the air.
    if len(text) > MAX_BYTES:
        raise ScenarioError([f"{where}: is larger than {MAX_BYTES // 1024} KiB; a scenario is a small text"])
    for number, line in enumerate(text.split("\n"), start=1):
        if len(line) > MAX_LINE_CHARS:
            raise ScenarioError([f"{where}: line {number}: is longer than {MAX_LINE_CHARS} characters"])


def parse(text: str, where: str = "scenario", known_planners: Collection[str] | None = None) -> Scenario:
    """Return the scenario in a TOML text. Raises `ScenarioError` with all problems.

    `where` names the text in the problems. With `known_planners` each team's planner must be one of these names.
    """
    _small_enough(text, printable(where, 200))
    data = _toml(text, printable(where, 200))
    problems = Problems(where, map_lines(text))
    root = Table(problems, "", data)
    root.integer("format", low=FORMAT, high=FORMAT)
    name, seed = root.name("name", 64), root.integer("seed", low=0, high=2**63 - 1)
    footprint_m = root.number("footprint_radius_m", above=0, high=MAX_DISTANCE_M)
    origin = _origin(root.table("origin", required=True))
    frame = LocalFrame(origin) if origin is not None else None
    parts = ScenarioParts(
        limits=root.table("limits").struct(Limits),
        rounds=[(t.path, _round(t, frame)) for t in root.tables("round", MAX_ROUNDS)],
        teams=[(t.path, _team(t)) for t in root.tables("team", MAX_TEAMS)],
        places=[(t.path, _place(t, frame)) for t in root.tables("place", MAX_VEHICLES)],
    )
    results, link_loss = _results(root.table("results")), root.table("link_loss").struct(LinkLoss)
    tasks = [task for t in root.tables("task", MAX_TASKS, least=0) if (task := read_task(t, frame)) is not None]
    check_tasks(root, tasks, [team.name for _, team in parts.teams if team is not None])
    battery = root.table("battery").struct(BatteryLimits)
    communication = root.table("communication").struct(Communication)
    kinds = [read_class(t, parts.limits, footprint_m) for t in root.tables("class", MAX_CLASSES, least=0)]
    classes = tuple(kind for kind in kinds if kind is not None)
    remote_id = read_remote_id(root.table("remote_id"), frame)
    checklist = read_checklist(root)
    root.done()
    check(parts, problems, known_planners, classes)
    check_classes(classes, problems)
    if problems.lines or origin is None:
        raise ScenarioError(problems.lines)
    rounds, teams, places = parts.sound()
    try:
        places = with_layers(rounds, braking_limits(parts.limits, classes), teams, places)
    except LayerError as error:
        problems.add("place", str(error), "layer_m may be left out: one is found for every place without it")
        raise ScenarioError(problems.lines) from None
    return Scenario(
        name=name,
        seed=seed,
        origin=origin,
        footprint_radius_m=footprint_m,
        limits=parts.limits,
        results=results,
        link_loss=link_loss,
        rounds=rounds,
        teams=teams,
        places=places,
        communication=communication,
        classes=classes,
        remote_id=remote_id,
        tasks=tuple(tasks),
        battery=battery,
        checklist=checklist,
    )


def _toml(text: str, where: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    # tomllib reads nested arrays by recursion: a file of nothing but brackets would end the program.
    except RecursionError:
        raise ScenarioError([f"{where}: not valid TOML: nested too deep"]) from None
    except ValueError as error:  # TOMLDecodeError, or a number too long for Python
        reason = printable(str(error), 200)
        if found := re.fullmatch(r"(.*) \(at line (\d+), column (\d+)\)", reason):
            reason = f"{found[1]} (column {found[3]})"
            where = f"{where}: line {found[2]}"
        raise ScenarioError([f"{where}: not valid TOML: {reason}"]) from None


def _results(table: Table) -> ResultLimits:
    """Return the gates of a run. `core/judging/metric_log.py` compares those of metrics with what planners declare."""
    gates, metrics = table.table("metrics"), {}
    for key in gates.data:
        if re.fullmatch(GATE_NAME, key):
            metrics[key] = gates.number(key, low=-MAX_GATE, high=MAX_GATE)
        else:
            gates.has(key)
            gates.wrong(shown_key(key), "is no gate of a metric", "must be a metric's name with _min or _max")
    return msgspec.structs.replace(table.struct(ResultLimits), metrics=metrics)


def _origin(table: Table) -> Origin | None:
    # Nearer to a pole the number of degrees in a metre of east changes too much within one scenario.
    lat_deg = table.number("lat_deg", low=-89, high=89)
    lon_deg = table.number("lon_deg", low=-180, high=180)
    ground_amsl_m = table.number("ground_amsl_m", low=-500, high=9000)
    table.done()
    return Origin(lat_deg, lon_deg, ground_amsl_m) if table.ok else None


def _round(table: Table, frame: LocalFrame | None) -> Round | None:
    name = table.name("name")
    duration_s = table.number("duration_s", above=0, high=86_400)
    area = _area(table.table("area", required=True), frame)
    zones = [_zone(t, frame) for t in table.tables("zone", MAX_ZONES)]
    density = [read_peak(t, frame) for t in table.tables("density", MAX_PEAKS, least=0)]
    obstacles = [read_obstacle(t, frame) for t in table.tables("obstacle", MAX_OBSTACLES, least=0)]
    table.done()
    good = tuple(zone for zone in zones if zone is not None)
    peaks = tuple(peak for peak in density if peak is not None)
    discs = tuple(disc for disc in obstacles if disc is not None)
    if (
        not table.ok
        or area is None
        or (len(good), len(peaks), len(discs)) != (len(zones), len(density), len(obstacles))
    ):
        return None
    return Round(name, duration_s, area, good, peaks, discs)


def _area(table: Table, frame: LocalFrame | None) -> OperatingArea | None:
    shape = _shape(table, frame) if table.data else None
    alt_min_m = table.number("alt_min_m", low=0, high=MAX_ALTITUDE_M)
    alt_max_m = table.number("alt_max_m", above=0, high=MAX_ALTITUDE_M)
    if alt_min_m >= alt_max_m:
        table.wrong("alt_max_m", f"{alt_max_m:g} is not above alt_min_m", f"must be more than {alt_min_m:g}")
    table.done()
    return OperatingArea(shape, alt_min_m, alt_max_m) if table.ok and shape is not None else None


def _zone(table: Table, frame: LocalFrame | None) -> Zone | None:
    name, role = table.name("name"), table.choice("role", [r.value for r in Role])
    shape = _shape(table, frame)
    alt_min_m, alt_max_m = (
        table.number(key, low=0, high=MAX_ALTITUDE_M) if table.has(key) else None for key in ("alt_min_m", "alt_max_m")
    )
    if alt_min_m is not None and alt_max_m is not None and alt_min_m >= alt_max_m:
        table.wrong("alt_max_m", f"{alt_max_m:g} is not above alt_min_m", f"must be more than {alt_min_m:g}")
    table.done()
    if not table.ok or shape is None:
        return None
    return Zone(name, Role(role), shape, alt_min_m, alt_max_m)


def _shape(table: Table, frame: LocalFrame | None) -> Shape | None:
    kind = table.choice("shape", ("circle", "rectangle", "polygon"))
    shape: Shape | None = None
    if kind == "circle":
        centre_m, radius_m = _point(table, "centre", frame), table.number("radius_m", above=0, high=MAX_DISTANCE_M)
        shape = Circle(centre_m, radius_m) if centre_m is not None else None
    elif kind == "rectangle":
        centre_m = _point(table, "centre", frame)
        width_m, height_m = (table.number(key, above=0, high=MAX_DISTANCE_M) for key in ("width_m", "height_m"))
        heading_deg = table.number("heading_deg", 0.0, low=-360, high=360)
        shape = Rectangle(centre_m, width_m, height_m, heading_deg) if centre_m is not None else None
    elif kind == "polygon":
        shape = Polygon(tuple(_vertices(table, frame)))
    else:  # the kind is wrong: do not report its keys as unknown, too
        for key in _SHAPE_KEYS:
            table.has(key)
    return shape if table.ok else None


_SHAPE_KEYS = (
    *("centre_m", "centre_deg", "vertices_m", "vertices_deg"),
    *("radius_m", "width_m", "height_m", "heading_deg"),
)


def _which(table: Table, stem: str) -> str:
    """Return the key that gives a position, `stem` with `_m` or `_deg`; "" unless exactly one is there."""
    found = [key for key in (f"{stem}_m", f"{stem}_deg") if table.has(key)]
    if len(found) == 1:
        return found[0]
    wrong = f"both {stem}_m and {stem}_deg are given" if found else f"{stem}_m is missing"
    table.wrong("", wrong, f"give {stem}_m (metres east, north) or {stem}_deg (latitude, longitude)")
    return ""


def _point(table: Table, stem: str, frame: LocalFrame | None) -> Point | None:
    key = _which(table, stem)
    point = table.pair(key) if key else None
    return in_metres(table, key, point, frame) if point is not None else None


def _vertices(table: Table, frame: LocalFrame | None) -> list[Point]:
    key = _which(table, "vertices")
    points = table.pairs(key, MAX_VERTICES) if key else []
    if key and table.ok and len(points) < 3:
        table.wrong(key, f"{len(points)} vertices", "a polygon has at least 3")
    # KML and GeoJSON rings end with their first point, and are copied from there.
    elif len(points) > 3 and points[0] == points[-1]:
        table.wrong(key, "the last vertex is the first again", "leave the last one out: polygons close by themselves")
    vertices = [in_metres(table, f"{key}[{i + 1}]", point, frame) for i, point in enumerate(points)]
    return [vertex for vertex in vertices if vertex is not None]


def _team(table: Table) -> Team | None:
    name, zone = table.simple_name("name"), table.name("zone")
    planner = _planner(table)
    vehicles = tuple(_vehicles(table))
    count = table.integer("count", low=1, high=MAX_VEHICLES) if table.has("count") else 0
    if table.has("vehicles") == table.has("count"):
        wrong = "vehicles and count are both given" if table.has("count") else "neither vehicles nor count is given"
        table.wrong("", wrong, "give vehicles = [ids] or count = n")
    parameters = _parameters(table.table("parameters"))
    instances = table.choice("instances", get_args(Instances)) if table.has("instances") else None
    table.done()
    if not table.ok or parameters is None:
        return None
    return Team(name, zone, planner, vehicles, count, parameters, cast(Instances | None, instances))


def _planner(table: Table) -> str:
    value = table.data.get("planner")
    # A scenario that names a file would run that file's code on whoever opens it: files come from the command line.
    if isinstance(value, str) and ("/" in value or value.endswith(".py")):
        table.has("planner")
        file = f"{shown(value)} is a file; a scenario names planners only"
        table.wrong(
            "planner", file, "give the planner's own name here, and the file on the command line: --planner FILE.py"
        )
        return ""
    return table.simple_name("planner", 64)


def _vehicles(table: Table) -> list[int]:
    value = table.data["vehicles"] if table.has("vehicles") else []
    if "vehicles" in table.data and (not isinstance(value, list) or not 1 <= len(value) <= MAX_VEHICLES):
        what = f"a list of {len(value)} ids" if isinstance(value, list) else kind_of(value)
        table.wrong("vehicles", f"{what} is not allowed here", f"must be a list of 1 to {MAX_VEHICLES} ids")
        return []
    good = []
    for i, item in enumerate(value):
        # In Python `true` is the integer 1, which would be vehicle 1.
        if isinstance(item, int) and not isinstance(item, bool) and _is_vehicle(item):
            good.append(item)
        else:
            table.wrong(f"vehicles[{i + 1}]", f"{shown(item)} is not a system id", VEHICLES_ALLOWED)
    return good


def _is_vehicle(number: int) -> bool:
    return 1 <= number <= MAX_VEHICLE_ID and 1 <= number % 1000 <= MAX_SYSTEM_ID


def _parameters(table: Table) -> dict[str, float | int | bool | str] | None:
    """Return a planner's parameters unchecked: only the planner knows which values it allows."""
    parameters: dict[str, float | int | bool | str] = {}
    for key, value in table.data.items():
        if (table.has(key) and isinstance(value, str | bool)) or (
            isinstance(value, int | float) and abs(value) <= 1e12
        ):
            parameters[key] = value
        else:
            table.wrong(shown_key(key), f"{shown(value)} is not allowed", "must be a number, true, false or text")
    return parameters if table.ok else None


def _place(table: Table, frame: LocalFrame | None) -> TakeOffPlace | None:
    place_m = _point(table, "place", frame)
    layer_m = table.number("layer_m", above=0, high=MAX_ALTITUDE_M) if table.has("layer_m") else math.nan
    vehicle = table.integer("vehicle", low=1, high=MAX_VEHICLE_ID) if table.has("vehicle") else None
    if vehicle is not None and not _is_vehicle(vehicle):
        table.wrong("vehicle", f"{vehicle} is not a system id", VEHICLES_ALLOWED)
    table.done()
    return TakeOffPlace(place_m, layer_m, vehicle) if table.ok and place_m is not None else None
