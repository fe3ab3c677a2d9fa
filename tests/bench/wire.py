"""The receiving path against pymavlink's parser: the same datagrams, in turns, CPU time, best of several rounds."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

from pymavlink.dialects.v20 import all as mavlink
from pymavlink.generator import mavcrc

from tests.bench.row import NotMeasured, Row
from tests.bench.stream import ORIGIN_DEG, Datagram, signed_stream, stream
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.mavlink.intake import Intake
from tui_gcs.core.mavlink.sources import Slot, Source
from tui_gcs.core.records.event_log import EventLog

VEHICLES, SECONDS = 250, 16.0
ROUNDS = 5
READ_S, LOOK_EVERY = 0.005, 10
"""As a station under load: links are read every 5 ms, the newest is looked at every 50 ms."""
WARM_S = 10.5
"""The beginning is read but not measured: every vehicle is found, every message has come (texts every 10 s)."""
ORIGIN = Origin(lat_deg=ORIGIN_DEG[0], lon_deg=ORIGIN_DEG[1], ground_amsl_m=110.0)
LINK = "udpin:0.0.0.0:14550"

Batch = list[tuple[bytes, tuple[str, int]]]
Read = Callable[[list[Batch]], int]
"""Reads what came in each `READ_S`; how many frames that were."""
Maker = Callable[[], Read]


def wire(_: Path) -> Iterator[Row]:
    """Microseconds per frame."""
    if mavcrc.mcrf4xx is None:
        raise NotMeasured("pymavlink does not use fastcrc here")
    plain, signed = stream(VEHICLES, SECONDS), signed_stream(VEHICLES, SECONDS)
    theirs, kept, columns = best_us([pymavlink, newest_raw, fleet_columns], plain)
    yield Row(f"wire, {VEHICLES} vehicles: pymavlink", theirs, "us/frame")
    yield Row("wire: cut, CRC, newest raw kept", kept, "us/frame")
    yield Row("wire: the same, and fleet columns", columns, "us/frame")
    yield Row("wire: times faster, newest raw kept", theirs / kept, "x", 8, at_least=True)
    yield Row("wire: times faster, fleet columns", theirs / columns, "x", 5, at_least=True)
    theirs, columns = best_us([pymavlink, fleet_columns], signed)
    yield Row("wire, signed as PX4 does: pymavlink", theirs, "us/frame")
    yield Row("wire, signed as PX4 does: fleet columns", columns, "us/frame")
    yield Row("wire, signed as PX4 does: times faster", theirs / columns, "x", 5, at_least=True)


def best_us(makers: list[Maker], sent: tuple[Datagram, ...]) -> list[float]:
    """Microseconds per frame of each reader; they take turns, so that each meets the same machine."""
    before, after = split(sent)
    frames = sum(datagram.frames for datagram in sent if datagram.t_s >= WARM_S)
    best_s = [float("inf")] * len(makers)
    for _ in range(ROUNDS):
        for i, maker in enumerate(makers):
            read = maker()
            read(before)
            began_s = time.process_time()
            count = read(after)
            best_s[i] = min(best_s[i], time.process_time() - began_s)
            if count != frames:
                raise NotMeasured(f"{maker.__name__} took {count} of {frames} frames")
    return [1e6 * seconds / frames for seconds in best_s]


def split(sent: tuple[Datagram, ...]) -> tuple[list[Batch], list[Batch]]:
    """Datagrams as a link gives them: all that came since the last look, with their senders; warming up, and then."""
    batches: list[Batch] = [[] for _ in range(int(sent[-1].t_s / READ_S) + 1)]
    for datagram in sent:
        batches[int(datagram.t_s / READ_S)].append((datagram.data, ("127.0.0.1", 20_000 + datagram.vehicle)))
    warm = round(WARM_S / READ_S)
    return batches[:warm], batches[warm:]


def pymavlink() -> Read:
    parser = mavlink.MAVLink(None)
    parser.robust_parsing = True

    def read(batches: list[Batch]) -> int:
        count = 0
        for batch in batches:
            for data, _ in batch:
                messages = parser.parse_buffer(data)
                if messages:
                    count += len(messages)
        return count - parser.total_receive_errors

    return read


class Nobody:
    """An owner that wants nothing but the newest raw frames."""

    def place(self, slot: Slot, source: Source) -> None:
        source.vehicle_count = 1  # a vehicle's address, as the fleet says after its first heartbeat

    def report_oddity(self, source: Source, what: str) -> None:
        raise NotMeasured(what)


def newest_raw() -> Read:
    intake = Intake("", Nobody())

    def read(batches: list[Batch]) -> int:
        return sum(len(intake.datagrams(LINK, batch, n * READ_S)) for n, batch in enumerate(batches))

    return read


def fleet_columns() -> Read:
    """All that the fleet does with what it hears, read as often as a station does."""
    clock = VirtualClock()
    fleet = VehicleRegistry(clock, EventLog(clock), LocalFrame(ORIGIN), 255)
    intake = fleet.intakes[""]

    def read(batches: list[Batch]) -> int:
        count = 0
        for number, batch in enumerate(batches):
            clock.advance(READ_S)
            count += len(intake.datagrams(LINK, batch, clock.now()))
            if number % LOOK_EVERY == 0:
                fleet.tick()
        seen = fleet.vehicles.values()
        if len(seen) != VEHICLES or not all(
            v.telemetry.has_position() and v.telemetry.has_battery_status for v in seen
        ):
            raise NotMeasured("the columns are not filled")
        return count

    return read
