"""The bus: one small interface, and an in-memory implementation of it for lock-step runs and tests.

`zenoh_bus.py` is the other implementation. Payloads are bytes (see `common.py`). Keys are slash-separated; `*` in a
subscription stands for one segment.

The key fixes the writer: a principal asks under `gcs/req/<principal>`, a planner worker publishes under
`gcs/planner/<team>` and nowhere else. Identity is never taken from a payload.
"""

from collections.abc import Callable
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import Any, Protocol

FLEET = "gcs/fleet"
STATUS = "gcs/status"
EVENT = "gcs/event"
SCENARIO = "gcs/scenario"
TASK = "gcs/team/{team}/task"
PLAN = "gcs/planner/{team}/plan"
PREVIEW_TASK = "gcs/team/{team}/preview"
PREVIEW = "gcs/planner/{team}/preview"
REQUEST = "gcs/req/{principal}"
ALIVE = "gcs/alive/{principal}"

OnSample = Callable[[str, bytes], None]
"""Called with (key, payload), possibly on a thread of the bus: hand over and return."""
OnQuestion = Callable[[str, bytes, Callable[[bytes], None]], None]
"""Called with (key, payload, reply); `reply` may be called later and from another thread, once."""
OnAnswer = Callable[[bytes | None], None]
"""Called once, possibly on a thread of the bus, with the answer; None: none came in time."""
OnAlive = Callable[[str, bool], None]
"""Called with (key, present) when a principal comes or goes."""


class BusError(Exception):
    """The other side is not there, or did not answer in time."""


class Closable(Protocol):
    """A subscription, an answering, a token: ends with `close`."""

    def close(self) -> None:
        """End it; a second call does nothing."""
        ...


class Bus(Protocol):
    """What all parts of the system talk through."""

    def publish(self, key: str, payload: bytes) -> None:
        """Send to all subscribers of `key`; never blocks, may be dropped when a receiver is slow."""
        ...

    def subscribe(self, key: str, on_sample: OnSample) -> Closable:
        """Call `on_sample` for every sample whose key matches `key`, until the subscription is closed."""
        ...

    def begin(
        self, key: str, payload: bytes, on_answer: OnAnswer, timeout_s: float = 2.0, *, late: bool = False
    ) -> None:
        """Ask, and return without waiting. Questions that one thread asks arrive in the order in which it asks them.

        Once `on_answer` got None, the request is not carried out later either, unless it is a `late` one.
        """
        ...

    def ask(self, key: str, payload: bytes, timeout_s: float = 2.0) -> bytes:
        """Ask, and wait for the answer. Raises `BusError` if none comes in time; see `begin`."""
        ...

    def answer(self, key: str, on_question: OnQuestion) -> Closable:
        """Call `on_question` for every request whose key matches `key`."""
        ...

    def alive(self, key: str) -> Closable:
        """Show `key` as present until closed, or until this process is gone."""
        ...

    def watch(self, key: str, on_alive: OnAlive) -> Closable:
        """Call `on_alive` for everything present that matches, now and as it comes and goes."""
        ...

    def close(self) -> None:
        """Leave the bus; subscriptions, answers and tokens of this side end."""
        ...


@lru_cache(4096)
def matches(pattern: str, key: str) -> bool:
    """Whether `key` matches `pattern`, where `*` is one whole segment."""
    parts, wanted = key.split("/"), pattern.split("/")
    return len(parts) == len(wanted) and all(fnmatchcase(p, w) for p, w in zip(parts, wanted, strict=True))


