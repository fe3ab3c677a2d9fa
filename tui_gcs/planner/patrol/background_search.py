"""Work between two steps: in a thread that the next step waits for, so that the same frames give the same plans."""

import threading
from collections.abc import Callable


class BackgroundThread:
    """At most one thread, which works while nobody else looks at what it works on."""

    def __init__(self) -> None:
        self._thread: threading.Thread | None = None
        self._error: BaseException | None = None

    def begin(self, work: Callable[[], None]) -> None:
        """Work until `wait`; what was begun before must be waited for first."""

        def run() -> None:
            try:
                work()
            except BaseException as error:  # noqa: BLE001 - raised again by `wait`, in the thread that waits
                self._error = error

        self._thread = threading.Thread(target=run, name="patrol search", daemon=True)
        self._thread.start()

    def wait(self) -> None:
        """Until the work is done. Raises what it raised."""
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._error is not None:
            error, self._error = self._error, None
            raise error
