"""TERRAIN_REQUEST: answered block by block from the operator's terrain file, never with a guess."""

from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest

from tests.core.rigs.wires import Wire, Wired
from tui_gcs.core.geometry.elevation import Elevation, ElevationGrid
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.mavlink.encode import Encoder

MakeWired = Callable[..., Wired]
CORNER_DEG = (52.05, -0.65)
ALL_BLOCKS = (1 << 56) - 1


def slope(*, known_to_deg: float = 1.0) -> Elevation:
    """Ground that rises by 1000 m for each degree to the north and by 100 m for each degree to the east."""
    rows, columns = np.mgrid[0:101, 0:101] * 0.01
    heights_m = 1000.0 * rows + 100.0 * columns
    heights_m[rows > known_to_deg] = np.nan
    return Elevation("slope.asc", [ElevationGrid(51.5, -1.0, 0.01, 0.01, heights_m)])


def flight_over(wired: MakeWired, elevation: Elevation | None, vehicles: int = 1) -> Wired:
    flight = wired(vehicles, wires=[Wire("near")])
    flight.station.config.elevation = elevation
    flight.boot_station()
    return flight.run(12.0)


def request(
    flight: Wired, mask: int = ALL_BLOCKS, lat_deg: float = CORNER_DEG[0], spacing_m: int = 100, vehicle: int = 1
) -> None:
    place = {"lat": round(lat_deg * 1e7), "lon": round(CORNER_DEG[1] * 1e7)}
    raw = Encoder(vehicle, 1).encode("TERRAIN_REQUEST", **place, grid_spacing=spacing_m, mask=mask)
    flight.wires[0].link.inject(raw, ("sim", vehicle - 1))


def answers(flight: Wired, since_s: float) -> list[dict[str, object]]:
    # It has no field for its target: it is sent to the address of the vehicle that asked.
    return [fields for _, fields in flight.sent_to(0, "TERRAIN_DATA", since_s)]


def test_every_block_of_a_request_is_answered_once(wired: MakeWired) -> None:
    flight = flight_over(wired, slope())
    since_s = flight.clock.now()
    request(flight)
    flight.run(5.0)
    sent = answers(flight, since_s)
    assert [data["gridbit"] for data in sent] == list(range(56))
    assert {(data["lat"], data["lon"], data["grid_spacing"]) for data in sent} == {(520500000, -6500000, 100)}
    # Block 9 is the second to the east in the second row: its second height lies 500 m east and 400 m north.
    lat_deg, lon_deg = LocalFrame(Origin(*CORNER_DEG, 0.0)).to_geodetic(500.0, 400.0)
    assert sent[9]["data"][1] == round(1000 * (lat_deg - 51.5) + 100 * (lon_deg + 1.0))  # type: ignore[index]
    assert sent[9]["data"][4] > sent[9]["data"][1]  # type: ignore[index]
    assert "it takes heights of the ground from slope.asc" in flight.texts("vehicle 1")


def test_only_the_blocks_that_are_asked_for(wired: MakeWired) -> None:
    flight = flight_over(wired, slope())
    since_s = flight.clock.now()
    request(flight, mask=0b101 | 1 << 60)
    flight.run(2.0)
    assert [data["gridbit"] for data in answers(flight, since_s)] == [0, 2]


def test_unknown_ground_is_not_answered_and_counted(wired: MakeWired) -> None:
    flight = flight_over(wired, slope(known_to_deg=0.56))
    since_s = flight.clock.now()
    request(flight)
    flight.run(5.0)
    # Heights are known up to 1112 m north of the corner: the third row of blocks ends at 1100 m.
    rows = {int(data["gridbit"]) // 8 for data in answers(flight, since_s)}  # type: ignore[call-overload]
    assert rows == {0, 1, 2}
    assert flight.station.parts.services.ignored()["terrain request for unknown ground"] == 32


@pytest.mark.parametrize("wrong", [{"lat_deg": 90.0}, {"spacing_m": 0}])
def test_a_request_that_names_no_place_is_counted(wired: MakeWired, wrong: dict[str, float]) -> None:
    flight = flight_over(wired, slope())
    since_s = flight.clock.now()
    request(flight, **wrong)  # type: ignore[arg-type]
    flight.run(1.0)
    assert not answers(flight, since_s)
    assert flight.station.parts.services.ignored()["terrain request without a place"] == 1


def test_asking_in_a_flood_is_no_way_to_a_higher_rate(wired: MakeWired) -> None:
    flight = flight_over(wired, slope())
    since_s = flight.clock.now()
    for _ in range(20):
        for _ in range(50):
            request(flight)
        flight.run(0.05)
    assert len(answers(flight, since_s)) <= 1.0 / 0.02 + 1


def test_without_a_terrain_file_nothing_is_answered(wired: MakeWired) -> None:
    flight = flight_over(wired, None)
    since_s = flight.clock.now()
    request(flight)
    flight.run(2.0)
    assert not answers(flight, since_s)


def test_many_that_ask_at_once_are_served_in_turn(wired: MakeWired, monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight ask for all of their ground, each for another one, which tells the answers apart; three fit into a tick."""
    monkeypatch.setattr("tui_gcs.core.services.terrain.MAX_AT_ONCE", 3)
    flight = flight_over(wired, slope(), vehicles=8)
    since_s = flight.clock.now()
    for vehicle in range(1, 9):
        request(flight, vehicle=vehicle, lat_deg=CORNER_DEG[0] + vehicle / 1000)
    flight.run(2.0)
    served = Counter(data["lat"] for data in answers(flight, since_s))
    assert len(served) == 8 and max(served.values()) - min(served.values()) <= 1
    flight.run(7.0)
    assert Counter(data["lat"] for data in answers(flight, since_s)) == dict.fromkeys(served, 56)
