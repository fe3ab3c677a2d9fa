"""What all `tui-gcs vehicle …` commands share: asking the station, waiting for tasks, asking the user, printing."""

import argparse
import select
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import msgspec

from tui_gcs.cli.command_report import CommandReport, VehicleReport, finish, of_vehicles
from tui_gcs.cli.common import join
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.station_control import which
from tui_gcs.cli.vehicle_numbers import listed, vehicle_ids
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol.bus import Bus, BusError
from tui_gcs.core.protocol.common import ReplyCode, Request, VehicleResult, decode, encode
from tui_gcs.core.protocol.services import GetTaskResult, GetTasks, ServiceReply, TaskInfo, TaskResult

POLL_S = 0.2
ASK_LIMIT_S = 5.0
SILENT_TRIES = 3
"""How many questions about tasks the station may leave unanswered, for example while it restarts."""
WAITS = "waits for"
"""A task that waits for another transfer of the vehicle, or for two others on its link, begins its text with this."""
LONG_LOOKS = 25
"""After this many looks in a row (5 s) a waiting task is reported where there is no terminal."""
LINE_CELLS = 400


@dataclass
class VehicleOutcome:
    """The result of a request for one vehicle."""

    vehicle: int
    ok: bool
    text: str
    task: int = 0
    result: TaskResult = field(default_factory=TaskResult)
    code: ReportCode = ReportCode.FAILED
    """Why it is not ok; without meaning where it is."""
    data: dict[str, Any] = field(default_factory=dict)
    """What is reported of it in JSON, beside its task and result."""

    def report(self, *shown: str) -> VehicleReport:
        """Return it as it stands in the JSON document.

        Of its result there are the fields that hold something, and those named in `shown` also when it has none.
        """
        empty = TaskResult()
        held = {name: getattr(self.result, name) for name in self.result.__struct_fields__}
        always = shown if self.ok else ()
        data = {name: value for name, value in held.items() if name in always or value != getattr(empty, name)}
        data |= ({"task": self.task} if self.task else {}) | self.data
        return VehicleReport(self.vehicle, self.ok, ReportCode.NONE if self.ok else self.code, self.text, data)


class TaskWatcher(Protocol):
    """Watches tasks while they run."""

    def look(self, infos: Sequence[TaskInfo]) -> None:
        """Take the tasks as they are now."""
        ...

    def interrupted(self, infos: Sequence[TaskInfo]) -> bool:
        """Handle Ctrl-C; return whether to go on waiting."""
        ...

    def over(self) -> None:
        """Clean up: the tasks have ended, or are not waited for any more."""
        ...


