"""Checks of several vehicles at the same time, on one clock: each runs until it lets time pass, then another.

Every body is a thread, but only one of them, or time itself, moves at any moment; so nothing needs a lock, and in
lock-step the same seed gives the same run.
"""

import threading
from collections.abc import Callable, Sequence

Body = Callable[[], None]


class Stopped(Exception):
    """The run is being ended by its operator: clean up, and go."""


class TimeUp(Exception):
    """A check took longer than it may."""


class Turns:
    """Lets bodies run in turns; `wait` is how a body lets time pass."""

    def __init__(self, move: Callable[[], None], now: Callable[[], float]) -> None:
        """`move` moves the vehicles, the station and the clock on by a moment."""
        self._move = move
        self._now = now
        self.stopping = False
        """Set it (from a signal handler), and every body gets one `Stopped` when it waits next."""

    def together(self, bodies: Sequence[Body]) -> None:
        """Run all to their ends."""
        turns = [_Turn(body) for body in bodies]
        for turn in turns:
            turn.start()
        while turns:
            turns = [turn for turn in turns if turn.go_on()]
            if turns:
                self._move()

    def wait(self) -> None:
        """Let a moment pass. Outside of `together` time moves at once.

        Raises:
            TimeUp: the present body's time is over (once; then it may clean up).
            Stopped: the run is being ended (once).
        """
        turn = threading.current_thread()
        if not isinstance(turn, _Turn):
            self._move()
            return
        turn.pass_on()
        if self.stopping and not turn.was_stopped:
            turn.was_stopped = True
            raise Stopped("stopped by the operator")
        if turn.limit_s is not None and self._now() > turn.limit_s:
            limit_s, turn.limit_s = turn.limit_s - turn.since_s, None
            raise TimeUp(f"not over after {limit_s:.0f} s")

    def limit(self, seconds: float | None) -> None:
        """The present body has so much time from now on (None: any)."""
        turn = threading.current_thread()
        if isinstance(turn, _Turn):
            turn.since_s = self._now()
            turn.limit_s = None if seconds is None else turn.since_s + seconds


class _Turn(threading.Thread):
    """One body. The semaphores are the baton: it is here, or there."""

    def __init__(self, body: Body) -> None:
        super().__init__(daemon=True)
        self._body = body
        self._here, self._there = threading.Semaphore(0), threading.Semaphore(0)
        self._over = False
        self._error: BaseException | None = None
        self.was_stopped = False
        self.since_s = 0.0
        self.limit_s: float | None = None

    def run(self) -> None:
        """As the thread: wait for the first turn, then do it."""
        self._here.acquire()
        try:
            self._body()
        except BaseException as error:  # noqa: BLE001 - handed to who waits for the end
            self._error = error
        self._over = True
        self._there.release()

    def go_on(self) -> bool:
        """Let it run until it waits or ends; whether it goes on."""
        self._here.release()
        self._there.acquire()
        if self._error is not None:
            raise self._error
        return not self._over

    def pass_on(self) -> None:
        """As the thread: let the others run."""
        self._there.release()
        self._here.acquire()
