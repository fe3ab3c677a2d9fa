"""What the simulator's processes have in common: errors of one line, addresses, and ending with who started them."""

import argparse
import ctypes
import os
import select
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


def add_starter(parser: argparse.ArgumentParser) -> None:
    """The options of `Starter`."""
    parser.add_argument("--parent", type=int, metavar="PID", help="end when this process, which started it, is gone")
    parser.add_argument("--lifeline", type=int, metavar="FD", help="end when nobody holds the other end of this pipe")


class Starter:
    """Whom a simulator runs for: the process that started it, or everybody who holds the other end of a pipe."""

    def __init__(self, parent: int | None, lifeline: int | None = None) -> None:
        """`lifeline` goes before `parent`; with neither it runs until it is told to end.

        Raises:
            LaunchError: there is no such descriptor.
        """
        self._parent, self._lifeline = parent, lifeline
        if lifeline is not None:
            try:
                os.fstat(lifeline)
            except OSError:
                raise LaunchError(f"--lifeline {lifeline}: no pipe is open under this number") from None

    @property
    def is_there(self) -> bool:
        """Whether anybody still wants it."""
        if self._lifeline is not None:
            return not select.select([self._lifeline], [], [], 0.0)[0]  # nobody writes: what can be read is the end
        return self._parent is None or os.getppid() == self._parent  # one that was killed may still have its number


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
