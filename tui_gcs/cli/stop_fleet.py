"""`tui-gcs hold`, `return` and `land`: the stops of the console from a shell, for when there is no console.

A stop never asks. Without vehicles it is for all, as the console's HOLD ALL, RETURN ALL and LAND ALL are.
"""

import argparse
import asyncio
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from typing import cast

import msgspec

from tui_gcs.cli.command_report import VehicleReport, finish, of_vehicles
from tui_gcs.cli.common import join
from tui_gcs.cli.exit_codes import CommandError, ReportCode
from tui_gcs.cli.station_control import which
from tui_gcs.cli.vehicle_numbers import named_vehicles
from tui_gcs.core.base.text import clean
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.base import StopRequest
from tui_gcs.core.protocol.bus import Bus, BusError
from tui_gcs.core.protocol.common import (
    FleetFrame,
    Freshness,
    Hold,
    Reply,
    ReplyCode,
    Return,
    VehicleResult,
    VehicleRow,
    decode,
)
from tui_gcs.core.protocol.flight import Land
from tui_gcs.feed.stop_requests import TRIES_OVER_RESTART, StopRequests

REQUESTS: dict[str, type[StopRequest]] = {"hold": Hold, "return": Return, "land": Land}
SEEN_S = 15.0
"""Telemetry may take this long to show it, as the console waits: ArduCopter brakes 3 s after the last velocity target,
from 8 m/s in another 3.2 s."""
DESCENT_M_S = 0.1
"""A vehicle that lands descends faster: PX4 crawls at 0.3 m/s (MPC_LAND_CRWL), ArduCopter lands at 0.5 (LAND_SPEED)."""
POLL_S = 0.1
PRINCIPAL = "cli"
CELLS = 400


def run(arguments: argparse.Namespace) -> int:
    """Send the stop, wait until telemetry shows it, and report each vehicle. The exit code is 0 only if all obey."""
    request = REQUESTS[arguments.what](vehicles=named_vehicles(arguments.ids))
    bus = join(which(arguments.kind))
    try:
        entries, text = stop_vehicles(bus, arguments.what, request)
    finally:
        bus.close()
    if not arguments.json:
        _print(arguments.what, entries, text)
    return finish(arguments, of_vehicles(entries, text))


def stop_vehicles(
    bus: Bus,
    what: str,
    request: StopRequest,
    *,
    pause: Callable[[], None] = lambda: time.sleep(POLL_S),
    now: Callable[[], float] = lambda: time.monotonic(),
) -> tuple[list[VehicleReport], str]:
    """Send a stop; return the result for each vehicle, and the station's words. Raises `CommandError`."""
    frames: list[bytes] = []
    subscription = bus.subscribe(keys.FLEET, lambda _, data: frames.append(data))
    try:
        reply = _send(bus, request)
        frames.clear()  # what was heard before the station answered shows nothing of this order
        return _shown(what, reply, frames, pause, now), clean(reply.text, CELLS)
    finally:
        subscription.close()


def _send(bus: Bus, request: StopRequest) -> Reply:
    async def send() -> bytes:
        return await StopRequests(bus, keys.REQUEST.format(principal=PRINCIPAL)).begin(request, TRIES_OVER_RESTART)

    try:
        return decode(asyncio.run(send()), Reply)
    except BusError as error:
        raise CommandError(
            f"{error}: it may still carry this out; send it again, and watch the vehicles", ReportCode.NO_ANSWER
        ) from None
    except msgspec.MsgspecError:
        raise CommandError("the station's answer cannot be read: another version of tui-gcs?") from None


def _shown(
    what: str, reply: Reply, frames: list[bytes], pause: Callable[[], None], now: Callable[[], float]
) -> list[VehicleReport]:
    """Return a result for each vehicle, when telemetry has shown it for all that accepted, or the time is up."""
    # Imported when the stop is out already: the console's tables of actions take 0.35 s more to load.
    from tui_gcs.actions.orders import BY_ID

    shown = cast(Callable[[VehicleRow], bool], BY_ID[what].seen)

    def seen(row: VehicleRow) -> bool:
        # The phase is what the station wants of it: that it lands shows by its descent.
        descends = row.velocity_m_s[2] < -DESCENT_M_S or not row.armed
        return shown(row) and (what != "land" or descends)

    waiting = {result.vehicle for result in reply.results if result.ok}
    end_s = now() + SEEN_S
    while waiting and now() < end_s:
        pause()
        if frames:
            waiting -= _obey(seen, waiting, decode(frames[-1], FleetFrame).rows())
            frames.clear()
    return [_entry(result, waiting) for result in reply.results]


def _obey(seen: Callable[[VehicleRow], bool], vehicles: set[int], rows: Iterable[VehicleRow]) -> set[int]:
    """The vehicles that obey the order by their telemetry; the row of a lost vehicle is old and shows nothing."""
    return {row.id for row in rows if row.id in vehicles and row.freshness is not Freshness.LOST and seen(row)}


def _entry(result: VehicleResult, waiting: set[int]) -> VehicleReport:
    text: str = clean(result.text, CELLS)
    if not result.ok:
        code = ReportCode.NOT_CONFIRMED if result.code is ReplyCode.NOT_CONFIRMED else ReportCode.REFUSED
        return VehicleReport(result.vehicle, False, code, text or "no reason given", {})
    if result.vehicle in waiting:
        text = f"asked, not confirmed: telemetry does not show it within {SEEN_S:.0f} s"
        return VehicleReport(result.vehicle, False, ReportCode.NOT_SEEN, text, {})
    return VehicleReport(result.vehicle, True, ReportCode.NONE, text, {})


def _print(what: str, entries: Sequence[VehicleReport], text: str) -> None:
    for entry in entries:
        word = "" if entry.ok else "FAILED: "
        sys.stdout.write(f"vehicle {entry.vehicle}: {word}{entry.text or 'done'}\n")
    if not entries:
        sys.stdout.write(f"{what}: {text}\n")
