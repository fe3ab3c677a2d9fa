"""What all `tui-gcs vehicle …` commands share: asking the station, waiting for tasks, asking the user, telling."""

import select
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import msgspec

from tui_gcs.cli.common import join
from tui_gcs.cli.exit_codes import FAILED, OK, CommandError
from tui_gcs.cli.station_control import which
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.bus import Bus, BusError
from tui_gcs.core.protocol.common import Request, decode, encode
from tui_gcs.core.protocol.services import GetTaskResult, GetTasks, ServiceReply, TaskInfo, TaskResult

POLL_S = 0.2
ASK_LIMIT_S = 5.0
SILENT_TRIES = 3
"""Questions about tasks that a station may leave unanswered, e.g. while it is restarted."""
WAITS = "waits for"
"""For another transfer of the vehicle, or for two others on its link."""
LONG_LOOKS = 25
"""So often in a row something is seen to wait before that is told where there is no terminal: 5 s."""
LINE_CELLS = 400
BIGGEST_ID = 1_000_000
MOST_OF_A_RANGE = 999


@dataclass
class Ended:
    """What became of a request for one vehicle."""

    vehicle: int
    ok: bool
    text: str
    task: int = 0
    result: TaskResult = field(default_factory=TaskResult)
    cancelled: bool = False
    """Somebody wanted it so: no failure."""


class Watcher(Protocol):
    """Somebody who looks at tasks while they run."""

    def look(self, infos: Sequence[TaskInfo]) -> None:
        """The tasks as they are now."""
        ...

    def interrupted(self, infos: Sequence[TaskInfo]) -> bool:
        """Ctrl-c was typed; whether to wait on."""
        ...

    def over(self) -> None:
        """They ended, or nobody waits any more."""
        ...


class StationClient:
    """The running station, asked as principal `cli`."""

    def __init__(self, kind: RunKind, bus: Bus) -> None:
        """Over `bus`."""
        self.kind = kind
        self._bus = bus

    def ask(self, request: Request) -> ServiceReply:
        """One question. Raises `CommandError`."""
        try:
            question = encode(request)
        except OverflowError:
            raise CommandError("a number of so many digits is none that a vehicle can take") from None
        try:
            return decode(self._bus.ask("gcs/req/cli", question, timeout_s=ASK_LIMIT_S), ServiceReply)
        except (BusError, msgspec.MsgspecError) as error:
            raise CommandError(str(error)) from None

    def carry_out(self, request: Request, watcher: "Watcher | None" = None) -> list[Ended]:
        """Ask, wait for what takes time; one result per vehicle, in order. Raises `CommandError`."""
        return self.finish(self.begin(request), watcher or Progress())

    def begin(self, request: Request) -> ServiceReply:
        """Ask for what takes time. Raises `CommandError`."""
        reply = self.ask(request)
        if not reply.results and not reply.ok:
            raise CommandError(clean(reply.text))
        return reply

    def finish(self, reply: ServiceReply, watcher: Watcher, joined: Sequence[TaskInfo] = ()) -> list[Ended]:
        """Wait for the tasks of a reply, and for others that are joined.

        One result per vehicle of the reply, in order, then those of the joined. Raises `CommandError`.
        """
        numbers = {info.vehicle: info.number for info in reply.tasks}
        others = {info.vehicle: info.number for info in joined}
        infos = {info.vehicle: info for info in self._wait((*numbers.values(), *others.values()), watcher)}
        return [
            self._ended(infos[r.vehicle])
            if r.vehicle in infos
            else Ended(
                r.vehicle, r.ok and r.vehicle not in numbers, r.text if r.vehicle not in numbers else "forgotten"
            )
            for r in reply.results
        ] + [self._ended(infos[vehicle]) for vehicle in others if vehicle in infos]

    def entered(self) -> bool:
        """Whether a line was typed since."""
        if not sys.stdin.isatty():
            return False
        ready, _, _ = select.select([sys.stdin], [], [], 0)
        return bool(ready) and sys.stdin.readline() != ""

    def pause(self) -> None:
        """Between two looks at what goes on."""
        time.sleep(POLL_S)

    def close(self) -> None:
        """Leave."""
        self._bus.close()

    def _ended(self, info: TaskInfo) -> Ended:
        result = self.ask(GetTaskResult(info.number)).result or TaskResult()
        text = info.text or ("" if info.state == "done" else info.state)
        return Ended(info.vehicle, info.state == "done", text, info.number, result, info.state == "cancelled")

    def _wait(self, numbers: tuple[int, ...], watcher: Watcher) -> Sequence[TaskInfo]:
        infos: Sequence[TaskInfo] = ()
        try:
            while numbers:
                try:
                    infos = self._look(numbers)
                    watcher.look(infos)
                    if all(info.over for info in infos):
                        return infos
                    self.pause()
                except KeyboardInterrupt:
                    if not watcher.interrupted(infos):
                        raise
        except KeyboardInterrupt:
            text = ", ".join(map(str, numbers))
            raise CommandError(
                f"interrupted; task {text} goes on: `tui-gcs vehicle tasks` shows it, `cancel` ends it"
            ) from None
        finally:
            watcher.over()
        return ()

    def _look(self, numbers: tuple[int, ...]) -> Sequence[TaskInfo]:
        """How tasks stand; a station that is restarted gets a second chance."""
        for _ in range(SILENT_TRIES - 1):
            try:
                return self.ask(GetTasks(numbers)).tasks
            except CommandError:
                continue
        return self.ask(GetTasks(numbers)).tasks


