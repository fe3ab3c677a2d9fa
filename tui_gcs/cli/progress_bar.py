"""Shows on stderr how far a lock-step flight is."""

import os
import sys
import time

from tui_gcs.cli.installation.general_options import QUIET, is_set

BAR_CELLS = 30


class ProgressBar:
    """One line on stderr, redrawn at most a few times a second."""

    def __init__(self) -> None:
        """Draw nothing before the first call of `show`."""
        self._next_s = float("inf") if is_set(QUIET, os.environ) else 0.0

    def show(self, share: float, text: str) -> None:
        """Draw the line if it is time to."""
        now = time.monotonic()
        if now < self._next_s:
            return
        self._next_s = now + (0.2 if sys.stderr.isatty() else 5.0)
        full = int(share * BAR_CELLS)
        line = f"[{'#' * full}{'.' * (BAR_CELLS - full)}] {share:4.0%} {text}"
        sys.stderr.write(f"\r{_fitted(line, 78):<78}" if sys.stderr.isatty() else line + "\n")
        sys.stderr.flush()

    def end(self) -> None:
        """Clear the line, so that the result stands alone."""
        if sys.stderr.isatty():
            sys.stderr.write("\r" + " " * 78 + "\r")


def _fitted(line: str, cells: int) -> str:
    return line if len(line) <= cells else line[: cells - 1] + "…"
