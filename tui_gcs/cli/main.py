"""The `tui-gcs` command. It imports nothing heavy: `--help` must be instant."""

import argparse
import contextlib
import errno
import importlib
import os
import sys
import traceback
from collections.abc import Sequence

from tui_gcs import __version__
from tui_gcs.cli import console_options, options
from tui_gcs.cli.exit_codes import CANNOT, FAILED, CommandError, UsageError
from tui_gcs.cli.files import parser as files_parser
from tui_gcs.cli.installation import config, general_options
from tui_gcs.cli.installation.completion import SHELLS
from tui_gcs.cli.links import parser as links_parser
from tui_gcs.cli.planner import parser as planner_parser
from tui_gcs.cli.vehicle import parser as vehicle_parser
from tui_gcs.client.user_settings import path_of
from tui_gcs.core.base.directories import ConfigError

LACKS = {
    errno.EMFILE: "raise the limit of open files (`ulimit -n`)",
    errno.ENFILE: "this computer has too many files open: end other programs",
    errno.ENOSPC: "make room on the disk, or name another place (TUI_GCS_STATE_DIR)",
    errno.EDQUOT: "make room in your quota, or name another place (TUI_GCS_STATE_DIR)",
    errno.EROFS: "nothing can be written there: name another place (TUI_GCS_STATE_DIR)",
}
"""What the computer may lack, whatever the command does, and what to do about it."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one subcommand; every error the user can cause is one line on stderr and exit code 2."""
    words = sys.argv[1:] if argv is None else list(argv)
    arguments = _parsed(words)
    try:
        used = config.apply(arguments, os.environ)
        console_options.apply(arguments, os.environ)
        general_options.apply(arguments, os.environ)
        if used and general_options.is_set(general_options.VERBOSE, os.environ):
            settings = ", ".join(f"{key} = {value!r}" for key, value in used.items())
            print(f"tui-gcs: {path_of(os.environ)}: {settings}", file=sys.stderr)  # noqa: T201
        return _run(arguments)
    except (CommandError, ConfigError) as error:
        from tui_gcs.core.base.text import clean

        if general_options.is_set(general_options.VERBOSE, os.environ):
            traceback.print_exc()
        return _cannot_run(arguments, error, clean(str(error), options.MAX_ERROR_CELLS))
    except ImportError as error:
        text = f"this installation is not whole: {error}; install it again (pip install .)"
        return _cannot_run(arguments, error, text)
    except KeyboardInterrupt as error:
        return _cannot_run(arguments, error, "interrupted", 130)
    except BrokenPipeError:  # whoever read it has seen enough, e.g. `head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except OSError as error:
        if error.errno not in LACKS:
            raise
        where = f"{error.filename}: " if error.filename else ""
        return _cannot_run(arguments, error, f"{where}{error.strerror}: {LACKS[error.errno]}")


def _parsed(words: Sequence[str]) -> argparse.Namespace:
    """Return the arguments. Raises `UsageError`, after it was reported in JSON where that is asked for."""
    try:
        if file := options.file_after_json(words):
            text = f"--json is a flag: to write the result to a file, give --json --output {file}"
            print(f"tui-gcs: {text}", file=sys.stderr)  # noqa: T201
            raise UsageError(text)
        return command_line_parser().parse_args(words)
    except UsageError as error:
        if "--json" in words:
            from tui_gcs.cli.command_report import CommandReport, write_line
            from tui_gcs.cli.exit_codes import ReportCode

            write_line(sys.stdout, CommandReport(False, ReportCode.CANNOT_RUN, error.text))
        raise


def _run(arguments: argparse.Namespace) -> int:
    """Run the command's module, which is imported only now; with `--json` nothing but the document goes to stdout."""
    run = importlib.import_module(f"tui_gcs.cli.{arguments.module}").run
    if not getattr(arguments, "json", False):
        code: int = run(arguments)
        return code
    from tui_gcs.cli.command_report import document_alone

    with document_alone(arguments):
        code = run(arguments)
    return code


