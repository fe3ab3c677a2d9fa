"""Who speaks for a vehicle, and how old what it says really is."""

from collections.abc import Callable
from typing import Any

import pytest
from fastcrc.crc16 import mcrf4xx
from wires import Wire, Wired

from tui_gcs.core.links import Address
from tui_gcs.core.messages import Freshness, Phase
from tui_gcs.core.wire import dialect
from tui_gcs.core.wire.encode import Encoder

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
    assert vehicle.component == 1 and vehicle.identified
    assert vehicle.freshness(flight.clock.now()) is Freshness.OK
    assert flight.texts("vehicle 1").count("its autopilot now speaks as component 1") == 1


def test_after_a_restart_in_flight_a_forged_heartbeat_keeps_no_landing_from_arriving(wired: MakeWired) -> None:
    near = Wire("near")
    flight = wired(1, wires=[near])
    flight.flying()
    flight.boot_station()
    beat(flight, near, 2)
    flight.run(5.0)
    height_m = flight.place(1)[2]
    flight.station.commands.submit(flight.station.firmware.land(1))
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
    assert vehicle.component == 2 and vehicle.identified
    assert vehicle.freshness(flight.clock.now()) is Freshness.OK
    assert "its autopilot now speaks as component 2" in flight.texts("vehicle 1")


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
    assert not any("speaks as component" in text for text in flight.texts())


def test_a_companion_is_no_autopilot_however_silent_that_is(wired: MakeWired) -> None:
    near = Wire("near")
    flight = wired(1, wires=[near])
    flight.ready()
    flight.sim.silence(0)
    for _ in range(20):
        beat(flight, near, 191, type=18, autopilot=8)
        flight.run(0.5)
    assert flight.vehicle().component == 1
