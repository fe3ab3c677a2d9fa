"""A thread that searches between two steps.

The next step waits for it, so that the same frames give the same plans.
"""

import contextlib
import os
import sys
import threading
from collections.abc import Callable

NICE = 5
"""Lower priority of a search: the station and the steps of planners come first on a busy computer."""


def _give_way() -> None:
    """Lower the priority of the calling thread, which Linux knows as a process of its own; elsewhere it stays."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICE)


class BackgroundThread:
    """At most one thread. While it works, its owner must not touch what it works on."""

    def __init__(self) -> None:
        self._thread: threading.Thread | None = None
        self._error: BaseException | None = None

    def begin(self, work: Callable[[], None]) -> None:
        """Run `work` on a thread; call `wait` before the next `begin`."""

        def run() -> None:
            _give_way()
            try:
                work()
            except BaseException as error:  # noqa: BLE001 - raised again by `wait`, in the thread that waits
                self._error = error

        self._thread = threading.Thread(target=run, name="patrol search", daemon=True)
        self._thread.start()

    def wait(self) -> None:
        """Wait until the work is done. Raises what it raised."""
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._error is not None:
            error, self._error = self._error, None
            raise error
