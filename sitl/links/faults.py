"""What a bad link does to datagrams, from a seed, without sockets and without a clock of its own.

`parse` reads what an operator writes, for example "loss=0.1,delay=200ms,jitter=20%,down.rate=5760":

loss=SHARE              each datagram is lost with this chance
burst=ENTER/LEAVE       Gilbert-Elliott: chance per datagram to enter a state that loses all, and to leave it again
delay=TIME              each datagram is later by this time
jitter=SHARE            the delay varies evenly by ± this share; the order is kept
dup=SHARE               arrives twice
reorder=SHARE           changes places with the next one (or comes half a second late if none follows)
rate=BYTES_PER_S        a narrow channel with a queue of 400 ms; what does not fit is lost
corrupt=CHANCE          each bit flips with this chance
flap=ON/OFF             works and is dead by turns; each vehicle begins at another moment of the turn

Shares are 0.1 or 10 %, times 200ms or 2s. `up.` (station to vehicle) or `down.` before a name means that direction
only, and overrides the same name without it. `python -m sitl.links.faults TEXT` checks a text, and reports in one line
what is wrong with it.
"""

import math
import random
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from heapq import heappop, heappush
from typing import Any

QUEUE_S = 0.4
"""The queue of a narrow channel holds as much as it sends in this time."""
HOLD_S = 0.5
"""A datagram that waits to be overtaken is released after this time."""
MAX_DELAY_S, MAX_FLAP_S, MIN_FLAP_S = 60.0, 3600.0, 0.01
MIN_RATE_BYTES_S, MAX_RATE_BYTES_S = 10.0, 1e9
BITS_PER_BYTE = 8


class FaultError(ValueError):
    """A text that is not a link's faults; the message is one line: what is wrong, and what is right."""


@dataclass(frozen=True)
class Faults:
    """The faults of one direction of a link."""

    loss: float = 0.0
    burst: tuple[float, float] = (0.0, 1.0)
    """Chances per datagram to enter the state that loses all, and to leave it."""
    delay: float = 0.0
    """Seconds that each datagram is late."""
    jitter: float = 0.0
    """Share of the delay by which it varies."""
    dup: float = 0.0
    reorder: float = 0.0
    rate: float = 0.0
    """Bytes per second; 0 is no limit."""
    corrupt: float = 0.0
    """Chance of each bit to flip."""
    flap: tuple[float, float] = (0.0, 0.0)
    """Seconds that the link works, and seconds that it is dead."""


@dataclass(frozen=True)
class LinkFaults:
    """The faults of both directions of a link."""

    up: Faults = Faults()
    """From the station to the vehicle."""
    down: Faults = Faults()


def parse(text: str) -> LinkFaults:
    """Read the text of a `--fault` option; an empty one is a perfect link.

    Raises:
        FaultError: A name is unknown or given twice, or a value is missing or out of range.
    """
    given: dict[str, dict[str, Any]] = {"": {}, "up": {}, "down": {}}
    for part in filter(None, (p.strip() for p in text.split(","))):
        direction, name, value = _split(part)
        if name in given[direction]:
            raise FaultError(f"{part}: {name} is given twice")
        try:
            given[direction][name] = _READERS[name](value)
        except ValueError as error:
            raise FaultError(f"{part}: {error}") from None
    return LinkFaults(_direction(given, "up"), _direction(given, "down"))


def _split(part: str) -> tuple[str, str, str]:
    """Return direction ("up", "down" or ""), name and value."""
    key, equals, value = part.partition("=")
    direction, dot, name = key.strip().rpartition(".")
    if (dot and direction not in ("up", "down")) or name not in _READERS or not equals:
        raise FaultError(f"{part}: must be NAME=VALUE, up.NAME=VALUE or down.NAME=VALUE; names: {', '.join(_READERS)}")
    return direction, name, value.strip()


def _direction(given: dict[str, dict[str, Any]], direction: str) -> Faults:
    faults = Faults(**(given[""] | given[direction]))
    if faults.jitter and not faults.delay:
        raise FaultError("jitter is a share of the delay: give a delay, too, for example delay=200ms,jitter=20%")
    return faults


