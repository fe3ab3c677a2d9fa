"""What the simulator's programs have in common: errors of one line, addresses, and ending with their starter."""

import argparse
import ctypes
import os
import select
import signal
import socket
import sys

EXIT_BAD_INPUT = 2
PARENT_CHECK_S = 1.0
_PR_SET_PDEATHSIG = 1
"""Option of Linux's prctl(2): the signal that a process gets when its parent ends."""


class LaunchError(Exception):
    """A program cannot run; the message is one line for the operator."""


def parse_target(text: str, option: str = "--target") -> tuple[str, int]:
    """Return host and port of "HOST:PORT".

    Raises:
        LaunchError: The text has another form.
    """
    host, _, port = text.rpartition(":")
    if not host or not (port.isascii() and port.isdigit()) or not 0 < int(port) < 65536:
        raise LaunchError(f"{option} {text}: must be HOST:PORT, for example 127.0.0.1:14550")
    return host, int(port)


def why(error: Exception) -> object:
    """Return what an error of a socket means, without its number."""
    return getattr(error, "strerror", None) or error


def resolved(address: tuple[str, int], option: str) -> tuple[str, int]:
    """Return an address with the number of its host.

    Raises:
        LaunchError: The host is unknown.
    """
    host, port = address
    try:
        return socket.gethostbyname(host), port
    except (OSError, UnicodeError):
        raise LaunchError(f"{option} {host}:{port}: this host is unknown") from None


def refuse(error: Exception) -> int:
    """Report bad input in one line, and return the exit status."""
    sys.stderr.write(f"sitl: {error}\n")
    return EXIT_BAD_INPUT


def add_starter(parser: argparse.ArgumentParser) -> None:
    """Add the options of `Starter`."""
    parser.add_argument("--parent", type=int, metavar="PID", help="end when this process, which started it, is gone")
    parser.add_argument("--lifeline", type=int, metavar="FD", help="end when the other end of this pipe is closed")


class Starter:
    """The process for which a program runs: the one that started it, or all that hold the other end of a pipe."""

    def __init__(self, parent: int | None, lifeline: int | None = None) -> None:
        """`lifeline` goes before `parent`; with neither the program runs until a signal ends it.

        Raises:
            LaunchError: The descriptor is not open.
        """
        self._parent, self._lifeline = parent, lifeline
        if lifeline is not None:
            try:
                os.fstat(lifeline)
            except OSError:
                raise LaunchError(f"--lifeline {lifeline}: no pipe is open under this number") from None

    @property
    def is_there(self) -> bool:
        """Whether the starter still exists."""
        if self._lifeline is not None:
            # Nothing is ever written to the pipe: when it gets readable, its other end was closed.
            return not select.select([self._lifeline], [], [], 0.0)[0]
        # The parent's number is compared, not looked for: a killed process may still have its number in use.
        return self._parent is None or os.getppid() == self._parent


class ProgramLoop:
    """The main loop of a program: it runs until a signal comes, or its starter is gone."""

    def __init__(self, starter: Starter) -> None:
        self.starter = starter
        self.running = True

    def catch_signals(self) -> None:
        """End the loop by SIGTERM and SIGINT from now on."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._stop)

    def _stop(self, *_: object) -> None:
        self.running = False


class ParentBond:
    """Ties a child to this process, between fork and exec: the kernel kills it when this process ends. Linux only.

    Elsewhere a child outlives this process if that is killed by SIGKILL, unless the child watches its parent itself
    (ArduPilot's simulator does).
    """

    def __init__(self) -> None:
        """Load the C library; between fork and exec that would not be safe."""
        self._prctl = ctypes.CDLL(None).prctl if sys.platform == "linux" else None
        self._parent = os.getpid()

    def __call__(self) -> None:
        """Tie the calling process to the one that made this object."""
        if self._prctl is not None:
            self._prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
            # The parent ended before the call above.
            if os.getppid() != self._parent:
                os._exit(1)
