"""What the simulator's processes have in common: errors of one line, addresses, and ending with who started them."""

import ctypes
import os
import signal
import sys

EXIT_BAD_INPUT = 2
PARENT_CHECK_S = 1.0
_PR_SET_PDEATHSIG = 1
"""Of Linux's prctl(2)."""


class LaunchError(Exception):
    """One line for the user."""


def parse_target(text: str, option: str = "--target") -> tuple[str, int]:
    """HOST:PORT.

    Raises:
        LaunchError: It is not.
    """
    host, _, port = text.rpartition(":")
    if not host or not (port.isascii() and port.isdigit()) or not 0 < int(port) < 65536:
        raise LaunchError(f"{option} {text}: must be HOST:PORT, for example 127.0.0.1:14550")
    return host, int(port)


def alive(pid: int) -> bool:
    """Whether there is such a process."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


class ParentBond:
    """Called in a child between fork and exec: the kernel kills it when we die, however we die. Linux only.

    Elsewhere a child outlives us if we are killed with SIGKILL, unless it watches its parent itself (ArduPilot's
    simulator does).
    """

    def __init__(self) -> None:
        """Loaded here, because little is safe between fork and exec."""
        self._prctl = ctypes.CDLL(None).prctl if sys.platform == "linux" else None
        self._parent = os.getpid()

    def __call__(self) -> None:
        """Tie this process to the one that made this object."""
        if self._prctl is not None:
            self._prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
            if os.getppid() != self._parent:  # it died before the call above
                os._exit(1)
