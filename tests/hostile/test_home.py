"""Bad input B.6-64: an impossible home, reported by vehicle 1 itself."""

from collections.abc import Callable

import pytest

from tests.hostile.oracle import Oracle
from tests.hostile.test_telemetry import HOME, to_home, zeros
from tui_gcs.core.firmware.registry import FirmwareRegistry
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Phase
from tui_gcs.core.records.event_log import ALERT

pytestmark = pytest.mark.long  # nearly each is a flight

Attack = Callable[..., Oracle]
AMSL_M = 110.0
"""Of the scenario's ground."""


def tell_home(oracle: Oracle, north_m: float, up_m: float = 0.0, **lie: int) -> None:
    """Vehicle 1 reports its home so far north of where it was, and so much higher."""
    x, y, _ = oracle.twin.station.picture.fleet.vehicles[1].telemetry.home_m
    lat, lon = oracle.flight.station.picture.fleet.frame.to_geodetic(x, y + north_m)
    place = {"latitude": round(float(lat) * 1e7), "longitude": round(float(lon) * 1e7)}
    fields = zeros("HOME_POSITION", altitude=round((AMSL_M + up_m) * 1e3), q=(1.0, 0.0, 0.0, 0.0)) | place | lie
    oracle.say("HOME_POSITION", 1, **fields)
    oracle.run(0.1)


def heights(oracle: Oracle) -> tuple[float, str]:
    """How high the station takes its home to be, and why it does not know."""
    firmware: FirmwareRegistry = oracle.flight.station.comms.firmware
    known = firmware.home(oracle.vehicle)
    return round(known.amsl_m, 3), known.problem


def asks_vehicle_1(address: Address, message: str) -> bool:
    """Its home came so often that its interval was asked for again."""
    return (address, message) == (HOME, "COMMAND_LONG")


@pytest.mark.parametrize("up_m", [0.0, 60.0])
def test_b6_64_a_home_that_jumps_100_km_in_flight(attack: Attack, up_m: float) -> None:
    """It is reported, and nothing is computed from it: neither heights, nor where we bring the vehicle."""
    oracle = attack()
    before = oracle.vehicle.telemetry.home_m, heights(oracle)
    assert before[0] is not None and before[1] == (AMSL_M, "")
    for _ in range(20):
        tell_home(oracle, 100_000.0, up_m)
        assert (oracle.vehicle.telemetry.home_m, heights(oracle)) == before
    assert [e.severity for e in oracle.told("reports a home 100 km away: not used")] == [ALERT]
    oracle.both(lambda rig: rig.ask(m.Return(vehicles=rig.ids)))
    oracle.run(1.0)
    assert oracle.flight.phase(1) is Phase.RETURNING
    oracle.holds(counted="implausible home", sends=asks_vehicle_1)


def test_b6_64_a_home_that_is_nowhere(attack: Attack) -> None:
    oracle = attack()
    before = oracle.vehicle.telemetry.home_m, heights(oracle)
    for lie in ({"latitude": 0, "longitude": 0}, {"latitude": 2**31 - 1}):
        counted = oracle.dropped()["invalid position"]
        tell_home(oracle, 0.0, **lie)
        assert (oracle.vehicle.telemetry.home_m, heights(oracle)) == before, lie
        assert oracle.dropped()["invalid position"] > counted, lie
    oracle.holds(counted="invalid position", told="frames not taken: invalid position")


def test_b6_64_a_home_that_was_moved_in_flight_is_true_and_reported(attack: Attack) -> None:
    """DO_SET_HOME of another station: the vehicle would return there, and count its heights from there."""
    oracle = attack()
    before = oracle.vehicle.telemetry.home_m
    assert before is not None
    tell_home(oracle, 200.0, 30.0)
    assert oracle.vehicle.telemetry.home_m == pytest.approx((before[0], before[1] + 200.0, 0.0), abs=0.1)
    assert "contradict each other" in heights(oracle)[1], "until its position counts from there, too"
    assert [e.severity for e in oracle.told(r"its home moved 200 m, \+30 m in height")] == [ALERT]
    oracle.holds(told="its home moved", sends=to_home, less=to_home)


def test_b6_64_a_far_home_before_a_flight_is_none(attack: Attack) -> None:
    """Which one is true is not known then; the next good one is."""
    oracle = attack(flying=False)
    tell_home(oracle, 100_000.0)
    assert oracle.vehicle.telemetry.home_m is None and heights(oracle)[1] == "it has not reported its home position yet"
    assert oracle.told("reports a home 100 km away")
    tell_home(oracle, 0.0)
    assert oracle.vehicle.telemetry.home_m == pytest.approx(
        oracle.twin.station.picture.fleet.vehicles[1].telemetry.home_m, abs=0.1
    )
    oracle.holds(counted="implausible home", sends=to_home, less=to_home)
