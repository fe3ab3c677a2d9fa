"""The process in which a planner is checked. It may hang or crash: `check`, which started it, goes on.

Findings go as lines of JSON to the descriptor in the job; a number alone is a sign of life, the CPU seconds so far.
"""

import dataclasses
import faulthandler
import json
import os
import signal
import sys
import time
from typing import Any

from tui_gcs.planner.check.subject import Finding, checked_planner, failed, passed
from tui_gcs.planner.check.suite import CHECKS, Check, findings
from tui_gcs.planner.runtime.planner_errors import PlannerError

BEAT_S = 0.2


class FindingWriter:
    """Writes findings and signs of life to the process that started the check."""

    def __init__(self, descriptor: int) -> None:
        """Write to the open file `descriptor`, line by line."""
        self._out = os.fdopen(descriptor, "w", buffering=1)
        self._next_s = 0.0

    def begin(self, check: str) -> None:
        """Report that a check begins."""
        self._tell({"begin": check})

    def found(self, finding: Finding) -> None:
        """Report one finding of the check that runs."""
        self._tell({"finding": dataclasses.asdict(finding)})

    def end(self) -> None:
        """Report that all checks were made."""
        self._tell({"end": True})

    def beat(self) -> None:
        """Report that the process is alive."""
        if (now := time.monotonic()) >= self._next_s:
            self._next_s = now + BEAT_S
            # CPU time, not the clock's: the parent waits longer where the machine is busy.
            self._out.write(f"{time.process_time()}\n")

    def _tell(self, what: dict[str, Any]) -> None:
        self._out.write(json.dumps(what) + "\n")


def main(job: dict[str, Any]) -> None:
    """Load the planner and make the checks of the job, in order."""
    faulthandler.enable()
    # Only native code can report where a Python loop stands that never gives way.
    faulthandler.register(signal.SIGUSR1)
    teller = FindingWriter(job["descriptor"])
    teller.begin("loads")
    try:
        subject = checked_planner(job["planner"], job["seed"], job["quick"], teller.beat, job["instances"])
    except PlannerError as error:
        teller.found(failed(str(error), "mend that first", check="loads"))
    else:
        if job["first"]:
            teller.found(passed(f"class {subject.planner.__name__} of {subject.path.name}", check="loads"))
        for name in job["checks"]:
            teller.begin(name)
            for finding in findings(_check(name), name, subject):
                teller.found(finding)
    teller.end()


def _check(name: str) -> Check:
    if name in CHECKS:
        return CHECKS[name]
    from tui_gcs.cli.planner import check_flights  # the simulator, which other checks do not need

    return {"flight": check_flights.shipped, "faults": check_flights.protection}[name]


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
