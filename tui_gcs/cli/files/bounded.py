"""Limits of time and memory for a computation in this process."""

import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType


class TimeUsedUp(KeyboardInterrupt):
    """The computation has used up its time.

    What guards against the errors of planners lets a KeyboardInterrupt pass, and nothing else.
    """


@contextmanager
def bounded(seconds: float, memory_bytes: int) -> Iterator[None]:
    """Limit what runs inside to processor time and additional memory; to be used in the main thread.

    Raises:
        TimeUsedUp: the time is used up.
        MemoryError: the memory is.
    """
    # Processor time, so that a busy computer changes no result.
    before = signal.signal(signal.SIGPROF, _end)
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    limit = _data_bytes() + memory_bytes
    resource.setrlimit(resource.RLIMIT_DATA, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def _end(_signal: int, _frame: FrameType | None) -> None:
    raise TimeUsedUp


def _data_bytes() -> int:
    """The private memory of this process that counts towards RLIMIT_DATA; 0 where /proc does not show it."""
    try:
        pages = int((Path("/proc") / "self" / "statm").read_text().split()[5])
    except OSError:
        return 0
    return pages * resource.getpagesize()
