"""`tui-gcs planner check`: everything that must hold before a planner flies, one line each.

The planner runs in a process of its own: if it hangs or crashes, that becomes a line, and the checks go on.
"""

import argparse
import json
import os
import re
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tui_gcs.cli.command_report import CommandReport, check_output, finish
from tui_gcs.cli.common import check_seed
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.core.base.text import clean
from tui_gcs.planner.check.suite import CHECKS, FIRST
from tui_gcs.planner.runtime import describe, registry

NAMES = (*CHECKS, "flight", "faults")
PRINTED_BY = {"loads": "", "other process": "same again"}
"""Other names that a report prints, and the check that finds them. Loading comes before every check."""
SILENT_S = 60.0
"""A planner without a sign of life this long hangs. The station waits 2 s for a step and 20 s for a first plan."""
LOADING_SILENT_S = describe.LOAD_LIMIT_S
"""The same while its file is loaded: a planner that takes longer is not flown either."""
CPU_SHARE = 1 / 3
"""On a busy machine a silent planner is still waited for unless it had this share of a processor."""
CHECK_LIMIT_S = 900.0
DUMP_S = 1.0
MAX_CELLS = 400

Line = dict[str, Any]


def run(arguments: argparse.Namespace) -> int:
    """Make the checks; the exit code is 0 only if all of them hold."""
    check_seed(arguments.seed)
    check_output(arguments)
    what = arguments.planner
    _exists(what)
    wanted = wanted_checks(arguments.only)
    found: list[Line] = []
    for finding in findings(what, wanted, arguments):
        found.append(finding)
        if not arguments.json:
            sys.stdout.write(text_of(finding))
            sys.stdout.flush()
    bad = [finding for finding in found if finding["verdict"] == "FAIL"]
    good = "what was asked for holds" if arguments.only else "everything holds"
    text = f"{what}: {f'{len(bad)} FAIL' if bad else good}"
    if not arguments.json:
        sys.stdout.write(f"\n{text}\n")
    code = ReportCode.FAILED if bad else ReportCode.NONE
    return finish(arguments, CommandReport(not bad, code, text, {"planner": what, "findings": found}))


def wanted_checks(only: list[str]) -> list[str]:
    """Return the checks that `--only` names, or all. Raises `CommandError` with all names for an unknown one."""
    if not only:
        return list(NAMES)
    for name in only:
        if name not in NAMES and name not in PRINTED_BY:
            names = ", ".join([*PRINTED_BY, *NAMES])
            raise CommandError(f"--only {name!r}: no check of that name; there are: {names}")
    made = {PRINTED_BY.get(name, name) for name in only}
    return [name for name in NAMES if name in made]


def _exists(what: str) -> None:
    if what.endswith(".py"):
        if not Path(what).is_file():
            raise CommandError(f"{what}: there is no such file; `tui-gcs planner new NAME` writes one to begin with")
    elif what not in registry.names():
        raise CommandError(
            f"{what}: no planner of that name (there are: {', '.join(registry.names())}); a file ends in .py"
        )


def text_of(finding: Line) -> str:
    """Return a finding as text: the check, whether it holds, how much, and what to do."""
    head = f"{finding['verdict']:<5} {finding['check']:<14} {clean(finding['value'], MAX_CELLS)}\n"
    return head + (f"{'':21}-> {clean(finding['advice'], MAX_CELLS)}\n" if finding["advice"] else "")


def findings(what: str, names: list[str], arguments: argparse.Namespace) -> Iterator[Line]:
    """Yield all findings as they come; a check that ends its process is a failed one."""
    left, first = names, True
    while left or first:
        now, bad = "", False
        for line in _child(what, left, first, arguments):
            now = line.get("begin", now)
            if "finding" in line:
                bad = bad or (line["finding"]["verdict"] == "FAIL" and now in ("loads", *FIRST))
                yield line["finding"]
            if "died" in line:
                bad = bad or now in ("", "loads", *FIRST)
                yield {"check": now or "loads", "verdict": "FAIL", "value": line["died"], "advice": line["advice"]}
            if bad:
                return
            if line.get("end"):
                return
        if now not in left:
            return
        left, first = left[left.index(now) + 1 :], False


