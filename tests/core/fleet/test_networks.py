"""Several networks, each with ids of its own, and links over satellites."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs import orders
from tests.core.rigs.wires import Wire, Wired
from tui_gcs.core.fleet.vehicle import Signing
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.signing import SigningKey, ticks
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Freshness
from tui_gcs.core.signing.keystore import KeyStore

MakeWired = Callable[..., Wired]
SECRET = bytes(range(1, 33))
BEAT = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}


def only(number: int) -> Callable[[int, int], Address | None]:
    return lambda fleet, index: (f"fleet {number}", index) if fleet == number else None


def two_networks(wired: MakeWired, **options: Any) -> Wired:
    """Vehicle 1 of the scenario on the first network, another vehicle 1 on the network "north"."""
    wires = [Wire("south", place=only(0)), Wire("north", place=only(1), network="north")]
    flight = wired(1, wires=wires, **options)
    flight.stranger()
    return flight.run(15.0)


# ---------------------------------------------------------------- networks


def test_one_id_on_two_networks_is_two_vehicles_and_no_conflict(wired: MakeWired) -> None:
    flight = two_networks(wired)
    assert sorted(flight.station.picture.fleet.vehicles) == [1, 1001]
    assert [flight.vehicle(v).network for v in (1, 1001)] == ["", "north"]
    assert not flight.vehicle(1).identity.blocked and not flight.vehicle(1001).identity.blocked
    assert flight.vehicle(1).identity.uid != flight.vehicle(1001).identity.uid
    assert flight.station.picture.fleet.dropped["second source of one system id"] == 0
    assert [link.network for link in flight.status().links] == ["", "north"]


def test_commands_go_to_the_vehicle_on_its_own_network_only(wired: MakeWired) -> None:
    flight = two_networks(wired)
    south, north = flight.wires
    since_s = flight.clock.now()
    flight.station.comms.commands.submit(orders.land(flight, 1001))
    flight.run(2.0)
    assert 176 in flight.commands(north, since_s) and 176 not in flight.commands(south, since_s)
    assert int(flight.fleets[1].mode[0]) == 9 and int(flight.fleets[0].mode[0]) != 9
    assert flight.vehicle(1001).telemetry.custom_mode == 9 and flight.vehicle(1).telemetry.custom_mode != 9


def test_an_ack_on_one_network_does_not_answer_for_the_other(wired: MakeWired) -> None:
    flight = two_networks(wired)
    flight.remove(1)
    done: list[str] = []
    action = orders.speed(flight, 1001, 5.0)
    action.on_done = lambda _, outcome, why: done.append(outcome.value)
    flight.station.comms.commands.submit(action)
    flight.wires[0].link.inject(
        Encoder(1, 1).encode("COMMAND_ACK", command=178, result=0, target_system=254), ("fleet 0", 0)
    )
    flight.run(1.0)
    assert not done


def test_keys_belong_to_a_network(wired: MakeWired, tmp_path: Path) -> None:
    keys = KeyStore(tmp_path / "keys")
    keys.add(SigningKey("field", SECRET))
    keys.assign("field", "north", 1)
    wires = [Wire("south", place=only(0)), Wire("north", place=only(1), network="north")]
    flight = wired(1, wires=wires, keys=keys)
    flight.stranger()
    flight.fleets[1].set_key(0, SECRET, ticks(flight.clock.wall()))
    flight.run(15.0)
    assert (flight.vehicle(1).identity.signing, flight.vehicle(1001).identity.signing) == (
        Signing.UNSIGNED,
        Signing.OURS,
    )
    assert flight.vehicle(1001).identity.identified and not flight.vehicle(1).identity.keyed


@pytest.mark.parametrize("network", ["", "north"])
def test_each_network_has_room_for_a_whole_id_space_and_no_more(wired: MakeWired, network: str) -> None:
    wires = [Wire("south"), Wire("north", network="north")]
    flight = wired(1, wires=wires).run(2.0)
    wire = wires[0] if network == "" else wires[1]
    for _ in range(20):
        for system in range(256):
            for component in (1, 2):
                wire.link.inject(Encoder(system, component).encode("HEARTBEAT", **BEAT), ("flood", system % 7))
        flight.run(0.2)
    vehicles = flight.station.picture.fleet.vehicles.values()
    assert 64 <= sum(v.network == network for v in vehicles) <= 255 + 64
    assert sum(v.network != network for v in vehicles) == 1
    assert flight.vehicle(1).freshness(flight.clock.now()) is Freshness.OK


# ---------------------------------------------------------------- satellites


def high_latency(flight: Wired, age_s: float = 0.0, **fields: Any) -> bytes:
    """HIGH_LATENCY2 of vehicle 1 as it was `age_s` ago."""
    frame = flight.station.picture.fleet.frame
    lat, lon = frame.to_geodetic(50.0, 200.0)
    said: dict[str, Any] = {
        "timestamp": round((flight.clock.now() - age_s) * 1e3),
        "type": 2, "autopilot": 3, "custom_mode": 4,
        "latitude": round(float(lat) * 1e7), "longitude": round(float(lon) * 1e7),
        "altitude": 140, "target_altitude": 140,
        "heading": 45, "target_heading": 45, "target_distance": 0, "throttle": 50, "airspeed": 0, "airspeed_sp": 0,
        "groundspeed": 10, "windspeed": 0, "wind_heading": 0, "eph": 10, "epv": 10, "temperature_air": 20,
        "climb_rate": 0, "battery": 71, "wp_num": 0, "failure_flags": 0, "custom0": 0, "custom1": 0, "custom2": 0,
    }  # fmt: skip
    return Encoder(1, 1).encode("HIGH_LATENCY2", **said | fields)


def test_a_vehicle_heard_over_a_satellite_only_is_shown_and_left_in_peace(wired: MakeWired) -> None:
    satellite = Wire("satellite", high_latency=True, place=lambda fleet, index: None)
    flight = wired(1, wires=[satellite])
    flight.station.comms.uplink._token = (
        ""  # nobody can prove over a satellite that he is one of our simulated vehicles
    )
    for _ in range(6):
        satellite.link.inject(high_latency(flight), ("modem", 1))
        flight.run(20.0)
        vehicle = flight.vehicle()
        assert vehicle.freshness(flight.clock.now()) is Freshness.OK
    assert vehicle.telemetry.battery_pct == 71.0 and vehicle.telemetry.position_m[:2] == pytest.approx(
        (50.0, 200.0), abs=0.1
    )
    assert vehicle.telemetry.custom_mode == 4
    assert satellite.seen == [], "no heartbeat, no request for rates, nobody asks who it is"
    orders.land(flight, 1).send(0)
    flight.run(0.1)
    assert flight.commands(satellite) == [176]
    assert flight.frame is not None and flight.frame.freshness[0] is Freshness.OK
    flight.run(95.0)
    assert vehicle.freshness(flight.clock.now()) is not Freshness.LOST
    flight.run(10.0)
    assert vehicle.freshness(flight.clock.now()) is Freshness.LOST
    assert any(text.startswith("LOST: nothing heard for") for text in flight.texts("vehicle 1"))


def test_it_cannot_be_started_over_a_satellite(wired: MakeWired) -> None:
    satellite = Wire("satellite", high_latency=True, place=lambda fleet, index: None)
    flight = wired(1, wires=[satellite])
    satellite.link.inject(high_latency(flight), ("modem", 1))
    flight.run(3.0)
    assert not flight.ask(m.Start(vehicles=(1,))).ok


def with_satellite(wired: MakeWired) -> tuple[Wired, Wire, Wire]:
    near = Wire("near")
    satellite = Wire("satellite", high_latency=True, place=lambda fleet, index: None)
    return wired(1, wires=[near, satellite]).run(40.0), near, satellite


def test_a_satellite_beside_a_normal_link_changes_nothing_while_that_works(wired: MakeWired) -> None:
    flight, _, satellite = with_satellite(wired)
    place = flight.vehicle().telemetry.position_m
    for k in range(60):
        if k % 10 == 0:
            satellite.link.inject(high_latency(flight, age_s=5.0, battery=12), ("modem", 1))
        flight.run(1.0)
        assert flight.vehicle().link == "near" and not flight.vehicle().why_not_commanded
        assert flight.vehicle().telemetry.position_m == pytest.approx(place, abs=1.0)
        assert flight.vehicle().telemetry.battery_pct != 12.0
    assert [p.source.link for p in flight.vehicle().used_paths()] == ["near", "satellite"]
    assert satellite.seen == []


def test_when_the_normal_link_dies_the_satellite_takes_over_without_flapping(wired: MakeWired) -> None:
    flight, near, satellite = with_satellite(wired)
    satellite.link.inject(high_latency(flight), ("modem", 1))
    flight.run(5.0)
    near.up = False
    flight.run(5.0)
    satellite.link.inject(high_latency(flight, age_s=30.0, battery=12), ("modem", 1))
    flight.run(0.5)
    assert flight.vehicle().telemetry.battery_pct != 12.0, "that is older than what we know"
    for _ in range(4):
        satellite.link.inject(high_latency(flight, age_s=1.0, battery=55), ("modem", 1))
        flight.run(20.0)
        assert flight.vehicle().freshness(flight.clock.now()) is Freshness.OK
    assert flight.vehicle().link == "satellite" and flight.vehicle().telemetry.battery_pct == 55.0
    orders.land(flight, 1).send(0)
    flight.run(0.1)
    assert flight.commands(satellite) == [176] and set(flight.names(satellite)) == {"COMMAND_LONG"}
    near.up = True
    flight.until(lambda: flight.vehicle().link == "near", 2.0)
    flight.run(10.0)
    assert flight.vehicle().freshness(flight.clock.now()) is Freshness.OK and flight.vehicle().integrity.reboots == 0
    assert not [text for text in flight.texts("vehicle 1") if "LOST" in text or "DUPLICATE" in text]


def test_a_normal_link_to_a_vehicle_known_by_satellite_is_taken_at_once(wired: MakeWired) -> None:
    near = Wire("near", up=False)
    satellite = Wire("satellite", high_latency=True, place=lambda fleet, index: None)
    flight = wired(1, wires=[near, satellite]).run(15.0)
    satellite.link.inject(high_latency(flight), ("modem", 1))
    flight.run(10.0)
    assert flight.vehicle().link == "satellite"
    near.up = True
    flight.until(lambda: flight.vehicle().link == "near", 3.0)
    flight.run(5.0)
    satellite.link.inject(high_latency(flight), ("modem", 1))
    flight.run(10.0)
    assert not flight.vehicle().why_not_commanded and flight.vehicle().identity.identified
    assert len(flight.vehicle().used_paths()) == 2 and not flight.vehicle().identity.blocked
