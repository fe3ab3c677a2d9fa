"""What a vehicle does when something is lost, from the parameters of real autopilots."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from tests.core.rigs.rig import Rig
from tests.core.rigs.service_rig import PX4, Peer, ServiceRig
from tests.core.rigs.vehicles import a_vehicle
from tui_gcs.core.base.text import SafeText
from tui_gcs.core.firmware.failsafes import FailsafeLine, explain, wanted
from tui_gcs.core.firmware.lost_link_behaviour import lost_link_behaviour
from tui_gcs.core.firmware.px4_offboard import OFFBOARD
from tui_gcs.core.guard.motion_prediction import LostLinkBehaviour
from tui_gcs.core.services.parameters.param_channel import ParamTable
from tui_gcs.core.services.parameters.param_exchange import ParamReading
from tui_gcs.core.services.parameters.param_values import Parameter, ParamType
from tui_gcs.core.services.vehicle.failsafe_service import FailsafeService

COPTER_DEFAULTS = {
    "FS_GCS_ENABLE": 0.0,
    "FS_GCS_TIMEOUT": 5.0,
    "FS_OPTIONS": 16.0,
    "MAV_GCS_SYSID": 255.0,
    "BATT_FS_LOW_ACT": 0.0,
    "BATT_FS_CRT_ACT": 0.0,
    "BATT_LOW_VOLT": 10.5,
    "BATT_LOW_MAH": 0.0,
    "BATT_CRT_VOLT": 0.0,
    "BATT_CRT_MAH": 0.0,
    "FENCE_ENABLE": 0.0,
    "FENCE_ACTION": 1.0,
    "FS_EKF_ACTION": 1.0,
    "FS_THR_ENABLE": 1.0,
    "GUID_TIMEOUT": 3.0,
}
"""As the real ArduCopter ships (shared/data/arducopter)."""
PX4_DEFAULTS = {
    "NAV_DLL_ACT": 0.0,
    "COM_DL_LOSS_T": 10.0,
    "COM_DLL_EXCEPT": 0.0,
    "COM_FAIL_ACT_T": 5.0,
    "COM_OBL_RC_ACT": 0.0,
    "COM_OF_LOSS_T": 1.0,
    "COM_LOW_BAT_ACT": 0.0,
    "BAT_CRIT_THR": 0.07,
    "BAT_EMERGEN_THR": 0.05,
    "GF_ACTION": 2.0,
    "NAV_RCL_ACT": 2.0,
    "COM_RC_IN_MODE": 1.0,
}


def copter(**values: float) -> dict[str, FailsafeLine]:
    return {line.when: line for line in explain(a_vehicle(), COPTER_DEFAULTS | values, 255)}


def px4(**values: float) -> dict[str, FailsafeLine]:
    vehicle = a_vehicle()
    vehicle.autopilot = PX4
    return {line.when: line for line in explain(vehicle, PX4_DEFAULTS | values, 255)}


def test_both_autopilots_ship_doing_nothing_without_a_station() -> None:
    for line in (copter()["this station is not heard"], px4()["no station is heard"]):
        assert line.warning and line.does.startswith("NOTHING")


def test_arducopter_as_it_ships() -> None:
    warnings = {when for when, line in copter().items() if line.warning}
    assert warnings == {"this station is not heard", "battery low", "battery critical", "fence crossed"}
    assert copter()["position estimate lost (GPS, EKF)"].does == "lands after 8 s (FS_EKF_ACTION 1)"
    assert copter()["set-points cease (GUIDED)"].does.startswith("brakes 3 s after the last moving one")


@pytest.mark.parametrize(
    ("values", "when", "does", "warning"),
    [
        ({"FS_GCS_ENABLE": 1}, "this station is not heard", "returns (RTL) after 5 s (FS_GCS_ENABLE 1)", False),
        ({"FS_GCS_ENABLE": 99}, "this station is not heard", "not known: FS_GCS_ENABLE is 99", True),
        ({"FS_GCS_ENABLE": float("nan")}, "this station is not heard", "not known: FS_GCS_ENABLE is nan", True),
        ({"BATT_FS_LOW_ACT": 2}, "battery low", "returns (RTL) (BATT_FS_LOW_ACT 2)", False),
        ({"BATT_FS_LOW_ACT": 5}, "battery low", "TERMINATES the flight (BATT_FS_LOW_ACT 5)", True),
        (
            {"BATT_FS_CRT_ACT": 1},
            "battery critical",
            "NOTHING: no limit is set (BATT_CRT_VOLT, BATT_CRT_MAH)",
            True,
        ),
        ({"FENCE_ENABLE": 1}, "fence crossed", "returns (RTL) or lands (FENCE_ACTION 1)", False),
        ({"FENCE_ENABLE": 1, "FENCE_ACTION": 0}, "fence crossed", "NOTHING (FENCE_ACTION 0)", True),
        (
            {"MAV_GCS_SYSID": 250},
            "which station it listens for",
            "waits for the heartbeat of station 250, not ours (255): MAV_GCS_SYSID",
            True,
        ),
    ],
)
def test_arducopters_parameters_in_words(values: dict[str, float], when: str, does: str, warning: bool) -> None:
    line = copter(**values)[when]
    assert (line.does, line.warning) == (does, warning)


def test_the_old_name_of_the_stations_id_is_taken_too() -> None:
    values = {k: v for k, v in COPTER_DEFAULTS.items() if k != "MAV_GCS_SYSID"} | {"SYSID_MYGCS": 1.0}
    lines = {line.when: line for line in explain(a_vehicle(), values, 255)}
    assert lines["which station it listens for"].does.endswith("SYSID_MYGCS")
    assert {"SYSID_MYGCS", "MAV_GCS_SYSID"} <= set(wanted(a_vehicle()))


def test_px4_as_it_ships() -> None:
    warnings = {when for when, line in px4().items() if line.warning}
    assert warnings == {"no station is heard", "battery critical", "set-points cease (OFFBOARD)"}
    assert (
        px4()["set-points cease (OFFBOARD)"].does
        == "Position mode, without a pilot SINKS through the layers below after 1 s (COM_OBL_RC_ACT 0)"
    )


@pytest.mark.parametrize(
    ("values", "when", "does", "warning"),
    [
        (
            {"NAV_DLL_ACT": 2},
            "no station is heard",
            "returns (RTL) after 10 s and 5 s of holding (NAV_DLL_ACT 2)",
            False,
        ),
        (
            {"NAV_DLL_ACT": 6},
            "no station is heard",
            "DISARMS in the air after 10 s and 5 s of holding (NAV_DLL_ACT 6)",
            True,
        ),
        ({"COM_OBL_RC_ACT": 4}, "set-points cease (OFFBOARD)", "lands where it is after 1 s (COM_OBL_RC_ACT 4)", True),
        ({"COM_OBL_RC_ACT": 5}, "set-points cease (OFFBOARD)", "holds after 1 s (COM_OBL_RC_ACT 5)", False),
        ({"COM_LOW_BAT_ACT": 3}, "battery critical", "returns (RTL) at 7 %, lands at 5 % (COM_LOW_BAT_ACT 3)", False),
        ({"GF_ACTION": 77}, "fence crossed", "not known: GF_ACTION is 77", True),
        ({"GF_ACTION": 4}, "fence crossed", "TERMINATES the flight (GF_ACTION 4)", True),
        ({"COM_DLL_EXCEPT": 4}, "no station is heard in OFFBOARD", "NOTHING (COM_DLL_EXCEPT)", True),
    ],
)
def test_px4s_parameters_in_words(values: dict[str, float], when: str, does: str, warning: bool) -> None:
    """PX4 checks no range: GF_ACTION 77 was accepted."""
    line = px4(**values)[when]
    assert (line.does, line.warning) == (does, warning)


def test_what_was_not_read_is_a_warning() -> None:
    vehicle = a_vehicle()
    lines = explain(vehicle, {}, 255)
    assert all(line.warning for line in lines if "not known" in line.does) and len(lines) >= 6
    vehicle.type = 10
    assert explain(vehicle, {}, 255)[0].warning, "a rover's are not known"


class Reader:
    """Parameters of a vehicle that answers when the test wants it."""

    def __init__(self) -> None:
        self.asked: list[tuple[int, tuple[str, ...], Callable[[ParamReading], None]]] = []

    def read(self, vehicle: int, names: Sequence[str], on_done: Callable[[ParamReading], None]) -> None:
        self.asked.append((vehicle, tuple(names), on_done))

    def table(self, vehicle: int) -> ParamTable:
        return ParamTable()


def reading(values: dict[str, float]) -> ParamReading:
    held = {name: Parameter(SafeText(name), value, ParamType.REAL32) for name, value in values.items()}
    return ParamReading(1, held)


def test_they_are_read_on_demand_only_and_forgotten_at_reboot(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    reader = Reader()
    service = FailsafeService(rig.station.services.context, reader)
    vehicle = rig.vehicle()
    assert not reader.asked and not service.known(vehicle) and service.warnings(vehicle)
    done = []
    service.ask(1, lambda: done.append(service.known(vehicle)))
    ((asked, names, on_read),) = reader.asked
    assert asked == 1 and "FS_GCS_ENABLE" in names and not done
    on_read(reading(COPTER_DEFAULTS | {"FS_GCS_ENABLE": 1.0, "EVIL": 1.0}))
    assert done == [True]
    assert "this station is not heard" not in {line.when for line in service.warnings(vehicle)}
    for listener in rig.station.picture.fleet.paths.on_reboot:
        listener(vehicle)
    assert not service.known(vehicle)


def test_who_is_not_known_is_not_asked(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    reader, done = Reader(), []
    FailsafeService(rig.station.services.context, reader).ask(9, lambda: done.append(True))
    assert not reader.asked and done


# ---------------------------------------------------------------- in numbers, for the guard

HOME = (1.0, 2.0, 0.0)
HOLD = 50593792
"""AUTO LOITER."""


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({}, None),
        (COPTER_DEFAULTS, None),
        ({"FS_GCS_ENABLE": 1.0}, LostLinkBehaviour(HOME, 8.0, 15.0)),
        ({"FS_GCS_ENABLE": 1.0, "FS_GCS_TIMEOUT": 10.0, "RTL_ALT": 3000.0}, LostLinkBehaviour(HOME, 13.0, 30.0)),
        ({"FS_GCS_ENABLE": 4.0, "RTL_ALT_M": 40.0}, LostLinkBehaviour(HOME, 8.0, 40.0, sinks=True)),
        ({"FS_GCS_ENABLE": 5.0}, LostLinkBehaviour(HOME, 8.0, sinks=True)),
    ],
)
def test_what_a_copter_does_that_hears_nothing(values: dict[str, float], expected: LostLinkBehaviour | None) -> None:
    assert repr(lost_link_behaviour(a_vehicle(), values, HOME)) == repr(expected)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({}, LostLinkBehaviour(HOME, 4.0, 60.0, sinks=True)),
        (PX4_DEFAULTS, LostLinkBehaviour(HOME, 4.0, 60.0, sinks=True)),
        ({"COM_OBL_RC_ACT": 3.0, "RTL_RETURN_ALT": 45.0, "COM_OF_LOSS_T": 2.0}, LostLinkBehaviour(HOME, 5.0, 45.0)),
        ({"COM_OBL_RC_ACT": 4.0}, LostLinkBehaviour(HOME, 4.0, sinks=True)),
        ({"COM_OBL_RC_ACT": 5.0}, None),
        ({"COM_OBL_RC_ACT": 5.0, "NAV_DLL_ACT": 2.0}, LostLinkBehaviour(HOME, 18.0, 60.0)),
        ({"COM_OBL_RC_ACT": 5.0, "NAV_DLL_ACT": 3.0, "COM_DL_LOSS_T": 20.0}, LostLinkBehaviour(HOME, 28.0, sinks=True)),
    ],
)
def test_what_a_px4_does_that_hears_nothing(values: dict[str, float], expected: LostLinkBehaviour | None) -> None:
    vehicle = a_vehicle()
    vehicle.autopilot, vehicle.telemetry.custom_mode = PX4, OFFBOARD
    assert repr(lost_link_behaviour(vehicle, values, HOME)) == repr(expected)


def test_set_points_that_cease_are_only_missed_in_offboard() -> None:
    vehicle = a_vehicle()
    vehicle.autopilot, vehicle.telemetry.custom_mode = PX4, HOLD
    assert lost_link_behaviour(vehicle, PX4_DEFAULTS, HOME) is None
    assert lost_link_behaviour(vehicle, PX4_DEFAULTS | {"NAV_DLL_ACT": 2.0}, HOME) == LostLinkBehaviour(
        HOME, 18.0, 60.0
    )


def test_of_other_autopilots_nothing_is_known() -> None:
    vehicle = a_vehicle()
    vehicle.autopilot = 18
    assert lost_link_behaviour(vehicle, {"FS_GCS_ENABLE": 1.0, "NAV_DLL_ACT": 2.0}, HOME) is None


def ask_failsafes(flight: Rig, vehicle: int) -> None:
    service = flight.station.services.failsafes
    service.ask(vehicle)
    flight.until(lambda: service.known(flight.station.picture.fleet.vehicles[vehicle]), 60.0, "read")


def test_what_comes_after_the_hold_is_shown_before_a_start_as_soon_as_it_was_read(rig: Callable[..., Rig]) -> None:
    """Flown: three real ArduCopters with FS_GCS_ENABLE 1 went home, though "brakes and holds" was shown."""
    flight = rig(2, autopilots="mixed").ready()
    flight.sim._pilots[0].platform.params.set("FS_GCS_ENABLE", 1.0)
    flight.sim._pilots[1].platform.params.set("NAV_DLL_ACT", 2.0)
    before = flight.station.publisher.status().if_silent
    assert before[1] == "brakes after 3 s and holds; on its way to a place flies there first"
    for vehicle in (1, 2):
        ask_failsafes(flight, vehicle)
    reported = flight.station.publisher.status().if_silent
    assert reported[1] == f"{before[1]}; not heard, it returns (RTL) after 5 s (FS_GCS_ENABLE 1)"
    assert reported[2].endswith("; not heard, it returns (RTL) after 10 s and 5 s of holding (NAV_DLL_ACT 2)")


def test_nothing_is_added_for_a_vehicle_that_does_nothing_more(rig: Callable[..., Rig]) -> None:
    flight = rig(1).ready()
    ask_failsafes(flight, 1)
    assert "not heard" not in flight.station.publisher.status().if_silent[1]


def test_a_line_names_the_parameter_that_chooses_and_what_each_value_would_do() -> None:
    line = copter()["this station is not heard"]
    assert line.param == "FS_GCS_ENABLE"
    assert line.choices[0] == "NOTHING" and line.choices[5] == "lands where it is"
    assert copter(FENCE_ENABLE=0)["fence crossed"].param == "FENCE_ENABLE"
    assert copter()["set-points cease (GUIDED)"].param == ""


def test_values_that_are_no_numbers_are_explained_too() -> None:
    nan = float("nan")
    assert px4(COM_DLL_EXCEPT=nan, NAV_DLL_ACT=nan)["no station is heard"].warning
    assert "this station is not heard in AUTO" not in copter(FS_OPTIONS=nan)
