"""The known file formats: recognised by their contents when read, by the ending of the name when written."""

from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

from tui_gcs.core.base.text import clean
from tui_gcs.core.formats import (
    fence_rally_lists,
    geojson,
    kml,
    params,
    plan_json,
    qgc_plan,
    wpl,
)
from tui_gcs.core.formats.bounded import json_of, text_of
from tui_gcs.core.formats.content import Content, Drawing, FormatError
from tui_gcs.core.formats.flight_logs import log_in
from tui_gcs.core.formats.wpl import HomeLine
from tui_gcs.core.plans.model import Plan, PlanKind


class Family(Enum):
    """What kind of thing a format holds."""

    PLAN = "plan"
    DRAWING = "drawing"
    PARAMS = "parameters"
    SCENARIO = "scenario"


@dataclass(frozen=True)
class Format:
    """A format that can be written."""

    name: str
    family: Family
    endings: tuple[str, ...]
    text: str


FORMATS = (
    Format("plan", Family.PLAN, (".plan",), "QGroundControl's plan: mission, fence and rally points"),
    Format("wpl", Family.PLAN, (".waypoints", ".wpl", ".txt"), "QGC WPL 110: one of mission, fence, rally points"),
    Format("json", Family.PLAN, (".json",), "ours: one of mission, fence, rally points"),
    Format("fence", Family.PLAN, (".fen", ".fence"), "the older fence file of Mission Planner and MAVProxy"),
    Format("rally", Family.PLAN, (".ral", ".rally"), "the older rally file of Mission Planner and MAVProxy"),
    Format("kml", Family.DRAWING, (".kml",), "zones and paths for map programs"),
    Format("kmz", Family.DRAWING, (".kmz",), "the same, packed"),
    Format("geojson", Family.DRAWING, (".geojson",), "zones and paths for geographic programs"),
    Format("param", Family.PARAMS, (".param",), "parameters as Mission Planner writes them"),
    Format("parm", Family.PARAMS, (".parm",), "parameters as MAVProxy writes them"),
    Format("params", Family.PARAMS, (".params",), "parameters as QGroundControl writes them"),
    Format("scenario", Family.SCENARIO, (".toml",), "a scenario of this program"),
)
BY_NAME = {each.name: each for each in FORMATS}
KNOWN = ", ".join(ending for each in FORMATS for ending in each.endings)
NEEDED = {(".kml",): "XML document", (".kmz",): "ZIP archive", (".plan", ".json", ".geojson"): "JSON object"}
"""By the endings of a name, what such a file is at least; checked last, because files are often named wrongly."""


def format_of(name: str) -> Format | None:
    """Return the format that belongs to the ending of a name, None if unknown."""
    lower = name.lower()
    return next((each for each in FORMATS if lower.endswith(each.endings)), None)


def read_file(
    data: bytes,
    kind: PlanKind | None = None,
    home: HomeLine = HomeLine.AUTO,
    path: Path | None = None,
) -> Content:
    """Read a file of any of these formats but scenarios, recognised by its contents. Raises FormatError.

    `kind` is the kind of plan in a `QGC WPL` file, `home` whether its first line is home. From `path`, files that a
    parameter file includes are found, and what it should hold by its name.
    """
    if data.startswith(kml.ZIP_MAGIC):
        return _drawn(kml.read_kmz(data))
    # By contents, not by name: files are often named wrongly.
    if data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"<":
        return _drawn(kml.read_kml(data))
    if log := log_in(data):
        raise FormatError(f"is {log}, and no plan, drawing or parameters")
    text = text_of(data)
    if text.lstrip().startswith("{"):
        return _of_json(text)
    if wpl.is_wpl(text):
        read = wpl.read_wpl(text, kind, home)
        return replace(_of_plan(read.plan), home=read.home, notes=(read.note,) * bool(read.note))
    return _of_lines(text, path)


def _of_lines(text: str, path: Path | None) -> Content:
    """Read one of the formats that are lines of words and numbers. Raises FormatError."""
    for endings, needed in NEEDED.items():
        if path is not None and path.name.lower().endswith(endings):
            raise FormatError(f"is named {path.suffix}, and is no {needed}")
    lines = fence_rally_lists.lines_of(text)
    if not lines:
        raise FormatError("is empty")
    if fence_rally_lists.is_rally(lines):
        plan, lost = fence_rally_lists.read_rally(lines)
        return Content(rally=plan, left_out=lost)
    if fence_rally_lists.is_fence(lines):
        return Content(fence=fence_rally_lists.read_fence(lines))
    if not params.are_params(lines):
        raise FormatError(f"line {lines[0][0]}: none of the formats known here ({KNOWN})")
    read = params.read_params(lines, path)
    return Content(params=read.params, left_out=read.left_out, notes=read.notes)


def _of_json(text: str) -> Content:
    document = json_of(text)
    if qgc_plan.is_qgc(document):
        return qgc_plan.content_of(document)
    if geojson.is_geojson(document):
        return _drawn(geojson.read_geojson(document))
    if "kind" in document:
        return _of_plan(plan_json.read_plain(document))
    if "items" in document and document.get("groundStation") == "QGroundControl":
        raise FormatError(
            "is an old mission of QGroundControl (.mission), which is not read here: save it as .plan there"
        )
    keys = clean(", ".join(list(document)[:3]), 60)
    raise FormatError(f"JSON, but no plan and no GeoJSON (it has {keys or 'nothing'})")


def _of_plan(plan: Plan) -> Content:
    match plan.kind:
        case PlanKind.MISSION:
            return Content(mission=plan)
        case PlanKind.FENCE:
            return Content(fence=plan)
        case PlanKind.RALLY:
            return Content(rally=plan)


def _drawn(drawings: tuple[Drawing, ...]) -> Content:
    if not drawings:
        raise FormatError("nothing is drawn in it: no point, path or area")
    return Content(drawings=drawings)


def family_of(content: Content) -> Family:
    """Return what kind of thing a content is."""
    if content.params:
        return Family.PARAMS
    return Family.DRAWING if content.drawings else Family.PLAN
