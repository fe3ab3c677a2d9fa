"""The arguments of `tui-gcs planner …`. It imports nothing heavy."""

import argparse
from typing import Any

from tui_gcs.cli import console_options, sim_options

EXAMPLES = """a planner of your own, from nothing:
  tui-gcs planner new mine               writes mine.py, which flies; change it
  tui-gcs planner check mine.py          everything that must hold before it flies, and what to do where it does not
  tui-gcs planner watch mine.py          flies it on simulated vehicles; and flies on with every version you save

Exit codes: 0 all well, 1 something does not hold, 2 it could not be done (one line says why)."""


def add(commands: Any) -> None:
    """Add the `planner` command to the parser."""
    text = "write, check and try planners of your own"
    planner = commands.add_parser(
        "planner", help=text, description=text, epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    planner.set_defaults(module="planner.verb")
    actions = planner.add_subparsers(title="actions", required=True, metavar="ACTION", dest="what")

    new = _action(actions, "new", "write a small planner that flies, to begin with")
    new.add_argument("name", metavar="NAME", help="lower-case letters, digits, - and _")
    new.add_argument("--dir", default=".", metavar="DIR", help="where to (default: here)")

    listed = _action(actions, "list", "built-in and installed planners, and what can be set")
    listed.add_argument("--json", action="store_true")

    check = _action(actions, "check", "everything that must hold before a planner flies; takes some minutes")
    check.add_argument("planner", metavar="FILE.py|NAME", help="a file, or a built-in or installed planner")
    check.add_argument("--seed", type=int, default=1, metavar="N", help="of everything random (default 1)")
    check.add_argument("--quick", action="store_true", help="fewer cases, and one round instead of all")
    check.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="CHECK",
        help="only this one, as the report calls it; may be repeated",
    )
    check.add_argument("--json", action="store_true")

    watch = _action(actions, "watch", "fly a planner on simulated vehicles, and every new version as you save it")
    watch.add_argument("file", metavar="FILE.py")
    watch.add_argument("scenario", metavar="SCENARIO.toml", nargs="?", help="another than the shipped one")
    watch.add_argument("--seed", type=int, metavar="N", help="another seed than the scenario's")
    sim_options.autopilot(watch)
    sim_options.weather(watch)
    sim_options.world(watch)
    console_options.add(watch)


def _action(actions: Any, name: str, text: str) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = actions.add_parser(name, help=text, description=text)
    return parser
