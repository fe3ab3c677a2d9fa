"""What all `tui-gcs vehicle …` commands share: asking the station, waiting for tasks, asking the user, telling."""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import msgspec

from tui_gcs.commands.common import join
from tui_gcs.commands.control import which
from tui_gcs.core.bus import Bus, BusError
from tui_gcs.core.kinds import Kind
from tui_gcs.core.messages import Request, decode, encode
from tui_gcs.core.messages_services import GetTaskResult, GetTasks, ServiceReply, TaskInfo, TaskResult
from tui_gcs.core.text import clean
from tui_gcs.exits import FAILED, OK, CommandError

POLL_S = 0.2
ASK_LIMIT_S = 5.0
SILENT_TRIES = 3
"""Questions about tasks that a station may leave unanswered, e.g. while it is restarted."""
LINE_CELLS = 400
BIGGEST_ID = 1_000_000


@dataclass
class Ended:
    """What became of a request for one vehicle."""

    vehicle: int
    ok: bool
    text: str
    task: int = 0
    result: TaskResult = field(default_factory=TaskResult)


class StationClient:
    """The running station, asked as principal `cli`."""

    def __init__(self, kind: Kind, bus: Bus) -> None:
        """Over `bus`."""
        self.kind = kind
        self._bus = bus

    def ask(self, request: Request) -> ServiceReply:
        """One question. Raises `CommandError`."""
        try:
            return decode(self._bus.ask("gcs/req/cli", encode(request), timeout_s=ASK_LIMIT_S), ServiceReply)
        except (BusError, msgspec.MsgspecError) as error:
            raise CommandError(str(error)) from None

    def carry_out(self, request: Request) -> list[Ended]:
        """Ask, wait for what takes time; one result per vehicle, in order. Raises `CommandError`."""
        reply = self.ask(request)
        if not reply.results and not reply.ok:
            raise CommandError(clean(reply.text))
        numbers = {info.vehicle: info.number for info in reply.tasks}
        infos = {info.vehicle: info for info in self._wait(tuple(numbers.values()))}
        return [
            self._ended(infos[r.vehicle])
            if r.vehicle in infos
            else Ended(
                r.vehicle, r.ok and r.vehicle not in numbers, r.text if r.vehicle not in numbers else "forgotten"
            )
            for r in reply.results
        ]

    def pause(self) -> None:
        """Between two looks at what goes on."""
        time.sleep(POLL_S)

    def close(self) -> None:
        """Leave."""
        self._bus.close()

    def _ended(self, info: TaskInfo) -> Ended:
        result = self.ask(GetTaskResult(info.number)).result or TaskResult()
        text = info.text or ("" if info.state == "done" else info.state)
        return Ended(info.vehicle, info.state == "done", text, info.number, result)

    def _wait(self, numbers: tuple[int, ...]) -> Sequence[TaskInfo]:
        silent = 0
        try:
            while numbers:
                try:
                    infos = self.ask(GetTasks(numbers)).tasks
                    silent = 0
                except CommandError:
                    silent += 1
                    if silent >= SILENT_TRIES:
                        raise
                    continue
                _show_progress(infos)
                if all(info.over for info in infos):
                    return infos
                self.pause()
        except KeyboardInterrupt:
            text = ", ".join(map(str, numbers))
            progress_over()
            raise CommandError(
                f"interrupted; task {text} goes on: `tui-gcs vehicle tasks` shows it, `cancel` ends it"
            ) from None
        finally:
            progress_over()
        return ()


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
        low, high = int(first[:8]), int((last or first)[:8])
        if not 0 < low <= high < BIGGEST_ID or high - low > 999:
            raise CommandError(f"{clean(text, 40)!r}: no such vehicles")
        ids += range(low, high + 1)
    return tuple(dict.fromkeys(ids))


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


def confirmed(act: str, *, yes: bool) -> bool:
    """Whether the user means it. Raises `CommandError` where nobody can be asked."""
    if yes:
        return True
    if not sys.stdin.isatty():
        raise CommandError(f"{act}: say --yes, or answer on a terminal")
    sys.stdout.write(f"{clean(act, LINE_CELLS)}? [y/N] ")
    sys.stdout.flush()
    if sys.stdin.readline().strip().lower() in ("y", "yes"):
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
            word = "" if one.ok else "FAILED: "
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


def _show_progress(infos: Sequence[TaskInfo]) -> None:
    """On a terminal: how far it is, in place."""
    if not sys.stderr.isatty():
        return
    over = sum(info.over for info in infos)
    running = [info for info in infos if info.state == "running" and info.total]
    words = ", ".join(f"{info.vehicle}: {100 * info.done // info.total} %" for info in running[:4])
    sys.stderr.write(f"\r\x1b[K{over} of {len(infos)} done  {words}")
    sys.stderr.flush()


def progress_over() -> None:
    """Away with the progress line."""
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()
