"""Gains and airframes: read on demand, changed by bounded steps, and set back."""

from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.param_peer import INT8, INT32, REAL32, ParamServer
from tests.core.rigs.service_rig import ARDUPILOT, PX4, Peer, ServiceRig
from tui_gcs.core.services.parameters.param_change import ParamChange
from tui_gcs.core.services.parameters.param_exchange import ParamReading
from tui_gcs.core.services.setup.airframe import AirframeService
from tui_gcs.core.services.setup.tuning import TuningService

RATE = {
    f"ATC_RAT_{axis}_{gain}": (REAL32, 0.0)
    for axis in ("RLL", "PIT", "YAW")
    for gain in ("P", "I", "D", "FF", "IMAX", "FLTT", "FLTE", "FLTD")
}
COPTER = RATE | {
    "ATC_RAT_RLL_P": (REAL32, 0.135),
    "ATC_ANG_RLL_P": (REAL32, 4.5),
    "PSC_POSXY_P": (REAL32, 1.0),
    "PSC_POSZ_P": (REAL32, 1.0),
    "FRAME_CLASS": (INT8, 1),
    "FRAME_TYPE": (INT8, 0),
    "FS_GCS_ENABLE": (INT8, 0),
}
NEWER = {name: pair for name, pair in COPTER.items() if not name.startswith("PSC")} | {"PSC_NE_POS_P": (REAL32, 1.0)}
QUAD = {
    "MC_ROLLRATE_P": (REAL32, 0.15),
    "MC_ROLL_P": (REAL32, 6.5),
    "SYS_AUTOSTART": (INT32, 4001),
    "SYS_AUTOCONFIG": (INT32, 0),
}


def make(tmp_path: Path, autopilot: int = ARDUPILOT, params: dict[str, Any] | None = None, **how: Any):
    peer = Peer(1, autopilot=autopilot)
    server = ParamServer(peer, params or (QUAD if autopilot == PX4 else COPTER))
    return ServiceRig(tmp_path, peer, **how).heard(), server


def tuning(rig: ServiceRig) -> TuningService:
    found: TuningService = rig.station.services.tuning
    return found


def airframes(rig: ServiceRig) -> AirframeService:
    found: AirframeService = rig.station.services.airframes
    return found


def read(rig: ServiceRig, group: str, limit_s: float = 10.0) -> ParamReading:
    reading = tuning(rig).read(1, group)
    assert isinstance(reading, ParamReading), reading
    rig.until(lambda: reading.over, limit_s)
    return reading


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_groups_of_each_autopilot(tmp_path: Path, autopilot: int) -> None:
    rig, _ = make(tmp_path, autopilot)
    assert [group.name for group in tuning(rig).groups(1)] == ["rate", "attitude", "velocity", "position"]
    assert "no such group" in str(tuning(rig).read(1, "feelings"))


@pytest.mark.parametrize("params", [COPTER, NEWER])
def test_gains_are_found_under_the_names_of_either_version(tmp_path: Path, params: dict[str, Any]) -> None:
    """ArduPilot does not answer to names it does not have: the other version's are not waited for."""
    rig, _ = make(tmp_path, params=params)
    wanted = {name for name in params if name.startswith("PSC")}
    reading = tuning(rig).read(1, "position")
    assert isinstance(reading, ParamReading)
    rig.until(lambda: set(reading.values) == wanted, 1.0)
    others = {"PSC_NE_POS_P", "PSC_POSXY_P"} - wanted
    assert all("otherwise" in reading.missing[name] for name in others)