class MemoryBus:
    """All parts in one process: calls happen at once, in order of registration, on the caller's stack."""

    def __init__(self) -> None:
        self._subscribers: list[tuple[str, OnSample]] = []
        self._answerers: list[tuple[str, OnQuestion]] = []
        self._watchers: list[tuple[str, OnAlive]] = []
        self._present: list[str] = []

    def publish(self, key: str, payload: bytes) -> None:
        """See `Bus.publish`."""
        for pattern, on_sample in list(self._subscribers):
            if matches(pattern, key):
                on_sample(key, payload)

    def subscribe(self, key: str, on_sample: OnSample) -> Closable:
        """See `Bus.subscribe`."""
        return _registered(self._subscribers, (key, on_sample))

    def begin(
        self, key: str, payload: bytes, on_answer: OnAnswer, timeout_s: float = 2.0, *, late: bool = False
    ) -> None:
        """See `Bus.begin`; the answer comes before this returns."""
        try:
            answer = self.ask(key, payload, timeout_s)
        except BusError:
            on_answer(None)
        else:
            on_answer(answer)

    def ask(self, key: str, payload: bytes, timeout_s: float = 2.0) -> bytes:
        """See `Bus.ask`; the answer must come before the answerer returns."""
        answers: list[bytes] = []
        # A copy: a handler may register or close others while it runs.
        for pattern, on_question in list(self._answerers):
            if matches(pattern, key):
                on_question(key, payload, answers.append)
                break
        if not answers:
            raise BusError(f"nothing answers {key}")
        return answers[0]

    def answer(self, key: str, on_question: OnQuestion) -> Closable:
        """See `Bus.answer`."""
        return _registered(self._answerers, (key, on_question))

    def alive(self, key: str) -> Closable:
        """See `Bus.alive`."""
        self._present.append(key)
        self._notify(key, True)

        def leave() -> None:
            self._present.remove(key)
            self._notify(key, False)

        return Registration(leave)

    def watch(self, key: str, on_alive: OnAlive) -> Closable:
        """See `Bus.watch`."""
        registration = _registered(self._watchers, (key, on_alive))
        for present in list(self._present):
            if matches(key, present):
                on_alive(present, True)
        return registration

    def close(self) -> None:
        """Forget all subscribers, answerers and watchers."""
        self._subscribers.clear()
        self._answerers.clear()
        self._watchers.clear()

    def _notify(self, key: str, present: bool) -> None:
        for pattern, on_alive in list(self._watchers):
            if matches(pattern, key):
                on_alive(key, present)


class BusSession:
    """One partner's part of a shared bus: `close` ends what it began, and the others stay."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._begun: list[Closable] = []

    def publish(self, key: str, payload: bytes) -> None:
        """See `Bus.publish`."""
        self._bus.publish(key, payload)

    def subscribe(self, key: str, on_sample: OnSample) -> Closable:
        """See `Bus.subscribe`."""
        return self._keep(self._bus.subscribe(key, on_sample))

    def begin(
        self, key: str, payload: bytes, on_answer: OnAnswer, timeout_s: float = 2.0, *, late: bool = False
    ) -> None:
        """See `Bus.begin`."""
        self._bus.begin(key, payload, on_answer, timeout_s, late=late)

    def ask(self, key: str, payload: bytes, timeout_s: float = 2.0) -> bytes:
        """See `Bus.ask`."""
        return self._bus.ask(key, payload, timeout_s)

    def answer(self, key: str, on_question: OnQuestion) -> Closable:
        """See `Bus.answer`."""
        return self._keep(self._bus.answer(key, on_question))

    def alive(self, key: str) -> Closable:
        """See `Bus.alive`."""
        return self._keep(self._bus.alive(key))

    def watch(self, key: str, on_alive: OnAlive) -> Closable:
        """See `Bus.watch`."""
        return self._keep(self._bus.watch(key, on_alive))

    def close(self) -> None:
        """End everything that this session began."""
        for begun in self._begun:
            begun.close()
        self._begun.clear()

    def _keep(self, begun: Closable) -> Closable:
        self._begun.append(begun)
        return begun


def _registered(entries: list[Any], entry: object) -> Closable:
    """Add `entry`, which leaves when what is returned is closed, if the bus was not closed before."""
    entries.append(entry)
    return Registration(lambda: entries.remove(entry) if entry in entries else None)


class Registration:
    """Undoes something when it is closed first."""

    def __init__(self, undo: Callable[[], None]) -> None:
        self._undo: Callable[[], None] | None = undo

    def close(self) -> None:
        """See `Closable.close`."""
        undo, self._undo = self._undo, None
        if undo is not None:
            undo()
