"""Contacts: distance, bearing, height and closest approach as seen from our vehicles, with any number unknown."""

import math

import pytest
from msgspec.structs import replace

from tests.screens.rigs.fake_station import FakeStation
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.protocol.bus import MemoryBus
from tui_gcs.core.protocol.common import FleetFrame, Track
from tui_gcs.core.protocol.setup import RemoteIdRow, TrafficRow
from tui_gcs.feed.traffic.contacts import Contact, Sighting, contacts, of_remote_ids, of_tracks, of_traffic

NAN = math.nan


def fleet(*places: tuple[float, float, float], velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> FleetFrame:
    station = FakeStation(MemoryBus(), count=len(places))
    frame = station.frame()
    amsl = tuple(100.0 + up for _, _, up in places)
    return replace(frame, position_m=places, velocity_m_s=(velocity,) * len(places), alt_amsl_m=amsl)


def sighting(place: tuple[float, float], velocity: tuple[float, float] = (NAN, NAN), **other: object) -> Sighting:
    usual = {"kind": "track", "name": "@1", "up_m": 50.0, "is_amsl": False, "age_s": 0.0, "seen_by": (1,)}
    return Sighting(place_m=place, velocity_m_s=velocity, **{**usual, **other})


def one(seen: Sighting, frame: FleetFrame | None) -> Contact:
    return contacts([seen], frame)[0]


def test_a_contact_is_seen_from_the_nearest_vehicle() -> None:
    found = one(sighting((0.0, 200.0)), fleet((0.0, 0.0, 30.0), (0.0, 190.0, 30.0)))
    assert (found.nearest, found.distance_m, found.bearing_deg, found.above_m) == (2, 10.0, 0.0, 20.0)
    assert found.approach_of == 0 and found.is_near


def test_the_closest_approach_is_that_of_any_vehicle() -> None:
    found = one(sighting((2000.0, 50.0), (-20.0, 0.0)), fleet((0.0, 0.0, 30.0), (1900.0, 1500.0, 30.0)))
    assert found.nearest == 2
    assert (found.approach_of, found.approach_m, found.approach_s) == (1, 50.0, 100.0)


def test_a_contact_that_flies_away_is_nearest_now() -> None:
    found = one(sighting((500.0, 0.0), (20.0, 0.0)), fleet((0.0, 0.0, 30.0)))
    assert (found.approach_m, found.approach_s) == (500.0, 0.0)


def test_where_it_was_is_moved_on_by_its_age() -> None:
    assert one(sighting((500.0, 0.0), (-10.0, 0.0), age_s=20.0), fleet((0.0, 0.0, 30.0))).distance_m == 300.0


def test_heights_above_the_sea_are_compared_with_heights_above_the_sea() -> None:
    assert one(sighting((10.0, 0.0), up_m=180.0, is_amsl=True), fleet((0.0, 0.0, 30.0))).above_m == 50.0


@pytest.mark.parametrize(("up_m", "near"), [(50.0, True), (NAN, True), (900.0, False)])
def test_an_unknown_height_counts_as_near(up_m: float, near: bool) -> None:
    assert one(sighting((400.0, 0.0), up_m=up_m), fleet((0.0, 0.0, 30.0))).is_near is near


def test_a_simulated_aircraft_is_never_near() -> None:
    assert not one(sighting((4.0, 0.0), is_real=False), fleet((0.0, 0.0, 30.0))).is_near


@pytest.mark.parametrize("frame", [None, fleet(), fleet((NAN, NAN, NAN))], ids=["no frame", "nobody", "no place"])
def test_without_a_place_of_ours_nothing_is_compared(frame: FleetFrame | None) -> None:
    found = one(sighting((0.0, 0.0), (1.0, 1.0)), frame)
    assert found.nearest == 0 and math.isnan(found.distance_m) and not found.is_near


def test_hostile_numbers_are_compared_without_an_error() -> None:
    for place, velocity in (((NAN, NAN), (NAN, NAN)), ((1e38, -1e38), (1e38, 1e38)), ((math.inf, 0.0), (0.0, 0.0))):
        one(sighting(place, velocity), fleet((0.0, 0.0, 30.0)))


def test_the_most_pressing_comes_first() -> None:
    far, soon, near = sighting((9000.0, 0.0)), sighting((3000.0, 0.0), (-30.0, 0.0)), sighting((800.0, 0.0))
    found = contacts([far, near, soon], fleet((0.0, 0.0, 30.0)))
    assert [each.seen for each in found] == [soon, near, far]


def test_all_three_kinds_become_sightings() -> None:
    local = LocalFrame(FakeStation(MemoryBus()).scenario.origin)
    lat_deg, lon_deg = local.to_geodetic(100.0, 200.0)
    track = Track(7, (1.0, 2.0, 3.0), (4.0, 5.0, 0.0), (1.0, 0.0, 1.0), 0.0, 8.0, (2, 3), False)
    adsb = TrafficRow(0xABC, "", lat_deg, lon_deg, 500.0, True, 90.0, 60.0, 0.0, False, 2, 1.0, NAN, NAN)
    remote = RemoteIdRow(0, 3, "ID1", "op", "survey", lat_deg, lon_deg, 90.0, NAN, NAN, None, "", 236, 2.0)
    (seen,) = of_tracks([track], 10.0)
    assert (seen.name, seen.age_s, seen.note) == ("@7", 2.0, "not confirmed")
    (seen,) = of_traffic([adsb], local)
    assert seen.name == "000ABC" and seen.velocity_m_s == pytest.approx((60.0, 0.0), abs=1e-9)
    assert seen.place_m == pytest.approx((100.0, 200.0))
    (seen,) = of_remote_ids([remote, replace(remote, vehicle=1)], local)
    assert seen.note == "operator op, survey, 90 m above the ellipsoid" and math.isnan(seen.up_m)
