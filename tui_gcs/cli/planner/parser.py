"""The arguments of `tui-gcs planner …`. It imports nothing heavy."""

import argparse

from tui_gcs.cli import console_options, options

LOG_LEVELS = ("all", "info", "warning", "error")
"""By the least rank of `core/protocol/planner_log.py`; stderr counts as a warning."""
EXAMPLES = """a planner of your own, from nothing:
  tui-gcs planner new mine               writes mine.py, which flies; change it
  tui-gcs planner check mine.py          everything that must hold before it flies, and what to do where it does not
  tui-gcs planner watch mine.py          flies it on simulated vehicles; and flies on with every version you save
  tui-gcs planner log --follow           what the planners of the running station print and log

Exit codes: 0 all well, 1 something does not hold, 2 it could not be done (one line says why)."""


def add(commands: options.Commands) -> None:
    """Add the `planner` command to the parser."""
    text = "write, check and try planners of your own"
    planner = options.command(commands, "planner", text, examples=EXAMPLES)
    actions = planner.add_subparsers(title="actions", required=True, metavar="ACTION", dest="what")

    new = _action(actions, "new", "write a small planner that flies, to begin with")
    new.add_argument("name", metavar="NAME", help="lower-case letters, digits, - and _")
    new.add_argument("--dir", default=".", metavar="DIR", help="where to (default: here)")

    per_vehicle = "one that runs on each vehicle and hears its neighbours, instead of one for the team"
    new.add_argument("--per-vehicle", action="store_true", help=per_vehicle)
    options.report(new)

    listed = _action(actions, "list", "built-in and installed planners, and what can be set")
    options.report(listed)

    check = _action(actions, "check", "everything that must hold before a planner flies; takes some minutes")
    check.add_argument("planner", metavar="FILE.py|NAME", help="a file, or a built-in or installed planner")
    check.add_argument("--seed", type=int, default=1, metavar="N", help="of everything random (default 1)")
    check.add_argument("--quick", action="store_true", help="fewer cases, and one round instead of all")
    options.instances(check)
    options.repeated(check, "--only", "CHECK", "only this one, as the report calls it; may be repeated")
    options.report(check)

    log = _action(actions, "log", "what the planners of the running station print and log")
    log.add_argument("--team", default="", metavar="NAME", help="only the lines of this team")
    log.add_argument("--level", choices=LOG_LEVELS, default="all", help="only lines that are at least this severe")
    log.add_argument("--words", default="", metavar="WORDS", help="only lines with all of these words")
    log.add_argument("--lines", type=int, default=50, metavar="N", help="the newest N that fit (default 50)")
    log.add_argument("--follow", action="store_true", help="go on with new lines until Ctrl-C")
    log.add_argument("--kind", choices=("sim", "live"), help="which station, if two run")
    options.report(log)

    watch = _action(actions, "watch", "fly a planner on simulated vehicles, and every new version as you save it")
    watch.add_argument("file", metavar="FILE.py")
    watch.add_argument("scenario", metavar="SCENARIO.toml", nargs="?", help="another than the shipped one")
    watch.add_argument("--seed", type=int, metavar="N", help="another seed than the scenario's")
    options.instances(watch)
    options.simulation(watch)
    console_options.add(watch)


def _action(actions: options.Commands, name: str, text: str) -> argparse.ArgumentParser:
    parser = options.command(actions, name, text)
    parser.set_defaults(module=f"planner.{name}")
    return parser
