"""A real console in a pseudo-terminal, for tests: start it, press keys, read what it painted, kill it."""

import fcntl
import os
import pty
import select
import signal
import struct
import sys
import termios
import time


class PtyConsole:
    """`tui-gcs ARGUMENTS` in a terminal of the given size."""

    def __init__(
        self,
        arguments: list[str],
        columns: int = 120,
        lines: int = 40,
        environment: dict[str, str] | None = None,
        module: str = "tui_gcs.cli.main",
    ) -> None:
        self.output = b""
        self.pid, self._fd = pty.fork()
        if self.pid == 0:
            _set_size(pty.STDOUT_FILENO, columns, lines)
            os.environ |= {"TERM": "xterm-256color"} | (environment or {})
            sized = {"COLUMNS", "LINES"}  # of the terminal that runs the tests; the readline module sets them, too
            left = {name: value for name, value in os.environ.items() if name not in sized}
            os.execve(sys.executable, [sys.executable, "-m", module, *arguments], left)
        self.modes = termios.tcgetattr(self._fd)
        """Of the terminal, when last looked at: `look_at_modes`."""
        self.modes_before = self.modes

    def read(self, seconds: float) -> bytes:
        """What it writes within `seconds`."""
        got, end = b"", time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            if select.select([self._fd], [], [], left)[0]:
                try:
                    got += os.read(self._fd, 65536)
                except OSError:
                    break
        self.output += got
        return got

    def read_some(self, seconds: float) -> bytes:
        """The first piece that it writes, within `seconds`."""
        got = b""
        if select.select([self._fd], [], [], seconds)[0]:
            try:
                got = os.read(self._fd, 65536)
            except OSError:
                got = b""
        self.output += got
        return got

    def wait_for(self, text: bytes, seconds: float) -> bool:
        """Whether `text` is painted (since the start) within `seconds`."""
        end = time.monotonic() + seconds
        while text not in self.output and time.monotonic() < end:
            self.read(0.2)
        return text in self.output

    def look_at_modes(self) -> list[object]:
        """Of the terminal now; those at its end when it is closed."""
        if self._fd >= 0:
            self.modes = termios.tcgetattr(self._fd)
        return self.modes

    def unread(self) -> int:
        """Bytes that it has written and nobody has read."""
        return int(struct.unpack("i", fcntl.ioctl(self._fd, termios.FIONREAD, b"    "))[0])

    def is_ended(self) -> bool:
        """Whether the process has ended, read or not."""
        return os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None

    def wait_stopped(self, seconds: float) -> bool:
        """Whether the process is stopped within `seconds`."""
        end = time.monotonic() + seconds
        while os.waitid(os.P_PID, self.pid, os.WSTOPPED | os.WNOHANG) is None:
            self.read(0.1)
            if time.monotonic() > end:
                return False
        self.read(0.2)
        return True

    def press(self, keys: bytes) -> None:
        """Type; what the console writes meanwhile is read, or neither would go on."""
        while keys:
            keys = keys[os.write(self._fd, keys[:4096]) :]
            if keys:
                self.read_some(0.001)

    def resize(self, columns: int, lines: int) -> None:
        """Another size: the console is told by SIGWINCH."""
        _set_size(self._fd, columns, lines)

    def kill(self) -> None:
        """kill -9."""
        os.kill(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)
        self._close()

    def wait_exit(self, seconds: float) -> int | None:
        """Exit code, or None if it still runs after `seconds`."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            done, status = os.waitpid(self.pid, os.WNOHANG)
            if done:
                self.read(0.1)
                self._close()
                return os.waitstatus_to_exitcode(status)
            self.read(0.1)
        return None

    def end(self) -> None:
        """kill -9, unless it is over."""
        if self._fd >= 0:
            self.kill()

    def _close(self) -> None:
        self.look_at_modes()
        os.close(self._fd)
        self._fd = -1


def _set_size(terminal: int, columns: int, lines: int) -> None:
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))
