"""What a link may lose or forge without a vehicle being steered blind, or by the wrong station."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.core.rigs.rig import SETPOINT, Rig
from tui_gcs.core.flight.flights import ArmingStep
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram, decode
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase

pytestmark = pytest.mark.long  # nearly each is a flight

MakeRig = Callable[..., Rig]
GLOBAL_POSITION_INT, COMMAND_ACK, EXTENDED_SYS_STATE = 33, 77, 245


def losing(flight: Rig, vehicle: int, *msgids: int) -> set[int]:
    """These messages of a vehicle do not arrive, until the set that is returned is emptied."""
    lost, inject, source = set(msgids), flight.link.inject, ("sim", flight.sim_index[vehicle])

    def thin(data: bytes, address: Address) -> None:
        if address != source or not lost & {frame.msgid for frame in cut_datagram(data).frames}:
            inject(data, address)

    flight.link.inject = thin  # type: ignore[method-assign]
    return lost


# ---------------------------------------------------------------- a take-off nobody hears of


UNHEARD = {
    "all frames": set(range(60_000)),
    "positions": {GLOBAL_POSITION_INT, EXTENDED_SYS_STATE},
    "positions and answers": {GLOBAL_POSITION_INT, EXTENDED_SYS_STATE, COMMAND_ACK},
}


@pytest.mark.parametrize(
    ("unheard", "after_s", "for_s"),
    [
        ("all frames", 0.0, 3.2),
        ("all frames", 0.0, 12.0),
        ("all frames", 0.2, 12.0),
        ("positions", 0.0, 6.0),
        ("positions", 0.0, 12.0),
        ("positions and answers", 0.0, 3.2),
        ("positions and answers", 0.2, 12.0),
    ],
)
def test_a_start_that_seems_to_fail_disarms_nobody_in_the_air(
    rig: MakeRig, unheard: str, after_s: float, for_s: float
) -> None:
    """`after_s`: the answer to take-off is lost, too, or just not."""
    flight = rig(2).ready()
    assert flight.ask(m.Start(vehicles=(1,))).ok
    flight.until(lambda: flight.station.flight.flights.by_id[1].step is ArmingStep.TAKE_OFF, 60.0)
    flight.run(after_s)
    lost = losing(flight, 1, *UNHEARD[unheard])
    assert flight.disarms_in_the_air(for_s) == []
    lost.clear()
    assert flight.disarms_in_the_air(30.0) == []
    in_the_air = flight.place(1)[2] > 0.5
    assert in_the_air == (flight.phase(1) is not Phase.GROUND), "what it is and what is shown agree"
    if in_the_air:
        assert flight.ask(m.Return(vehicles=(1,))).ok
    flight.until(lambda: not flight.sim.armed[0] and flight.phase(1) is Phase.GROUND, 90.0, "down and disarmed")


# ---------------------------------------------------------------- another aircraft with the id of one of ours

ELSEWHERE = ("real", 99)


def real_aircraft(flight: Rig, seconds: float, *, token: bytes = b"") -> None:
    """For some time a real ArduCopter in GUIDED says that it is system 2, from another address."""
    encoder = Encoder(2, 1)
    place = {"lat": 520_738_000, "lon": -6_250_000, "alt": 144_000, "relative_alt": 34_000}

    def say(name: str, **fields: Any) -> None:
        flight.link.inject(encoder.encode(name, **fields), ELSEWHERE)

    for k in range(round(seconds / 0.1)):
        if k % 10 == 0:
            heartbeat = {"type": 2, "autopilot": 3, "base_mode": 209, "custom_mode": 4}
            say("HEARTBEAT", system_status=4, mavlink_version=3, **heartbeat)
            say("EXTENDED_SYS_STATE", vtol_state=0, landed_state=2)
        if token and k % 10 == 5:
            say("AUTOPILOT_VERSION", **version(token))
        boot_ms = 9_000_000 + round(flight.clock.now() * 1e3)
        say("GLOBAL_POSITION_INT", time_boot_ms=boot_ms, vx=0, vy=0, vz=0, hdg=9000, **place)
        flight.run(0.1)


def version(token: bytes) -> dict[str, Any]:
    numbers = ("capabilities", "flight_sw_version", "middleware_sw_version", "os_sw_version", "board_version")
    rest = {"vendor_id": 0, "product_id": 0, "uid": 0}
    custom = {f"{part}_custom_version": bytes(8) for part in ("middleware", "os")}
    return dict.fromkeys(numbers, 0) | rest | custom | {"flight_custom_version": token}


def sent_to_address(flight: Rig, address: Address) -> list[str]:
    """Grows by the name (or the command number) of everything that is sent to `address` from now on."""
    names: list[str] = []
    send = flight.link.send

    def note(data: bytes, to: Address) -> None:
        for frame in cut_datagram(data).frames if to == address else ():
            message = decode(frame)
            assert message is not None
            names.append(str(message.fields.get("command", message.name)))
        send(data, to)

    flight.link.send = note  # type: ignore[method-assign]
    return names


@pytest.mark.parametrize("token", [b"", b"stranger"], ids=["silent about itself", "says who it is"])
def test_in_sim_another_aircraft_with_the_id_of_ours_is_not_commanded(rig: MakeRig, token: bytes) -> None:
    flight = rig(3).flying().run(8.0)
    names = sent_to_address(flight, ELSEWHERE)
    flight.sim.silence(1)
    flight.run(3.6)
    real_aircraft(flight, 10.0, token=token)
    flight.ask(m.Hold())
    real_aircraft(flight, 5.0, token=token)
    flight.ask(m.Resume())
    real_aircraft(flight, 5.0, token=token)
    flight.ask(m.Return())
    real_aircraft(flight, 5.0, token=token)
    assert set(names) <= {"HEARTBEAT", "511", "512"}


def test_in_sim_an_id_that_moved_to_another_address_is_told_and_out_of_the_mission(rig: MakeRig) -> None:
    flight = rig(3).flying().run(8.0)
    flight.sim.silence(1)
    flight.run(3.6)
    real_aircraft(flight, 5.0)
    assert flight.phase(2) is Phase.TAKEN_OUT
    assert "2" in flight.station.publisher.status().alarm
    assert any("address" in text for text in flight.texts("vehicle 2"))
    assert flight.phase(1) is flight.phase(3) is Phase.FLYING


# ---------------------------------------------------------------- a vehicle without positions


def test_a_vehicle_whose_positions_stop_is_taken_out_and_not_steered(rig: MakeRig) -> None:
    flight = rig(3).flying().run(8.0)
    reported = len(flight.texts("vehicle 2"))
    losing(flight, 2, GLOBAL_POSITION_INT)
    flight.run(6.0)
    assert flight.phase(2) is Phase.TAKEN_OUT
    assert len(flight.texts("vehicle 2")) > reported
    since_s = flight.clock.now()
    flight.run(10.0)
    assert not flight.sent_to(2, SETPOINT, since_s)
    assert flight.sent_to(1, SETPOINT, since_s)


@pytest.mark.parametrize("before_s", [1.0, 6.0], ids=["not noticed yet", "noticed"])
def test_return_of_the_others_does_not_wait_for_a_vehicle_without_positions(rig: MakeRig, before_s: float) -> None:
    flight = rig(3).flying().run(8.0)
    losing(flight, 2, GLOBAL_POSITION_INT)
    flight.run(before_s)
    flight.ask(m.Return())
    flight.until(lambda: not flight.sim.armed[[0, 2]].any(), 110.0, "the others landed")
    assert flight.phase(2) is Phase.TAKEN_OUT
    assert "2" in flight.station.publisher.status().alarm


def test_positions_that_are_back_bring_it_back(rig: MakeRig) -> None:
    flight = rig(3).flying().run(8.0)
    lost = losing(flight, 2, GLOBAL_POSITION_INT)
    flight.run(8.0)
    assert flight.phase(2) is Phase.TAKEN_OUT
    lost.clear()
    flight.run(3.0)
    assert flight.phase(2) in (Phase.HOLDING, Phase.FLYING)
    assert flight.ask(m.Return()).ok
    flight.until(lambda: not flight.sim.armed.any(), 120.0, "all landed")


# ---------------------------------------------------------------- a lost vehicle


def test_where_a_lost_px4_may_sink_or_return_is_in_the_frame_that_planners_get(rig: MakeRig) -> None:
    flight = rig(2, wants=None, autopilots="px4").flying()
    flight.until(lambda: flight.speed(2) > 7.0, 60.0, "fast")
    assert flight.station.publisher.frame().keep_out == ()
    flight.loses = lambda way, index: index == 1
    flight.run(5.0)
    volumes = flight.station.publisher.frame().keep_out
    assert {volume.vehicle for volume in volumes} == {2} and len(volumes) >= 3, "there, down, and home"
    assert min(volume.low_m for volume in volumes) < 0.0
    x, y = volumes[0].begin_m
    assert any(abs(x - volume.begin_m[0]) + abs(y - volume.begin_m[1]) > 1.0 for volume in volumes), "its way home, too"
