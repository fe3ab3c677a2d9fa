"""Where other stations may send a vehicle, and by which missions. See `forward_rig` for the area."""

import math

import pytest

from tests.core.rigs.forward_questions import (
    ARDUCOPTER,
    HERE_INT,
    NAN,
    PX4,
    ask,
    flying,
    item,
    landed,
    long,
    placed,
    said,
    upload,
)
from tests.core.rigs.forward_rig import HOME_AMSL_M, LOCAL, vehicle
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.request_checks import ForeignRequest

# ---------------------------------------------------------------- places and heights


@pytest.mark.parametrize(
    ("place", "word"),
    [
        ((80.0, 50.0, 30.0), "reposition"),
        ((80.0, 50.0, 19.6), "reposition"),
        ((250.0, 50.0, 30.0), "no: (250, 50) m is outside the operating area"),
        ((100.0, 100.0, 30.0), "no: (100, 100) m is outside the operating area"),  # the pond
        ((150.0, 150.0, 30.0), "no: the straight way there leaves the operating area"),  # over the pond
        ((80.0, 50.0, 5.0), "no: 5.0 m above home is outside the altitude band 20-90 m"),
        ((80.0, 50.0, 500.0), "no: 500.0 m above home is outside the altitude band 20-90 m"),
        ((80.0, 50.0, -math.inf), "no: -inf m above home is outside the altitude band 20-90 m"),
    ],
)
def test_a_reposition_ends_inside_the_area_and_its_band(place: tuple[float, float, float], word: str) -> None:
    assert said(placed(flying(), 192, *place)) == word


def test_heights_are_read_as_the_autopilot_reads_them() -> None:
    sea = HOME_AMSL_M + 30.0
    assert said(placed(flying(), 192, 80, 50, sea, frame=0)) == "reposition"
    assert said(placed(flying(), 192, 80, 50, sea, frame=6)).startswith("no: 518.0 m above home")
    assert said(placed(flying(PX4), 192, 80, 50, sea, frame=0)) == "reposition"
    assert said(placed(flying(PX4), 192, 80, 50, 30.0, frame=6)).startswith("no: PX4 takes every height as above sea")
    assert said(placed(flying(), 192, 80, 50, 30.0, frame=11)).startswith("no: heights in frame 11 cannot be checked")
    lat, lon = LOCAL.to_geodetic(80.0, 50.0)
    assert said(long(flying(PX4), 192, -1, 1, 0, NAN, lat, lon, sea)) == "reposition"
    assert said(long(flying(PX4), 192, -1, 1, 0, NAN, lat, lon, 30.0)).startswith("no: -458.0 m above home")
    stranger = flying(autopilot=0)
    assert said(long(stranger, 192, -1, 1, 0, NAN, lat, lon, 30.0)) == (
        "no: how this autopilot takes the height is not known"
    )


def test_a_reposition_of_a_vehicle_whose_place_is_not_known_is_refused() -> None:
    lost = flying()
    lost.telemetry.position_m = (NAN, NAN, NAN)
    assert said(placed(lost, 192, 80, 50, 30.0)) == "no: where it is, is not known"
    deaf = flying()
    deaf.telemetry.fix = ()
    assert said(placed(deaf, 192, 80, 50, 518.0, frame=0)).startswith("no: its home's height above sea level")


def test_a_reposition_may_lead_back_inside_and_change_only_the_height() -> None:
    outside = flying()
    outside.telemetry.position_m = (-50.0, 50.0, 30.0)
    assert said(placed(outside, 192, 80, 50, 30.0)) == "reposition"
    higher = ask("COMMAND_INT", flying(), command=192, x=HERE_INT, y=HERE_INT, z=60.0, param1=-1, param2=1,
                 param3=0, param4=NAN)  # fmt: skip
    assert said(higher) == "reposition"
    assert said(long(flying(PX4), 192, -1, 1, 0, NAN, NAN, 8.5, 518.0)) == "no: its latitude and longitude are no place"


