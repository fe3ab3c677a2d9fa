"""Aircraft heard by ADS-B: the newest of each, bounded, with nothing invented."""

import math
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.services.payload.traffic import FORGOTTEN_S, MAX_TRACKS, TrafficService

ALL_KNOWN = 0x19F
HERE: dict[str, Any] = {
    "ICAO_address": 0xABCDEF,
    "lat": 474_000_000,
    "lon": 85_500_000,
    "altitude_type": 1,
    "altitude": 1_200_000,
    "heading": 9_000,
    "hor_velocity": 5_000,
    "ver_velocity": -200,
    "callsign": b"SWR123 ",
    "emitter_type": 3,
    "tslc": 2,
    "flags": ALL_KNOWN | 32,
    "squawk": 7000,
}


@pytest.fixture
def rig(tmp_path: Path) -> ServiceRig:
    return ServiceRig(tmp_path, Peer(1), Peer(2)).heard()


def traffic(rig: ServiceRig, system: int = 1, **fields: Any) -> TrafficService:
    rig.peers[system].say("ADSB_VEHICLE", **(HERE | fields))
    rig.run(0.1)
    service: TrafficService = rig.station.services.traffic
    return service


def test_one_aircraft(rig: ServiceRig) -> None:
    (track,) = traffic(rig).tracks()
    assert (track.icao, track.callsign, track.squawk) == (0xABCDEF, "SWR123", 7000)
    assert (track.alt_m, track.heading_deg, track.speed_m_s, track.climb_m_s) == (1200.0, 90.0, 50.0, -2.0)
    assert (
        track.lat_deg == pytest.approx(47.4)
        and math.dist(track.position_m[:2], rig.vehicle().telemetry.position_m[:2]) < 5000
    )
    assert track.heard_by == 1 and track.is_geometric and not track.simulated
    assert rig.clock.now() - track.seen_s == pytest.approx(2.1, abs=0.1)


def test_what_is_not_known_is_not_invented(rig: ServiceRig) -> None:
    (track,) = traffic(rig, flags=1, callsign=b"EVIL").tracks()
    assert track.callsign == "" and track.squawk == 0
    assert all(math.isnan(v) for v in (track.alt_m, track.heading_deg, track.speed_m_s, track.climb_m_s))


@pytest.mark.parametrize(
    "fields", [{"flags": 0}, {"lat": 0, "lon": 0}, {"lat": 910_000_000}, {"lon": 2**31 - 1}], ids=str
)
def test_no_place_no_track(rig: ServiceRig, fields: dict[str, int]) -> None:
    service = traffic(rig, **fields)
    assert not service.tracks() and service.dropped["traffic without a place"] == 1


def test_impossible_numbers_are_unknown(rig: ServiceRig) -> None:
    (track,) = traffic(rig, altitude=2**31 - 1, heading=65535).tracks()
    assert math.isnan(track.alt_m) and math.isnan(track.heading_deg)


def test_two_vehicles_hear_the_same_aircraft_once(rig: ServiceRig) -> None:
    traffic(rig, 1, lat=474_000_000, tslc=0)
    (track,) = traffic(rig, 2, lat=473_000_000, tslc=20).tracks()
    assert track.heard_by == 1 and track.lat_deg == pytest.approx(47.4), "what was heard later counts"


def test_aircraft_leave_the_table_after_a_minute(rig: ServiceRig) -> None:
    service = traffic(rig, tslc=0)
    rig.run(FORGOTTEN_S - 1)
    assert service.tracks()
    rig.run(2.0)
    assert not service.tracks()


def test_b6_106_ten_thousand_aircraft(rig: ServiceRig) -> None:
    for icao in range(10_000):
        rig.peers[1].say("ADSB_VEHICLE", **(HERE | {"ICAO_address": icao, "tslc": 0}))
        if icao % 500 == 499:
            rig.step()
    rig.run(0.2)
    service = rig.station.services.traffic
    assert [track.icao for track in service.tracks()] == list(range(10_000 - MAX_TRACKS, 10_000))
    assert service.dropped["traffic table full"] == 10_000 - MAX_TRACKS


def test_a_receiver_that_is_a_component_of_its_own_is_heard(rig: ServiceRig) -> None:
    rig.peers[1].out.append(Encoder(1, 156).encode("ADSB_VEHICLE", **HERE))
    rig.run(0.1)
    assert len(rig.station.services.traffic.tracks()) == 1


def test_a_vehicle_is_asked_to_send_traffic_only_by_an_order(rig: ServiceRig) -> None:
    def asked() -> list[float]:
        return [f["param2"] for f in rig.peers[1].got("COMMAND_LONG") if f["command"] == 511 and f["param1"] == 246]

    assert not asked()
    rig.station.services.traffic.listen(1)
    rig.run(1.0)
    assert asked() == [200_000.0]
