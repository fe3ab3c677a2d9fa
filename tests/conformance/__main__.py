"""`make conformance LINK=… IDS=…`: judge the vehicles on a link, whoever made them, one line per check.

It arms and flies them: motors turn, and each needs 100 m of free room around it. Vehicles must be ready to fly outdoors
(or be simulated), and nobody else may command them meanwhile.
"""

import argparse
import sys
import tempfile
from pathlib import Path

from tests.conformance import checks
from tests.conformance.field import Failed, Field, live_field, simulated_field
from tests.conformance.report import CHECKS, Line, run_all, summary
from tui_gcs.core.links import LinkError


def main(argv: list[str] | None = None) -> int:
    """0: nothing failed; 1: something did; 2: it could not be tried."""
    checks.load()
    parser = argparse.ArgumentParser(prog="python -m tests.conformance", description=__doc__)
    parser.add_argument("--link", default="udpin:127.0.0.1:14550", help="where the vehicles are heard")
    parser.add_argument("--ids", default="1-2", help="their system ids: 1-8 or 1,3,5")
    parser.add_argument("--sim", help="judge our simulator in lock-step instead: ardupilot, px4 or ardupilot,px4")
    parser.add_argument("--list", action="store_true", help="name the checks and end")
    parser.add_argument("only", nargs="*", help="only checks whose name contains one of these words")
    options = parser.parse_args(argv)
    if options.list:
        print(*[entry.name for entry in CHECKS], sep="\n")
        return 0
    try:
        ids = ids_of(options.ids)
        with tempfile.TemporaryDirectory() as log_dir:
            if options.sim:
                return _judge(simulated_field(tuple(options.sim.split(",")), Path(log_dir)), options.only)
            return _judge(live_field(options.link, ids, Path(log_dir)), options.only)
    except (LinkError, Failed, ValueError) as error:
        print(error, file=sys.stderr)
        return 2


def _judge(field: Field, only: list[str]) -> int:
    try:
        field.discover()
        lines = run_all(field, only, tell)
    finally:
        field.close()
    print(summary(lines))
    return 1 if any(line.verdict == "FAIL" for line in lines) else 0


def tell(line: Line) -> None:
    """Print a line at once."""
    print(line, flush=True)


def ids_of(text: str) -> tuple[int, ...]:
    """ "1-3,7" as (1, 2, 3, 7).

    Raises:
        ValueError: It is not a list of system ids.
    """
    ids: list[int] = []
    for part in text.split(","):
        first, _, last = part.strip().partition("-")
        if not first.isdigit() or (last and not last.isdigit()):
            raise ValueError(f"--ids {text}: must be like 1-8 or 1,3,5")
        ids += range(int(first), int(last or first) + 1)
    if not ids or not all(1 <= i <= 255 for i in ids):
        raise ValueError(f"--ids {text}: system ids are 1 to 255")
    return tuple(dict.fromkeys(ids))


if __name__ == "__main__":
    sys.exit(main())
