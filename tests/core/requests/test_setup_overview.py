"""How the setup of a vehicle stands: judged by the parameters of both autopilots, and by what is under way."""

from pathlib import Path

import pytest

import sitl
from tests.core.rigs.param_peer import INT8, INT32, REAL32, ParamServer
from tests.core.rigs.service_asking import ask, ended
from tests.core.rigs.service_rig import ARDUPILOT, PX4, Peer, ServiceRig
from tui_gcs.core.protocol.setup import GetSetup, ReadSetup, SectionWord, SetupSectionRow

FILES = {ARDUPILOT: "arducopter.param", PX4: "px4.param"}
TYPES = {"1": INT8, "2": REAL32, "3": INT32, "4": REAL32, "6": INT32, "9": REAL32}
UNKNOWN, ATTENTION, DONE = "unknown", "needs attention", "done"


def parameters(autopilot: int) -> dict[str, tuple[int, float]]:
    """The parameters of the simulator of that autopilot, which are those of a real one's SITL."""
    lines = (Path(sitl.__file__).parent / "data" / FILES[autopilot]).read_text().splitlines()
    rows = (line.split() for line in lines if line and not line.startswith("#"))
    return {name: (TYPES[kind], float(value)) for name, kind, value, *_ in rows}


def make(tmp_path: Path, autopilot: int = ARDUPILOT, **changed: float) -> ServiceRig:
    """A vehicle with the simulator's parameters, some of them changed."""
    peer = Peer(1, autopilot=autopilot)
    held = parameters(autopilot)
    ParamServer(peer, held | {name: (held[name][0], value) for name, value in changed.items()})
    return ServiceRig(tmp_path, peer).heard()


def sections(rig: ServiceRig, wanted: SectionWord | None = None) -> dict[str, SetupSectionRow]:
    return {row.section: row for row in ask(rig, GetSetup((1,), wanted)).setup_sections}


def read(rig: ServiceRig, section: SectionWord | None = None) -> None:
    ended(rig, ReadSetup((1,), section), 60.0)


def finding(rig: ServiceRig, section: SectionWord) -> tuple[str, str]:
    read(rig, section)
    row = sections(rig)[section]
    return row.state, row.text


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_nothing_is_known_before_it_is_read(tmp_path: Path, autopilot: int) -> None:
    rows = sections(make(tmp_path, autopilot))
    assert list(rows) == ["airframe", "sensors", "radio", "modes", "failsafes", "motors", "battery", "tuning"]
    assert {row.state for row in rows.values()} == {UNKNOWN}


def test_one_section_is_reported_alone(tmp_path: Path) -> None:
    rig = make(tmp_path)
    alone = ask(rig, GetSetup((1,), "sensors", only=True)).setup_sections
    assert alone == (sections(rig, "sensors")["sensors"],)


def test_a_copter_as_it_is_delivered_lacks_its_failsafes(tmp_path: Path) -> None:
    rig = make(tmp_path)
    read(rig)
    rows = sections(rig)
    assert {name: row.state for name, row in rows.items() if row.state != DONE} == {
        "failsafes": ATTENTION, "motors": UNKNOWN,
    }  # fmt: skip
    assert rows["airframe"].text == "quad, plus"
    assert rows["battery"].text == "analog voltage and current, 3300 mAh"
    assert "STABILIZE" in rows["modes"].text


def test_a_px4_without_a_radio_needs_no_switch(tmp_path: Path) -> None:
    rig = make(tmp_path, PX4)
    read(rig)
    rows = sections(rig)
    assert rows["radio"].state == DONE and "no transmitter is expected" in rows["radio"].text
    assert rows["modes"].state == DONE
    assert rows["sensors"].text == "calibrated: gyro, accel, compass"