class StationClient:
    """The running station, asked as the principal `cli`."""

    def __init__(self, kind: RunKind, bus: Bus) -> None:
        """Send requests over `bus`; `kind` names the state directory of the station."""
        self.kind = kind
        self._bus = bus

    def ask(self, request: Request) -> ServiceReply:
        """Send one request and return its reply. Raises `CommandError`."""
        try:
            question = encode(request)
        # msgpack has integers of 64 bits at most: a number of thirty digits is typed sooner than one thinks.
        except OverflowError:
            raise CommandError("a number of so many digits is none that a vehicle can take") from None
        try:
            return decode(self._bus.ask("gcs/req/cli", question, timeout_s=ASK_LIMIT_S), ServiceReply)
        except (BusError, msgspec.MsgspecError) as error:
            raise CommandError(str(error), ReportCode.NO_ANSWER) from None

    def carry_out(self, request: Request, watcher: "TaskWatcher | None" = None) -> list[VehicleOutcome]:
        """Send a request, wait for its tasks, and return one result per vehicle, in order. Raises `CommandError`."""
        return self.finish(self.begin(request), watcher or TaskProgress())

    def begin(self, request: Request) -> ServiceReply:
        """Send a request that starts tasks, and return its reply. Raises `CommandError`."""
        reply = self.ask(request)
        if not reply.results and not reply.ok:
            raise CommandError(clean(reply.text), ReportCode.REFUSED)
        return reply

    def finish(
        self, reply: ServiceReply, watcher: TaskWatcher, joined: Sequence[TaskInfo] = ()
    ) -> list[VehicleOutcome]:
        """Wait for the tasks of a reply, and for other tasks that are joined.

        Returns one result per vehicle of the reply, in order, then those of the joined tasks. Raises `CommandError`.
        """
        numbers = {info.vehicle: info.number for info in reply.tasks}
        others = {info.vehicle: info.number for info in joined}
        infos = {info.vehicle: info for info in self._wait((*numbers.values(), *others.values()), watcher)}
        ended = []
        for result in reply.results:
            if result.vehicle in infos:
                ended.append(self._ended(infos[result.vehicle]))
            elif result.vehicle in numbers:
                ended.append(VehicleOutcome(result.vehicle, False, "forgotten", numbers[result.vehicle]))
            else:
                ended.append(VehicleOutcome(result.vehicle, result.ok, result.text, code=refusal(result)))
        return ended + [self._ended(infos[vehicle]) for vehicle in others if vehicle in infos]

    def entered(self) -> bool:
        """Return whether the user has typed a line since the last look."""
        if not sys.stdin.isatty():
            return False
        # A pipe at its end is always readable, and would confirm step after step: so only a terminal is read.
        ready, _, _ = select.select([sys.stdin], [], [], 0)
        return bool(ready) and sys.stdin.readline() != ""

    def pause(self) -> None:
        """Wait between two looks at the tasks."""
        time.sleep(POLL_S)

    def close(self) -> None:
        """Close the connection to the station; its tasks go on."""
        self._bus.close()

    def _ended(self, info: TaskInfo) -> VehicleOutcome:
        result = self.ask(GetTaskResult(info.number)).result or TaskResult()
        text = info.text or ("" if info.state == "done" else info.state)
        code = ReportCode.CANCELLED if info.state == "cancelled" else ReportCode.FAILED
        return VehicleOutcome(info.vehicle, info.state == "done", text, info.number, result, code)

    def _wait(self, numbers: tuple[int, ...], watcher: TaskWatcher) -> Sequence[TaskInfo]:
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
        """Return the state of tasks; a station that restarts is asked again."""
        for _ in range(SILENT_TRIES - 1):
            try:
                return self.ask(GetTasks(numbers)).tasks
            except CommandError:
                continue
        return self.ask(GetTasks(numbers)).tasks


class TaskProgress:
    """Shows on a terminal how far all tasks are, in one line; elsewhere it reports what waits for long."""

    def __init__(self) -> None:
        """Count looks in a row from zero."""
        self._waited = 0
        """For how many looks in a row some tasks waited."""

    def look(self, infos: Sequence[TaskInfo]) -> None:
        """Draw one line about all tasks."""
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
        """Stop waiting; the tasks go on."""
        return False

    def over(self) -> None:
        """Clear the line: the tasks have ended."""
        self._draw("")

    def _draw(self, text: str) -> None:
        if sys.stderr.isatty():
            sys.stderr.write(f"\r\x1b[K{text}")
            sys.stderr.flush()


def open_station(named: str | None) -> StationClient:
    """Join the station that runs. Raises `CommandError`."""
    kind = which(named)
    return StationClient(kind, join(kind))


def confirmed(act: str, *, yes: bool, vehicles: int = 1) -> bool:
    """Ask the user to confirm: with `y`, or with the number of vehicles where there are several (docs/threats.md D.1).

    Raises `CommandError` where there is no terminal to ask on.
    """
    if yes:
        return True
    if not sys.stdin.isatty():
        raise CommandError(f"{act}: say --yes, or answer on a terminal", ReportCode.NOT_CONFIRMED)
    # A habitual "y" must not confirm for a whole fleet: the number has to be read to be typed (docs/threats.md D.1).
    accepted = ("y", "yes") if vehicles == 1 else (str(vehicles),)
    how = "[y/N]" if vehicles == 1 else f"type their number, {vehicles}:"
    sys.stdout.write(f"{clean(act, LINE_CELLS)}? {how} ")
    sys.stdout.flush()
    return sys.stdin.readline().strip().lower() in accepted


NOT_SENT = "nothing was sent"


