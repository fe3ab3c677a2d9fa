"""The descendants of a process: found and killed even when they left its process group.

A planner may start a program in a session of its own. A process that calls `adopt_orphans` becomes the parent of such
programs when the one that started them has ended, and can then kill them. Linux only; elsewhere nothing is found, and
the process group is all that can be killed.
"""

import contextlib
import ctypes
import os
import signal
import sys
from pathlib import Path

# A constant of the Linux kernel (linux/prctl.h), for which Python has no name.
_PR_SET_CHILD_SUBREAPER = 36
MAX_LOOKS = 5
"""How often the descendants are looked for again: one may start another while it is being killed."""


def adopt_orphans() -> bool:
    """Make this process the parent of every orphan among its descendants; False where that is not possible."""
    if not sys.platform.startswith("linux"):
        return False
    with contextlib.suppress(OSError, AttributeError):
        return bool(ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0)
    return False


def children_of(pid: int) -> list[int]:
    """The children of the process `pid`, ended ones that were not waited for among them."""
    found: list[int] = []
    with contextlib.suppress(OSError):
        for thread in (Path("/proc") / str(pid) / "task").iterdir():
            with contextlib.suppress(OSError):
                found += map(int, (thread / "children").read_text().split())
    return found


def kill_descendants(pid: int) -> None:
    """Kill all that `pid` has started, directly or not, and not itself."""
    for _ in range(MAX_LOOKS):
        found, waiting = [], [pid]
        while waiting:
            children = children_of(waiting.pop())
            found += children
            waiting += children
        alive = [child for child in found if not _has_ended(child)]
        if not alive:
            return
        for child in alive:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(child, signal.SIGKILL)


def kill_orphans(kept: set[int]) -> None:
    """Kill and forget the children in other sessions that are not `kept`, and what they have started.

    What this process itself starts without a new session is in its own one, and stays.
    """
    for child in children_of(os.getpid()):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if child in kept or os.getsid(child) == os.getsid(0):
                continue
            kill_descendants(child)
            os.kill(child, signal.SIGKILL)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(child, os.WNOHANG)


def _has_ended(pid: int) -> bool:
    """Whether it is gone, or only its exit code is left."""
    try:
        return (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except (OSError, IndexError):
        return True
