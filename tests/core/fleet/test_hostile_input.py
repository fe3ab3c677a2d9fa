"""Input on a link is hostile: junk, forged values and impostors cost nothing but a counter."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from tests.core.rigs.rig import Rig
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Freshness, Phase

MakeRig = Callable[..., Rig]


def position(flight: Rig, x: float, y: float, z: float = 27.0, **other: Any) -> dict[str, Any]:
    """Fields of GLOBAL_POSITION_INT at an ENU place."""
    lat, lon = flight.station.picture.fleet.frame.to_geodetic(x, y)
    fields = {"lat": round(float(lat) * 1e7), "lon": round(float(lon) * 1e7), "relative_alt": round(z * 1e3)}
    rest = {"time_boot_ms": 900_000, "alt": round(z * 1e3), "vx": 0, "vy": 0, "vz": 0, "hdg": 0}
    return rest | fields | other


def heartbeat(**other: int) -> dict[str, int]:
    rest = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
    return rest | other


def test_junk_disturbs_nobody(rig: MakeRig) -> None:
    import random

    chance = random.Random(1)
    flight = rig(2).flying()
    for _ in range(100):
        for _ in range(5):
            flight.link.inject(chance.randbytes(chance.randrange(1, 300)), ("sim", chance.randrange(3)))
        flight.link.inject(b"\xfd" * 280, ("somebody", 1))
        flight.step()
    assert flight.station.picture.fleet.intakes[""].counts("memory")["junk bytes"] >= 100 * 280
    assert flight.phases() == {Phase.FLYING}
    assert set(flight.station.picture.fleet.vehicles) == {1, 2}


def test_system_id_0_and_our_own_id_are_no_vehicles(rig: MakeRig) -> None:
    flight = rig(1)
    flight.say("HEARTBEAT", 0, **heartbeat())
    flight.say("HEARTBEAT", 254, **heartbeat())
    flight.run(1.0)
    assert not {0, 254} & set(flight.station.picture.fleet.vehicles)
    assert (
        flight.station.picture.fleet.dropped["system id 0"]
        == flight.station.picture.fleet.dropped["our own system id"]
        == 1
    )
    assert "another station uses our system id 254: change one of them" in flight.texts("station")


@pytest.mark.parametrize(
    ("component", "fields"),
    [
        (190, heartbeat(type=6, autopilot=8)),  # a ground station
        (154, heartbeat(type=26, autopilot=8)),  # a gimbal
        (1, heartbeat(type=18)),  # a companion computer
        (255, heartbeat()),
    ],
)
def test_what_is_no_flight_controller_is_no_vehicle(rig: MakeRig, component: int, fields: dict[str, int]) -> None:
    flight = rig(1)
    flight.say("HEARTBEAT", 77, component=component, **fields)
    flight.run(0.1)
    assert 77 not in flight.station.picture.fleet.vehicles
    assert flight.station.picture.fleet.dropped["not a vehicle"] == 1


def test_nothing_counts_before_the_first_heartbeat(rig: MakeRig) -> None:
    flight = rig(1)
    flight.say("GLOBAL_POSITION_INT", 77, **position(flight, 50.0, 50.0))
    flight.run(0.1)
    assert 77 not in flight.station.picture.fleet.vehicles
    assert flight.station.picture.fleet.dropped["before its first heartbeat"] >= 1


def test_three_hundred_fake_vehicles_are_capped_and_the_fleet_flies_on(rig: MakeRig) -> None:
    flight = rig(2).flying()
    for i in range(300):
        flight.say("HEARTBEAT", i % 256, index=5, **heartbeat())
    flight.run(3.0)
    assert len(flight.station.picture.fleet.vehicles) <= 254
    assert flight.phases() == {Phase.FLYING}
    assert sorted(flight.station.flight.flights.by_id) == [1, 2], "nobody joins a team by saying so"


# ---------------------------------------------------------------- positions


@pytest.mark.parametrize(
    "lie", [{"lat": 0, "lon": 0}, {"lat": 910_000_000}, {"lon": -1_900_000_000}, {"lat": 2**31 - 1}], ids=str
)
def test_impossible_positions_are_not_used(rig: MakeRig, lie: dict[str, int]) -> None:
    flight = rig(1).flying()
    fleet = flight.station.picture.fleet
    before, dropped = fleet.vehicles[1].telemetry.position_m, fleet.dropped["invalid position"]
    flight.sim.silence(0)
    flight.say("GLOBAL_POSITION_INT", 1, **position(flight, 60.0, 170.0, **lie))
    flight.run(0.1)
    assert fleet.vehicles[1].telemetry.position_m == before
    assert fleet.dropped["invalid position"] == dropped + 1


def test_a_jump_is_used_only_once_confirmed(rig: MakeRig) -> None:
    flight = rig(1).ready()
    flight.sim.silence(0)
    vehicle = flight.station.picture.fleet.vehicles[1]
    for k in range(4):
        assert vehicle.telemetry.position_m[0] < 50.0
        flight.say("GLOBAL_POSITION_INT", 1, **position(flight, 5000.0 + k, 0.0))
        flight.run(0.1)
    assert vehicle.telemetry.position_m[0] == pytest.approx(5003.0, abs=0.1)
    assert flight.station.picture.fleet.dropped["implausible position"] == 3
    assert "position jumped: not used until confirmed" in flight.texts("vehicle 1")


def test_jumps_that_contradict_each_other_are_never_used(rig: MakeRig) -> None:
    flight = rig(1).ready()
    flight.sim.silence(0)
    vehicle = flight.station.picture.fleet.vehicles[1]
    for k in range(12):
        flight.say("GLOBAL_POSITION_INT", 1, **position(flight, 5000.0 * (-1) ** k, 3000.0 * k))
        flight.run(0.1)
        assert math.hypot(*vehicle.telemetry.position_m[:2]) < 300.0
    assert flight.station.picture.fleet.dropped["implausible position"] == 12


# ---------------------------------------------------------------- impostors


def test_a_second_source_of_one_id_is_not_heard(rig: MakeRig) -> None:
    flight = rig(2).flying()
    before = flight.station.picture.fleet.vehicles[1].telemetry.position_m
    for _ in range(20):
        flight.say("HEARTBEAT", 1, index=9, **heartbeat(custom_mode=6))
        flight.say("GLOBAL_POSITION_INT", 1, index=9, **position(flight, 60.0, 200.0))
        flight.run(0.1)
    vehicle = flight.station.picture.fleet.vehicles[1]
    assert vehicle.telemetry.custom_mode == 4
    assert math.dist(before, vehicle.telemetry.position_m) < 30.0
    assert flight.station.picture.fleet.dropped["second source of one system id"] == 40
    said = [t for t in flight.texts("vehicle 1") if "second source" in t]
    assert said == ["a second source uses this system id: its frames are not used"]
    assert flight.phases() == {Phase.FLYING}


def test_a_vehicle_may_move_to_another_address_once_the_old_one_is_silent(rig: MakeRig) -> None:
    flight = rig(1).ready()
    flight.sim.silence(0)
    flight.run(3.2)
    flight.say("HEARTBEAT", 1, index=9, **heartbeat())
    flight.run(0.1)
    assert flight.station.picture.fleet.vehicles[1].address == ("sim", 9)
    assert flight.station.picture.fleet.vehicles[1].freshness(flight.clock.now()) is not Freshness.LOST


def test_acks_meant_for_another_station_are_counted(rig: MakeRig) -> None:
    flight = rig(1).ready()
    flight.say("COMMAND_ACK", 1, command=400, result=0, target_system=255)
    flight.say("COMMAND_ACK", 1, command=400, result=0, target_system=254)
    flight.run(0.1)
    assert flight.station.comms.commands.ignored == {"ack for another station": 1, "ack for nothing asked": 1}


def test_a_camera_of_the_vehicle_does_not_speak_for_its_autopilot(rig: MakeRig) -> None:
    flight = rig(1).flying()
    flight.say("HEARTBEAT", 1, component=100, **heartbeat(custom_mode=6, base_mode=0))
    flight.run(0.1)
    assert flight.station.picture.fleet.vehicles[1].telemetry.armed
    assert flight.phases() == {Phase.FLYING}


# ---------------------------------------------------------------- texts


@pytest.mark.parametrize("text", ["\x1b]0;owned\x07", "\x1b[2J\x1b[H", "a\nb\rc\td", "\u202eevil", "[red]x[/red]"])
def test_escape_sequences_in_status_texts_are_cleaned(rig: MakeRig, text: str) -> None:
    flight = rig(1).ready()
    flight.say("STATUSTEXT", 1, severity=4, text=text.encode()[:50])
    flight.run(0.1)
    last = flight.texts("vehicle 1")[-1]
    assert last and all(c.isprintable() for c in last), repr(last)


def test_long_texts_come_in_chunks_and_are_told_whole(rig: MakeRig) -> None:
    flight = rig(1).ready()
    for index, chunk in enumerate((b"x" * 50, b"y" * 50, b"end")):
        flight.say("STATUSTEXT", 1, severity=4, text=chunk, id=7, chunk_seq=index)
    flight.say("STATUSTEXT", 1, severity=4, text=b"lost" * 12 + b"ab", id=8, chunk_seq=1)
    flight.run(2.0)
    assert flight.texts("vehicle 1")[-2:] == ["x" * 50 + "y" * 50 + "end", " ... " + "lost" * 12 + "ab"]


def test_a_flood_of_one_text_is_told_once_in_five_seconds(rig: MakeRig) -> None:
    flight = rig(1).ready()
    count = len(flight.texts())
    for _ in range(200):
        flight.say("STATUSTEXT", 1, severity=9, text=b"same")
    flight.run(1.0)
    assert len(flight.texts()) == count + 1
    assert flight.events()[-1].severity == 5, "a severity that does not exist is a notice"


# ---------------------------------------------------------------- freshness, reboot


def test_fresh_stale_lost(rig: MakeRig) -> None:
    flight = rig(1).ready()
    vehicle = flight.station.picture.fleet.vehicles[1]
    assert vehicle.freshness(flight.clock.now()) is Freshness.OK
    flight.sim.silence(0)
    flight.run(3.3)
    assert vehicle.freshness(flight.clock.now()) is Freshness.STALE
    flight.run(0.6)
    assert vehicle.freshness(flight.clock.now()) is Freshness.LOST
    assert "LOST: nothing heard for 3.5 s" in flight.texts("vehicle 1")
    flight.sim.unsilence(0)
    flight.run(2.0)
    assert vehicle.freshness(flight.clock.now()) is Freshness.OK
    assert "heard again" in flight.texts("vehicle 1")


def test_after_a_reboot_it_is_asked_for_its_messages_again(rig: MakeRig) -> None:
    flight = rig(1).run(20.0)
    asked = len(flight.sent_to(1, "COMMAND_LONG"))
    flight.sim._pilots[0].restart(flight.sim._now_us)
    flight.run(10.0)
    vehicle = flight.station.picture.fleet.vehicles[1]
    assert vehicle.integrity.reboots == 1 and "rebooted" in flight.texts("vehicle 1")
    assert len(flight.sent_to(1, "COMMAND_LONG")) >= asked + 6
    assert vehicle.freshness(flight.clock.now()) is Freshness.OK
    assert vehicle.identity.identified


def test_loss_is_counted_from_sequence_numbers(rig: MakeRig) -> None:
    import random

    chance = random.Random(5)
    flight = rig(1).ready()
    flight.loses = lambda way, index: way == "up" and chance.random() < 0.3
    flight.run(300.0)
    assert flight.station.picture.fleet.vehicles[1].loss_pct == pytest.approx(30.0, abs=4.0)


def test_what_the_status_says_of_it(rig: MakeRig) -> None:
    flight = rig(1).ready()
    for _ in range(3):
        flight.say("HEARTBEAT", 0, **heartbeat())
    flight.run(1.0)

    status = m.decode(m.encode(flight.station.publisher.status()), m.StationStatus)
    assert status.dropped["system id 0"] == 3
