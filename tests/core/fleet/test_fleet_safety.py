"""Which frames count for a vehicle, and how old its values really are."""

import random
from collections.abc import Callable
from typing import Any

import pytest
from fastcrc.crc16 import mcrf4xx

from tests.core.rigs import orders
from tests.core.rigs.wires import Wire, Wired
from tui_gcs.core.fleet.identity.boot_clock import BootClock, BootTimeResult
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol.common import Freshness, Phase

MakeWired = Callable[..., Wired]
BEAT = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
POSITION = b"\x21\0\0"


def beat(flight: Wired, wire: Wire, component: int, **other: int) -> None:
    """A heartbeat of another component of vehicle 1 arrives at its address."""
    wire.link.inject(Encoder(1, component).encode("HEARTBEAT", **BEAT | other), ("sim", 0))


def as_component(raw: bytes, component: int) -> bytes:
    """The same frame, said by another component."""
    layout = dialect.layout(int.from_bytes(raw[7:10], "little"))
    assert layout is not None
    body = raw[1:6] + bytes((component,)) + raw[7:-2]
    return b"\xfd" + body + int(mcrf4xx(body + layout.extra)).to_bytes(2, "little")


class OtherComponent(Wire):
    """What the vehicle says comes from another component of it."""

    component = 1

    def from_vehicle(self, now: float, data: bytes, address: Address) -> None:
        if data[0] == 0xFD:  # no text of its boot
            data = as_component(data, self.component)
        super().from_vehicle(now, data, address)


# ---------------------------------------------------------------- which component is the autopilot


@pytest.mark.parametrize("component", [2, 191])
def test_one_forged_first_heartbeat_blinds_nobody(wired: MakeWired, component: int) -> None:
    near = Wire("near")
    flight = wired(1, wires=[near])
    beat(flight, near, component)
    flight.run(12.0)
    vehicle = flight.vehicle()
    assert vehicle.component == 1 and vehicle.identity.identified
    assert vehicle.freshness(flight.clock.now()) is Freshness.OK
    assert flight.texts("vehicle 1").count("its autopilot now sends as component 1") == 1


def test_after_a_restart_in_flight_a_forged_heartbeat_keeps_no_landing_from_arriving(wired: MakeWired) -> None:
    near = Wire("near")
    flight = wired(1, wires=[near])
    flight.flying()
    flight.boot_station()
    beat(flight, near, 2)
    flight.run(5.0)
    height_m = flight.place(1)[2]
    flight.station.comms.commands.submit(orders.land(flight, 1))
    flight.run(10.0)
    assert flight.place(1)[2] < height_m - 5.0


def test_who_comes_back_as_another_component_is_heard_and_asked_anew(wired: MakeWired) -> None:
    near = OtherComponent("near")
    flight = wired(1, wires=[near])
    flight.ready()
    near.component = 2
    flight.run(2.0)
    assert flight.vehicle().component == 1, "not before it was silent for 3 s"
    flight.run(8.0)
    vehicle = flight.vehicle()
    assert vehicle.component == 2 and vehicle.identity.identified
    assert vehicle.freshness(flight.clock.now()) is Freshness.OK
    assert "its autopilot now sends as component 2" in flight.texts("vehicle 1")


@pytest.mark.parametrize(
    ("component", "other"),
    [(191, {}), (191, {"type": 18, "autopilot": 8}), (100, {"type": 30, "autopilot": 8}), (190, {"type": 6})],
)
def test_who_speaks_beside_the_autopilot_changes_nothing(
    wired: MakeWired, component: int, other: dict[str, Any]
) -> None:
    near = Wire("near")
    flight = wired(1, wires=[near])
    flight.flying()
    for _ in range(20):
        beat(flight, near, component, **other)
        flight.run(0.5)
    assert flight.vehicle().component == 1 and flight.phase(1) is Phase.FLYING
    assert not any("sends as component" in text for text in flight.texts())


def test_a_companion_is_no_autopilot_however_silent_that_is(wired: MakeWired) -> None:
    near = Wire("near")
    flight = wired(1, wires=[near])
    flight.ready()
    flight.sim.silence(0)
    for _ in range(20):
        beat(flight, near, 191, type=18, autopilot=8)
        flight.run(0.5)
    assert flight.vehicle().component == 1


# ---------------------------------------------------------------- how old a position is


