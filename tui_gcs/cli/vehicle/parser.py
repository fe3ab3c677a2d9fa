"""The arguments of `tui-gcs vehicle …`. It imports nothing heavy."""

import argparse
from typing import Any

from tui_gcs.cli import options
from tui_gcs.cli.options import Commands

EXAMPLES = """examples:
  tui-gcs vehicle list
  tui-gcs vehicle show 3                          who it is, what is wrong with it, what it does when a link is lost
  tui-gcs vehicle params set 1-4 RTL_ALT 3000     vehicles are named: 3, 3-7 or 1,4
  tui-gcs vehicle params save 3 three.param       and `params diff 4 three.param`, `params load 4 three.param`
  tui-gcs vehicle plan upload 3 --kind fence area.json
  tui-gcs vehicle mode 3 RTL
  tui-gcs vehicle logs 3 get 12
  tui-gcs vehicle calibrate 3 compass             says what to do, shows how far it is; ctrl-c cancels
  tui-gcs vehicle tune 3 rate ATC_RAT_RLL_P 0.12  and `tune 3 --undo`
  tui-gcs vehicle tasks                           what goes on, also of others; `cancel 7` ends one

What takes time goes on in the station if this command is interrupted. Exit code 0 only if every vehicle did it."""


MEET = "though it comes too close to other vehicles"
HELP = ("-h", "--help")
"""Options that stay where they are: `plan upload --help` asks about upload, not about plan."""


class AnyOrderParser(options.CommandLineParser):
    """A parser that takes options between positional arguments, where argparse would miss optional positional ones."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse as argparse does, with the known options moved to the front."""
        moved: list[str] = []
        others: list[str] = []
        words = iter(args or ())
        for word in words:
            action = self._option_string_actions.get(word.partition("=")[0])
            if word == "--" or action is None or word in HELP:
                others += [word, *words] if word == "--" else [word]
                continue
            moved.append(word)
            if action.nargs != 0 and "=" not in word:
                moved += [value for value in [next(words, None)] if value is not None]
        return super().parse_known_args([*moved, *others], namespace)


def add(commands: Commands) -> None:
    """Add the `vehicle` command to the parser."""
    text = "everything that can be done with vehicles by name, through the running station"
    vehicle = options.command(commands, "vehicle", text, examples=EXAMPLES)
    vehicle.set_defaults(module="vehicle.verb")
    actions = _actions(vehicle, "what")
    _leaf(actions, "list", "all vehicles, a line each")
    _add_looks(actions)
    _add_params(actions)
    _add_plan(actions)
    _add_files(actions)
    _add_logs(actions)
    _add_acts(actions)
    _add_setup(actions)
    _add_carry(actions)
    _leaf(actions, "tasks", "what was asked of vehicles, and how far it is")
    cancel = _leaf(actions, "cancel", "end a task, another console's too")
    cancel.add_argument("task", type=int, metavar="N")


def _leaf(
    actions: Commands, name: str, text: str, *, ids: bool = False, destructive: bool = False, plan: bool = False
) -> argparse.ArgumentParser:
    parser = options.command(actions, name, text)
    if ids:
        parser.add_argument("ids", metavar="ID", help="3, 3-7 or 1,4: as the fly screen numbers them")
    names = ("--station",) if plan else ("--kind", "--station")
    parser.add_argument(*names, dest="station", choices=("sim", "live"), help="which station, where both run")
    options.report(parser)
    if destructive:
        parser.add_argument("--yes", action="store_true", help="do not ask")
    return parser


def _group(actions: Commands, name: str, text: str, *, ids: bool = False) -> Commands:
    """Add a verb that has actions of its own; with `ids` the vehicles stand before the action."""
    parser = options.command(actions, name, text)
    if ids:
        parser.add_argument("ids", metavar="ID", help="3, 3-7 or 1,4")
    return _actions(parser, "act")


def _actions(parser: argparse.ArgumentParser, dest: str) -> Commands:
    return parser.add_subparsers(
        title="actions", required=True, metavar="ACTION", dest=dest, parser_class=AnyOrderParser
    )


