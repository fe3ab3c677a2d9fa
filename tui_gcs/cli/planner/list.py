"""`tui-gcs planner list`: the planners that a scenario can name, and the meaning of their parameters."""

import argparse
import sys
from importlib.metadata import entry_points
from typing import Any

from tui_gcs.cli.command_report import CommandReport, finish
from tui_gcs.cli.exit_codes import ReportCode
from tui_gcs.core.base.text import clean
from tui_gcs.planner.api import Param
from tui_gcs.planner.runtime import registry
from tui_gcs.planner.runtime.planner_errors import PlannerError


def run(arguments: argparse.Namespace) -> int:
    """Print them all; the exit code is 1 if one of them cannot be loaded."""
    rows = [_row(name) for name in registry.names()]
    if not arguments.json:
        sys.stdout.write("\n".join(map(_text, rows)))
    broken = [row["name"] for row in rows if "problem" in row]
    code = ReportCode.FAILED if broken else ReportCode.NONE
    text = f"cannot be loaded: {', '.join(broken)}" if broken else ""
    return finish(arguments, CommandReport(not broken, code, text, {"planners": rows}))


def _row(name: str) -> dict[str, Any]:
    row: dict[str, Any] = {"name": name, "source": _source(name)}
    try:
        planner = registry.load(name)
    except PlannerError as error:
        return row | {"problem": clean(str(error))}
    about = (planner.__doc__ or "").strip().partition("\n")[0]
    row |= {"version": planner.version, "rate_hz": planner.rate_hz, "about": clean(about)}
    return row | {"parameters": [_parameter(param) for param in planner.params]}


def _source(name: str) -> str:
    packages = sorted(point.dist.name for point in entry_points(group=registry.GROUP, name=name) if point.dist)
    return f"package {packages[0]}" if packages else "built in"


def _parameter(param: Param) -> dict[str, Any]:
    return {
        "name": param.name,
        "type": param.type.__name__,
        "default": param.default,
        "minimum": param.minimum,
        "maximum": param.maximum,
        "choices": list(param.choices),
        "unit": param.unit,
        "help": param.help,
    }


def _text(row: dict[str, Any]) -> str:
    if "problem" in row:
        return f"{row['name']}  ({row['source']})  BROKEN: {row['problem']}\n"
    lines = [f"{row['name']} {row['version']}  {row['rate_hz']:g} Hz  ({row['source']})  {row['about']}".rstrip()]
    for param in row["parameters"]:
        allowed = "|".join(param["choices"]) or _range(param["minimum"], param["maximum"])
        value = f"{param['default']} {param['unit']}".strip()
        lines.append(f"  {param['name']:<18}{value:<12}{allowed:<16}{param['help']}".rstrip())
    return "\n".join(lines) + "\n"


def _range(low: float | None, high: float | None) -> str:
    if low is None and high is None:
        return ""
    return f"{'' if low is None else f'{low:g}'} … {'' if high is None else f'{high:g}'}".strip()