class Memory(Wire):
    """A router that repeats the newest of each message."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.last: dict[bytes, bytes] = {}

    def from_vehicle(self, now: float, data: bytes, address: Address) -> None:
        self.last[data[7:10]] = data
        super().from_vehicle(now, data, address)


def lateness(flight: Wired) -> list[str]:
    """What was told of late positions."""
    return [text for text in flight.texts("vehicle 1") if "late" in text]


def test_a_position_that_is_repeated_gets_stale(wired: MakeWired) -> None:
    near = Memory("near")
    flight = wired(1, wires=[near])
    flight.flying()
    flight.run(1.0)
    near.loses = lambda way, data: True
    begin_s, heartbeat, position = flight.clock.now(), near.last[b"\0\0\0"], near.last[POSITION]
    for _ in range(20):
        for raw in (heartbeat, position):
            near.link.inject(raw, ("sim", 0))
        flight.run(0.5)
    vehicle = flight.vehicle()
    assert vehicle.freshness(flight.clock.now()) is Freshness.STALE
    assert vehicle.telemetry.position_s <= begin_s
    assert flight.station.picture.fleet.dropped["repeated position"] > 10


def with_boot_ms(raw: bytes, boot_ms: int) -> bytes:
    """The same position (all 28 bytes of it), at another boot time."""
    layout = dialect.layout(33)
    assert layout is not None and raw[1] == 28
    body = raw[1:10] + boot_ms.to_bytes(4, "little") + raw[14:-2]
    return b"\xfd" + body + int(mcrf4xx(body + layout.extra)).to_bytes(2, "little")


class NoClock(Wire):
    """The vehicle has no boot clock: it says 7 ms for ever; what else it says changes as that of a real GPS does."""

    def from_vehicle(self, now: float, data: bytes, address: Address) -> None:
        if data[7:10] == POSITION and data[1] == 28:
            noise = int.from_bytes(data[14:18], "little", signed=True) + round(now * 20) % 3
            data = with_boot_ms(data[:14] + noise.to_bytes(4, "little", signed=True) + data[18:], 7)
        super().from_vehicle(now, data, address)


def test_a_vehicle_without_a_boot_clock_is_seen_to_move(wired: MakeWired) -> None:
    flight = wired(1, wires=[NoClock("near")])
    flight.run(60.0)
    assert flight.clock.now() - flight.vehicle().telemetry.position_s < 1.0
    assert not lateness(flight) and flight.vehicle().integrity.reboots == 0


def test_positions_that_come_ever_later_are_told(wired: MakeWired) -> None:
    """A modem that buffers: the way becomes 30 s slow within 2 minutes."""
    near = Wire("near")
    flight = wired(1, wires=[near], wants=lambda frame, task: [])
    flight.ready()
    assert flight.vehicle().freshness(flight.clock.now()) is Freshness.OK
    for _ in range(2400):
        near.delay_s += 30 / 2400
        flight.step()
    assert flight.vehicle().freshness(flight.clock.now()) is Freshness.OK, "freshness is the time of arrival"
    reported = lateness(flight)
    assert 2 <= len(reported) <= 5
    assert 15.0 < float(reported[-1].split()[2]) < 30.0, "less 3 % by which the vehicle's clock may be slow"
    near.delay_s = 0.0
    near._up.clear()
    flight.run(60.0)
    assert len(lateness(flight)) == len(reported), "not any more, when they are new again"


class Stopped(Wire):
    """Holds all frames back while `most` is 0; else brings so many at a time."""

    most = 1000

    def arrive(self, now: float) -> None:
        for _ in range(min(self.most, len(self._up))):
            _, data, address = self._up.popleft()
            self.link.inject(data, address)


def test_a_backlog_is_told_once(wired: MakeWired) -> None:
    """The way stops for 20 s, then brings all of it little by little."""
    near = Stopped("near")
    flight = wired(1, wires=[near])
    flight.run(20.0)
    near.most = 0
    flight.run(20.0)
    near.most, held = 4, len(near._up)
    flight.run(0.5)
    assert held > 100
    flight.until(lambda: not near._up, 30.0)
    flight.run(0.5)
    assert flight.clock.now() - flight.vehicle().telemetry.position_s < 0.5
    assert len(lateness(flight)) == 1


@pytest.mark.parametrize("ratio", [0.98, 1.0, 1.05])
def test_a_clock_that_drifts_is_not_late(ratio: float) -> None:
    clock = BootClock()
    for k in range(6000):
        clock.check(round(1e5 + ratio * 250 * k), k / 4)
        assert clock.measure_delay() == 0.0


def test_jitter_and_loss_are_not_lateness() -> None:
    """A second of jitter and a fifth lost, for 10 minutes."""
    chance = random.Random(3)
    arrivals = sorted((k / 4 + chance.random(), k) for k in range(2400) if chance.random() > 0.2)
    clock = BootClock()
    for at_s, k in arrivals:
        clock.check(100_000 + 250 * k, at_s)
        assert clock.measure_delay() == 0.0


def test_a_reboot_and_a_wrap_are_not_lateness() -> None:
    clock = BootClock()
    for boot_ms, at_s in ((900_000, 0.0), (901_000, 1.0), (500, 5.0), (1500, 6.0), (2500, 7.0)):
        clock.check(boot_ms, at_s)
        assert clock.measure_delay() == 0.0
    clock = BootClock()
    for boot_ms, at_s in ((2**32 - 1500, 0.0), (2**32 - 500, 1.0), (500, 2.0), (1500, 3.0)):
        assert clock.check(boot_ms, at_s) is BootTimeResult.CONTINUES
        assert clock.measure_delay() == 0.0
