"""Ways that look alive and are not: stops must still arrive, and nobody else may be taken for the vehicle."""

from collections.abc import Callable
from typing import Any

import pytest
from wires import Wire, Wired

from tui_gcs.core.keystore import KeyStore
from tui_gcs.core.messages import Freshness
from tui_gcs.core.wire.encode import Encoder
from tui_gcs.core.wire.signing import Key, ticks

MakeWired = Callable[..., Wired]
SECRET = bytes(range(1, 33))
BEAT = {"type": 18, "autopilot": 8, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
RADIO = {"rxerrors": 0, "fixed": 0, "rssi": 200, "remrssi": 200, "txbuf": 100, "noise": 10, "remnoise": 10}
SPEAKERS = {
    "companion": (191, "HEARTBEAT", BEAT),
    "camera": (100, "HEARTBEAT", BEAT),
    "modem": (1, "RADIO_STATUS", RADIO),
}


def keyed(wired: MakeWired, tmp_path: Any, wires: list[Wire]) -> Wired:
    """A flight with one vehicle that signs."""
    keys = KeyStore(tmp_path / "keys")
    keys.add(Key("field", SECRET))
    keys.assign("field", "", 1)
    flight = wired(1, keys=keys, wires=wires)
    flight.sim.set_key(0, SECRET, ticks(flight.clock.wall()))
    return flight


def cut(wire: Wire) -> None:
    """Nothing passes between the autopilot and whoever sits at the wire."""
    wire.loses = lambda way, data: True


def speak(flight: Wired, wire: Wire, who: str, seconds: float) -> None:
    """Something that shares the vehicle's system id goes on to speak on `wire`."""
    component, name, fields = SPEAKERS[who]
    encoder = Encoder(1, component)
    for _ in range(round(seconds / 0.5)):
        wire.link.inject(encoder.encode(name, **fields), ("sim", 0))
        flight.run(0.5)


def land(flight: Wired) -> None:
    flight.station.commands.submit(flight.station.firmware.land(1))


# ---------------------------------------------------------------- who speaks for a path


@pytest.mark.parametrize("signed", [False, True], ids=["no key", "key"])
@pytest.mark.parametrize("who", list(SPEAKERS))
def test_only_its_autopilot_keeps_a_path_in_use(wired: MakeWired, tmp_path: Any, who: str, signed: bool) -> None:
    near, far = Wire("near"), Wire("far", delay_s=0.05)
    flight = keyed(wired, tmp_path, [near, far]) if signed else wired(1, wires=[near, far])
    flight.flying().run(5.0)
    assert flight.vehicle().link == "near" and len(flight.vehicle().used_paths()) == 2
    cut(near)
    speak(flight, near, who, 2.0)
    assert flight.vehicle().link == "far"
    land(flight)
    speak(flight, near, who, 15.0)
    assert flight.place(1)[2] < 20.0


@pytest.mark.parametrize("signed", [False, True], ids=["no key", "key"])
@pytest.mark.parametrize("who", list(SPEAKERS))
def test_nobody_else_hides_that_an_autopilot_is_lost(wired: MakeWired, tmp_path: Any, who: str, signed: bool) -> None:
    near = Wire("near")
    flight = keyed(wired, tmp_path, [near]) if signed else wired(1, wires=[near])
    flight.flying().run(5.0)
    cut(near)
    speak(flight, near, who, 4.5)
    assert flight.vehicle().freshness(flight.clock.now()) is Freshness.LOST


def test_a_path_whose_positions_stopped_is_left_for_one_that_brings_them(wired: MakeWired) -> None:
    near, far = Wire("near"), Wire("far", delay_s=0.4)
    flight = wired(1, wires=[near, far]).run(10.0)
    near.loses = lambda way, data: way == "up" and data[7:10] != b"\0\0\0"
    flight.run(10.0)
    assert flight.vehicle().link == "far"


def test_a_stop_goes_over_every_way_and_nothing_else_does(wired: MakeWired) -> None:
    near, far = Wire("near"), Wire("far", delay_s=0.05)
    flight = wired(1, wires=[near, far]).flying().run(5.0)
    since_s = flight.clock.now()
    flight.station.commands.submit(flight.station.firmware.speed(1, 5.0))
    flight.run(1.0)
    assert 178 in flight.commands(near, since_s) and 178 not in flight.commands(far, since_s)
    land(flight)
    flight.run(1.0)
    assert 176 in flight.commands(near, since_s) and 176 in flight.commands(far, since_s)
    assert "land: confirmed" in flight.texts("vehicle 1")
