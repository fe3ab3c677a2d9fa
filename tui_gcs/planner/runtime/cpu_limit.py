"""Ends a call that takes too much CPU time, so that an endless loop in one instance does not stop the others.

The limit is CPU time of this process and not time of a clock: a busy computer is no reason to end a planner. It works
on the main thread only, where Python delivers signals, and ends Python code; a loop within C code goes on, and then the
station ends the whole worker, as it does for every planner that hangs.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

AGAIN_S = 0.05
"""The limit is raised again after this much more CPU time: code may catch everything and loop on."""


class CpuLimitExceeded(BaseException):
    """Raised within a call that took too much CPU time. No `Exception`: what is caught broadly must not catch it."""


@contextmanager
def cpu_limit(limit_s: float) -> Iterator[None]:
    """Raise `CpuLimitExceeded` within the block after so much CPU time."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    armed = True

    def end(_signal: int, _frame: FrameType | None) -> None:
        if armed:
            raise CpuLimitExceeded(f"more than {limit_s:g} s of CPU time at once")

    before = signal.signal(signal.SIGVTALRM, end)
    signal.setitimer(signal.ITIMER_VIRTUAL, limit_s, AGAIN_S)
    try:
        yield
    finally:
        armed = False
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