def _child(what: str, names: list[str], first: bool, arguments: argparse.Namespace) -> Iterator[Line]:
    """Yield what the planner's process reports, and last how it died, if it did."""
    reader, writer = os.pipe()
    job = {"planner": what, "seed": arguments.seed, "quick": arguments.quick, "checks": names}
    job["instances"] = arguments.instances
    job |= {"first": first, "descriptor": writer}
    with tempfile.TemporaryFile() as errors:
        command = [sys.executable, "-m", "tui_gcs.cli.planner.check_child", json.dumps(job)]
        # One order of sets here: the check of other processes compares with another one.
        environment = os.environ | {"PYTHONHASHSEED": "0"}
        child = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=errors, stderr=errors, pass_fds=(writer,), env=environment
        )
        os.close(writer)
        hung = ended = False
        try:
            lines = _ChildLines(reader, child.pid)
            for line in lines:
                ended = ended or "end" in line
                yield line
            if hung := lines.hung:
                child.send_signal(signal.SIGUSR1)  # it says where it is
                time.sleep(DUMP_S)
                child.kill()
            code = child.wait()
        finally:
            child.kill()
            child.wait()
            os.close(reader)
        errors.seek(0)
        error_text = errors.read().decode(errors="replace")
    # `os._exit(0)` in a step ended the checks unseen: "everything holds", exit code 0.
    if hung or code or not ended:  # code 0 before all was checked: the planner ended it
        yield _death(what, error_text, code, hung_s=lines.silent_s if hung else None)


class _ChildLines:
    """The lines of a pipe, until it is closed or silent for too long.

    A line with only a number is a sign of life; the number is the CPU seconds used so far.
    """

    def __init__(self, descriptor: int, pid: int) -> None:
        """Begin with an empty buffer."""
        self._descriptor = descriptor
        self._pid = pid
        self._cpu_s = 0.0
        """The CPU seconds that the process reported last."""
        self._check_s = time.monotonic()
        self.hung = False
        self.silent_s = SILENT_S
        """In the present check a process without a sign of life this long hangs."""

    def __iter__(self) -> Iterator[Line]:
        rest = b""
        while True:
            if not select.select([self._descriptor], [], [], self.silent_s)[0]:
                if self._computes() and time.monotonic() - self._check_s < CHECK_LIMIT_S:
                    continue
                self.hung = True
                return
            data = os.read(self._descriptor, 65536)
            if not data:
                return
            *whole, rest = (rest + data).split(b"\n")
            for text in whole:
                line = json.loads(text)
                if isinstance(line, float):
                    self._cpu_s = line
                    continue
                if "begin" in line:
                    self._check_s = time.monotonic()
                    self.silent_s = LOADING_SILENT_S if line["begin"] == "loads" else SILENT_S
                yield line

    def _computes(self) -> bool:
        """Return whether it was given too little of the processor to be called silent."""
        command = ["ps", "-o", "state=,time=", "-p", str(self._pid)]
        columns = subprocess.run(command, capture_output=True, text=True, check=False).stdout.split()
        if len(columns) != 2 or not columns[0].startswith("R"):
            return False
        # A process that a busy machine does not let run is no process that hangs.
        seconds = 0.0
        for part in re.split("[-:]", columns[1]):  # [[days-]hours:]minutes:seconds; nobody computes for days here
            seconds = 60.0 * seconds + float(part)
        return seconds - self._cpu_s < self.silent_s * CPU_SHARE


def _death(what: str, error_text: str, code: int, *, hung_s: float | None) -> Line:
    """Return how the process ended, and in which line of the planner's file, as far as it is known.

    With `hung_s` the process was killed after so many seconds without a sign of life.
    """
    name = Path(what).name
    place = rf'File "[^"]*{re.escape(name)}", line (\d+) in (\w+|<module>)'
    places = re.findall(place, error_text) if what.endswith(".py") else []
    where = f" at {name}:{places[0][0]} in {places[0][1]}".removesuffix(" in <module>") if places else ""
    if hung_s == LOADING_SILENT_S:
        text = f"does not finish loading within {hung_s:g} s{where}"
        return {"died": text, "advice": "what takes long belongs into configure; no flight takes it otherwise"}
    if hung_s is not None:
        text = f"no sign of life for {hung_s:g} s{where}: it hangs"
        return {"died": text, "advice": "a step must end: in flight its vehicles would hold, and the worker be killed"}
    if code < 0:
        text = f"the process died of {signal.Signals(-code).name}{where}"
        return {"died": text, "advice": "it crashes in native code, or runs out of memory"}
    last = error_text.strip().rpartition("\n")[2]
    return {
        "died": f"the process ended with code {code}{where}: {last}",
        "advice": "a planner must not end its process",
    }
