"""Promises of docs/threats.md as figures that other work of the computer does not change: counts and virtual time.

`python -m tests.bench promises` takes some minutes. Random inputs come from one seed.
"""

import asyncio
import base64
import gc
import random
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rich.color import ColorSystem

from tests.bench.latency import percentile
from tests.bench.promises.big_files import big_files
from tests.bench.promises.system_calls import system_calls
from tests.bench.row import Row
from tests.core.rates.test_rates_on_radio import HEARTBEAT, Ground
from tests.core.rigs.plan_peers import ArduPilotPeer, PlanPeer, Px4Peer, mission
from tests.core.rigs.rig import Rig, scenario, toml
from tests.core.rigs.service_rig import ServiceRig
from tests.core.rigs.wires import Wire, Wired, apart
from tests.hostile.oracle import KEY, Oracle, Watched
from tests.hostile.test_forged import forgeries
from tests.hostile.test_identity import accepted, listening
from tests.screens.rigs.meter import PERIOD_S, metered
from tui_gcs.core.firmware.plan_dialects import dialect_of
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.missions.plan_compare import compare
from tui_gcs.core.plans.model import PlanKind
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.core.services.plans.plan_messages import item_of
from tui_gcs.core.uplink.jobs import JobState

SEED = 23
FORGED = 1_000_000
MISSIONS, ITEMS = 200, 100
MISSION_LOSSES = (0.2, 0.3)
"""At the first one every mission must arrive; at the second it may be reported as failed."""
OUTAGES, FALSE_LOST_S, FALSE_LOST_LOSS = 100, 3600.0, 0.2
DUPLICATES, REBOOTS = 30, 30
VEHICLES, RADIO_S = 8, 600.0
CONSOLE_WARM_S, CONSOLE_S = 10.0, 120.0
ORDERS = frozenset({"COMMAND_LONG", "COMMAND_INT", "SET_MODE", "PARAM_SET", "MISSION_COUNT", "MISSION_CLEAR_ALL"})
QUESTIONS = frozenset({511, 512})
"""Commands that request messages."""


def promises(folder: Path) -> Iterator[Row]:
    """Each part in a folder of its own."""
    for part in (
        lost_links,
        duplicates,
        reboots,
        missions,
        radio,
        console_frames,
        orders,
        forged,
        big_files,
        system_calls,
    ):
        place = folder / part.__name__
        place.mkdir()
        yield from part(place)


def forged(folder: Path, frames: int = FORGED) -> Iterator[Row]:
    """R4: forged and replayed frames among those of two vehicles that sign, beside a station that gets none."""
    oracle = Oracle(folder, keyed=(1, 2))
    heard = listening(oracle.flight)
    oracle.run(30.0)
    recording = [data for data, _ in heard]
    oracle.flight.on_way = None
    before = accepted(oracle.twin)
    oracle.flood(forgeries(oracle, recording, frames))
    oracle.run(3.0)
    genuine, refused = accepted(oracle.twin) - before, oracle.dropped()
    believed = accepted(oracle.flight) - accepted(oracle.twin)
    oracle.close()
    yield Row("R4 forged and replayed frames", frames, "", frames, at_least=True)
    yield Row("R4 of them refused and counted", sum(refused.values()) - refused["junk bytes"], "")
    yield Row("R4 believed, or genuine ones not believed", abs(believed), "", 0)
    yield Row("R4 genuine frames meanwhile, all believed", genuine, "", 100, at_least=True)


