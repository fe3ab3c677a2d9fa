"""Places as they are typed."""

import math

import pytest

from tests.core.rigs.rig import scenario
from tui_gcs.actions.places import PlaceReferences, PlaceTextError, destinations
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.protocol.common import Freshness, Phase, VehicleRow

NAN = math.nan


def row(vehicle: int, place: tuple[float, float, float]) -> VehicleRow:
    values = dict.fromkeys(VehicleRow._fields, 0)
    values |= {"id": vehicle, "position_m": place, "phase": Phase.FLYING, "freshness": Freshness.OK}
    return VehicleRow(**values)  # type: ignore[arg-type]


AROUND = PlaceReferences(
    {1: row(1, (10.0, 20.0, 30.0)), 2: row(2, (30.0, 20.0, 34.0)), 3: row(3, (NAN, NAN, NAN))},
    {"north field": (450.0, 200.0)},
    LocalFrame(scenario().origin),
    (7.0, 8.0),
)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("450 200", (450.0, 200.0, NAN)),
        ("450, 200, 35", (450.0, 200.0, 35.0)),
        ("-5 0", (5.0, 20.0, NAN)),
        ("+5 -2 +3", (15.0, 18.0, 33.0)),
        ("+5 -2 40", (15.0, 18.0, 40.0)),
        ("v2 +1 0", (31.0, 20.0, NAN)),
        ("zone North Field", (450.0, 200.0, NAN)),
        ("zone north field -50 0 25", (400.0, 200.0, 25.0)),
        ("cursor", (7.0, 8.0, NAN)),
    ],
)
def test_a_place_for_one_vehicle(text: str, place: tuple[float, float, float]) -> None:
    assert destinations(text, (1,), AROUND).points_m[1] == pytest.approx(place, nan_ok=True)


def test_degrees_have_letters_so_that_nobody_takes_metres_for_them() -> None:
    origin = scenario().origin
    text = f"{origin.lat_deg}N {abs(origin.lon_deg)}{'W' if origin.lon_deg < 0 else 'E'} 30"
    assert destinations(text, (1,), AROUND).points_m[1] == pytest.approx((0.0, 0.0, 30.0), abs=0.1)


def test_several_keep_their_formation_about_the_place() -> None:
    points = destinations("100 100 30", (1, 2), AROUND).points_m
    assert points == {1: (90.0, 100.0, 30.0), 2: (110.0, 100.0, 30.0)}


def test_home_is_each_vehicles_own() -> None:
    found = destinations("home +5 0 20", (1, 2), AROUND)
    assert found.from_home and found.points_m == {1: (5.0, 0.0, 20.0), 2: (5.0, 0.0, 20.0)}


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "no such place"),
        ("450", "no such place"),
        ("v9", "position of vehicle 9 is not known"),
        ("v3", "position of vehicle 3 is not known"),
        ("zone nowhere", "there are: north field"),
        ("zone north field x", "is no offset"),
        ("100N 5E", "no such latitude"),
        ("450 200 +5", "a height with a sign is relative"),
    ],
)
def test_what_is_no_place_says_so(text: str, why: str) -> None:
    with pytest.raises(PlaceTextError, match=why):
        destinations(text, (1,), AROUND)
