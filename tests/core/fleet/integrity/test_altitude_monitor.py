"""Heights that may be wrong: compared with the GPS, reported, and no return at too low a height."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

import pytest

from sitl.ardupilot.telemetry import CopterTelemetry
from tests.core.fleet.integrity.test_position_jump_monitor import alarms, believes
from tests.core.rigs.rig import Rig
from tui_gcs.core.process.state_store import StateStore
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase

MakeRig = Callable[..., Rig]


@contextmanager
def gps_says(flight: Rig, vehicle: int, off_m: float, v_acc_m: float = 0.3) -> Iterator[None]:
    """Its GPS finds it so much higher than it reports; it keeps to what it says (a barometer that is off)."""
    plain = CopterTelemetry.BUILDERS["GPS_RAW_INT"]

    def built(ap: object) -> object:
        fields = plain(ap)  # type: ignore[arg-type]
        if fields is None or ap.spec.system_id != vehicle:  # type: ignore[attr-defined]
            return fields
        return {**fields, "alt": fields.get("alt", 0) + round(1000 * off_m), "v_acc": round(1000 * v_acc_m)}

    with patch.dict(CopterTelemetry.BUILDERS, GPS_RAW_INT=built):
        yield


def test_who_is_lower_than_it_says_is_told_of_and_held(rig: MakeRig) -> None:
    """As flown: a real ArduCopter sank by 20 m when its barometer was off by so much, and said nothing of it."""
    flight = rig(2).flying().run(10.0)
    with gps_says(flight, 1, -20.0):
        flight.run(8.0)
        assert alarms(flight)["height"] == ((1,), "by its GPS it is 20 m lower than it reports")
        assert [flight.phase(1), flight.phase(2)] == [Phase.HOLDING, Phase.FLYING]
    flight.run(8.0)
    assert "height" not in alarms(flight)


@pytest.mark.parametrize(("off_m", "v_acc_m"), [(11.0, 0.3), (-11.0, 0.3), (-20.0, 9.0), (-16.0, 0.0)])
def test_a_gps_knows_heights_only_so_well(rig: MakeRig, off_m: float, v_acc_m: float) -> None:
    flight = rig(2).flying().run(10.0)
    with gps_says(flight, 1, off_m, v_acc_m):
        flight.run(10.0)
        assert "height" not in alarms(flight) and flight.phases() == {Phase.FLYING}


def test_what_a_gps_said_on_the_ground_is_no_difference(rig: MakeRig) -> None:
    """It may have another sea level."""
    flight = rig(2)
    with gps_says(flight, 1, 47.0):
        flight.flying().run(10.0)
        assert "height" not in alarms(flight)


def test_a_return_is_not_too_low_whichever_height_is_right(rig: MakeRig) -> None:
    flight = rig(2).flying().run(10.0)
    layer_m = flight.station.flight.flights.by_id[1].layer_m
    with gps_says(flight, 1, -20.0):
        flight.run(8.0)
        results = flight.ask(m.Return()).results
        assert [result.text for result in results] == [
            "returns 20 m above its layer: its height is in doubt",
            "returns",
        ]
        flight.until(lambda: flight.phase(1) is Phase.LANDING, 120.0, "above its home")
        assert abs(flight.place(1)[2] - layer_m - 20.0) < 1.5
        flight.until(lambda: flight.phases() == {Phase.GROUND}, 120.0, "landed")


def test_a_return_goes_no_higher_than_its_area_for_a_doubt(rig: MakeRig) -> None:
    flight = rig(2).flying().run(10.0)
    ceiling_m = flight.station.active.round.area.alt_max_m
    with gps_says(flight, 1, -200.0):
        flight.run(8.0)
        assert flight.ask(m.Return(vehicles=(1,))).ok
        assert flight.station.flight.flights.by_id[1].home_layer_m == ceiling_m


def test_who_jumped_down_returns_on_its_layer(rig: MakeRig) -> None:
    flight = rig(2).flying().run(10.0)
    believes(flight, 0, (0.0, 0.0, -14.0))
    flight.run(4.0)
    assert alarms(flight)["height"] == ((1,), "it jumped down by 14 m: it may be so much higher than it reports")
    assert flight.ask(m.Return(vehicles=(1,))).results[0].text == "returns"


def test_the_next_station_compares_with_the_same(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(2).flying().run(10.0)
    StateStore(tmp_path / "memory.json").remember(flight.station.parts, flight.station.frontend)
    with gps_says(flight, 1, -20.0):
        flight.restart_station(StateStore(tmp_path / "memory.json"))
        flight.run(12.0)
        assert alarms(flight)["height"] == ((1,), "by its GPS it is 20 m lower than it reports")


def test_who_is_found_in_the_air_is_compared_too(rig: MakeRig, tmp_path: Path) -> None:
    flight = rig(2).flying().run(10.0)
    for off_m, reported in ((-20.0, False), (-30.0, True)):
        with gps_says(flight, 1, off_m):
            flight.restart_station(StateStore(tmp_path / "none.json"))
            flight.run(12.0)
            assert ("height" in alarms(flight)) is reported