def lost_links(folder: Path, outages: int = OUTAGES, calm_s: float = FALSE_LOST_S) -> Iterator[Row]:
    """R10: eight vehicles on the ground; each outage begins at another moment of their streams."""
    chance = random.Random(SEED)
    flight = Rig(scenario(VEHICLES), toml(), folder).ready()
    shown_s, back_s = [], []
    for number in range(outages):
        index = number % len(flight.sim)
        vehicle = flight.station.picture.fleet.vehicles[flight.sim.specs[index].system_id]
        flight.run(chance.uniform(0.5, 2.0))
        flight.sim.silence(index)
        shown_s.append(flight.until(lambda v=vehicle: freshness(flight, v) is Freshness.LOST, 30.0))
        flight.run(chance.uniform(0.5, 2.0))
        flight.sim.unsilence(index)
        back_s.append(flight.until(lambda v=vehicle: freshness(flight, v) is Freshness.OK, 30.0))
    before = lost_texts(flight)
    flight.loses = lambda way, index: chance.random() < FALSE_LOST_LOSS
    flight.run(calm_s)
    false = lost_texts(flight) - before
    flight.close()
    yield Row(f"R10 {outages} outages: shown as LOST, p99", percentile(shown_s, 99), "s", 4.0)
    yield Row(f"R10 {outages} outages: whole again, p99", percentile(back_s, 99), "s", 2.0)
    yield Row(f"R10 {calm_s / 60:.0f} min at 20 % loss, 8 vehicles: false LOST", false, "", 0)


def duplicates(folder: Path, times: int = DUPLICATES) -> Iterator[Row]:
    """R15: a second vehicle with the id of the first one, switched on some time ago, on another address."""
    chance, took_s = random.Random(SEED), []
    for number in range(times):
        place = folder / str(number)
        place.mkdir()
        flight = Wired(scenario(1), toml(), place, wires=[Wire("near", place=apart)])
        flight.run(20.0 + chance.random())
        flight.stranger(age_s=chance.uniform(1.0, 300.0))
        took_s.append(flight.until(lambda one=flight: bool(one.vehicle().why_not_commanded), 60.0))
        flight.close()
    yield Row(f"R15 {times} duplicate ids: found and blocked, at most", max(took_s), "s", 5.0)


def reboots(folder: Path, times: int = REBOOTS) -> Iterator[Row]:
    """R17: an autopilot is switched off and on; counted from its first frame after that."""
    chance, took_s = random.Random(SEED), []
    flight = Rig(scenario(2), toml(), folder).ready()
    for _ in range(times):
        flight.run(chance.uniform(20.0, 30.0))
        told, heard_s = flight.texts("vehicle 1").count("rebooted"), flight.clock.now()
        flight.sim.power_cycle(0)
        vehicle = flight.station.picture.fleet.vehicles[1]
        flight.until(lambda since_s=heard_s, one=vehicle: one.last_heard_s > since_s, 30.0)
        took_s.append(flight.until(lambda n=told: flight.texts("vehicle 1").count("rebooted") > n, 30.0))
    flight.close()
    yield Row(f"R17 {times} reboots: noticed after the first frame, at most", max(took_s), "s", 2.0)


def missions(folder: Path, times: int = MISSIONS) -> Iterator[Row]:
    """R9: uploads of a hundred items over a bad link, by turns to an ArduPilot and a PX4, read back and compared."""
    for loss in MISSION_LOSSES:
        took_s, results = [], Counter[str]()
        for seed in range(times):
            place = folder / f"{loss}-{seed}"
            place.mkdir()
            result, seconds = upload(place, seed, loss)
            results[result] += 1
            took_s.append(seconds)
        name = f"R9 {times} missions of {ITEMS} items, {loss:.0%} loss"
        all_right = loss == MISSION_LOSSES[0]
        yield Row(f"{name}: right", results["right"], "", times if all_right else None, at_least=True)
        yield Row(f"{name}: done with wrong content", results["wrong"], "", 0)
        yield Row(f"{name}: longest", max(took_s), "s", 60.0 if all_right else None)


def upload(folder: Path, seed: int, loss: float) -> tuple[str, float]:
    """Whether one upload was right, wrong or reported as failed, and how many seconds it took."""
    peer: PlanPeer = (ArduPilotPeer, Px4Peer)[seed % 2](1)
    rig, plan = ServiceRig(folder, peer, seed=seed).heard(), mission(ITEMS, first=seed)
    rig.loss = loss
    job = rig.station.services.missions.upload(1, plan)
    took_s = rig.until(lambda: job.over, 600.0, "over")
    dialect = dialect_of(rig.vehicle())
    held = dialect.from_wire(PlanKind.MISSION, tuple(item_of(f) for f in peer.stores[PlanKind.MISSION]))
    if job.state is not JobState.DONE:
        return "failed", took_s
    return ("right" if compare(plan, held, dialect).same else "wrong"), took_s


