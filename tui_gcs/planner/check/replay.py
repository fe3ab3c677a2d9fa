"""`python -m tui_gcs.planner.check.replay JOB`: the plans for recorded frames, made in a process of its own."""

import sys
from pathlib import Path

import msgspec

from tui_gcs.planner.check.determinism import ReplayJob
from tui_gcs.planner.check.subject import Broken, essence, subject_of
from tui_gcs.planner.runtime.registry import PlannerError


def main(file: Path) -> int:
    """Write `JOB.plans`; 1 with one line on stderr if the planner raised."""
    job = msgspec.msgpack.decode(file.read_bytes(), type=ReplayJob)
    try:
        subject = subject_of(job.what, job.seed, False, lambda: None)
        host = subject.host(job.task)
        plans = [essence(subject.step(host, frame)) for frame in job.frames]
    except (Broken, PlannerError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    file.with_name("job.plans").write_bytes(msgspec.msgpack.encode(plans))
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
