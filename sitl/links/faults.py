"""What a bad link does to datagrams: seeded, without sockets and without a clock of its own.

`parse` reads what a user writes, for example "loss=0.1,delay=200ms,jitter=20%,down.rate=5760":

loss=SHARE              each datagram is lost with this chance
burst=ENTER/LEAVE       Gilbert-Elliott: chance per datagram to fall into a state that loses all, and to leave it again
delay=TIME              later by this
jitter=SHARE            of the delay, evenly ±; the order is kept
dup=SHARE               arrives twice
reorder=SHARE           changes places with the next one (or comes half a second late where none follows)
rate=BYTES_PER_S        a narrow channel with a queue of 400 ms; what does not fit is lost
corrupt=CHANCE          each bit flips with this chance
flap=ON/OFF             works and is dead by turns; each vehicle begins elsewhere in the turn

Shares are 0.1 or 10 %, times 200ms or 2s. `up.` (station to vehicle) or `down.` before a name means that direction
only, and wins over the same name without it. Given to this module as a program, a text is checked:
`python -m sitl.links.faults TEXT` says in one line what is wrong with it.
"""

import math
import random
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from heapq import heappop, heappush
from typing import Any

QUEUE_S = 0.4
"""A narrow channel's queue holds what it sends in this time."""
HOLD_S = 0.5
"""A datagram that waits to be overtaken is let go after this time."""
MOST_DELAY_S, MOST_FLAP_S, LEAST_FLAP_S = 60.0, 3600.0, 0.01
LEAST_RATE, MOST_RATE = 10.0, 1e9
BITS = 8


class FaultError(ValueError):
    """One line: what is wrong with a text, and what is right."""


@dataclass(frozen=True)
class Faults:
    """What one direction of a link does."""

    loss: float = 0.0
    burst: tuple[float, float] = (0.0, 1.0)
    """Chances per datagram to fall into the state that loses all, and to leave it."""
    delay: float = 0.0
    """Seconds."""
    jitter: float = 0.0
    """Share of the delay."""
    dup: float = 0.0
    reorder: float = 0.0
    rate: float = 0.0
    """Bytes per second; 0: no limit."""
    corrupt: float = 0.0
    """Chance per bit."""
    flap: tuple[float, float] = (0.0, 0.0)
    """Seconds on and off."""


@dataclass(frozen=True)
class LinkFaults:
    """Both directions of a link."""

    up: Faults = Faults()
    """From the station to the vehicle."""
    down: Faults = Faults()


# ---------------------------------------------------------------- what a user writes


def parse(text: str) -> LinkFaults:
    """Read the text of a `--fault` option; an empty one is a perfect link.

    Raises:
        FaultError: An unknown name, a value that is none or out of range, something said twice.
    """
    said: dict[str, dict[str, Any]] = {"": {}, "up": {}, "down": {}}
    for part in filter(None, (p.strip() for p in text.split(","))):
        direction, name, value = _split(part)
        if name in said[direction]:
            raise FaultError(f"{part}: {name} is given twice")
        try:
            said[direction][name] = _READERS[name](value)
        except ValueError as error:
            raise FaultError(f"{part}: {error}") from None
    return LinkFaults(_direction(said, "up"), _direction(said, "down"))


def _split(part: str) -> tuple[str, str, str]:
    """("up", "down" or "", name, value)."""
    key, equals, value = part.partition("=")
    direction, dot, name = key.strip().rpartition(".")
    if (dot and direction not in ("up", "down")) or name not in _READERS or not equals:
        raise FaultError(f"{part}: must be NAME=VALUE, up.NAME=VALUE or down.NAME=VALUE; names: {', '.join(_READERS)}")
    return direction, name, value.strip()


def _direction(said: dict[str, dict[str, Any]], direction: str) -> Faults:
    faults = Faults(**(said[""] | said[direction]))
    if faults.jitter and not faults.delay:
        raise FaultError("jitter is a share of the delay: give a delay, too, for example delay=200ms,jitter=20%")
    return faults


