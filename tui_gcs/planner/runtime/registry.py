"""The planners that can be named: built-in ones and those of installed packages (entry points `tui_gcs.planners`)."""

import contextlib
import re
from collections.abc import Collection, Mapping
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import get_args

from tui_gcs.core.protocol.planning import TYPES, PlannerInfo
from tui_gcs.planner.api import Instances, JudgedBy, Metric, Param, ParamValue, Planner
from tui_gcs.planner.runtime.planner_errors import PlannerError
from tui_gcs.planner.runtime.planner_file import PlannerFile, load_file

GROUP = "tui_gcs.planners"
NAME = r"[A-Za-z0-9_-]{1,64}"
"""Pattern of the planner names that a scenario can hold."""
RATE_HZ = (1.0, 20.0)
"""Smallest and largest step rate that a planner may declare."""
MAX_ITERATIONS_PER_S = 1e6

_BUILTIN = {
    "guardian": "tui_gcs.planner.guardian.guardian:Guardian",
    "patrol": "tui_gcs.planner.patrol.patrol:Patrol",
    "search": "tui_gcs.planner.search:Search",
    "survey": "tui_gcs.planner.survey.survey:SurveyPlanner",
    "waypoints": "tui_gcs.planner.waypoints:Waypoints",
}

_FILE_PLANNERS: dict[str, type[Planner]] = {}


def names() -> tuple[str, ...]:
    """Return the names of all known planners, sorted."""
    return tuple(sorted({*_BUILTIN, *(point.name for point in entry_points(group=GROUP))}))


def register_class(planner: type[Planner]) -> str:
    """Make a planner class from a file known in this process. The prefix `file:` keeps its name apart."""
    name = f"file:{planner.name or planner.__name__}"
    _FILE_PLANNERS[name] = planner
    return name


def load(name: str, files: Mapping[str, PlannerFile] | None = None) -> type[Planner]:
    """Return the planner class called `name`, imported on first use. Packages cannot replace built-in names.

    Raises:
        PlannerError: the name is unknown, its module cannot be imported, or it is no subclass of our `Planner`.
    """
    if files and name in files:
        return validated(load_file(files[name].path, files[name].sha256))
    try:
        found = _import(name)
    except Exception as error:
        raise PlannerError(f"planner {name!r} cannot be loaded: {type(error).__name__}: {error}") from error
    if found is None:
        raise PlannerError(f"unknown planner {name!r}; known: {', '.join(names())}")
    if not (isinstance(found, type) and issubclass(found, Planner)):
        raise PlannerError(f"planner {name!r} is not a subclass of tui_gcs.planner.api.Planner")
    return validated(found)


def validated(planner: type[Planner]) -> type[Planner]:
    """Return `planner` if its declared rates and parameters are valid. Raises PlannerError."""
    low, high = RATE_HZ
    for value, what, least, most in (
        (planner.rate_hz, "rate_hz", low, high),
        (planner.iterations_per_s, "iterations_per_s", 0.0, MAX_ITERATIONS_PER_S),
    ):
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value <= most:
            raise PlannerError(f"planner {planner.name!r}: {what} {value!r} is not from {least:g} to {most:g}")
    for param in planner.params:
        if not isinstance(param, Param) or param.type not in TYPES.values():
            raise PlannerError(
                f"planner {planner.name!r}: params holds {param!r}: each is a Param of float, int, bool or str"
            )
        if problem := param.problem(param.default):
            raise PlannerError(f"planner {planner.name!r}: the default of {problem}")
    if planner.instances not in get_args(Instances):
        forms = " or ".join(map(repr, get_args(Instances)))
        raise PlannerError(f"planner {planner.name!r}: instances = {planner.instances!r}: must be {forms}")
    if problem := _judgement_problem(planner):
        raise PlannerError(f"planner {planner.name!r}: {problem}")
    return planner


