"""Arguments that several commands share: subcommands, repeated options, simulated vehicles.

It imports nothing heavy.
"""

import argparse
import math
import sys
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NoReturn

from tui_gcs.cli.exit_codes import UsageError

Commands = Any
"""The type of argparse's subparsers, which has no public name."""


MAX_ERROR_CELLS = 4000
ERROR_HINTS = {
    "required: SCENARIO.toml": "it says where vehicles may fly, and `tui-gcs scenario new FILE.toml` writes one",
    "argument COMMAND: invalid choice": "for single vehicles: tui-gcs vehicle --help",
}
"""What to do about a mistake, by a part of the message that argparse has for it."""


class CommandLineParser(argparse.ArgumentParser):
    """An argument parser that reports errors without repeating escape sequences to the terminal."""

    def error(self, message: str) -> NoReturn:
        """Report the error after the usage. Raises `UsageError`."""
        from tui_gcs.core.base.text import clean

        hints = [hint for part, hint in ERROR_HINTS.items() if part in message]
        text = "; ".join((clean(message, MAX_ERROR_CELLS), *hints))
        self.print_usage(sys.stderr)
        sys.stderr.write(f"{self.prog}: error: {text}\n")
        raise UsageError(text)


def command(commands: Commands, name: str, text: str, *, examples: str = "") -> argparse.ArgumentParser:
    """Add a subcommand. `text` is its line in the list and its description; `examples` keep their line ends."""
    form = {"epilog": examples, "formatter_class": argparse.RawDescriptionHelpFormatter} if examples else {}
    parser: argparse.ArgumentParser = commands.add_parser(name, help=text, description=text, **form)
    return parser


def repeated(parser: argparse.ArgumentParser, name: str, value: str, text: str, kind: type = str) -> None:
    """Add an option that may be given several times; its values are a list."""
    parser.add_argument(name, action="append", default=[], type=kind, metavar=value, help=text)


def positive(text: str) -> float:
    """Return a number above 0, for argparse."""
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text}: must be above 0")
    return value


def simulation(parser: argparse.ArgumentParser) -> None:
    """Add the options for autopilots, weather and intruders."""
    autopilot(parser)
    weather(parser)
    world(parser)


def weather(parser: argparse.ArgumentParser) -> None:
    """Add the options for wind and position errors."""
    parser.add_argument("--wind", metavar="E,N", help="m/s toward east and north, with gusts")
    parser.add_argument("--gps-noise", type=float, metavar="M", help="standard deviation of positions")


def world(parser: argparse.ArgumentParser) -> None:
    """Add the options for intruders and for the sensors that find them."""
    parser.add_argument("--intruders", type=int, metavar="N", help="so many in each wave, against the defended zone")
    parser.add_argument(
        "--sensor",
        metavar="WHAT",
        help="what the vehicles see them with, e.g. range=60,rate=5,p=0.9,false=1,sigma=2 (m, Hz, share, 1/min, m)",
    )


def autopilot(parser: argparse.ArgumentParser) -> None:
    """Add the option for the autopilot that is simulated."""
    known = "of the simulated vehicles, default ardupilot; mixed: they take turns"
    parser.add_argument("--autopilot", choices=("ardupilot", "px4", "mixed"), help=known)


def fault(parser: argparse.ArgumentParser) -> None:
    """Add the option for bad links."""
    parser.add_argument(
        "--fault",
        default="",
        metavar="FAULTS",
        help="bad links, e.g. loss=0.1,burst=0.05/0.3,delay=200ms,jitter=20%%,dup=0.01,reorder=0.05,rate=5760,"
        "corrupt=1e-4,flap=10s/2s; up.NAME=… to the vehicles only, down.NAME=… to the station only",
    )


def instances(parser: argparse.ArgumentParser) -> None:
    """Add `--instances`."""
    known = "run planners once for the team or once on each vehicle (default: as they declare)"
    parser.add_argument("--instances", choices=("per_team", "per_vehicle"), help=known)


def report(parser: argparse.ArgumentParser) -> None:
    """Add `--json` and `--output`: see `command_report`."""
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    parser.add_argument("--output", metavar="FILE", help="write that document to a file, whatever is printed")


FILE_BEFORE = ("demo", "run", "rehearse")
"""Commands whose `--json` took a file until 0.2."""


def file_after_json(words: Sequence[str]) -> str:
    """Return the file that a command line gives to `--json`, as it was until 0.2; "" if it gives none."""
    for word in words:
        if word.startswith("--json="):
            return word.removeprefix("--json=")
    command = next((word for word in words if not word.startswith("-")), "")
    for option, value in pairwise(words if command in FILE_BEFORE else ()):
        # A scenario may follow the flag.
        if option == "--json" and not value.startswith("-") and (command == "demo" or not value.endswith(".toml")):
            return value
    return ""