def _number(text: str, least: float, most: float, what: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
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
        return _time(on, LEAST_FLAP_S, MOST_FLAP_S), _time(off, LEAST_FLAP_S, MOST_FLAP_S)
    except ValueError:
        raise ValueError(f"must be ON/OFF, {LEAST_FLAP_S:g} to {MOST_FLAP_S:g} s each, for example 2s/2s") from None


_READERS: dict[str, Callable[[str], Any]] = {
    "loss": _share,
    "burst": _burst,
    "delay": lambda text: _time(text, 0.0, MOST_DELAY_S),
    "jitter": _share,
    "dup": _share,
    "reorder": _share,
    "rate": lambda text: _number(text, LEAST_RATE, MOST_RATE, "bytes per second, at least 10, for example 5760"),
    "corrupt": lambda text: _number(text, 0.0, 1.0, "the chance of a bit to flip, for example 1e-4"),
    "flap": _flap,
}


# ---------------------------------------------------------------- what happens to datagrams


@dataclass
class Tally:
    """What became of the datagrams of a lane, or of many lanes."""

    taken: int = 0
    passed: int = 0
    """Came out, second copies included."""
    lost: int = 0
    burst: int = 0
    flap: int = 0
    queue: int = 0
    """Lost: one by one, in bursts, while the link was dead, because the queue was full."""
    corrupted: int = 0
    duplicated: int = 0
    overtaken: int = 0
    """Came out after one that came in later."""
    delay_s: float = 0.0
    longest_s: float = 0.0
    """Sum over all that came out, and the longest."""

    def add(self, other: "Tally") -> None:
        """Count another lane's in."""
        for field in fields(self):
            if field.name != "longest_s":
                setattr(self, field.name, getattr(self, field.name) + getattr(other, field.name))
        self.longest_s = max(self.longest_s, other.longest_s)

    def text(self) -> str:
        """One line for people."""
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
    """Of arrival; a second copy has the number of the first."""
    taken_s: float
    datagram: bytes


class Lane:
    """One direction of one vehicle's link. The same seed, vehicle and calls give the same result.

    Time is given with each call, in seconds from anywhere, and must not go back.
    """

    def __init__(self, faults: Faults, *, seed: int, vehicle: int, direction: str) -> None:
        self.faults = faults
        self.tally = Tally()
        self._random = random.Random(f"{seed}/{vehicle}/{direction}")
        self._phase_s = random.Random(f"{seed}/{vehicle}").random() * sum(faults.flap)
        """The same for both directions: it is one radio."""
        self._bad = False
        self._busy_until_s = -math.inf
        self._last_due_s = -math.inf
        self._highest = -1
        self._turn = 0
        self._waiting: list[_Waiting] = []
        self._held: _Waiting | None = None
        """Waits for the next one to overtake it."""

    @property
    def due_s(self) -> float:
        """When `step` will have something to give; infinity if nothing waits."""
        first = self._waiting[0].due_s if self._waiting else math.inf
        return min(first, self._held.due_s + HOLD_S) if self._held is not None else first

    def step(self, now_s: float, datagram: bytes | None = None) -> list[bytes]:
        """Take a datagram, if any; give those that are due by now."""
        if self._held is not None and now_s >= self._held.due_s + HOLD_S:
            self._let_go(self._held.due_s + HOLD_S)
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
        """When the last byte leaves; None if it must not wait any more."""
        if not self.faults.rate:
            return now_s
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
        bits = len(datagram) * BITS
        flipped = bytearray(datagram)
        at = self._gap()
        while at < bits:
            flipped[at // BITS] ^= 1 << at % BITS
            at += 1 + self._gap()
        if flipped != datagram:
            self.tally.corrupted += 1
        return bytes(flipped)

    def _gap(self) -> int:
        """Good bits before the next bad one (geometric: one draw per error, not per bit)."""
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
        self._last_due_s = max(item.due_s, self._last_due_s)
        self._queue(item, self._last_due_s)
        if self._held is not None:
            self._let_go(self._last_due_s)

    def _let_go(self, due_s: float) -> None:
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
    """Both directions of one vehicle's link."""

    def __init__(self, faults: LinkFaults, *, seed: int, vehicle: int) -> None:
        self.up = Lane(faults.up, seed=seed, vehicle=vehicle, direction="up")
        self.down = Lane(faults.down, seed=seed, vehicle=vehicle, direction="down")


if __name__ == "__main__":
    try:
        parse(",".join(sys.argv[1:]))
    except FaultError as wrong:
        sys.stderr.write(f"--fault {wrong}\n")
        sys.exit(2)
