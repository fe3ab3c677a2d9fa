"""Edits of a scenario file that keep everything else as it was: comments, order, number formats, line ends.

The text is edited by lines: a value is replaced in its own lines (by tomlkit, which keeps their comment), new keys go
below the last key of their table, whole tables in or out. An edit that cannot be made leaves the text as it was.
"""

import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import msgspec
import tomlkit

from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.geometry.zones import Circle, Polygon, Rectangle, Shape, Zone
from tui_gcs.core.scenario.lines import Span, map_lines
from tui_gcs.core.scenario.load import ScenarioError
from tui_gcs.core.scenario.model import Limits, OperatingArea, ResultLimits, TakeOffPlace, Team

Value = float | int | bool | str | list[Any]
Parameters = Mapping[str, float | int | bool | str]
_SHAPE_KEYS = (
    *("shape", "centre_m", "centre_deg", "radius_m", "width_m", "height_m", "heading_deg"),
    *("vertices_m", "vertices_deg", "alt_min_m", "alt_max_m"),
)


class ScenarioDocument:
    """A scenario's text and edits of it. Rounds are counted from 0, zones and teams go by name.

    Edits say nothing about sense: parse `text` afterwards. They raise `ScenarioError` where there is no such round,
    zone or team, or where it is written in a way that is not edited here (inline tables).
    """

    def __init__(self, text: str) -> None:
        """Take a TOML text. Raises `ScenarioError` if it is none."""
        self._text = text
        self._data = _loads(text)

    @property
    def text(self) -> str:
        """The file as it stands; without edits the very text given."""
        return self._text

    def set_scenario(self, *, name: str, seed: int, footprint_radius_m: float) -> None:
        """Set what stands above all tables."""
        with self._all_or_nothing():
            self._apply("", {"name": name, "seed": seed, "footprint_radius_m": footprint_radius_m})

    def set_origin(self, origin: Origin) -> None:
        """Set where ENU (0, 0) lies: what is written in metres moves with it, what is written in degrees stays."""
        self._set_table("origin", msgspec.structs.asdict(origin))

    def set_limits(self, limits: Limits) -> None:
        """Set what no vehicle may exceed; what is as preset and was not written is not written."""
        self._set_table("limits", msgspec.structs.asdict(limits), msgspec.structs.asdict(Limits()))

    def set_results(self, results: ResultLimits) -> None:
        """Set what a good run must reach; what is as preset and was not written is not written."""
        self._set_table("results", msgspec.structs.asdict(results), msgspec.structs.asdict(ResultLimits()))

    def set_resume(self, resume: bool) -> None:
        """Set whether a restarted station flies on by itself."""
        self._set_table("link_loss", {"resume": resume}, {"resume": False})

    def set_round(self, round_index: int, *, name: str | None = None, duration_s: float | None = None) -> None:
        """Set a round's name or duration."""
        given = {"name": name, "duration_s": duration_s}
        with self._all_or_nothing():
            self._apply(self._round(round_index), {k: v for k, v in given.items() if v is not None})

    def add_round(self, like_index: int, name: str) -> None:
        """Add a round behind the last one: the same as this one under another name. Its comments are not copied."""
        rounds = len(self._tables("", "round"))
        lines = self._lines()
        copied: list[str] = []
        for span in self._spans_under(self._round(like_index)):
            copied += ["", *(line.rstrip("\r") for line in lines[span.first : span.last + 1])]
        with self._all_or_nothing():
            self._insert_after(self._spans_under(self._round(rounds - 1))[-1].last, copied)
            self._apply(self._round(rounds), {"name": name})

    def remove_round(self, round_index: int) -> None:
        """Remove a round with its zones; comments around it stay."""
        self._remove_tables(self._round(round_index))

    def set_area(self, round_index: int, area: OperatingArea) -> None:
        """Set a round's operating area."""
        path = f"{self._round(round_index)}.area"
        band = {"alt_min_m": area.alt_min_m, "alt_max_m": area.alt_max_m}
        with self._all_or_nothing():
            self._apply(path, self._shape_keys(path, area.shape) | band, _SHAPE_KEYS)

    def set_zone(self, round_index: int, zone_name: str, zone: Zone) -> None:
        """Replace one round's zone of that name; `zone.name` may be another (see `rename_zone`)."""
        path = self._zone(round_index, zone_name)
        with self._all_or_nothing():
            self._apply(path, self._zone_keys(path, zone), _SHAPE_KEYS)

    def add_zone(self, round_index: int, zone: Zone) -> None:
        """Add a zone after the last one of the round."""
        path = self._round(round_index)
        zones = self._tables(path, "zone")
        after = f"{path}.zone[{len(zones)}]" if zones else f"{path}.area"
        if not self._has_header(after):
            after = path
        self._insert_table(self._span(after).last, "[[round.zone]]", self._zone_keys("", zone))

    def remove_zone(self, round_index: int, zone_name: str) -> None:
        """Remove one round's zone; comments around it stay."""
        self._remove_tables(self._zone(round_index, zone_name))

    def rename_zone(self, old: str, new: str) -> None:
        """Give a zone another name in every round, and in the teams that serve it."""
        places: list[tuple[str, str]] = []
        for r, _ in enumerate(self._tables("", "round")):
            if any(zone.get("name") == old for zone in self._tables(self._round(r), "zone")):
                places.append((self._zone(r, old), "name"))
        for team in self._tables("", "team"):
            if team.get("zone") == old:
                places.append((self._team(str(team.get("name"))), "zone"))
        self._replace_values(places, new)

    def add_team(self, team: Team) -> None:
        """Add a team behind the last one."""
        numbers: dict[str, Value] = {"vehicles": list(team.vehicles)} if team.vehicles else {"count": team.count}
        keys: dict[str, Value] = {"name": team.name, "zone": team.zone, "planner": team.planner, **numbers}
        teams = len(self._tables("", "team"))
        with self._all_or_nothing():
            self._insert_table(self._spans_under(f"team[{teams}]")[-1].last, "[[team]]", keys)
            if team.parameters:
                self._set_parameters(self._team(team.name), team.parameters)

    def remove_team(self, name: str) -> None:
        """Remove a team with its planner's parameters."""
        self._remove_tables(self._team(name))

    def add_place(self, place: TakeOffPlace) -> None:
        """Add a take-off place behind the last one."""
        places = len(self._tables("", "place"))
        keys = self._place_keys(f"place[{places}]", place)
        self._insert_table(self._spans_under(f"place[{places}]")[-1].last, "[[place]]", keys)

    def set_place(self, index: int, place: TakeOffPlace) -> None:
        """Replace a take-off place, counted from 0."""
        path = self._place(index)
        with self._all_or_nothing():
            self._apply(path, self._place_keys(path, place), ("vehicle",))

    def remove_place(self, index: int) -> None:
        """Remove a take-off place, counted from 0."""
        self._remove_tables(self._place(index))

    def set_team(
        self,
        team_name: str,
        *,
        name: str | None = None,
        zone: str | None = None,
        planner: str | None = None,
        vehicles: Sequence[int] | None = None,
        count: int | None = None,
        parameters: Parameters | None = None,
    ) -> None:
        """Set what is given of a team. `vehicles` takes out `count` and the other way round; `parameters` are all."""
        path = self._team(team_name)
        given: dict[str, Value | None] = {"name": name, "zone": zone, "planner": planner, "count": count}
        given["vehicles"] = list(vehicles) if vehicles is not None else None
        swapped = ("vehicles", "count") if vehicles is not None or count is not None else ()
        with self._all_or_nothing():
            if parameters is not None:
                self._set_parameters(path, parameters)
            self._apply(path, {k: v for k, v in given.items() if v is not None}, swapped)

    def _set_parameters(self, team_path: str, parameters: Parameters) -> None:
        path = f"{team_path}.parameters"
        have = self._at(team_path).get("parameters")
        if have is None and parameters:
            self._insert_table(self._span(team_path).last, "[team.parameters]", parameters)
        elif have is not None and self._has_header(path):
            self._apply(path, parameters, tuple(have))
        elif have is not None:  # an inline table is a value
            table = tomlkit.inline_table()
            table.update(parameters)
            self._apply(team_path, {"parameters": table})

    def _set_table(self, path: str, values: Parameters, preset: Parameters | None = None) -> None:
        """Set a table's keys; those that are as `preset` are not added."""
        have = self._at(path)
        values = {k: v for k, v in values.items() if k in have or preset is None or preset[k] != v}
        with self._all_or_nothing():
            if have and path in self._inline():
                table = tomlkit.inline_table()
                table.update({**have, **values})
                self._apply("", {path: table})
            elif have or self._has_header(path):
                self._apply(path, values)
            elif values:
                lines = self._lines()
                written = (number for number in reversed(range(len(lines))) if lines[number].strip())
                last = self._span("origin").last if self._has_header("origin") else next(written)
                self._insert_table(last, f"[{path}]", values)

    def _inline(self) -> set[str]:
        """Keys above all tables that hold a table in braces."""
        lines, spans = self._lines(), self._spans()
        return {
            key
            for key, value in self._data.items()
            if isinstance(value, dict) and key in spans and not lines[spans[key].first].lstrip().startswith("[")
        }

    @contextmanager
    def _all_or_nothing(self) -> Iterator[None]:
        before, done = (self._text, self._data), False
        try:
            yield
            done = True
        finally:
            if not done:
                self._text, self._data = before

    # ------------------------------------------------------------ where things are

    def _round(self, index: int) -> str:
        if not 0 <= index < len(self._tables("", "round")):
            raise ScenarioError([f"scenario: there is no round {index + 1}"])
        return f"round[{index + 1}]"

    def _zone(self, round_index: int, name: str) -> str:
        return self._named(self._round(round_index), "zone", name)

    def _team(self, name: str) -> str:
        return self._named("", "team", name)

    def _place(self, index: int) -> str:
        if not 0 <= index < len(self._tables("", "place")):
            raise ScenarioError([f"scenario: there is no take-off place {index + 1}"])
        return f"place[{index + 1}]"

    def _named(self, path: str, key: str, name: str) -> str:
        for i, table in enumerate(self._tables(path, key)):
            if table.get("name") == name:
                return f"{path}.{key}[{i + 1}]".removeprefix(".")
        raise ScenarioError([f"scenario: {path or 'file'}: there is no {key} named {name!r}"])

    def _tables(self, path: str, key: str) -> list[dict[str, Any]]:
        found = self._at(path).get(key, [])
        return found if isinstance(found, list) and all(isinstance(t, dict) for t in found) else []

    def _at(self, path: str) -> dict[str, Any]:
        """The table at a key path, as plain data; empty if it is not there."""
        table: Any = self._data
        for step in filter(None, path.replace("]", "").replace("[", ".").split(".")):
            table = table[int(step) - 1] if isinstance(table, list) else table.get(step, {})
        return table if isinstance(table, dict) else {}

    def _spans(self) -> dict[str, Span]:
        return map_lines(self._text)

    def _has_header(self, path: str) -> bool:
        span = self._spans().get(path)
        return span is not None and self._lines()[span.first].lstrip().startswith("[")

    def _span(self, path: str, known: Mapping[str, Span] | None = None) -> Span:
        spans = self._spans() if known is None else known
        if path not in spans:
            header = path.replace("]", "").split("[")[0]
            raise ScenarioError(
                [f"scenario: {path} is not edited here; write it under a header of its own, [{header}]"]
            )
        return spans[path]

    def _spans_under(self, path: str) -> list[Span]:
        """Of the table at `path` and of all tables with a header of their own in it, in the order of the file."""
        self._span(path)
        lines = self._lines()
        inside = [span for at, span in self._spans().items() if at == path or at.startswith(f"{path}.")]
        return sorted(span for span in inside if lines[span.first].lstrip().startswith("["))

    # ------------------------------------------------------------ edits

    def _apply(self, path: str, values: Mapping[str, Any], owned: Iterable[str] = ()) -> None:
        """Set `values` in the table at `path` and take out the other `owned` keys it has."""
        have = self._at(path)
        for key, value in values.items():
            if key not in have:
                self._add_key(path, key, value)
            elif not _same(have[key], value):
                self._replace_values([(path, key)], value)
        for key in owned:
            if key in have and key not in values:
                span = self._span(_join(path, key))
                self._commit([*self._lines()[: span.first], *self._lines()[span.last + 1 :]])

    def _replace_values(self, places: Iterable[tuple[str, str]], value: Value) -> None:
        """Put `value` under each of these (table, key): from the last on, so that lines above stay where they are."""
        lines, known = self._lines(), self._spans()
        spans = [(self._span(_join(path, key), known), path, key) for path, key in places]
        for span, path, key in sorted(spans, reverse=True):
            end = "\r" if lines[span.last].endswith("\r") else ""
            fragment = tomlkit.parse("\n".join(lines[span.first : span.last + 1]).replace("\r", ""))
            if key not in fragment:
                raise ScenarioError([f"scenario: {_join(path, key)} is not edited here; write it as {key} = value"])
            fragment[key] = value
            lines[span.first : span.last + 1] = [line + end for line in fragment.as_string().split("\n")]
        self._commit(lines)

    def _add_key(self, path: str, key: str, value: Value) -> None:
        self._insert_after(self._span(path).last, [_key_line(key, value)])

    def _insert_table(self, after_line: int, header: str, values: Mapping[str, Any]) -> None:
        self._insert_after(after_line, ["", header, *(_key_line(k, v) for k, v in values.items())])

    def _remove_tables(self, path: str) -> None:
        """This table and those in it, each with the empty line behind it."""
        lines = self._lines()
        for span in reversed(self._spans_under(path)):
            last = span.last + (span.last + 1 < len(lines) and not lines[span.last + 1].strip())
            del lines[span.first : last + 1]
        self._commit(lines)

    def _insert_after(self, line: int, new: list[str]) -> None:
        lines = self._lines()
        end = "\r" if lines[line].endswith("\r") else ""
        if line == len(lines) - 1:  # the file's last line has no end; the new last one shall have it
            new = [*new, ""]
        self._commit([*lines[: line + 1], *(text + end if text or end else text for text in new), *lines[line + 1 :]])

    def _lines(self) -> list[str]:
        return self._text.split("\n")

    def _commit(self, lines: list[str]) -> None:
        text = "\n".join(lines)
        self._data = _loads(text)
        self._text = text

    # ------------------------------------------------------------ values

    def _zone_keys(self, path: str, zone: Zone) -> dict[str, Value]:
        keys: dict[str, Value] = {"name": zone.name, "role": zone.role.value, **self._shape_keys(path, zone.shape)}
        band = {"alt_min_m": zone.alt_min_m, "alt_max_m": zone.alt_max_m}
        return keys | {key: value for key, value in band.items() if value is not None}

    def _shape_keys(self, path: str, shape: Shape) -> dict[str, Value]:
        """The keys of a shape; positions stay in degrees where they were."""
        match shape:
            case Circle():
                return {"shape": "circle", **self._at_place(path, "centre", shape.centre_m), "radius_m": shape.radius_m}
            case Rectangle():
                keys = {"shape": "rectangle", **self._at_place(path, "centre", shape.centre_m)}
                keys |= {"width_m": shape.width_m, "height_m": shape.height_m}
                if shape.heading_deg or "heading_deg" in self._at(path):
                    keys["heading_deg"] = shape.heading_deg
                return keys
            case Polygon():
                degrees = "vertices_deg" in self._at(path)
                points = [self._degrees(point) if degrees else list(point) for point in shape.vertices_m]
                return {"shape": "polygon", "vertices_deg" if degrees else "vertices_m": points}

    def _place_keys(self, path: str, place: TakeOffPlace) -> dict[str, Value]:
        keys = {"vehicle": place.vehicle} if place.vehicle is not None else {}
        return {**keys, **self._at_place(path, "place", place.place_m), "layer_m": place.layer_m}

    def _at_place(self, path: str, stem: str, point_m: tuple[float, float]) -> dict[str, Value]:
        if f"{stem}_deg" in self._at(path):
            return {f"{stem}_deg": self._degrees(point_m)}
        return {f"{stem}_m": list(point_m)}

    def _degrees(self, point_m: tuple[float, float]) -> list[float]:
        """[latitude, longitude] to 1e-9 degrees (0.1 mm)."""
        origin = self._data["origin"]
        frame = LocalFrame(Origin(float(origin["lat_deg"]), float(origin["lon_deg"]), 0.0))
        return [round(degrees, 9) for degrees in frame.to_geodetic(*point_m)]


def _loads(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ScenarioError([f"scenario: not valid TOML: {error}"]) from None


def _join(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key


def _key_line(key: str, value: Value) -> str:
    table = tomlkit.document()
    table[key] = value
    return table.as_string().rstrip("\n")


def _same(old: Any, new: Any) -> bool:
    """Equal and of one kind: 1 and 1.0 are the same number, true is not 1."""
    if isinstance(old, bool) or isinstance(new, bool):
        return old is new
    return bool(old == new)