def _cannot_run(arguments: argparse.Namespace, error: BaseException, text: str, code: int = CANNOT) -> int:
    """Report why a command could not run, in one line on stderr and by `--json`; return the exit code."""
    print(f"tui-gcs: {text}", file=sys.stderr)  # noqa: T201
    if not hasattr(arguments, "output"):
        return code
    with contextlib.suppress(ImportError):  # an installation that is not whole
        from tui_gcs.cli.command_report import cannot_run

        return cannot_run(arguments, error, text, code)
    return code


def command_line_parser() -> argparse.ArgumentParser:
    """Return the parser of everything that may be typed: also for completion, manual pages and tests of documents."""
    parser: argparse.ArgumentParser = options.CommandLineParser(
        prog="tui-gcs", description="A ground control station for fleets of autonomous vehicles, in a terminal."
    )
    parser.add_argument("--version", action="version", version=f"tui-gcs {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    _add_demo(commands)
    _add_fly(commands)
    _add_run(commands)
    _add_replay(commands)
    _add_rehearse(commands)
    _add_control(commands)
    _add_stops(commands)
    _add_task(commands)
    links_parser.add(commands)
    _add_preflight(commands)
    _add_sim(commands)
    _add_keys(commands)
    files_parser.add(commands)
    vehicle_parser.add(commands)
    planner_parser.add(commands)
    _add_installation(commands, parser)
    general_options.add(parser)
    return parser


def _add(commands: options.Commands, name: str, text: str, module: str = "") -> argparse.ArgumentParser:
    parser = options.command(commands, name, text)
    parser.set_defaults(module=module or name)
    return parser


def _add_demo(commands: options.Commands) -> None:
    parser = _add(commands, "demo", "eight simulated vehicles, a station and planners, and a console on them")
    parser.add_argument(
        "--headless", action="store_true", help="as fast as it goes, without a console: all rounds, a result table"
    )
    options.report(parser)
    parser.add_argument("--seed", type=int, help="another seed than the scenario's")
    parser.add_argument("--rounds", type=int, metavar="N", help="headless: only the first N rounds")
    console_options.add(parser)
    parser.add_argument("--scenario", metavar="FILE", help="another scenario than the shipped swarm-challenge")
    _planner(parser)
    options.simulation(parser)
    options.fault(parser)


def _add_fly(commands: options.Commands) -> None:
    parser = _add(commands, "fly", "start a station if none runs, and attach a console to it")
    console_options.add(parser)
    _scenario_and_links(parser)


def _add_run(commands: options.Commands) -> None:
    parser = _add(commands, "run", "fly a whole scenario without a console: every round, return, land, result")
    _scenario_and_links(parser)
    options.report(parser)
    known = (
        "on a terminal, too, this command is the order: nothing is asked; checks that can be overridden are, by name"
    )
    parser.add_argument("--yes", action="store_true", help=known)
    known = "LIVE: fly although this check before the start fails (`tui-gcs preflight` names them); may be repeated"
    options.repeated(parser, "--override", "CHECK", known)
    known = "LIVE: who signs the checks before the start, for the journal (default: your login name)"
    parser.add_argument("--operator", default="", metavar="NAME", help=known)


def _add_rehearse(commands: options.Commands) -> None:
    text = "fly a scenario on simulated vehicles, faster than real time, with what may go wrong; judged by its gates"
    parser = _add(commands, "rehearse", text)
    parser.add_argument("scenario", metavar="SCENARIO.toml", nargs="?", help="default: the shipped swarm-challenge")
    known = "a planner of your own, or a known one: it flies the teams that name it, or all teams where none does"
    options.repeated(parser, "--planner", "FILE.py|NAME", known)
    known = "a parameter of the planners, as `tui-gcs planner list` names them; may be repeated"
    options.repeated(parser, "--set", "NAME=VALUE", known)
    options.instances(parser)
    known = "so many vehicles in all, shared among the teams as the scenario shares them"
    parser.add_argument("--vehicles", type=int, metavar="N", help=known)
    known = "write every metric of the planners over time there (CSV), and single events beside it (FILE-events.csv)"
    parser.add_argument("--metrics", metavar="FILE.csv", help=known)
    known = "write pictures, numbers and events there, for a browser; without a file beside the recording"
    parser.add_argument("--report", metavar="FILE.html", nargs="?", const="", help=known)
    options.report(parser)
    parser.add_argument("--seed", type=int, help="another seed than the scenario's")
    parser.add_argument("--rounds", type=int, metavar="N", help="only the first N rounds")
    known = "vehicle ID falls silent T seconds after the start, for S seconds or for good; may be repeated"
    options.repeated(parser, "--lose", "ID@T[/S]", known)
    known = "the battery of vehicle ID is low from T seconds after the start; may be repeated"
    options.repeated(parser, "--drain", "ID@T", known)
    known = "the station dies T seconds after the start, comes back, and is ordered to resume; may be repeated"
    options.repeated(parser, "--restart", "T", known, kind=float)
    options.simulation(parser)
    options.fault(parser)


def _add_replay(commands: options.Commands) -> None:
    text = "show a recorded flight on the fly screen, or a summary where there is no terminal"
    parser = _add(commands, "replay", text)
    console_options.add(parser)
    parser.add_argument("file", metavar="FILE.tlog")
    parser.add_argument("--speed", type=float, default=1.0, help="times real time (default 1)")
    parser.add_argument("--at", default="0", metavar="TIME", help="begin at this time of it: 95 (seconds) or 1:35")
    parser.add_argument("--summary", action="store_true", help="the summary, also on a terminal")
    options.report(parser)


def _add_control(commands: options.Commands) -> None:
    for name, text in (
        ("attach", "attach a console to the running station"),
        ("status", "what the running station sees, in lines"),
        ("stop", "end the running station; refused while anything is armed"),
    ):
        parser = _add(commands, name, text, "station_control")
        parser.set_defaults(what=name)
        parser.add_argument("--kind", choices=("sim", "live"), help="which station, where both run")
        if name == "attach":
            console_options.add(parser)
        if name != "attach":
            options.report(parser)
        if name == "stop":
            known = "vehicles that were armed when last heard, and of which you know what became"
            parser.add_argument("--lost", nargs="+", default=[], metavar="IDS", help=f"{known}: 1-3 5")


def _add_stops(commands: options.Commands) -> None:
    for name, text in (
        ("hold", "stop vehicles at once, and have them stay: all, or these; never asks"),
        ("return", "have vehicles return and land in turn: all, or these; never asks"),
        ("land", "have vehicles land where they are: all, or these; never asks"),
    ):
        parser = _add(commands, name, text, "stop_fleet")
        parser.set_defaults(what=name)
        parser.add_argument("ids", nargs="*", metavar="IDS", help="1-3 5; without: all that fly in teams")
        parser.add_argument("--kind", choices=("sim", "live"), help="which station, where both run")
        options.report(parser)


def _add_task(commands: options.Commands) -> None:
    text = "points of interest that planners send vehicles to, while they fly: add, list, cancel"
    task = options.command(commands, "task", text)
    actions = task.add_subparsers(title="actions", required=True, metavar="ACTION", dest="what")
    add = options.command(actions, "add", "add one point, or all of a file")
    where = add.add_mutually_exclusive_group(required=True)
    where.add_argument("--at", metavar="LAT,LON", help="degrees; south: --at=-33.86,151.2")
    where.add_argument("--xy", metavar="EAST,NORTH", help="metres from the scenario's origin; west: --xy=-20,50")
    known = "points with name, priority, deadline_s and team: columns of a CSV with lat and lon, or GeoJSON properties"
    where.add_argument("--file", metavar="FILE.csv|.geojson", help=known)
    add.add_argument("--name", default="", help="default: point N")
    add.add_argument("--priority", type=float, default=1.0, metavar="P", help="above 0, default 1; higher comes first")
    add.add_argument("--deadline", type=float, metavar="S", help="seconds from now")
    add.add_argument("--team", default="", help="the team that is to visit it (default: any)")
    listed = options.command(actions, "list", "all points, and what became of them")
    cancel = options.command(actions, "cancel", "cancel open points")
    cancel.add_argument("names", nargs="*", metavar="NAME")
    cancel.add_argument("--all", action="store_true", help="all that are open")
    for parser in (add, listed, cancel):
        parser.set_defaults(module="task")
        options.report(parser)
        parser.add_argument("--kind", choices=("sim", "live"), help="which station, where both run")


def _add_preflight(commands: options.Commands) -> None:
    text = "the checks before a start, read from the vehicles of the running station; exit code 0: nothing refuses it"
    parser = _add(commands, "preflight", text)
    parser.add_argument("--kind", choices=("sim", "live"), help="which station, where both run")
    options.report(parser)
    parser.add_argument("--read-again", action="store_true", help="read from the vehicles also what is known")
    known = "accept this failsafe as it is (LIVE), e.g. station-loss; may be repeated"
    options.repeated(parser, "--acknowledge", "CHECK", known)
    known = "tick this item of the scenario's checklist, by its text or its beginning; may be repeated"
    options.repeated(parser, "--tick", "TEXT", known)
    parser.add_argument("--sign", action="store_true", help="sign the list, for one start; refused while a check fails")
    parser.add_argument(
        "--operator", default="", metavar="NAME", help="your name for the journal (default: your login)"
    )


def _add_sim(commands: options.Commands) -> None:
    parser = _add(commands, "sim", "simulated vehicles alone, for any ground station: sends to a UDP address")
    parser.add_argument("scenario", metavar="SCENARIO.toml", nargs="?", help="vehicles at its take-off places")
    parser.add_argument("--count", type=int, metavar="N", help="without a scenario: so many vehicles, in rows")
    parser.add_argument("--home", metavar="LAT,LON,AMSL[,HEADING]", help="place of the first (default: the demo's)")
    parser.add_argument("--spacing", type=float, metavar="M", help="metres between them (default 12)")
    parser.add_argument("--first", type=int, metavar="ID", help="system id of the first (default 1)")
    options.autopilot(parser)
    parser.add_argument("--seed", type=int, help="of everything random")
    options.weather(parser)
    options.world(parser)
    parser.add_argument("--speed", type=float, default=1.0, metavar="X", help="times real time (default 1)")
    parser.add_argument(
        "--target", default="127.0.0.1:14550", metavar="HOST:PORT", help="where they send to (default 127.0.0.1:14550)"
    )
    options.fault(parser)
    parser.add_argument("--real", choices=("arducopter", "px4"), help="real autopilots, each in its own simulator")
    parser.add_argument("--binary", metavar="PATH", help="their program, if it is not on PATH")
    parser.add_argument("--params", metavar="FILE", help="their default parameters (ArduPilot)")
    parser.add_argument("--wipe", action="store_true", help="without the parameters and missions of earlier runs")


def _add_keys(commands: options.Commands) -> None:
    keys = _add(commands, "keys", "signing keys: make, import, list, assign, remove, give to a vehicle")
    actions = keys.add_subparsers(title="actions", required=True, metavar="ACTION", dest="what")
    parsers: dict[str, argparse.ArgumentParser] = {}
    for name, text in (
        ("add", "keep a new random key"),
        (
            "import",
            "keep a key that another ground station has; asks for it without showing it, or reads it from stdin",
        ),
        ("list", "names, fingerprints and vehicles; never a key"),
        ("assign", "a vehicle holds this key already: believe nothing else of it"),
        ("unassign", "a vehicle does not sign any more"),
        ("remove", "forget a key; asks"),
        ("provision", "give a vehicle its key, through the running station; asks"),
    ):
        parser = parsers[name] = options.command(actions, name, text)
        parser.add_argument("--kind", choices=("live", "sim"), default="live", help="whose keys (default live)")
        options.report(parser)
        if name == "provision":
            parser.add_argument("vehicle", type=int, metavar="VEHICLE", help="as the fly screen numbers it")
        if name not in ("list", "unassign"):
            parser.add_argument("name", metavar="NAME")
        if name in ("add", "import", "assign", "unassign"):
            needed = name.endswith("assign")
            parser.add_argument("--vehicle", type=int, metavar="ID", required=needed, help="MAVLink system id")
            parser.add_argument("--network", default="", metavar="NET", help="its network, if ids repeat")
    known = "not a random one: ask for 64 hex digits"
    parsers["add"].add_argument("--hex", dest="form", action="store_const", const="hex", help=known)
    parsers["import"].add_argument(
        "--as",
        dest="form",
        required=True,
        choices=("hex", "mavproxy", "missionplanner", "qgc"),
        help="64 hex digits, or a passphrase of that ground station (QGroundControl until 2025: missionplanner)",
    )


def _add_installation(commands: options.Commands, whole: argparse.ArgumentParser) -> None:
    text = "what this computer lacks for flying, and the command that mends it"
    doctor = _add(commands, "doctor", text, "installation.doctor")
    options.report(doctor)
    text = "a script that completes commands and options in your shell"
    known = """bash:  tui-gcs completion bash > ~/.local/share/bash-completion/completions/tui-gcs
zsh:   tui-gcs completion zsh > ~/.zfunc/_tui-gcs        with `fpath+=~/.zfunc` before compinit in ~/.zshrc
fish:  tui-gcs completion fish > ~/.config/fish/completions/tui-gcs.fish"""
    completion = options.command(commands, "completion", text, examples=known)
    completion.set_defaults(module="installation.completion", whole=whole)
    completion.add_argument("shell", choices=SHELLS)


def _planner(parser: argparse.ArgumentParser) -> None:
    known = "a planner of your own, beside the known ones or in place of the one of its name; may be repeated"
    options.repeated(parser, "--planner", "FILE.py", known)


def _scenario_and_links(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenario", metavar="SCENARIO.toml")
    _planner(parser)
    known = (
        "udpin:HOST:PORT, udpout:…, tcp:…, tcpin:… or serial:DEVICE:BAUD, with ,network=NAME ,secure ,highlatency "
        ",rate=BYTES_PER_S; may be repeated (default udpin:127.0.0.1:14550)"
    )
    options.repeated(parser, "--link", "LINK", known)
    known = "let another station hear the vehicles, e.g. udpout:192.168.1.5:14550; may be repeated"
    options.repeated(parser, "--forward", "LINK", known)
    known = "as --forward, and take its commands, too: each is judged and journalled"
    options.repeated(parser, "--forward-commands", "LINK", known)
    known = "MAVLink definitions of your own, beside all that are known; may be repeated"
    options.repeated(parser, "--dialect", "FILE.xml", known)
    known = "where you stand (degrees), for Remote ID, in place of the scenario's [remote_id]"
    parser.add_argument("--operator-at", nargs=2, type=float, metavar=("LAT", "LON"), help=known)
    known = "with --operator-at: your height above the WGS-84 ellipsoid"
    parser.add_argument("--operator-alt", type=float, metavar="M", help=known)
    known = "sim: these vehicles are simulated by another program; loopback links only"
    parser.add_argument("--kind", choices=("live", "sim"), default="live", help=known)


if __name__ == "__main__":
    sys.exit(main())