def declared_metrics(planner: type[Planner]) -> tuple[Metric, ...]:
    """Return the metrics that a class declares. A method or property of that name is the author's own: no metrics."""
    given: object = planner.metrics
    return tuple(given) if isinstance(given, (tuple, list)) else ()


def _judgement_problem(planner: type[Planner]) -> str:
    """Return what is wrong with `metrics` or `judged_by` of a class, or ""."""
    metrics = declared_metrics(planner)
    for metric in metrics:
        if not isinstance(metric, Metric):
            return f"metrics holds {metric!r}: each is a Metric"
        if problem := metric.problem():
            return problem
    names = [metric.name for metric in metrics]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        return f"metric {twice[0]} is declared twice"
    if planner.judged_by not in get_args(JudgedBy):
        return f"judged_by = {planner.judged_by!r}: must be one of {', '.join(get_args(JudgedBy))}"
    return ""


def info(name: str, files: Mapping[str, PlannerFile] | None = None) -> PlannerInfo:
    """Return what planner `name` declares, as a bus message. Raises PlannerError."""
    return described(name, load(name, files), (files or {}).get(name))


def infos(wanted: Collection[str], files: Mapping[str, PlannerFile] | None = None) -> dict[str, PlannerInfo]:
    """Return what these planners declare; those that cannot be loaded are left out."""
    found: dict[str, PlannerInfo] = {}
    for name in sorted(wanted):
        with contextlib.suppress(PlannerError):
            found[name] = info(name, files)
    return found


def described(name: str, found: type[Planner], file: PlannerFile | None) -> PlannerInfo:
    """Return what a planner class declares, as a bus message. `file` is where the class comes from."""
    params = tuple(param.info() for param in found.params)
    path, digest = (str(file.path), file.sha256) if file is not None else ("", "")
    metrics = declared_metrics(found)
    return PlannerInfo(name, str(found.version), params, float(found.rate_hz), path, digest, metrics, found.judged_by)


def file_info(path: Path, sha256: str) -> PlannerInfo:
    """Return what the planner in a file declares. Raises PlannerError, also for a name that no scenario can hold."""
    found = validated(load_file(path, sha256))
    if not isinstance(found.name, str) or not re.fullmatch(NAME, found.name):
        raise PlannerError(f"{path.name}: name = {found.name!r}: must be 1 to 64 of A-Z a-z 0-9 _ -")
    return described(found.name, found, PlannerFile(found.name, path, sha256))


def declared(name: str) -> tuple[Param, ...]:
    """Return the parameters that planner `name` declares, for forms and scenario checks. Raises PlannerError."""
    return load(name).params


def complete(name: str, given: Mapping[str, ParamValue]) -> dict[str, ParamValue]:
    """Return `given` checked against the declarations, with defaults for the missing ones.

    Raises:
        PlannerError: one line with everything that is wrong.
    """
    return checked(name, declared(name), given)


def checked(name: str, params: tuple[Param, ...], given: Mapping[str, ParamValue]) -> dict[str, ParamValue]:
    """As `complete`, for declarations that are already at hand."""
    problems = PlannerInfo(name, "", tuple(param.info() for param in params), 0.0).problems(dict(given))
    if problems:
        raise PlannerError(f"planner {name!r}: {'; '.join(problems)}")
    values: dict[str, ParamValue] = {}
    for param in params:
        value = given.get(param.name, param.default)
        values[param.name] = float(value) if param.type is float else value
    return values


def _import(name: str) -> object | None:
    if name in _FILE_PLANNERS:
        return _FILE_PLANNERS[name]
    if name in _BUILTIN:
        module, _, attribute = _BUILTIN[name].partition(":")
        found: object = getattr(import_module(module), attribute)
        return found
    # Sorted, because two packages may offer one name and their order depends on the file system.
    for point in sorted(entry_points(group=GROUP), key=lambda p: (p.name, p.value)):
        if point.name == name:
            return point.load()  # type: ignore[no-any-return]
    return None