def _number(text: str, least: float, most: float, what: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    # The form also refuses NaN.
    if not least <= value <= most:
        raise ValueError(f"must be {what}")
    return value


def _share(text: str) -> float:
    what = "a share of 0 to 1, for example 0.1 or 10%"
    if text.endswith("%"):
        return _number(text[:-1], 0.0, 100.0, what) / 100.0
    return _number(text, 0.0, 1.0, what)


def _time(text: str, least_s: float, most_s: float) -> float:
    what = f"a time of {least_s:g} to {most_s:g} s, for example 200ms or 2s"
    if text.endswith("ms"):
        return _number(text[:-2], least_s * 1e3, most_s * 1e3, what) / 1e3
    if text.endswith("s"):
        return _number(text[:-1], least_s, most_s, what)
    raise ValueError(f"must be {what}")


def _burst(text: str) -> tuple[float, float]:
    enter, _, leave = text.partition("/")
    try:
        chances = _share(enter), _share(leave)
    except ValueError:
        chances = 0.0, 0.0
    if not chances[1]:
        raise ValueError("must be ENTER/LEAVE, chances per datagram, for example 0.05/0.3")
    return chances


def _flap(text: str) -> tuple[float, float]:
    on, _, off = text.partition("/")
    try:
        return _time(on, MIN_FLAP_S, MAX_FLAP_S), _time(off, MIN_FLAP_S, MAX_FLAP_S)
    except ValueError:
        raise ValueError(f"must be ON/OFF, {MIN_FLAP_S:g} to {MAX_FLAP_S:g} s each, for example 2s/2s") from None


_READERS: dict[str, Callable[[str], Any]] = {
    "loss": _share,
    "burst": _burst,
    "delay": lambda text: _time(text, 0.0, MAX_DELAY_S),
    "jitter": _share,
    "dup": _share,
    "reorder": _share,
    "rate": lambda text: _number(
        text, MIN_RATE_BYTES_S, MAX_RATE_BYTES_S, "bytes per second, at least 10, for example 5760"
    ),
    "corrupt": lambda text: _number(text, 0.0, 1.0, "the chance of a bit to flip, for example 1e-4"),
    "flap": _flap,
}


@dataclass
class FaultCounter:
    """Counts what became of the datagrams of one lane, or of many."""

    taken: int = 0
    passed: int = 0
    """Datagrams that came out, second copies included."""
    lost: int = 0
    burst: int = 0
    flap: int = 0
    queue: int = 0
    """Datagrams that were lost: one by one, in bursts, while the link was dead, because the queue was full."""
    corrupted: int = 0
    duplicated: int = 0
    overtaken: int = 0
    """Datagrams that came out after one that came in later."""
    delay_s: float = 0.0
    longest_s: float = 0.0
    """Delays of all datagrams that came out: their sum, and the longest."""

    def add(self, other: "FaultCounter") -> None:
        """Add the counts of another lane."""
        for field in fields(self):
            if field.name != "longest_s":
                setattr(self, field.name, getattr(self, field.name) + getattr(other, field.name))
        self.longest_s = max(self.longest_s, other.longest_s)

    def text(self) -> str:
        """Return one line for the operator."""
        missing = self.lost + self.burst + self.flap + self.queue
        share = missing / self.taken if self.taken else 0.0
        mean_ms = 1e3 * self.delay_s / self.passed if self.passed else 0.0
        return (
            f"{self.taken} in, {self.passed} out; lost {missing} ({share:.1%}): {self.lost} alone, "
            f"{self.burst} in bursts, {self.flap} while dead, {self.queue} by a full queue; "
            f"{self.corrupted} corrupted, {self.duplicated} doubled, {self.overtaken} overtaken; "
            f"delay {mean_ms:.0f} ms, at most {1e3 * self.longest_s:.0f} ms"
        )


@dataclass(frozen=True, order=True)
class _Waiting:
    due_s: float
    turn: int
    number: int
    """Number of its arrival; a second copy has that of the first."""
    taken_s: float
    datagram: bytes


class Lane:
    """One direction of one vehicle's link. The same seed, vehicle and calls give the same result.

    Time comes with each call, in seconds since any moment, and must not go back.
    """

    def __init__(self, faults: Faults, *, seed: int, vehicle: int, direction: str) -> None:
        self.faults = faults
        self.tally = FaultCounter()
        # A generator for each direction of each vehicle: what one loses does not change what the others lose.
        self._random = random.Random(f"{seed}/{vehicle}/{direction}")
        self._phase_s = random.Random(f"{seed}/{vehicle}").random() * sum(faults.flap)
        """Start of the flapping, the same for both directions: it is one radio."""
        self._bad = False
        self._busy_until_s = -math.inf
        self._last_due_s = -math.inf
        self._highest = -1
        self._turn = 0
        self._waiting: list[_Waiting] = []
        self._held: _Waiting | None = None
        """A datagram that waits for the next one to overtake it."""

    @property
    def due_s(self) -> float:
        """When `step` will have a datagram to return; infinity if none waits."""
        first = self._waiting[0].due_s if self._waiting else math.inf
        return min(first, self._held.due_s + HOLD_S) if self._held is not None else first

    def step(self, now_s: float, datagram: bytes | None = None) -> list[bytes]:
        """Take a datagram, if any, and return those that are due by now."""
        if self._held is not None and now_s >= self._held.due_s + HOLD_S:
            self._release(self._held.due_s + HOLD_S)
        if datagram is not None:
            self._take(now_s, datagram)
        return list(self._due(now_s))

    def _take(self, now_s: float, datagram: bytes) -> None:
        number = self.tally.taken
        self.tally.taken += 1
        sent_s = self._sent(now_s, len(datagram))
        if sent_s is None or self._is_lost(sent_s):
            return
        if self.faults.corrupt:
            datagram = self._corrupt(datagram)
        copies = 1
        if self._chance(self.faults.dup):
            self.tally.duplicated += 1
            copies = 2
        for _ in range(copies):
            self._forward(_Waiting(sent_s + self._delay_s(), 0, number, now_s, datagram))

    def _sent(self, now_s: float, size: int) -> float | None:
        """Return when the last byte leaves; None if the queue is full."""
        if not self.faults.rate:
            return now_s
        # A radio's buffer is short: what a flood leaves no room for is lost, and is not sent seconds later.
        if self._busy_until_s - now_s > QUEUE_S:
            self.tally.queue += 1
            return None
        self._busy_until_s = max(self._busy_until_s, now_s) + size / self.faults.rate
        return self._busy_until_s

    def _is_lost(self, sent_s: float) -> bool:
        on_s, off_s = self.faults.flap
        if off_s and (sent_s + self._phase_s) % (on_s + off_s) >= on_s:
            self.tally.flap += 1
            return True
        enter, leave = self.faults.burst
        if enter:
            self._bad = not self._chance(leave) if self._bad else self._chance(enter)
            if self._bad:
                self.tally.burst += 1
                return True
        if self._chance(self.faults.loss):
            self.tally.lost += 1
            return True
        return False

    def _corrupt(self, datagram: bytes) -> bytes:
        bits = len(datagram) * BITS_PER_BYTE
        flipped = bytearray(datagram)
        at = self._gap()
        while at < bits:
            flipped[at // BITS_PER_BYTE] ^= 1 << at % BITS_PER_BYTE
            at += 1 + self._gap()
        if flipped != datagram:
            self.tally.corrupted += 1
        return bytes(flipped)

    def _gap(self) -> int:
        """Return the number of good bits before the next bad one."""
        # Geometric distribution: one draw per error, not one per bit.
        if self.faults.corrupt >= 1.0:
            return 0
        return int(math.log(1.0 - self._random.random()) / math.log1p(-self.faults.corrupt))

    def _delay_s(self) -> float:
        spread = self.faults.jitter
        return self.faults.delay * (1.0 + self._random.uniform(-spread, spread) if spread else 1.0)

    def _forward(self, item: _Waiting) -> None:
        if self._held is None and self._chance(self.faults.reorder):
            self._held = item
            return
        # Jitter alone keeps the order, as a radio does: only `reorder` changes places.
        self._last_due_s = max(item.due_s, self._last_due_s)
        self._queue(item, self._last_due_s)
        if self._held is not None:
            self._release(self._last_due_s)

    def _release(self, due_s: float) -> None:
        if self._held is not None:
            self._queue(self._held, due_s)
            self._held = None

    def _queue(self, item: _Waiting, due_s: float) -> None:
        self._turn += 1
        heappush(self._waiting, replace(item, due_s=due_s, turn=self._turn))

    def _due(self, now_s: float) -> Iterator[bytes]:
        while self._waiting and self._waiting[0].due_s <= now_s:
            item = heappop(self._waiting)
            delay_s = item.due_s - item.taken_s
            self.tally.passed += 1
            self.tally.delay_s += delay_s
            self.tally.longest_s = max(self.tally.longest_s, delay_s)
            if item.number < self._highest:
                self.tally.overtaken += 1
            self._highest = max(self._highest, item.number)
            yield item.datagram

    def _chance(self, share: float) -> bool:
        return share > 0.0 and self._random.random() < share


class FaultyLink:
    """Both directions of one vehicle's link, each a `Lane`."""

    def __init__(self, faults: LinkFaults, *, seed: int, vehicle: int) -> None:
        self.up = Lane(faults.up, seed=seed, vehicle=vehicle, direction="up")
        self.down = Lane(faults.down, seed=seed, vehicle=vehicle, direction="down")


if __name__ == "__main__":
    try:
        parse(",".join(sys.argv[1:]))
    except FaultError as wrong:
        sys.stderr.write(f"--fault {wrong}\n")
        sys.exit(2)
