"""How long a process has waited for a processor, as the kernel counts it.

A process that gets no CPU time looks like one that hangs: on a starved computer planner workers were killed four times
in a row, and each new start made it worse.
"""

import os

PROC = "/proc"
_LONGEST_BYTES = 200
"""A `schedstat` has three numbers."""


def run_delay_s(pid: int) -> float:
    """Return the seconds for which threads of a process were ready to run and had no CPU; 0 where that is not known.

    Linux counts it in the second field of each thread's `schedstat`, in nanoseconds; other systems do not.
    """
    # Twenty workers have some two hundred threads, and all are looked at several times a second: with pathlib that took
    # a tenth of the station's CPU time.
    total_ns, folder = 0, f"{PROC}/{pid}/task"
    try:
        threads = os.listdir(folder)  # noqa: PTH208 - see above
    except OSError:
        return 0.0
    for thread in threads:
        try:
            file = os.open(f"{folder}/{thread}/schedstat", os.O_RDONLY)
            try:
                total_ns += int(os.read(file, _LONGEST_BYTES).split()[1])
            finally:
                os.close(file)
        except (OSError, ValueError, IndexError):
            continue  # it has ended meanwhile, or the kernel does not count
    return total_ns / 1e9


class CpuWaitMonitor:
    """Adds up the waiting of one process; its threads may come and go."""

    def __init__(self, pid: int, now: float) -> None:
        self.waited_s = 0.0
        """Since the monitor began, and never more than the time that has passed."""
        self._pid, self._looked_s, self._delay_s = pid, now, run_delay_s(pid)

    def look(self, now: float) -> None:
        """Count what came since the last look."""
        delay_s = run_delay_s(self._pid)
        # The sum shrinks when a thread ends. Several threads that wait at once have waited once.
        self.waited_s += min(max(0.0, delay_s - self._delay_s), max(0.0, now - self._looked_s))
        self._looked_s, self._delay_s = now, delay_s