def test_a_reposition_keeps_clear_of_others() -> None:
    there, near = vehicle(2, ARDUCOPTER, (80.0, 50.0, 32.0)), vehicle(2, ARDUCOPTER, (65.0, 51.0, 32.0))
    parked = vehicle(2, ARDUCOPTER, (80.0, 50.0, 30.0), armed=False)
    assert said(placed(flying(), 192, 80, 50, 30.0, there)) == "no: vehicle 2 is there"
    assert said(placed(flying(), 192, 95, 50, 30.0, near)).startswith("no: too close to vehicle 2 in")
    assert said(placed(flying(), 192, 80, 50, 30.0, parked)) == "reposition"
    assert said(placed(flying(), 192, 55, 50, 30.0)) == "reposition", "of itself it need not keep clear"


def test_a_reposition_is_no_faster_than_allowed_and_circles_inside() -> None:
    assert said(placed(flying(), 192, 80, 50, 30.0, param1=20.0)) == "no: 20.0 m/s asked, 8.0 allowed"
    assert said(placed(flying(), 192, 80, 50, 30.0, param3=60.0)).startswith("no: a circle of 60 m about (80, 50) m")
    assert said(placed(flying(), 192, 80, 50, 30.0, param3=NAN)) == "reposition"


@pytest.mark.parametrize(
    ("who", "params", "word"),
    [
        (landed(), (0, 0, 0, 0, 0, 0, 30.0), "take-off"),
        (landed(), (0, 0, 0, 0, 0, 0, 91.0), "no: 91.0 m above home is outside"),
        (landed(), (0, 0, 0, 0, 0, 0, NAN), "no: nan m above home is outside"),
        (landed(PX4), (-1, 0, 0, NAN, NAN, NAN, HOME_AMSL_M + 30.0), "take-off"),
        (landed(PX4), (-1, 0, 0, NAN, NAN, NAN, NAN), "take-off"),  # its own default height
        (landed(PX4), (-1, 0, 0, NAN, NAN, NAN, 30.0), "no: -458.0 m above home is outside"),
        (landed(PX4), (-1, 0, 0, NAN, 0, 0, HOME_AMSL_M + 30.0), "no: (-"),  # it would fly to 0° N 0° E
        (vehicle(1, ARDUCOPTER, (500.0, 50.0, 0.0), armed=False), (0,) * 6 + (30.0,), "no: (500, 50) m is outside"),
    ],
)
def test_take_off(who: Vehicle, params: tuple[float, ...], word: str) -> None:
    assert said(long(who, 22, *params)).startswith(word)


# ---------------------------------------------------------------- missions


def test_missions_are_read_and_written_but_the_fence_is_ours() -> None:
    who = flying()
    assert said(ask("MISSION_REQUEST_LIST", who, mission_type=1)) == "mission read"
    assert said(ask("MISSION_COUNT", who, count=5)) == "mission upload"
    assert said(ask("MISSION_CLEAR_ALL", who)) == "mission clear"
    for kind in (1, 255):
        for name in ("MISSION_COUNT", "MISSION_CLEAR_ALL", "MISSION_WRITE_PARTIAL_LIST", "MISSION_ITEM_INT"):
            assert said(ask(name, who, mission_type=kind)) == "no: would change the fence"
    assert said(ask("MISSION_COUNT", who, mission_type=7)) == "no: unknown mission type 7"


