"""Places in degrees or metres, above home or sea: what each vehicle is told, and when it is told nothing."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.core.rigs.rig import scenario
from tests.core.rigs.service_rig import ARDUPILOT, PX4, Fields, Peer, ServiceRig
from tui_gcs.core.firmware.base import Firmware
from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.guard.permission import PASS
from tui_gcs.core.motion.target_place import AltitudeReference, HomeHeight, PlaceError, TargetPlace
from tui_gcs.core.uplink.actions import FRAME_AMSL

FRAME = LocalFrame(scenario().origin)
REPOSITION, GUIDED, HOLD = 192, 4, 0x03040000
HOME_AMSL_M = 488.0
LAT_DEG, LON_DEG = 47.3981, 8.5460


def home_position(amsl_m: float = HOME_AMSL_M) -> Fields:
    rest = dict.fromkeys(("x", "y", "z", "approach_x", "approach_y", "approach_z", "time_usec"), 0)
    place = {"latitude": 473_978_000, "longitude": 85_456_000, "altitude": round(amsl_m * 1e3)}
    return {"q": [1.0, 0.0, 0.0, 0.0]} | place | rest


def flying(tmp_path: Path, autopilot: int, *, home: bool = True) -> ServiceRig:
    """One vehicle 20 m above its home, in the mode in which it takes places."""
    accepts = {"COMMAND_INT": lambda peer, fields: peer.ack(fields["command"])}
    mode = HOLD if autopilot == PX4 else GUIDED
    peer = Peer(1, autopilot, custom_mode=mode, armed=True, alt_rel_mm=20_000, answers=accepts)
    rig = ServiceRig(tmp_path, peer).heard()
    if home:
        peer.say("HOME_POSITION", **home_position())
    return rig.run(1.0)


def firmware(rig: ServiceRig) -> Firmware:
    return rig.station.comms.firmware.of(rig.vehicle())


def told(rig: ServiceRig, autopilot: int) -> tuple[float, float, float]:
    """Latitude, longitude, height of the newest go-to, as the vehicle reads it."""
    if autopilot == PX4:
        fields = [f for f in rig.peers[1].got("COMMAND_INT") if f["command"] == REPOSITION][-1]
        assert fields["frame"] == FRAME_AMSL
        return fields["x"] / 1e7, fields["y"] / 1e7, fields["z"]
    fields = rig.peers[1].got("SET_POSITION_TARGET_GLOBAL_INT")[-1]
    assert fields["coordinate_frame"] == 6, "above home"
    return fields["lat_int"] / 1e7, fields["lon_int"] / 1e7, fields["alt"]


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
@pytest.mark.parametrize(
    ("alt_m", "above"), [(25.0, AltitudeReference.HOME), (HOME_AMSL_M + 25.0, AltitudeReference.SEA)]
)
def test_a_place_by_either_height_is_the_same_to_each_autopilot(
    tmp_path: Path, autopilot: int, alt_m: float, above: AltitudeReference
) -> None:
    rig = flying(tmp_path, autopilot)
    point_m = rig.station.comms.firmware.point_m(rig.vehicle(), TargetPlace(LAT_DEG, LON_DEG, alt_m, above))
    assert point_m[2] == pytest.approx(25.0, abs=0.01)
    firmware(rig).go_to(rig.vehicle(), point_m, 5.0, PASS, anew=True)
    rig.run(0.2)
    lat_deg, lon_deg, height_m = told(rig, autopilot)
    assert (lat_deg, lon_deg) == (pytest.approx(LAT_DEG, abs=2e-7), pytest.approx(LON_DEG, abs=2e-7))
    assert height_m == pytest.approx(25.0 + (HOME_AMSL_M if autopilot == PX4 else 0.0), abs=0.05)


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_metres_of_the_scenario_are_the_same_place(tmp_path: Path, autopilot: int) -> None:
    rig = flying(tmp_path, autopilot)
    place = TargetPlace.local(rig.station.picture.fleet.frame, (30.0, -40.0, HOME_AMSL_M + 15.0), AltitudeReference.SEA)
    assert rig.station.comms.firmware.point_m(rig.vehicle(), place) == pytest.approx((30.0, -40.0, 15.0), abs=0.01)


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_without_its_home_a_height_above_the_sea_is_nowhere(tmp_path: Path, autopilot: int) -> None:
    rig = flying(tmp_path, autopilot, home=False)
    with pytest.raises(PlaceError, match="has not reported its home position"):
        rig.station.comms.firmware.point_m(rig.vehicle(), TargetPlace(LAT_DEG, LON_DEG, 500.0, AltitudeReference.SEA))
    rig.peers[1].say("HOME_POSITION", **home_position(HOME_AMSL_M + 60.0))
    rig.run(0.5)
    with pytest.raises(PlaceError, match="contradict each other"):
        rig.station.comms.firmware.point_m(rig.vehicle(), TargetPlace(LAT_DEG, LON_DEG, 500.0, AltitudeReference.SEA))


def test_each_height_needs_the_home_only_where_it_is_of_the_other_kind() -> None:
    unknown = HomeHeight(problem="who knows")
    assert TargetPlace(LAT_DEG, LON_DEG, 20.0, AltitudeReference.HOME).point_m(FRAME, unknown)[2] == 20.0
    assert TargetPlace(LAT_DEG, LON_DEG, 20.0, AltitudeReference.SEA).amsl_m(unknown) == 20.0
    for wanted in (
        lambda: TargetPlace(LAT_DEG, LON_DEG, 20.0, AltitudeReference.HOME).amsl_m(unknown),
        lambda: TargetPlace(LAT_DEG, LON_DEG, 20.0, AltitudeReference.SEA).above_home_m(unknown),
        lambda: TargetPlace(LAT_DEG, LON_DEG, 20.0, AltitudeReference.SEA).above_home_m(HomeHeight()),
    ):
        with pytest.raises(PlaceError):
            wanted()


@pytest.mark.parametrize(
    "numbers",
    [(91.0, 0.0, 1.0), (0.0, 181.0, 1.0), (math.nan, 8.0, 1.0), (47.0, 8.0, math.inf), (0.0, 0.0, 20.0), (47, 8, 3e4)],
)
def test_what_is_no_place_is_none(numbers: tuple[float, float, float]) -> None:
    with pytest.raises(PlaceError):
        TargetPlace(*numbers, AltitudeReference.HOME)


@given(
    st.tuples(*[st.floats(-5_000, 5_000)] * 2, st.floats(-50, 500)),
    st.floats(-100, 4_000),
    st.sampled_from(AltitudeReference),
)
def test_there_and_back(point_m: tuple[float, float, float], home_m: float, above: AltitudeReference) -> None:
    z = point_m[2] + (home_m if above is AltitudeReference.SEA else 0.0)
    place = TargetPlace.local(FRAME, (point_m[0], point_m[1], z), above)
    assert place.point_m(FRAME, HomeHeight(home_m)) == pytest.approx(point_m, abs=1e-5)
    assert place.amsl_m(HomeHeight(home_m)) == pytest.approx(point_m[2] + home_m, abs=1e-9)
