"""Reads what happened in a recording in a process of its own: `read_timeline` asks, this module as a program answers.

A log may come from anywhere. The readers of vehicles' logs print about damaged places, from C code too, which would
spoil the screen; they take seconds and much memory, and a process that hangs or dies can be given up.
"""

import asyncio
import os
import sys
from pathlib import Path
from typing import Any

import msgspec

from tui_gcs.core.judging.flight_timeline import FlightReadError, FlightTimeline, timeline
from tui_gcs.core.records.flight_archive import RecordedFlight

LIMIT_S = 120.0
"""A log that takes longer is given up: an hour of eight vehicles takes 15 s."""


class _TimelineRequest(msgspec.Struct):
    flight: RecordedFlight
    archive: tuple[RecordedFlight, ...]


class _TimelineAnswer(msgspec.Struct):
    timeline: FlightTimeline | None = None
    error: str = ""


async def read_timeline(flight: RecordedFlight, archive: tuple[RecordedFlight, ...]) -> FlightTimeline:
    """Return `timeline(flight, archive)`, read by another process.

    Raises:
        FlightReadError: the recording cannot be read, or reading it took too long or ended the process.
    """
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "tui_gcs.core.judging.timeline_process"),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
    )
    request = msgspec.msgpack.encode(_TimelineRequest(flight, archive), enc_hook=str)
    try:
        answer, _ = await asyncio.wait_for(process.communicate(request), LIMIT_S)
    except TimeoutError:
        raise FlightReadError(f"{flight.path.name}: reading it takes longer than {LIMIT_S:.0f} s") from None
    finally:
        # Also where the screen was left meanwhile.
        if process.returncode is None:
            process.kill()
    try:
        found = msgspec.msgpack.decode(answer, type=_TimelineAnswer)
    except msgspec.MsgspecError:
        raise FlightReadError(f"{flight.path.name}: reading it failed; the file may be damaged") from None
    if found.timeline is None:
        raise FlightReadError(found.error)
    return found.timeline


def main() -> None:
    """Answer one request from standard input on standard output."""
    # What a reader prints must not get into the answer.
    out = os.dup(1)
    os.dup2(2, 1)
    request = msgspec.msgpack.decode(sys.stdin.buffer.read(), type=_TimelineRequest, dec_hook=_path)
    try:
        answer = _TimelineAnswer(timeline(request.flight, request.archive))
    except FlightReadError as error:
        answer = _TimelineAnswer(error=str(error))
    with os.fdopen(out, "wb") as file:
        file.write(msgspec.msgpack.encode(answer))


def _path(kind: type, value: Any) -> Any:
    return kind(value) if kind is Path else value


if __name__ == "__main__":
    main()