@pytest.mark.parametrize(
    ("asked", "word"),
    [
        (item(16, 80, 50, 30.0), "mission upload item"),
        (item(16, 80, 50, HOME_AMSL_M + 30.0, frame=0), "mission upload item"),
        (item(20, 0, 0, 0.0, frame=2), "mission upload item"),
        (item(177, 0, 0, 0.0, frame=2), "mission upload item"),
        (item(177, 0, 0, 0.0, frame=2, param1=5.0), "no: mission item 1: jumps only back"),
        (item(177, 0, 0, 0.0, frame=2, param1=NAN), "no: mission item 1: nan is no whole number"),
        (item(601, 0, 0, 0.0, frame=2), "no: mission item 1: command 601: not on the list"),
        (item(82, 80, 50, 30.0), "no: mission item 1: command 82: not on the list"),  # a curve is no straight way
        (item(21, 80, 50, 0.0), "mission upload item"),
        (item(22, 80, 50, 15.0), "mission upload item"),
        (item(5100, 80, 50, 30.0, mission_type=2), "mission upload item"),
        (item(16, 300, 50, 30.0), "no: mission item 1: (300, 50) m is outside the operating area"),
        (item(5100, 300, 50, 30.0, mission_type=2), "no: mission item 1: (300, 50) m is outside the operating area"),
        (item(21, 100, 100, 0.0), "no: mission item 1: (100, 100) m is outside the operating area"),
        (item(16, 80, 50, 10.0), "no: mission item 1: 10.0 m above home is outside"),
        (item(16, 80, 50, NAN), "no: mission item 1: nan m above home is outside"),
        (item(16, 80, 50, 30.0, frame=10), "no: mission item 1: heights in frame 10 cannot be checked"),
        (item(16, 80, 50, 30.0, frame=1), "no: mission item 1: heights in frame 1 cannot be checked"),
        (item(18, 80, 50, 30.0, param3=-60.0), "no: mission item 1: a circle of 60 m about (80, 50) m leaves"),
        (item(17, 80, 50, 30.0, param3=NAN), "no: mission item 1: a circle of nan m"),
        (item(178, 0, 0, 0.0, param2=30.0), "no: mission item 1: 30.0 m/s asked, 8.0 allowed"),
        (item(185, 0, 0, 0.0), "no: mission item 1: command 185: not on the list"),
        (item(179, 0, 0, 0.0), "no: mission item 1: command 179: not on the list"),
        (item(16, 80, 50, 30.0, current=2), "no: a guided way-point is a set-point"),
        (item(16, 80, 50, 30.0, seq=0, current=3), "no: a guided way-point is a set-point"),
    ],
)
def test_items_lead_only_where_vehicles_may_be(asked: ForeignRequest, word: str) -> None:
    assert said(asked).startswith(word)


def test_the_first_item_is_home_for_arducopter_only() -> None:
    home = {"seq": 0, "frame": 0}
    assert said(item(16, 900, 900, 488.0, **home)) == "mission upload item"
    assert said(item(16, 900, 900, 488.0, flying(PX4), **home)).startswith("no: mission item 0")
    assert said(item(21, 900, 900, 488.0, **home)).startswith("no: mission item 0")
    assert said(item(16, 900, 900, 488.0, mission_type=2, **home)).startswith("no: mission item 0")


def test_landing_at_0_0_is_here_for_arducopter_and_in_the_atlantic_for_px4() -> None:
    nowhere = {"x": 0, "y": 0, "z": 30.0} | {f"param{i}": 0.0 for i in range(1, 5)}
    assert said(ask("MISSION_ITEM_INT", flying(), upload=upload(1), command=21, **nowhere)) == "mission upload item"
    assert "outside the operating area" in said(ask("MISSION_ITEM_INT", flying(PX4), command=21, **nowhere))
    assert "outside the operating area" in said(ask("MISSION_ITEM_INT", flying(), command=16, **nowhere))


def test_old_items_have_degrees() -> None:
    lat, lon = LOCAL.to_geodetic(80.0, 50.0)
    params = {f"param{i}": 0.0 for i in range(1, 5)}
    old = ask("MISSION_ITEM", flying(), upload=upload(1), command=16, frame=3, x=lat, y=lon, z=30.0, **params)
    assert said(old) == "mission upload item"
    assert "no place" in said(ask("MISSION_ITEM", flying(), command=16, frame=3, x=95.0, y=lon, z=30.0, **params))
