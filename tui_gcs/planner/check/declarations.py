"""Checks what a planner declares, whether its first seconds fly, and whether its parameters work over their ranges."""

import ast
import re
import time
from collections.abc import Iterator

from tui_gcs.planner.api import Param, ParamValue, Planner
from tui_gcs.planner.check.plan_form import active_ids, faults
from tui_gcs.planner.check.subject import CheckedPlanner, Finding, PlannerFailure, PlannerRefusal, failed, noted, passed
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.kinematic_fleet import KinematicFleet, scattered, task_for
from tui_gcs.planner.runtime.planner_errors import PlannerError

NAME = re.compile(r"[a-z][a-z0-9_-]{0,31}")
TYPES = (float, int, bool, str)
CONFIGURE_LIMIT_S, CONFIGURE_GOAL_S = 20.0, 5.0
"""Without a plan this long after a task the station lets vehicles hold and notifies the operator."""
MAX_PARAMS = 32
MIN_RATE_HZ, MAX_RATE_HZ = 1.0, 20.0


def declares(subject: CheckedPlanner) -> Iterator[Finding]:
    """Check name, version, rates and parameters."""
    planner = subject.planner
    wrong = list(_wrong(planner)) or _refused(planner)
    if wrong:
        more = "; ".join(wrong[1:])
        yield failed(wrong[0], f"and {more}" if more else "operators' forms and the host go by what is declared")
        return
    texts = [param.name for param in planner.params if not param.help]
    yield passed(
        f"{planner.name} {planner.version}, {planner.rate_hz:g} Hz, parameters: {len(planner.params) or 'none'}"
    )
    if texts:
        yield noted(f"no help for {', '.join(texts)}", "Param(help=…) is what an operator reads in the form")


def _refused(planner: type[Planner]) -> list[str]:
    """Return why a station would not load this class, as for a metric that is declared wrongly."""
    try:
        registry.validated(planner)
    except PlannerError as problem:
        return [str(problem)]
    return []


def _wrong(planner: type[Planner]) -> Iterator[str]:
    if not isinstance(planner.name, str) or not NAME.fullmatch(planner.name):
        yield f"name = {planner.name!r}: must be lower-case letters, digits, - and _, beginning with a letter"
    if not isinstance(planner.version, str) or not planner.version:
        yield f"version = {planner.version!r}: must be a text, for example '1'"
    if not _is_number(planner.rate_hz) or not MIN_RATE_HZ <= planner.rate_hz <= MAX_RATE_HZ:
        yield f"rate_hz = {planner.rate_hz!r}: must be {MIN_RATE_HZ:g} to {MAX_RATE_HZ:g}"
    if not _is_number(planner.iterations_per_s) or not planner.iterations_per_s >= 0:
        yield f"iterations_per_s = {planner.iterations_per_s!r}: must be 0 or more"
    if not isinstance(planner.ids_matter, bool):
        yield f"ids_matter = {planner.ids_matter!r}: must be True or False"
    if planner.step is Planner.step:
        yield "step is not written: it is what a planner is"
    if not isinstance(planner.params, tuple) or not all(isinstance(param, Param) for param in planner.params):
        yield "params must be a tuple of Param(…): with one of them, write (Param(…),) with its comma"
        return
    names = [param.name for param in planner.params]
    if len(names) > MAX_PARAMS:
        yield f"{len(names)} parameters: at most {MAX_PARAMS}"
    for param in planner.params:
        yield from _wrong_param(param, names.count(param.name))