class Progress:
    """On a terminal: how far all are, in one line that is written over. Elsewhere: that something waits for long."""

    def __init__(self) -> None:
        """Nothing was looked at."""
        self._waited = 0
        """Looks at which some of them waited, one after the other."""

    def look(self, infos: Sequence[TaskInfo]) -> None:
        """Draw it."""
        over = sum(info.over for info in infos)
        running = [info for info in infos if info.state == "running" and info.total]
        words = [f"{info.vehicle}: {100 * info.done // info.total} %" for info in running[:4]]
        queued = [info for info in infos if info.state == "queued"]
        words += [f"{info.vehicle}: {WAITS} {clean(info.text, LINE_CELLS)}" for info in queued[:4]]
        self._draw(f"{over} of {len(infos)} done  {', '.join(words)}")
        self._waited = self._waited + 1 if queued else 0
        if self._waited == LONG_LOOKS and not sys.stderr.isatty():
            ids, what = listed([info.vehicle for info in queued]), clean(queued[0].text, LINE_CELLS)
            sys.stderr.write(f"{ids}: {WAITS} {what}: `tui-gcs vehicle tasks` shows what goes on, `cancel N` ends it\n")
            sys.stderr.flush()

    def interrupted(self, infos: Sequence[TaskInfo]) -> bool:
        """The tasks go on without us."""
        return False

    def over(self) -> None:
        """Away with it."""
        self._draw("")

    def _draw(self, text: str) -> None:
        if sys.stderr.isatty():
            sys.stderr.write(f"\r\x1b[K{text}")
            sys.stderr.flush()


def open_station(named: str | None) -> StationClient:
    """Join the station that runs. Raises `CommandError`."""
    kind = which(named)
    return StationClient(kind, join(kind))


# ---------------------------------------------------------------- vehicles by name


def vehicle_ids(text: str) -> tuple[int, ...]:
    """Numbers of what is named as 3, 3-7 or 1,4, in that order. Raises `CommandError`."""
    ids: list[int] = []
    for part in text.split(","):
        first, dash, last = part.partition("-")
        if not (first.isascii() and first.isdigit() and (not dash or (last.isascii() and last.isdigit()))):
            raise CommandError(f"{clean(text, 40)!r}: vehicles are named as 3, 3-7 or 1,4")
        low, high = _number(first), _number(last or first)
        if not 0 < low <= high < BIGGEST_ID or high - low > MOST_OF_A_RANGE:
            raise CommandError(f"{clean(text, 40)!r}: no such vehicles")
        ids += range(low, high + 1)
    return tuple(dict.fromkeys(ids))


def _number(digits: str) -> int:
    """What they say, if a vehicle may have that number: never the first of too many digits. Else `BIGGEST_ID`."""
    return int(digits) if len(digits) < len(str(BIGGEST_ID)) else BIGGEST_ID


def only_one(text: str, why: str) -> int:
    """The one vehicle that is named. Raises `CommandError`."""
    ids = vehicle_ids(text)
    if len(ids) != 1:
        raise CommandError(f"{clean(text, 40)}: name one vehicle, {why}")
    return ids[0]


def listed(ids: Sequence[int]) -> str:
    """Vehicles in words."""
    return f"vehicle{'s' if len(ids) > 1 else ''} {', '.join(map(str, ids))}"


# ---------------------------------------------------------------- asking and telling


def confirmed(act: str, *, yes: bool, vehicles: int = 1) -> bool:
    """Whether the user means it: `y`; for several vehicles at once their number is typed (security.md D.1).

    Raises `CommandError` where nobody can be asked.
    """
    if yes:
        return True
    if not sys.stdin.isatty():
        raise CommandError(f"{act}: say --yes, or answer on a terminal")
    wanted = ("y", "yes") if vehicles == 1 else (str(vehicles),)
    how = "[y/N]" if vehicles == 1 else f"type their number, {vehicles}:"
    sys.stdout.write(f"{clean(act, LINE_CELLS)}? {how} ")
    sys.stdout.flush()
    if sys.stdin.readline().strip().lower() in wanted:
        return True
    say("nothing was sent")
    return False


def say(text: str) -> None:
    """One line; what is in it cannot do anything to a terminal."""
    sys.stdout.write(clean(text, LINE_CELLS).rstrip() + "\n")


def say_json(thing: Any) -> None:
    """For scripts; numbers that are none are null."""
    sys.stdout.write(msgspec.json.encode(thing).decode() + "\n")


def tell(ended: Sequence[Ended], *, as_json: bool) -> int:
    """One line per vehicle; the exit code."""
    if as_json:
        say_json([as_row(one) for one in ended])
    else:
        for one in ended:
            word = "" if one.ok or one.cancelled else "FAILED: "
            say(f"vehicle {one.vehicle}: {word}{one.text or ('done' if one.ok else 'no reason was told')}")
    return exit_code(ended)


def as_row(one: Ended) -> dict[str, Any]:
    """One result for JSON, with what came of it."""
    empty = msgspec.to_builtins(TaskResult())
    came = {key: value for key, value in msgspec.to_builtins(one.result).items() if value != empty[key]}
    return {"vehicle": one.vehicle, "ok": one.ok, "text": one.text, "task": one.task} | came


def tell_failed(ended: Sequence[Ended]) -> None:
    """The lines of those that failed."""
    tell([one for one in ended if not one.ok], as_json=False)


def exit_code(ended: Sequence[Ended]) -> int:
    """0 only if all succeeded."""
    return OK if ended and all(one.ok for one in ended) else FAILED