def _add_looks(actions: Commands) -> None:
    _leaf(actions, "show", "one vehicle: identity, health, failsafes, links", ids=True)
    _leaf(actions, "failsafes", "what it does by itself when something is lost, read from it now", ids=True)
    events = _leaf(actions, "events", "its messages, what happened to it, what was ordered", ids=True)
    events.add_argument("--last", type=int, default=30, metavar="N", help="so many (default 30)")
    events.add_argument("--follow", action="store_true", help="and go on with what comes")


def _add_params(actions: Commands) -> None:
    acts = _group(actions, "params", "parameters: get, set, list, save, load, diff")
    get = _leaf(acts, "get", "ask for some by name", ids=True)
    get.add_argument("names", nargs="+", metavar="NAME")
    put = _leaf(acts, "set", "set one; done when the vehicle confirms the value", ids=True, destructive=True)
    put.add_argument("name", metavar="NAME")
    put.add_argument("value", metavar="VALUE")
    _beyond_range(put)
    listing = _leaf(acts, "list", "what is known, or all", ids=True)
    listing.add_argument("pattern", nargs="?", default="*", metavar="PATTERN", help="e.g. 'FS_*' or BATT")
    listing.add_argument("--fetch", action="store_true", help="ask the vehicle for all of them")
    for name, words in (
        ("save", "fetch all into a file: .param (Mission Planner), .params (QGroundControl), else as MAVProxy does"),
        ("load", "set what differs from such a file; shows it, and asks"),
        ("diff", "show what differs from such a file; exit code 0 if nothing"),
    ):
        leaf = _leaf(acts, name, words, ids=True, destructive=name != "diff")
        leaf.add_argument("file", metavar="FILE")
        if name == "load":
            _beyond_range(leaf)


def _beyond_range(parser: argparse.ArgumentParser) -> None:
    text = "also values outside of the ranges in its description"
    parser.add_argument("--beyond-range", action="store_true", help=text)


def _add_plan(actions: Commands) -> None:
    acts = _group(actions, "plan", "missions, fences, rally points: show, clear, upload, download, current item")
    home = "whether the first line of a WPL mission is home (auto: an AMSL way-point with index 0 is)"
    current = _leaf(acts, "current", "go on with item N of its mission", ids=True, destructive=True)
    current.add_argument("item", type=int, metavar="N", help="from 1, as `show` numbers them")
    current.add_argument("--meet", action="store_true", help=MEET)
    for name, words in (
        ("show", "what it holds, asked now"),
        ("clear", "delete it"),
        ("upload", "put a file on it (.plan: fence, rally points, mission); done when it was asked and holds it"),
        ("download", "read it into a file: .plan (all three) or .json if it ends so, else QGC WPL 110"),
    ):
        parser = _leaf(acts, name, words, ids=True, destructive=name != "show", plan=True)
        kinds = ("mission", "fence", "rally")
        in_files = name in ("upload", "download")
        default, text = (None, "default: what the file is of") if in_files else ("mission", "default mission")
        parser.add_argument("--kind", choices=kinds, default=default, help=text)
        if in_files:
            parser.add_argument("file", metavar="FILE")
        if name == "upload":
            parser.add_argument("--home-line", choices=("auto", "yes", "no"), default="auto", help=home)
            parser.add_argument("--in-flight", action="store_true", help="also while it flies its mission; asks")
            parser.add_argument("--meet", action="store_true", help=MEET)


def _add_files(actions: Commands) -> None:
    acts = _group(actions, "files", "files on a vehicle (MAVFTP)", ids=True)
    listing = _leaf(acts, "ls", "list a directory")
    listing.add_argument("path", nargs="?", default="/", metavar="PATH")
    get = _leaf(acts, "get", "read a file into the station's directory, and copy it here", destructive=True)
    get.add_argument("path", metavar="PATH")
    get.add_argument("file", nargs="?", metavar="FILE", help="a copy here")
    put = _leaf(acts, "put", "write a file; not while armed", destructive=True)
    put.add_argument("file", metavar="FILE")
    put.add_argument("path", metavar="PATH")
    remove = _leaf(acts, "rm", "remove a file; not while armed", destructive=True)
    remove.add_argument("path", metavar="PATH")