def not_sent(arguments: argparse.Namespace) -> int:
    """Report that the user did not confirm; return the exit code."""
    if not arguments.json:
        say(NOT_SENT)
    return finish(arguments, CommandReport(False, ReportCode.CANCELLED, NOT_SENT))


def say(text: str) -> None:
    """Print one line, with everything escaped that could disturb a terminal."""
    sys.stdout.write(clean(text, LINE_CELLS).rstrip() + "\n")


def tell(ended: Sequence[VehicleOutcome], arguments: argparse.Namespace) -> int:
    """Print one line per vehicle, or the document, and return the exit code."""
    if not arguments.json:
        say_outcomes(ended)
    return finish(arguments, of_vehicles(one.report() for one in ended))


def say_outcomes(ended: Sequence[VehicleOutcome]) -> None:
    """Print one line per vehicle."""
    for one in ended:
        word = "" if one.ok or one.code is ReportCode.CANCELLED else "FAILED: "
        say(f"vehicle {one.vehicle}: {word}{one.text or ('done' if one.ok else 'no reason was given')}")


def say_failed(ended: Sequence[VehicleOutcome]) -> None:
    """Print the lines of the vehicles for which it failed."""
    say_outcomes([one for one in ended if not one.ok])


def tell_lines(
    ended: Sequence[VehicleOutcome],
    lines: Callable[[VehicleOutcome], Iterable[str]],
    arguments: argparse.Namespace,
    *shown: str,
) -> int:
    """Print what each result holds, then the failures, or the document, and return the exit code.

    `shown` are the fields of `TaskResult` that the command is about.
    """
    if not arguments.json:
        for one in ended:
            for line in lines(one):
                say(line)
        say_failed(ended)
    return finish(arguments, of_vehicles(one.report(*shown) for one in ended))


def tell_reply(
    arguments: argparse.Namespace,
    reply: ServiceReply,
    lines: Iterable[str],
    vehicles: Iterable[VehicleReport],
    data: Mapping[str, Any] | None = None,
) -> int:
    """Print a reply as `lines` and problems, or as the document, and return the exit code."""
    if not arguments.json:
        for line in lines:
            say(line)
        for result in reply.results:
            say(f"vehicle {result.vehicle}: {result.text}")
    return finish(arguments, of_vehicles(vehicles, reply.text, data))


def reports_by_vehicle(
    reply: ServiceReply, ids: Sequence[int], data: Callable[[int], dict[str, Any]]
) -> Iterator[VehicleReport]:
    """Yield an entry of the document for each vehicle: its data, or what the station answered instead."""
    results = {result.vehicle: result for result in reply.results}
    for vehicle in ids:
        if (result := results.get(vehicle)) is None:
            yield VehicleReport(vehicle, True, data=data(vehicle))
        else:
            yield VehicleReport(vehicle, result.ok, refusal(result), result.text)


def refusal(result: VehicleResult) -> ReportCode:
    """Return the code for what the station answered at once for a vehicle."""
    if result.ok:
        return ReportCode.NONE
    return ReportCode.NOT_CONFIRMED if result.code is ReplyCode.NOT_CONFIRMED else ReportCode.REFUSED


def lines_by_vehicle(
    reply: ServiceReply, ids: Sequence[int], lines: Callable[[int], Sequence[str]], nothing: str
) -> Iterator[str]:
    """Yield the lines of each vehicle; `nothing` for one without lines, unless the reply has a problem of it."""
    for vehicle in ids:
        own = lines(vehicle)
        yield from own
        if not own and all(result.vehicle != vehicle for result in reply.results):
            yield f"vehicle {vehicle}: {nothing}"


def order(
    station: StationClient,
    arguments: argparse.Namespace,
    request: Request,
    act: str = "",
    watcher: TaskWatcher | None = None,
) -> int:
    """Carry out a request, after the user confirmed `act` if there is one; print the results, return the exit code."""
    if act and not confirmed(act, yes=arguments.yes, vehicles=len(vehicle_ids(arguments.ids))):
        return not_sent(arguments)
    return tell(station.carry_out(request, watcher), arguments)