def test_a_step_and_back(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    assert tuning(rig).set(1, "ATC_RAT_RLL_P", 0.15) == "read it first"
    read(rig, "rate")
    assert tuning(rig).set(1, "ATC_RAT_RLL_P", 0.2) == ""
    rig.run(0.5)
    assert tuning(rig).set(1, "ATC_RAT_RLL_P", 0.25) == ""
    rig.run(0.5)
    assert server.params["ATC_RAT_RLL_P"][1] == pytest.approx(0.25)
    assert tuning(rig).former(1)["ATC_RAT_RLL_P"] == pytest.approx((0.135, 0.2))
    assert tuning(rig).undo(1, "ATC_RAT_RLL_P") == ""
    rig.run(0.5)
    assert server.params["ATC_RAT_RLL_P"][1] == pytest.approx(0.2)
    change = tuning(rig).undo_all(1)
    assert isinstance(change, ParamChange)
    rig.until(lambda: change.over, 3.0)
    assert server.params["ATC_RAT_RLL_P"][1] == pytest.approx(0.135) and tuning(rig).former(1) == {}
    assert tuning(rig).undo(1, "ATC_RAT_RLL_P") == "it was not changed"
    assert tuning(rig).undo_all(1) == "nothing was changed"


def test_in_flight_too_but_no_leap(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    rig.peers[1].armed, rig.peers[1].alt_rel_mm = True, 20_000
    rig.run(2.0)
    read(rig, "rate")
    for value in (0.4, 0.05, -0.135, 0.0, float("nan"), float("inf")):
        assert tuning(rig).set(1, "ATC_RAT_RLL_P", value), value
    assert "no step by a factor" in tuning(rig).set(1, "ATC_RAT_RLL_D", 0.004)
    assert not rig.peers[1].got("PARAM_SET")
    assert tuning(rig).set(1, "ATC_RAT_RLL_P", 0.27) == ""
    assert tuning(rig).set(1, "ATC_RAT_RLL_D", 0.004, force=True) == ""
    rig.run(0.5)
    assert server.params["ATC_RAT_RLL_D"][1] == pytest.approx(0.004)


def test_only_gains_are_tuned(tmp_path: Path) -> None:
    rig, _ = make(tmp_path)
    rig.station.services.params.read(1, ["FS_GCS_ENABLE"])
    rig.run(0.5)
    assert tuning(rig).set(1, "FS_GCS_ENABLE", 1, force=True) == "not one of its gains"


def test_what_was_not_taken_is_no_former_value(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    read(rig, "rate")
    server.mute = True
    rig.peers[1].answers["PARAM_SET"] = lambda peer, fields: None
    ended: list[str] = []
    tuning(rig).set(1, "ATC_RAT_RLL_P", 0.2, lambda setting: ended.append(setting.error))
    rig.until(lambda: bool(ended), 10.0)
    assert ended[0] and tuning(rig).former(1) == {}


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.endurance) for seed in range(1, 3))])
def test_taken_back_over_a_link_that_loses(tmp_path: Path, seed: int) -> None:
    rig, server = make(tmp_path, PX4, loss=0.3, seed=seed)
    rig.station.services.params.read(1, ["MC_ROLLRATE_P", "MC_ROLL_P"])
    rig.until(lambda: len(rig.station.services.params.table(1).params) == 2, 10.0)
    for name in ("MC_ROLLRATE_P", "MC_ROLL_P"):
        tuning(rig).set(1, name, server.params[name][1] * 1.5)
    rig.until(lambda: len(tuning(rig).former(1)) == 2, 10.0)
    change = tuning(rig).undo_all(1)
    assert isinstance(change, ParamChange)
    rig.until(lambda: change.over, 20.0)
    assert not change.error and [server.params[n][1] for n in ("MC_ROLLRATE_P", "MC_ROLL_P")] == pytest.approx(
        [0.15, 6.5]
    )


# ---------------------------------------------------------------- airframes


def test_a_copters_frame(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    words = airframes(rig).parameters(1)
    assert words is not None and words.fields[0].choices[2] == "hexa"
    change = airframes(rig).choose(1, {"FRAME_CLASS": 2, "FRAME_TYPE": 1})
    assert isinstance(change, ParamChange)
    rig.until(lambda: change.over, 5.0)
    assert server.params["FRAME_CLASS"][1] == 2 and server.params["FRAME_TYPE"][1] == 1
    assert change.before == {"FRAME_CLASS": 1, "FRAME_TYPE": 0}
    assert "airframe changed: takes effect at the next boot" in rig.texts("vehicle 1")
    back = change.undo(rig.station.services.params)
    rig.until(lambda: back.over, 5.0)
    assert server.params["FRAME_CLASS"][1] == 1


def test_px4s_airframe_resets_all_parameters_and_warns_of_it(tmp_path: Path) -> None:
    rig, server = make(tmp_path, PX4)
    change = airframes(rig).choose(1, {"SYS_AUTOSTART": 123456})
    assert isinstance(change, ParamChange)
    rig.until(lambda: change.over, 15.0)
    assert server.params["SYS_AUTOSTART"][1] == 123456 and server.params["SYS_AUTOCONFIG"][1] == 1
    assert [f["param_id"] for f in rig.peers[1].got("PARAM_SET")] == ["SYS_AUTOSTART", "SYS_AUTOCONFIG"]
    assert any("all parameters but calibrations" in text for text in rig.texts("vehicle 1"))


def test_px4_is_not_reset_when_the_airframe_was_not_taken(tmp_path: Path) -> None:
    rig, server = make(tmp_path, PX4)
    rig.peers[1].answers["PARAM_SET"] = lambda peer, fields: server.error(str(fields["param_id"]), 5)
    change = airframes(rig).choose(1, {"SYS_AUTOSTART": 6001})
    assert isinstance(change, ParamChange)
    rig.until(lambda: change.over, 15.0)
    assert "it cannot be written" in change.error and server.params["SYS_AUTOCONFIG"][1] == 0
    assert len(rig.peers[1].got("PARAM_SET")) == 1


def test_nonsense_and_armed_vehicles_are_refused(tmp_path: Path) -> None:
    rig, _ = make(tmp_path)
    assert airframes(rig).choose(1, {"FRAME_CLASS": 99}) == "FRAME_CLASS is 0 to 17"
    assert "to be chosen" in str(airframes(rig).choose(1, {"FS_GCS_ENABLE": 1}))
    assert "to be chosen" in str(airframes(rig).choose(1, {}))
    rig.peers[1].armed = True
    rig.run(2.0)
    assert airframes(rig).choose(1, {"FRAME_CLASS": 2}) == "it is armed"