CASES: list[tuple[int, dict[str, float], SectionWord, str]] = [
    (ARDUPILOT, {"FRAME_CLASS": 0}, "airframe", "no class is chosen (FRAME_CLASS 0)"),
    (ARDUPILOT, dict.fromkeys(("COMPASS_OFS_X", "COMPASS_OFS_Y", "COMPASS_OFS_Z"), 0), "sensors", "compass: NOT"),
    (ARDUPILOT, {"RCMAP_YAW": 0}, "radio", "no channel is yaw"),
    (ARDUPILOT, {"FLTMODE_CH": 0}, "modes", "no switch chooses modes"),
    (ARDUPILOT, {"BATT_MONITOR": 0}, "battery", "no battery is measured (BATT_MONITOR 0)"),
    (ARDUPILOT, {"BATT_CAPACITY": 0}, "battery", "capacity: not set (BATT_CAPACITY), so what is left is not known"),
    (PX4, {"SYS_AUTOSTART": 0}, "airframe", "no airframe is chosen (SYS_AUTOSTART 0)"),
    (PX4, {"CAL_MAG0_ID": 0}, "sensors", "compass: NOT calibrated"),
    (PX4, {"COM_RC_IN_MODE": 0}, "radio", "no channel is throttle, yaw, roll, pitch"),
    (PX4, {"COM_RC_IN_MODE": 0}, "modes", "no switch chooses modes (RC_MAP_FLTMODE 0)"),
    (PX4, {"BAT1_SOURCE": -1}, "battery", "no battery is measured (BAT1_SOURCE -1)"),
    (PX4, {"BAT1_N_CELLS": 0}, "battery", "cells: not set (BAT1_N_CELLS), so what is left is guessed"),
]


@pytest.mark.parametrize(("autopilot", "changed", "section", "text"), CASES)
def test_what_is_missing_needs_attention(
    tmp_path: Path, autopilot: int, changed: dict[str, float], section: SectionWord, text: str
) -> None:
    state, found = finding(make(tmp_path, autopilot, **changed), section)
    assert state == ATTENTION and text in found


def test_channels_with_the_ends_of_the_factory_were_never_calibrated(tmp_path: Path) -> None:
    factory = {f"RC{n}_{end}": us for n in range(1, 5) for end, us in (("MIN", 1100), ("MAX", 1900), ("TRIM", 1500))}
    assert finding(make(tmp_path, **factory), "radio") == (
        ATTENTION, "never calibrated: all ends of its channels are the factory's",
    )  # fmt: skip


def test_a_compass_that_is_not_there_needs_no_calibration(tmp_path: Path) -> None:
    assert finding(make(tmp_path, PX4, SYS_HAS_MAG=0, CAL_MAG0_ID=0), "sensors") == (DONE, "calibrated: gyro, accel")


def test_only_the_section_that_is_looked_at_has_its_lines(tmp_path: Path) -> None:
    rig = make(tmp_path)
    read(rig, "failsafes")
    rows = sections(rig, "failsafes")
    assert [name for name, row in rows.items() if row.fields] == ["failsafes"]
    station = rows["failsafes"].fields[0]
    assert (station.param, station.value, station.needs_attention) == ("FS_GCS_ENABLE", 0, True)
    assert dict(station.choices)[1] == "returns (RTL)"


def test_what_must_be_rebooted_needs_attention(tmp_path: Path) -> None:
    rig = make(tmp_path)
    read(rig, "sensors")
    rig.vehicle().reboot_first = "compass calibration done"
    assert sections(rig)["sensors"].text == "compass calibration done: reboot it before it flies"


def test_of_an_unknown_autopilot_nothing_is_claimed(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1, autopilot=18)).heard()
    assert {row.state for row in sections(rig).values()} <= {UNKNOWN}


def test_a_value_that_no_table_has_is_shown_as_it_is(tmp_path: Path) -> None:
    assert finding(make(tmp_path, BATT_MONITOR=77), "battery") == (DONE, "77, 3300 mAh")


@pytest.mark.parametrize("value", [float("nan"), 1e30, -1e30])
@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_values_that_are_no_numbers_end_no_section(tmp_path: Path, autopilot: int, value: float) -> None:
    peer = Peer(1, autopilot=autopilot)
    ParamServer(peer, dict.fromkeys(parameters(autopilot), (REAL32, value)))
    rig = ServiceRig(tmp_path, peer).heard()
    read(rig)
    for section in sections(rig):
        assert sections(rig, section)[section].state in (UNKNOWN, ATTENTION, DONE)