def _wrong_param(param: Param, count: int) -> Iterator[str]:
    if not isinstance(param.name, str) or not param.name.isidentifier():
        yield f"parameter {param.name!r}: its name must be an identifier"
    if count > 1:
        yield f"parameter {param.name} is declared {count} times"
    if param.type not in TYPES:
        yield f"parameter {param.name}: type {param.type!r} must be float, int, bool or str"
        return
    low, high = param.minimum, param.maximum
    if low is not None and high is not None and low > high:
        yield f"parameter {param.name}: minimum {low:g} is above maximum {high:g}"
    if param.choices and param.type is not str:
        yield f"parameter {param.name}: choices are for texts"
    if problem := param.problem(param.default):
        yield f"parameter {param.name}: its own default {param.default!r} is refused ({problem})"


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def flies(subject: CheckedPlanner) -> Iterator[Finding]:
    """Fly four vehicles for twenty seconds."""
    task = task_for(range(1, 5), subject.name, seed=subject.seed)
    began_s = time.process_time()
    host = subject.host(task)
    took_s = time.process_time() - began_s
    world = KinematicFleet(task, scattered(4))
    begin_m = world.position_m.copy()
    commanded: set[int] = set()
    steps = 0
    for frame, plan in subject.fly(host, world, 20.0):
        if wrong := faults(plan, frame, task):
            yield failed(f"step {steps + 1}: {wrong[0]}", "the station does not take such an intent, or vetoes it")
            return
        commanded |= {intent.vehicle for intent in plan.intents}
        steps += 1
    silent = sorted(active_ids(world.frame()) - commanded)
    moved = float(abs(world.position_m - begin_m).max())
    if silent:
        yield noted(f"no intent in 20 s for vehicles {silent}", "a vehicle without an intent holds where it is")
    yield passed(f"{steps} steps, 4 vehicles, the farthest moved {moved:.0f} m along one axis")
    limit = f"configure took {took_s:.2f} s of CPU"
    if took_s > CONFIGURE_LIMIT_S:
        yield failed(
            limit,
            f"after {CONFIGURE_LIMIT_S:g} s the station lets vehicles hold: search in step, by ctx.iterations",
        )
    elif took_s > CONFIGURE_GOAL_S:
        yield noted(limit, "vehicles hold meanwhile: a first answer now, a better one later in step, by ctx.iterations")
    else:
        yield passed(limit)


def parameters(subject: CheckedPlanner) -> Iterator[Finding]:
    """Fly with every parameter at both ends of its range: the planner must fly or refuse."""
    refused = []
    if not subject.planner.params:
        yield passed("there are none")
        return
    for end in ("least", "greatest"):
        values = {param.name: _extreme(param, end) for param in subject.planner.params}
        task = task_for(range(1, 4), subject.name, seed=subject.seed, parameters=values)
        try:
            host = subject.host(task)
            for frame, plan in subject.fly(host, KinematicFleet(task, scattered(3)), 3.0):
                if wrong := faults(plan, frame, task):
                    raise PlannerFailure(wrong[0])
        except PlannerRefusal as why:
            refused.append(f"{end} values: {why}")
        except PlannerFailure as why:
            advice = "narrow minimum and maximum, or raise ValueError in configure with what is wrong"
            yield failed(f"all at their {end} value: {why}", advice)
            return
    yield passed("all at their least and greatest values")
    for text in refused:
        yield noted(f"refused, as configure may: {text}")


def _extreme(param: Param, end: str) -> ParamValue:
    if param.choices:
        return param.choices[0 if end == "least" else -1]
    if param.type is bool:
        return end == "greatest"
    bound = param.minimum if end == "least" else param.maximum
    if bound is None or param.type is str:
        return param.default
    return int(bound) if param.type is int else float(bound)


SUSPICIOUS = {"random", "secrets", "uuid", "time", "datetime"}
"""Modules that give time or chance, which a planner must take from its context."""


def suspects(source: bytes, name: str) -> str:
    """Return lines of `source` that use time, chance or unordered sets, as advice; "" without any."""
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError):
        return ""
    found: dict[int, str] = {}
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names):
                for module in [n.name for n in names if n.name.partition(".")[0] in SUSPICIOUS]:
                    found[node.lineno] = f"import {module}"
            case ast.ImportFrom(module=str(module)) if module.partition(".")[0] in SUSPICIOUS:
                found[node.lineno] = f"from {module} import"
            case ast.Attribute(value=ast.Attribute(value=ast.Name(id="np" | "numpy"), attr="random"), attr=attribute):
                if attribute not in ("Generator", "SeedSequence"):
                    found[node.lineno] = f"np.random.{attribute}"
            case ast.Call(func=ast.Name(id="hash" | "id" | "set" | "frozenset" as function)):
                found[node.lineno] = f"{function}()"
            case ast.Set() | ast.SetComp():
                found[node.lineno] = "a set"
    return ", ".join(f"{name}:{line} {what}" for line, what in sorted(found.items())[:5])
