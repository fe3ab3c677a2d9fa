"""Edits of a scenario file in terms of rounds, zones, teams and take-off places. What is not edited stays as it was."""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
import tomlkit

from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Shape, Zone
from tui_gcs.core.scenario.load import ScenarioError
from tui_gcs.core.scenario.model import (
    BatteryLimits,
    Instances,
    Limits,
    OperatingArea,
    ResultLimits,
    TakeOffPlace,
    Team,
)
from tui_gcs.core.scenario.toml_text import TomlText, Value

Parameters = Mapping[str, float | int | bool | str]
_SHAPE_KEYS = (
    *("shape", "centre_m", "centre_deg", "radius_m", "width_m", "height_m", "heading_deg"),
    *("vertices_m", "vertices_deg", "alt_min_m", "alt_max_m"),
)


class ScenarioDocument:
    """A scenario's text and edits of it. Rounds and places are counted from 0, zones and teams are named.

    Edits do not check what a scenario means: parse `text` afterwards. They raise `ScenarioError` where there is no such
    round, zone, team or place, or where it is written in a way that is not edited here (inline tables). An edit that
    cannot be made leaves the text as it was.
    """

    def __init__(self, text: str) -> None:
        """Take a TOML text. Raises `ScenarioError` if it is not valid TOML."""
        self._toml = TomlText(text)

    @property
    def text(self) -> str:
        """The file as it stands; without edits the very text given."""
        return self._toml.text

    def set_scenario(self, *, name: str, seed: int, footprint_radius_m: float) -> None:
        """Set the keys above all tables."""
        with self._toml.all_or_nothing():
            self._toml.apply("", {"name": name, "seed": seed, "footprint_radius_m": footprint_radius_m})

    def set_origin(self, origin: Origin) -> None:
        """Set where ENU (0, 0) lies: what is written in metres moves with it, what is written in degrees stays."""
        self._set_table("origin", msgspec.structs.asdict(origin))

    def set_limits(self, limits: Limits) -> None:
        """Set the limits that no vehicle may exceed. A default that was not written is not added."""
        self._set_table("limits", msgspec.structs.asdict(limits), msgspec.structs.asdict(Limits()))

    def set_results(self, results: ResultLimits) -> None:
        """Set what a good run must reach. A default that was not written is not added."""
        values, preset = msgspec.structs.asdict(results), msgspec.structs.asdict(ResultLimits())
        # The gates of metrics are a table of their own, which stays as it is written.
        self._set_table("results", {k: v for k, v in values.items() if k != "metrics"}, preset)

    def set_battery(self, battery: BatteryLimits) -> None:
        """Set when vehicles return for their batteries. A default that was not written is not added."""
        self._set_table("battery", msgspec.structs.asdict(battery), msgspec.structs.asdict(BatteryLimits()))

    def set_resume(self, resume: bool) -> None:
        """Set whether a restarted station flies on by itself."""
        self._set_table("link_loss", {"resume": resume}, {"resume": False})

    def set_round(self, round_index: int, *, name: str | None = None, duration_s: float | None = None) -> None:
        """Set a round's name or duration."""
        given = {"name": name, "duration_s": duration_s}
        with self._toml.all_or_nothing():
            self._toml.apply(self._round(round_index), {k: v for k, v in given.items() if v is not None})

    def add_round(self, like_index: int, name: str) -> None:
        """Add a copy of a round behind the last one, under another name. Its comments are not copied."""
        rounds = len(self._toml.tables("", "round"))
        like, last = self._round(like_index), self._round(rounds - 1)
        with self._toml.all_or_nothing():
            self._toml.copy_tables(like, last)
            self._toml.apply(self._round(rounds), {"name": name})

    def remove_round(self, round_index: int) -> None:
        """Remove a round with its zones; comments around it stay."""
        self._toml.remove_tables(self._round(round_index))

    def set_area(self, round_index: int, area: OperatingArea) -> None:
        """Set a round's operating area."""
        path = f"{self._round(round_index)}.area"
        band = {"alt_min_m": area.alt_min_m, "alt_max_m": area.alt_max_m}
        with self._toml.all_or_nothing():
            self._toml.apply(path, self._shape_keys(path, area.shape) | band, _SHAPE_KEYS)

    def set_zone(self, round_index: int, zone_name: str, zone: Zone) -> None:
        """Replace one round's zone of that name; `zone.name` may be another (see `rename_zone`)."""
        path = self._zone(round_index, zone_name)
        with self._toml.all_or_nothing():
            self._toml.apply(path, self._zone_keys(path, zone), _SHAPE_KEYS)

    def add_zone(self, round_index: int, zone: Zone) -> None:
        """Add a zone after the last one of the round."""
        path = self._round(round_index)
        zones = self._toml.tables(path, "zone")
        after = f"{path}.zone[{len(zones)}]" if zones else f"{path}.area"
        if not self._toml.has_header(after):
            after = path
        self._toml.insert_table(self._toml.last_line_of(after), "[[round.zone]]", self._zone_keys("", zone))

    def remove_zone(self, round_index: int, zone_name: str) -> None:
        """Remove one round's zone; comments around it stay."""
        self._toml.remove_tables(self._zone(round_index, zone_name))

    def rename_zone(self, old: str, new: str) -> None:
        """Give a zone another name in every round, and in the teams that serve it."""
        places: list[tuple[str, str]] = []
        for r, _ in enumerate(self._toml.tables("", "round")):
            if any(zone.get("name") == old for zone in self._toml.tables(self._round(r), "zone")):
                places.append((self._zone(r, old), "name"))
        for team in self._toml.tables("", "team"):
            if team.get("zone") == old:
                places.append((self._team(str(team.get("name"))), "zone"))
        self._toml.replace_values(places, new)

    def add_team(self, team: Team) -> None:
        """Add a team behind the last one."""
        numbers: dict[str, Value] = {"vehicles": list(team.vehicles)} if team.vehicles else {"count": team.count}
        keys: dict[str, Value] = {"name": team.name, "zone": team.zone, "planner": team.planner, **numbers}
        teams = len(self._toml.tables("", "team"))
        with self._toml.all_or_nothing():
            self._toml.insert_table(self._toml.last_line_under(f"team[{teams}]"), "[[team]]", keys)
            if team.parameters:
                self._set_parameters(self._team(team.name), team.parameters)

    def remove_team(self, name: str) -> None:
        """Remove a team with its planner's parameters."""
        self._toml.remove_tables(self._team(name))

    def add_place(self, place: TakeOffPlace) -> None:
        """Add a take-off place behind the last one."""
        path = f"place[{len(self._toml.tables('', 'place'))}]"
        self._toml.insert_table(self._toml.last_line_under(path), "[[place]]", self._place_keys(path, place))

    def set_place(self, index: int, place: TakeOffPlace) -> None:
        """Replace the take-off place at `index`."""
        path = self._place(index)
        with self._toml.all_or_nothing():
            self._toml.apply(path, self._place_keys(path, place), ("vehicle",))

    def remove_place(self, index: int) -> None:
        """Remove the take-off place at `index`."""
        self._toml.remove_tables(self._place(index))

    def set_team(
        self,
        team_name: str,
        *,
        name: str | None = None,
        zone: str | None = None,
        planner: str | None = None,
        vehicles: Sequence[int] | None = None,
        count: int | None = None,
        instances: Instances | None = None,
        parameters: Parameters | None = None,
    ) -> None:
        """Set what is given of a team. `vehicles` replaces `count` and the other way round.

        `parameters` replaces all parameters of its planner.
        """
        path = self._team(team_name)
        given: dict[str, Value | None] = {"name": name, "zone": zone, "planner": planner, "count": count}
        given["instances"] = instances
        given["vehicles"] = list(vehicles) if vehicles is not None else None
        swapped = ("vehicles", "count") if vehicles is not None or count is not None else ()
        with self._toml.all_or_nothing():
            if parameters is not None:
                self._set_parameters(path, parameters)
            self._toml.apply(path, {k: v for k, v in given.items() if v is not None}, swapped)

    def _set_parameters(self, team_path: str, parameters: Parameters) -> None:
        path = f"{team_path}.parameters"
        have = self._toml.table(team_path).get("parameters")
        if have is None and parameters:
            self._toml.insert_table(self._toml.last_line_of(team_path), "[team.parameters]", parameters)
        elif have is not None and self._toml.has_header(path):
            self._toml.apply(path, parameters, tuple(have))
        elif have is not None:  # an inline table is a value
            self._toml.apply(team_path, {"parameters": _inline_table(parameters)})

    def _set_table(self, path: str, values: Parameters, preset: Parameters | None = None) -> None:
        """Set a table's keys; those that equal `preset` are not added."""
        have = self._toml.table(path)
        values = {k: v for k, v in values.items() if k in have or preset is None or preset[k] != v}
        with self._toml.all_or_nothing():
            if have and self._toml.is_inline(path):
                self._toml.apply("", {path: _inline_table({**have, **values})})
            elif have or self._toml.has_header(path):
                self._toml.apply(path, values)
            elif values:
                has_origin = self._toml.has_header("origin")
                last = self._toml.last_line_of("origin") if has_origin else self._toml.last_written_line()
                self._toml.insert_table(last, f"[{path}]", values)

    # Key paths

    def _round(self, index: int) -> str:
        if not 0 <= index < len(self._toml.tables("", "round")):
            raise ScenarioError([f"scenario: there is no round {index + 1}"])
        return f"round[{index + 1}]"

    def _zone(self, round_index: int, name: str) -> str:
        return self._named(self._round(round_index), "zone", name)

    def _team(self, name: str) -> str:
        return self._named("", "team", name)

    def _place(self, index: int) -> str:
        if not 0 <= index < len(self._toml.tables("", "place")):
            raise ScenarioError([f"scenario: there is no take-off place {index + 1}"])
        return f"place[{index + 1}]"

    def _named(self, path: str, key: str, name: str) -> str:
        for i, table in enumerate(self._toml.tables(path, key)):
            if table.get("name") == name:
                return f"{path}.{key}[{i + 1}]".removeprefix(".")
        raise ScenarioError([f"scenario: {path or 'file'}: there is no {key} named {name!r}"])

    # Keys and values

    def _zone_keys(self, path: str, zone: Zone) -> dict[str, Value]:
        keys: dict[str, Value] = {"name": zone.name, "role": zone.role.value, **self._shape_keys(path, zone.shape)}
        band = {"alt_min_m": zone.alt_min_m, "alt_max_m": zone.alt_max_m}
        return keys | {key: value for key, value in band.items() if value is not None}

    def _shape_keys(self, path: str, shape: Shape) -> dict[str, Value]:
        """Give the keys of a shape; positions that were written in degrees stay in degrees."""
        match shape:
            case Circle():
                return {"shape": "circle", **self._at_place(path, "centre", shape.centre_m), "radius_m": shape.radius_m}
            case Rectangle():
                keys = {"shape": "rectangle", **self._at_place(path, "centre", shape.centre_m)}
                keys |= {"width_m": shape.width_m, "height_m": shape.height_m}
                if shape.heading_deg or "heading_deg" in self._toml.table(path):
                    keys["heading_deg"] = shape.heading_deg
                return keys
            case Polygon():
                degrees = "vertices_deg" in self._toml.table(path)
                points = [self._degrees(point) if degrees else list(point) for point in shape.vertices_m]
                return {"shape": "polygon", "vertices_deg" if degrees else "vertices_m": points}

    def _place_keys(self, path: str, place: TakeOffPlace) -> dict[str, Value]:
        keys = {"vehicle": place.vehicle} if place.vehicle is not None else {}
        return {**keys, **self._at_place(path, "place", place.place_m), "layer_m": place.layer_m}

    def _at_place(self, path: str, stem: str, point_m: tuple[float, float]) -> dict[str, Value]:
        if f"{stem}_deg" in self._toml.table(path):
            return {f"{stem}_deg": self._degrees(point_m)}
        return {f"{stem}_m": list(point_m)}

    def _degrees(self, point_m: tuple[float, float]) -> list[float]:
        """Convert ENU metres to [latitude, longitude], rounded to 1e-9 degrees (0.1 mm)."""
        origin = self._toml.data["origin"]
        frame = LocalFrame(Origin(float(origin["lat_deg"]), float(origin["lon_deg"]), 0.0))
        return [round(degrees, 9) for degrees in frame.to_geodetic(*point_m)]


def _inline_table(values: Mapping[str, Any]) -> Any:
    table = tomlkit.inline_table()
    table.update(values)
    return table
