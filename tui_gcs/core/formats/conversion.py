"""Converting the contents of a file to another format. What that cannot hold is reported, never dropped silently."""

from dataclasses import dataclass, replace

from tui_gcs.core.formats import (
    drawings,
    fence_rally_lists,
    geojson,
    kml,
    params,
    plan_json,
    qgc_write,
    scenario_drawings,
    wpl,
)
from tui_gcs.core.formats.content import Content, Drawing, FormatError, Written, counted
from tui_gcs.core.formats.file_types import Family, Format, family_of
from tui_gcs.core.geometry.zones import Role
from tui_gcs.core.plans.model import Plan, PlanKind
from tui_gcs.core.scenario.edit import ScenarioDocument
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import Scenario


@dataclass(frozen=True)
class BaseScenario:
    """A scenario and its text."""

    scenario: Scenario
    text: str


@dataclass(frozen=True)
class ConversionOptions:
    """What the file that is read does not give."""

    title: str = ""
    """The title of a drawing."""
    kind: PlanKind | None = None
    """The kind of plan to write, where a format holds one."""
    height_m: float | None = None
    """The height above home of paths and points that do not give one."""
    round_index: int | None = None
    """The round of a scenario; None: all rounds, and the first where one is needed."""
    role: Role | None = None
    """The role of zones that have none."""
    base: BaseScenario | None = None
    """The scenario that zones are added to."""


def convert(read: Content | BaseScenario, target: Format, options: ConversionOptions) -> Written:
    """Return the bytes of the other file. Raises FormatError where there is nothing sensible to write."""
    if isinstance(read, BaseScenario):
        return _from_scenario(read, target, options)
    # The whole document of a `.plan` goes through, so nothing is lost.
    is_kept = target.name == "plan" and read.source is not None
    before = Written(b"", () if is_kept else read.left_out, read.notes)
    if target.family is Family.SCENARIO:
        return _after(before, _zones(read, options))
    have = family_of(read)
    if (have is Family.PARAMS) != (target.family is Family.PARAMS):
        raise FormatError(f"parameters and plans do not become each other ({target.name})")
    if target.family is Family.PARAMS:
        return _after(before, params.WRITERS[target.name](read.params))
    if target.family is Family.DRAWING:
        drawn = drawings.DrawnPlan(read.drawings) if have is Family.DRAWING else drawings.draw(read)
        if not drawn.drawings:
            raise FormatError("nothing in it is a place that could be drawn")
        data = _drawing(drawn.drawings, target, options)
        return _after(before, Written(data, drawn.left_out, drawn.notes))
    if have is Family.DRAWING:
        planned = drawings.planned(read.drawings, options.height_m)
        return _after(before, _plan(planned, target, options))
    return _after(before, _plan(read, target, options))


def _after(before: Written, written: Written) -> Written:
    """Return `written` with the earlier losses and notes before its own."""
    return Written(written.data, (*before.left_out, *written.left_out), (*before.notes, *written.notes))


def _drawing(drawn: tuple[Drawing, ...], target: Format, options: ConversionOptions) -> bytes:
    if target.name == "geojson":
        return geojson.write_geojson(drawn)
    return (kml.write_kmz if target.name == "kmz" else kml.write_kml)(drawn, options.title)


def _plan(read: Content, target: Format, options: ConversionOptions) -> Written:
    if not read.plans and read.source is None and not any(read.plan(kind) is not None for kind in PlanKind):
        raise FormatError("no path, fence or rally point is in it")
    if target.name == "plan":
        return qgc_write.write_qgc(read)
    plan = _one(read, target, options)
    lost = [f"{_words(other)} (--kind {other.kind.word} writes it)" for other in read.plans if other is not plan]
    if plan.kind is PlanKind.MISSION:
        lost += [f"{part}: its way is not in the file" for part in read.not_flown]
    written = _text(plan, read, target)
    return replace(written, left_out=(*lost, *written.left_out))


def _one(read: Content, target: Format, options: ConversionOptions) -> Plan:
    """Return the plan to write into a format that holds one. Raises FormatError."""
    fixed = {"fence": PlanKind.FENCE, "rally": PlanKind.RALLY}.get(target.name, options.kind)
    if fixed is not None:
        plan = read.plan(fixed)
        if plan is None or not plan.items:
            raise FormatError(f"there is no {fixed.word} in it")
        return plan
    plans = sorted(read.plans, key=lambda plan: plan.kind)
    empty = next((plan for kind in PlanKind if (plan := read.plan(kind)) is not None), Plan(PlanKind.MISSION))
    return plans[0] if plans else empty


def _text(plan: Plan, read: Content, target: Format) -> Written:
    if target.name == "wpl":
        home = read.home if plan.kind is PlanKind.MISSION else None
        note = ("home is not known: its line is 0, 0",) * (plan.kind is PlanKind.MISSION and home is None)
        return Written(wpl.write_wpl(plan, home).encode(), (), note)
    if target.name == "json":
        note = ("home is not in such a file",) * (read.home is not None)
        return Written(plan_json.write_plain(plan).encode(), (), note)
    return fence_rally_lists.write_fence(plan) if target.name == "fence" else fence_rally_lists.write_rally(plan)


def _words(plan: Plan) -> str:
    return f"{plan.kind.word} of {counted(len(plan.items), 'item')}"


def _from_scenario(base: BaseScenario, target: Format, options: ConversionOptions) -> Written:
    scenario = base.scenario
    if target.family is Family.DRAWING:
        chosen = None if options.round_index is None else (options.round_index,)
        drawn = scenario_drawings.draw_scenario(scenario, chosen)
        lost = ("teams, planners, limits: drawings have places only",)
        return Written(_drawing(drawn, target, replace(options, title=options.title or scenario.name)), lost)
    if target.family is not Family.PLAN:
        raise FormatError(f"a scenario does not become {target.text}")
    index = options.round_index or 0
    fence = scenario_drawings.fence_of_round(scenario, index)
    round_ = scenario.rounds[index]
    note = f"{round_.name}: its operating area and {counted(len(round_.no_fly), 'no-fly zone')} as a fence"
    zones = len(round_.zones) - len(round_.no_fly)
    lost = (f"{counted(zones, 'zone')} to fly in, teams, planners and limits",)
    return _after(Written(b"", lost, (note,)), _plan(Content(fence=fence), target, replace(options, kind=None)))


def _zones(read: Content, options: ConversionOptions) -> Written:
    """Add the areas of a drawing to a scenario as zones. Raises FormatError."""
    if not read.drawings:
        raise FormatError("zones come from KML, KMZ or GeoJSON; convert a plan into one of them first")
    if options.base is None:
        raise FormatError("zones need a scenario to be added to: --base SCENARIO.toml")
    if options.role is None and scenario_drawings.needs_role(read.drawings):
        raise FormatError("its areas do not say what they are for: --role defend, attack or no-fly")
    try:
        document = ScenarioDocument(options.base.text)
        role = options.role or Role.DEFEND
        index, only = options.round_index or 0, options.round_index is not None
        put = scenario_drawings.put_drawings(document, options.base.scenario, read.drawings, index, role, only=only)
        # What is written must be readable: a zone may break a rule of scenarios.
        parse(document.text, "the result")
    except ScenarioError as error:
        raise FormatError(error.problems[0]) from None
    if not (put.added or put.replaced or put.areas):
        raise FormatError(put.text)
    return Written(document.text.encode(), put.left_out, (put.text,))
