"""`make conformance LINK=… IDS=…`: judge the vehicles on a link, whoever made them, one line per check and vehicle.

It arms and flies them, all at the same time, 3 m above each other: motors turn, and each needs 100 m of free room
around it. Vehicles must be on the ground, outdoors (or simulated), with nobody else commanding them. Parameters that
a check changes are put back after it; missions, fences and rally points that are on board are deleted.
"""

import argparse
import ipaddress
import signal
import sys
import tempfile
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from types import FrameType

from tests.conformance import checks
from tests.conformance.field import MAX_AT_ONCE, Failed, Field, live_field, simulated_field
from tests.conformance.pilot import Pilot
from tests.conformance.report import Line, Run, as_json, chosen, summary
from tui_gcs.core.firmware.registry import name_of
from tui_gcs.core.links import LinkError
from tui_gcs.core.links.spec import LinkSpec, parse_link

DISCOVER_S, READY_S, TELL_S = 60.0, 120.0, 10.0
SIMULATED = ("ardupilot", "px4")


def main(argv: list[str] | None = None) -> int:
    """0: nothing failed; 1: something did; 2: it could not be tried."""
    checks.load()
    options = _options(argv)
    wanted = chosen(options.only)
    if options.list:
        print(*[f"{entry.name}  ({entry.takes_s:.0f} s)" for entry in wanted], sep="\n")
        return 0
    if not wanted:
        print(f"no check is called {' or '.join(options.only)}; --list names them", file=sys.stderr)
        return 2
    try:
        with _folder(options.logs) as log_dir:
            field = _field(options, Path(log_dir))
            try:
                return _judge(field, Run(field, wanted, tell, options.at_once), options.json)
            finally:
                field.close()
    except (LinkError, Failed, ValueError) as error:
        print(error, file=sys.stderr)
        return 2


def _folder(path: str | None) -> AbstractContextManager[str]:
    """Where the station records: all frames (conformance.tlog) and all orders (conformance.jsonl)."""
    if path is None:
        return tempfile.TemporaryDirectory()
    Path(path).mkdir(mode=0o700, parents=True, exist_ok=True)
    return nullcontext(path)


def _options(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.conformance", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--link", default="udpin:127.0.0.1:14550", help="where the vehicles are heard")
    parser.add_argument("--ids", default="", help="their system ids: 1-8 or 1,3,5; on loopback all heard, if not given")
    parser.add_argument("--sim", help="judge our simulator in lock-step instead: ardupilot, px4 or ardupilot,px4")
    at_once = f"so many vehicles at the same time, 1 to {MAX_AT_ONCE} (default {MAX_AT_ONCE})"
    numbers = range(1, MAX_AT_ONCE + 1)
    parser.add_argument("--at-once", type=int, default=MAX_AT_ONCE, choices=numbers, metavar="N", help=at_once)
    parser.add_argument("--json", metavar="FILE", help="write the result there, too; - is the standard output")
    parser.add_argument("--logs", metavar="FOLDER", help="keep the recording (.tlog) and the journal of orders there")
    parser.add_argument("--list", action="store_true", help="name the checks and end")
    parser.add_argument("only", nargs="*", help="only checks whose name contains one of these words")
    return parser.parse_args(argv)


def _field(options: argparse.Namespace, log_dir: Path) -> Field:
    if options.sim:
        kinds = tuple(options.sim.split(","))
        wrong = [kind for kind in kinds if kind not in SIMULATED]
        if wrong:
            raise ValueError(f"--sim {options.sim}: must be of {', '.join(SIMULATED)}")
        return simulated_field(kinds, log_dir)
    ids = ids_of(options.ids) if options.ids else ()
    if not ids and not _is_loopback(parse_link(options.link)):
        raise ValueError("name the vehicles: --ids (make: IDS=), for example 1-8. They will fly")
    return live_field(options.link, ids, log_dir)


def _is_loopback(spec: LinkSpec) -> bool:
    try:
        return spec.host == "localhost" or ipaddress.ip_address(spec.host).is_loopback
    except ValueError:
        return False


def _judge(field: Field, run: Run, json_file: str | None) -> int:
    absent = field.discover(DISCOVER_S, lambda text: say(f"waiting: {text}"))
    armed = [system for system in field.ids if field.vehicle(system).telemetry.armed]
    if armed:
        raise Failed(f"vehicle {', '.join(map(str, armed))} is armed: land and disarm it first, then judge")
    for system in absent:
        run.lines.append(
            Line("FAIL", "discovery: identity", system, f"not heard with a position in {DISCOVER_S:.0f} s")
        )
        tell(run.lines[-1])
    if run.at_once > 1 and field.alone():
        say("several vehicles are behind one address: they are judged one after the other")
        run.at_once = 1
    _wait_until_ready(field)
    typical_s, most_s = run.expected_s
    say(
        f"{len(run.checks)} checks on {len(field.ids)} vehicles ({_named(field)}), {run.at_once} at a time: "
        f"about {typical_s / 60:.0f} minutes, at most {most_s / 60:.0f}"
    )
    began_s = field.clock.now()
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda n, _: _stop(field, n, _)) for number in numbers]
    try:
        lines = run.all()
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
    print(summary(lines), flush=True)
    if json_file:
        vehicles = [_described(field, system) for system in field.ids]
        text = as_json(lines, vehicles, field.clock.now() - began_s)
        if json_file == "-":
            print(text)
        else:
            Path(json_file).write_text(text + "\n", encoding="utf-8")
    return 1 if any(line.verdict == "FAIL" for line in lines) else 0


def _stop(field: Field, number: int, _: FrameType | None) -> None:
    """End tidily; a second time: at once, whatever flies."""
    if field.turns.stopping:
        signal.signal(number, signal.SIG_DFL)
        signal.raise_signal(number)
    field.turns.stopping = True
    say("stopping: vehicles are landed and parameters put back first; once more ends at once, whatever flies")


def _wait_until_ready(field: Field) -> None:
    """Vehicles that have just been switched on need their time; those that do not get ready fail where they fly."""
    end_s = told_s = field.clock.now()
    end_s += READY_S
    while field.clock.now() < end_s:
        pilots = [Pilot(field, system) for system in field.ids]
        waits = {p.system: p.problems() for p in pilots if not p.firmware.why_not(p.vehicle) and not _could_start(p)}
        if not waits:
            return
        if field.clock.now() - told_s > TELL_S:
            told_s = field.clock.now()
            say("waiting: " + "; ".join(f"vehicle {n}: {why or 'no position yet'}" for n, why in waits.items()))
        field.run(0.5)


def _could_start(pilot: Pilot) -> bool:
    """Whether it has a position to start from: whether it is ready in the mode it starts in is not known yet."""
    v = pilot.vehicle
    return v.telemetry.gps_fix >= 3 and v.telemetry.home_m is not None and not pilot.firmware.start_problem(v)


def _described(field: Field, system: int) -> dict[str, object]:
    v = field.vehicle(system)
    return {"id": system, "firmware": name_of(v), "autopilot": v.autopilot, "type": v.type, "uid": v.identity.uid}


def _named(field: Field) -> str:
    return ", ".join(f"{system} {name_of(field.vehicle(system))}" for system in field.ids)


def say(text: str) -> None:
    """What is no result."""
    print(f"---- {text}", flush=True)


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
    if not ids or not all(1 <= i <= 254 for i in ids):
        raise ValueError(f"--ids {text}: system ids of vehicles are 1 to 254")
    return tuple(dict.fromkeys(ids))


if __name__ == "__main__":
    sys.exit(main())