def _add_logs(actions: Commands) -> None:
    acts = _group(actions, "logs", "logs on a vehicle", ids=True)
    _leaf(acts, "ls", "list them")
    get = _leaf(acts, "get", "read one into the station's directory, and copy it here", destructive=True)
    get.add_argument("log", type=int, metavar="N")
    get.add_argument("file", nargs="?", metavar="FILE", help="a copy here")
    _leaf(acts, "erase", "erase all of them; not while armed", destructive=True)


def _add_acts(actions: Commands) -> None:
    mode = _leaf(actions, "mode", "the modes it has, or change to one", ids=True, destructive=True)
    mode.add_argument("name", nargs="?", metavar="NAME")
    mode.add_argument("--meet", action="store_true", help=MEET)
    shell = _leaf(actions, "shell", "type one line into its shell (PX4); not while armed", ids=True)
    known = "what is typed; after `--` also what looks like an option of this command"
    shell.add_argument("line", nargs=argparse.REMAINDER, metavar="WORD …", help=known)
    _leaf(actions, "reboot", "reboot its autopilot; not while armed", ids=True, destructive=True)


def _add_setup(actions: Commands) -> None:
    calibrate = _leaf(actions, "calibrate", "sensors and transmitter, led step by step", ids=True, destructive=True)
    words = ("gyro", "level", "accel", "simple-accel", "compass", "baro", "airspeed", "rc", "next", "cancel")
    text = "without: what it has. next: as Enter, for scripts. cancel: another console's too"
    calibrate.add_argument("sensor", nargs="?", choices=words, metavar="SENSOR|next|cancel", help=text)
    calibrate.add_argument("--undo", action="store_true", help="rc: set back what the last one wrote")
    tune = _leaf(actions, "tune", "gains by group; what they were is kept", ids=True, destructive=True)
    tune.add_argument("group", nargs="?", metavar="GROUP", help="rate, attitude, velocity, position; without: all")
    tune.add_argument("name", nargs="?", metavar="NAME")
    tune.add_argument("value", nargs="?", metavar="VALUE")
    tune.add_argument("--undo", action="store_true", help="take back all changes, or the last one of NAME")
    _beyond_range(tune)
    airframe = _leaf(actions, "airframe", "what it is built as; not while armed", ids=True, destructive=True)
    airframe.add_argument("act", nargs="?", choices=("list", "set"), metavar="list|set", help="the choices; choose")
    airframe.add_argument("words", nargs="*", metavar="X", help="number or name: class=quad type=X, or 4001")
    motor = _leaf(actions, "motor-test", "turn one motor, propellers off; not while armed", ids=True, destructive=True)
    order = "from 1; of ArduPilot as its motor test counts: clockwise from the front right (A, B, …)"
    motor.add_argument("motor", type=int, metavar="MOTOR", help=order)
    motor.add_argument("--throttle", type=float, default=15.0, metavar="PCT", help="at most 30 (default 15)")
    motor.add_argument("--seconds", type=float, default=1.0, metavar="S", help="at most 3 (default 1)")


def _add_carry(actions: Commands) -> None:
    gimbal = _leaf(actions, "gimbal", "point it, give it back, or show it", ids=True)
    gimbal.add_argument("act", nargs="?", choices=("release",), metavar="release", help="give control of it back")
    gimbal.add_argument("--pitch", type=float, metavar="DEG", help="up is positive")
    gimbal.add_argument("--yaw", type=float, metavar="DEG", help="right of the nose")
    gimbal.add_argument("--north", action="store_true", help="yaw is counted from north, and kept")
    camera = _leaf(actions, "camera", "a picture, a video, or which cameras it has", ids=True)
    camera.add_argument("act", nargs="?", choices=("photo", "start", "stop"), metavar="photo|start|stop")
    roi = _leaf(actions, "roi", "keep camera or nose on a place", ids=True)
    roi.add_argument(
        "place", nargs="+", metavar="PLACE", help="LAT LON HEIGHT (degrees, metres above its home), or none"
    )
    roi.add_argument("--amsl", action="store_true", help="HEIGHT is above mean sea level")
    traffic = _leaf(actions, "traffic", "aircraft that vehicles hear by ADS-B")
    traffic.add_argument("ids", nargs="?", metavar="ID", help="have these tell what they hear (ArduPilot)")
    _leaf(actions, "remote-id", "what it broadcasts, and whether that lets it arm", ids=True)