def radio(_: Path, seconds: float = RADIO_S) -> Iterator[Row]:
    """R18: eight vehicles that sign, behind one radio of 57.6 kbit/s, byte for byte."""
    for loss in (0.0, 0.1):
        ground = Ground(VEHICLES, loss=loss).run(45.0)
        ground.begin_measuring()
        ground.run(seconds)
        name = f"R18 {seconds / 60:.0f} min, {loss:.0%} loss"
        heartbeats = 100.0 * ground.heard[HEARTBEAT] / (VEHICLES * seconds)
        yield Row(f"{name}: heartbeats received", heartbeats, "%", None if loss else 99.0, at_least=True)
        yield Row(f"{name}: age of positions, p95", ground.p95_age_s(), "s", 1.5)


def console_frames(_: Path, seconds: float = CONSOLE_S) -> Iterator[Row]:
    """R23: the console's CPU time for each picture of eight flying vehicles, in truecolour."""

    async def fly() -> list[float]:
        async with metered(VEHICLES, ColorSystem.TRUECOLOR) as meter:
            await meter.fly(CONSOLE_WARM_S)
            gc.collect()
            gc.freeze()  # as a console does when it has started
            return [1e3 * (await meter.fly(PERIOD_S))[1] for _ in range(round(seconds / PERIOD_S))]

    frames_ms = asyncio.run(fly())
    gc.unfreeze()
    yield Row(f"R23 {len(frames_ms)} pictures of 8 vehicles: CPU p99", percentile(frames_ms, 99), "ms", 100)
    yield Row("R23 the slowest of them", max(frames_ms), "ms", 100)


def orders(folder: Path) -> Iterator[Row]:
    """R22: of every order on the wire the journal has a line before; no file of the run holds the vehicles' key."""
    flight = Watched(scenario(2), toml(), folder, keyed=(1, 2))
    journalled: Counter[tuple[int, str]] = Counter()
    sent, early = 0, 0
    write, send = flight.journal.write, flight.link.send

    def noted(entry: dict[str, Any]) -> None:
        if "message" in entry:
            journalled[entry["vehicle"], entry["message"]] += 1
        write(entry)

    def seen(data: bytes, to: Address) -> None:
        nonlocal sent, early
        for frame in cut_datagram(data).frames:
            message = decode(frame)
            if message is None or message.name not in ORDERS or message.fields.get("command") in QUESTIONS:
                continue
            key = message.fields["target_system"], message.name
            sent, early = sent + 1, early + (journalled[key] <= 0)
            journalled[key] -= 1
        send(data, to)

    flight.journal.write, flight.link.send = noted, seen  # type: ignore[method-assign]
    flight.flying().run(20.0)
    flight.ask(m.Hold())
    flight.run(5.0)
    flight.ask(m.Return())
    flight.until(lambda: not flight.sim.armed.any(), 200.0, "landed")
    flight.close()
    yield Row("R22 orders of a flight of two vehicles on the wire", sent, "", 10, at_least=True)
    yield Row("R22 of them without a line of the journal before", early, "", 0)
    logs = [path for path in folder.rglob("*") if path.is_file() and "keys" not in path.parts]
    written = b"".join(path.read_bytes() for path in logs)
    secrets = (KEY, KEY.hex().encode(), KEY.hex().upper().encode(), base64.b64encode(KEY))
    yield Row("R22 bytes of journal and log that were searched", len(written), "B", 100_000, at_least=True)
    yield Row("R22 places where they hold the key", sum(written.count(secret) for secret in secrets), "", 0)


def freshness(flight: Rig, vehicle: Vehicle) -> Freshness:
    """How fresh the station's picture of a vehicle is."""
    return vehicle.freshness(flight.clock.now())


def lost_texts(flight: Rig) -> int:
    """How often a vehicle was reported as LOST."""
    return sum("LOST" in text for text in flight.texts())
