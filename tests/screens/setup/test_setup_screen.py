"""The setup screen: what is done and what is missing, guided calibrations, values, motors, gains, undo."""

import msgspec
import pytest

from tests.screens.rigs.console import NARROW, WIDE, Console, console
from tests.screens.rigs.fake_station import FakeStation
from tests.screens.rigs.pictures import same_as_snapshot
from tui_gcs.core.protocol.services import CancelTask, ParamRow, SetParams, TaskInfo
from tui_gcs.core.protocol.setup import (
    Calibrate,
    CancelCalibration,
    ChooseAirframe,
    ConfirmStep,
    GetSetup,
    ReadSetup,
    SetGain,
    SetupFieldRow,
    SetupSectionRow,
    TestMotor,
    UndoGains,
    UndoRadio,
)

ATTENTION, UNKNOWN, DONE = "needs attention", "unknown", "done"
FRAMES = ((1, "quad"), (2, "hexa"))
SIX_POSES = "six poses, each held still"
LEVEL = "place the vehicle level, keep it still, then confirm"


def sections(vehicle: int) -> tuple[SetupSectionRow, ...]:
    """A copter; of vehicle 8 the compass is not calibrated."""
    compass = "calibrated" if vehicle != 8 else "NOT [b]calibrated[/b]"
    station = "this station is not heard"
    return (
        SetupSectionRow(vehicle, "airframe", DONE, "quad, plus", (
            SetupFieldRow("class", "airframe", "FRAME_CLASS", 1, choices=FRAMES, prompt="next boot"),
        )),
        SetupSectionRow(vehicle, "sensors", DONE if vehicle != 8 else ATTENTION, f"compass: {compass}", (
            SetupFieldRow("accel", "calibrate", words="calibrated", prompt=SIX_POSES),
            SetupFieldRow("compass", "calibrate", words=compass, needs_attention=vehicle == 8, prompt="go outside"),
        )),
        SetupSectionRow(vehicle, "radio", DONE, "channels: throttle 3", (
            SetupFieldRow("rc", "calibrate", words="channels: throttle 3", prompt="take the propellers off"),
        )),
        SetupSectionRow(vehicle, "failsafes", ATTENTION, f"look at: {station}", (
            SetupFieldRow(station, "parameter", "FS_GCS_ENABLE", 0, "NOTHING (FS_GCS_ENABLE 0)", True,
                          ((0, "NOTHING"), (1, "returns (RTL)"))),
            SetupFieldRow("set-points cease (GUIDED)", "none", words="brakes"),
        )),
        SetupSectionRow(vehicle, "motors", UNKNOWN, "0 of 4 tested", tuple(
            SetupFieldRow(f"motor {n}", "motor", value=n, words="not tested") for n in (1, 2)
        )),
        SetupSectionRow(vehicle, "battery", DONE, "analog voltage, 3300 mAh", (
            SetupFieldRow("capacity", "parameter", "BATT_CAPACITY", 3300 if vehicle < 5 else 5200, unit="mAh"),
        )),
        SetupSectionRow(vehicle, "tuning", DONE, "as it was found", (
            SetupFieldRow("rate", "gain", "ATC_RAT_RLL_P", 0.135, former=(0.12,)),
        )),
    )  # fmt: skip


NOT_READ = SetupSectionRow(1, "airframe", UNKNOWN, "FRAME_CLASS was not read", ())


def known(station: FakeStation) -> None:
    station.setup = tuple(row for vehicle in range(1, 9) for row in sections(vehicle))
    for vehicle in range(1, 9):
        station.params[vehicle] = {
            "FS_GCS_ENABLE": ParamRow("FS_GCS_ENABLE", 0, "int8"),
            "BATT_CAPACITY": ParamRow("BATT_CAPACITY", 3300, "int32", units="mAh"),
        }


def calibrating(station: FakeStation) -> None:
    """Vehicles 1 to 3 are asked for a pose, 3 for another one; vehicle 4's transmitter is looked at."""
    known(station)
    left = LEVEL.replace("level", "on its left side")
    notes = ("[red]Place vehicle level[/] and press any key.",)
    tasks = [
        TaskInfo(n, n, "calibrate accel", "console-test", "running", 0, 100, "", 3.0, LEVEL if n < 3 else left, True,
                 notes=notes)
        for n in (1, 2, 3)
    ]  # fmt: skip
    tasks.append(TaskInfo(4, 4, "download log 3", "console-77", "running", 1, 2, "", 3.0))
    station.tasks = {task.number: task for task in tasks}


async def opened(c: Console, *vehicles: int, section: str = "airframe") -> None:
    """The lines of a section, with these vehicles selected."""
    c.app.feed.selection.set(vehicles)
    await c.press("S", "s")
    await look(c)
    while c.app.screen.section != section:
        await c.press("down")
    await look(c)
    await c.press("right")


async def look(c: Console) -> None:
    c.app.screen.look()
    await c.settle()


def panel(c: Console) -> str:
    return " ".join(c.app.screen.panel.text().split())


def lines(c: Console) -> list[str]:
    return [row.row.label for row in c.app.screen.field_list.rows]


def asked(c: Console, kind: type) -> list[object]:
    return [request for request in c.station.requests if isinstance(request, kind)]


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_pictures(size: tuple[int, int]) -> None:
    async with console(size, known) as c:
        await opened(c, *range(1, 9), section="failsafes")
        assert same_as_snapshot(f"setup-failsafes-{size[0]}x{size[1]}", c.text())
        await c.press("enter")
        assert same_as_snapshot(f"box-choice-{size[0]}x{size[1]}", c.text())


@pytest.mark.parametrize("size", [WIDE, NARROW], ids=["120x40", "80x24"])
async def test_pictures_of_a_calibration(size: tuple[int, int]) -> None:
    async with console(size, calibrating) as c:
        await opened(c, 1, 2, 3, section="sensors")
        assert same_as_snapshot(f"setup-calibration-{size[0]}x{size[1]}", c.text())


async def test_at_80_cells_labels_and_values_of_failsafes_are_whole() -> None:
    async with console(NARROW, known) as c:
        await opened(c, *range(1, 9), section="failsafes")
        assert "! this station is not heard NOTHING (FS_GCS_ENABLE 0)" in c.text()
        assert "set-points cease (GUIDED) brakes" in c.text()
        assert "! sensors   8 " in c.text(), "which vehicles need attention"


async def test_a_section_that_was_not_read_names_the_key_that_reads_it() -> None:
    async with console(NARROW, lambda station: setattr(station, "setup", (NOT_READ,))) as c:
        await opened(c, 1)
        assert "unknown: FRAME_CLASS was not read (vehicle 1) R reads it" in panel(c)
    async with console(NARROW, known) as c:
        await opened(c, 1, section="motors")
        assert "unknown: 0 of 4 tested (vehicle 1)" in panel(c) and "R reads" not in panel(c)


async def test_a_section_says_which_vehicles_need_attention() -> None:
    async with console(WIDE, known) as c:
        await opened(c, section="sensors")
        assert "! sensors   attention: 8" in c.text()
        assert "needs attention: compass: NOT [b]calibrated[/b] (vehicle 8)" in panel(c)
        assert "Enter calibrate" in c.line(-1)
        await c.press("down")
        assert "calibrated [1-7]; NOT [b]calibrated[/b] [8]" in c.text()


async def test_without_a_selection_nothing_is_changed() -> None:
    async with console(WIDE, known) as c:
        await opened(c, section="sensors")
        await c.press("enter", "y", "d", "delete", "u", "U")
        assert c.station.commands() == [] and "no vehicle is selected" in panel(c)


async def test_a_calibration_begins_on_the_selected_after_its_prompt() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 2, 5, section="sensors")
        await c.press("enter")
        assert "calibrate accel: vehicles 2 5" in c.text() and SIX_POSES in c.text()
        await c.press("enter", "escape")
        assert asked(c, Calibrate) == []
        await c.press("enter", "y")
        assert asked(c, Calibrate) == [Calibrate((2, 5), "accel")]


async def test_prompts_of_different_autopilots_are_both_shown() -> None:
    def mixed(station: FakeStation) -> None:
        known(station)
        station.setup = tuple(
            msgspec.structs.replace(
                row, fields=tuple(msgspec.structs.replace(f, prompt="the vehicle says which side") for f in row.fields)
            )
            if row.vehicle == 5
            else row
            for row in station.setup
        )

    async with console(WIDE, mixed) as c:
        await opened(c, 2, 5, section="sensors")
        await c.press("enter")
        assert f"vehicle 2: {SIX_POSES}" in c.text() and "vehicle 5: the vehicle says which side" in c.text()


async def test_only_vehicles_with_the_same_prompt_are_confirmed() -> None:
    async with console(WIDE, calibrating) as c:
        await opened(c, 1, 2, 3, section="sensors")
        assert "vehicles 1-2: place the vehicle level" in panel(c) and "[red]Place vehicle level[/]" in panel(c)
        assert "download log" not in panel(c)
        await c.press("d")
        assert asked(c, ConfirmStep) == [ConfirmStep(1), ConfirmStep(2)]
        assert "1 wait for something else" in panel(c)


async def test_a_pose_that_is_not_taken_says_why() -> None:
    def moving(station: FakeStation) -> None:
        calibrating(station)
        station.no_confirm = "task 3: it does not wait for that now"

    async with console(WIDE, moving) as c:
        await opened(c, 3, section="sensors")
        await c.press("d")
        assert "vehicle 3: task 3: it does not wait for that now" in panel(c)


async def test_a_calibration_is_cancelled_after_y() -> None:
    async with console(WIDE, calibrating) as c:
        await opened(c, 1, 3, 4, section="sensors")
        await c.press("delete", "y")
        assert asked(c, CancelCalibration) == [CancelCalibration((1, 3))]


async def test_nothing_to_confirm_or_to_cancel_is_said() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, section="sensors")
        await c.press("d")
        assert "no selected vehicle waits" in panel(c)
        await c.press("delete")
        assert "nothing is under way" in panel(c) and c.station.commands() == []


async def test_a_failsafe_is_chosen_by_what_it_will_do() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, 2, section="failsafes")
        await c.press("enter")
        assert "0  NOTHING   (now)" in c.text()
        await c.press("down", "enter")
        assert "FS_GCS_ENABLE" in c.text() and "0 -> 1" in c.text()
        await c.press("y")
        assert asked(c, SetParams) == [SetParams((1, 2), {"FS_GCS_ENABLE": 1})]
        assert "FS_GCS_ENABLE = 1: set and confirmed on vehicles 1-2" in panel(c)
        await c.press("u", "y")
        assert asked(c, SetParams)[-1] == SetParams((1, 2), {"FS_GCS_ENABLE": 0}, beyond_range=True)


async def test_a_number_that_no_choice_has_can_be_typed() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, section="failsafes")
        await c.press("enter", "x", "1", "2", "backspace", "7", "enter", "y")
        assert asked(c, SetParams) == [SetParams((1,), {"FS_GCS_ENABLE": 17})]


async def test_what_no_parameter_chooses_is_not_set() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, section="failsafes")
        await c.press("down", "enter")
        assert "no parameter chooses this" in panel(c)


async def test_a_measure_is_typed_and_differing_vehicles_are_named() -> None:
    async with console(WIDE, known) as c:
        await opened(c, *range(1, 9), section="battery")
        assert "3300 mAh [1-4]; 5200 mAh [5-8]" in c.text()
        await c.press("enter", "ctrl+u", *"4000", "enter", "y")
        assert asked(c, SetParams) == [SetParams(tuple(range(1, 9)), {"BATT_CAPACITY": 4000})]


async def test_words_are_no_value() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, section="battery")
        await c.press("enter", "ctrl+u", *"big", "enter")
        assert "'big' is no number: nothing was set" in panel(c) and c.station.commands() == []


async def test_a_parameter_that_was_not_read_is_not_set() -> None:
    async with console(WIDE, known) as c:
        c.station.params.clear()
        await opened(c, 1, section="battery")
        await c.press("enter", "ctrl+u", *"4000", "enter")
        assert "BATT_CAPACITY was not read from vehicle 1: R reads it" in panel(c)


async def test_an_airframe_is_chosen_by_name_after_y() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, 2, section="airframe")
        await c.press("enter", "down", "enter")
        assert "class 2 hexa: vehicles 1-2" in c.text() and "next boot" in c.text()
        await c.press("y")
        assert asked(c, ChooseAirframe) == [ChooseAirframe((1, 2), ("class=2",))]


async def test_one_motor_of_one_vehicle_turns_once_the_propellers_are_off() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 3, 4, section="motors")
        await c.press("down", "enter")
        assert "turn motor 2: vehicle 3" in c.text() and "propellers must be OFF" in c.text()
        await c.press("enter", "n", "escape")
        assert asked(c, TestMotor) == []
        await c.press("enter", "y")
        assert asked(c, TestMotor) == [TestMotor((3,), 2, 0.15, 1.0, props_removed=True)]


async def test_a_motor_that_turns_is_stopped_at_once() -> None:
    def turning(station: FakeStation) -> None:
        known(station)
        station.tasks = {9: TaskInfo(9, 3, "test of motor 2: 15 %, 1 s", "console-test", "running", 0, 0, "", 0.2)}

    async with console(WIDE, turning) as c:
        await opened(c, 3, section="motors")
        await c.press("delete")
        assert asked(c, CancelTask) == [CancelTask(9)]


async def test_a_gain_is_set_and_doubts_are_asked_about() -> None:
    def doubtful(station: FakeStation) -> None:
        known(station)
        station.doubts = "3 times what it is: more than a factor of 2: say that it is meant"

    async with console(WIDE, doubtful) as c:
        await opened(c, 1, 2, section="tuning")
        assert "was 0.12" in c.text()
        await c.press("enter", "ctrl+u", *"0.4", "enter")
        assert "more than a factor of 2" in c.text()
        await c.press("y")
        assert asked(c, SetGain) == [
            SetGain((1, 2), "ATC_RAT_RLL_P", 0.4), SetGain((1, 2), "ATC_RAT_RLL_P", 0.4, sure=True),
        ]  # fmt: skip


async def test_a_gain_beyond_the_vehicles_own_range_is_asked_about_again() -> None:
    def bounded(station: FakeStation) -> None:
        known(station)
        station.greatest = {"ATC_RAT_RLL_P": 0.2}

    async with console(WIDE, bounded) as c:
        await opened(c, 1, 2, section="tuning")
        await c.press("enter", "ctrl+u", *"0.25", "enter")
        assert "must be within its range" in c.text()
        await c.press("y")
        insisted = SetGain((1, 2), "ATC_RAT_RLL_P", 0.25, beyond_range=True)
        assert asked(c, SetGain)[-1] == insisted and "NOT DONE" not in panel(c)


async def test_gains_are_taken_back_one_by_one_or_all() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, 2, section="tuning")
        await c.press("u")
        assert asked(c, UndoGains) == [UndoGains((1, 2), "ATC_RAT_RLL_P")]
        await c.press("U", "y")
        assert asked(c, UndoGains)[-1] == UndoGains((1, 2))


async def test_a_transmitter_is_taken_back_after_y() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, section="radio")
        await c.press("u", "y")
        assert asked(c, UndoRadio) == [UndoRadio((1,))]


async def test_a_section_or_all_of_them_are_read() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, 2, section="battery")
        await c.press("R")
        await c.press("left", "R")
        assert asked(c, ReadSetup) == [ReadSetup((1, 2), "battery"), ReadSetup((1, 2))]


async def test_refusals_of_vehicles_are_shown_each() -> None:
    def armed(station: FakeStation) -> None:
        known(station)
        station.refuse = (2,)

    async with console(WIDE, armed) as c:
        await opened(c, 1, 2, section="sensors")
        await c.press("enter", "y")
        assert "vehicle 2: NOT DONE: prearm: compass" in panel(c)
        assert "calibrate accel: done, vehicle 1" in panel(c)


async def test_the_same_refusal_of_several_vehicles_is_one_line() -> None:
    def armed(station: FakeStation) -> None:
        known(station)
        station.refuse = (1, 2, 5)

    async with console(WIDE, armed) as c:
        await opened(c, 1, 2, 5, section="sensors")
        await c.press("enter", "y")
        assert "vehicles 1-2 5: NOT DONE: prearm: compass" in panel(c)


async def test_while_a_calibration_is_under_way_its_prompt_is_shown_once_and_del_is_on_the_footer() -> None:
    async with console(NARROW, calibrating) as c:
        await opened(c, 1, 2, 3, section="sensors")
        assert "note:" not in panel(c) and "Del cancel" in c.line(-1)


async def test_a_read_only_console_changes_nothing() -> None:
    async with console(WIDE, calibrating, read_only=True) as c:
        await opened(c, 1, 2, section="sensors")
        await c.press("enter", "y", "d", "delete", "y", "u", "U", "R")
        assert c.station.commands() == [] and "read-only" in panel(c)


async def test_a_silent_station_is_said_and_no_vehicle_is_too() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, section="sensors")
        c.station.silent = True
        c.clock.advance(5.0)
        c.app.feed.check()
        await c.settle()
        assert "STATION SILENT" in c.text()
    async with console(NARROW, lambda station: setattr(station, "count", 0)) as c:
        await c.press("S", "s")
        await look(c)
        await c.press("right", "enter", "R", "d", "delete", "end", "tab")
        assert "no vehicle heard" in c.text()


async def test_the_lines_of_a_section_are_not_those_of_the_one_before() -> None:
    async with console(WIDE, known) as c:
        await opened(c, 1, section="sensors")
        assert lines(c) == ["accel", "compass"]
        await c.press("left", "down")
        assert lines(c) == ["rc"]


async def test_the_palette_finds_the_screen() -> None:
    async with console(WIDE, known) as c:
        await c.press(":", *"setup", "enter")
        assert c.app.current_mode == "setup"


def alone(c: Console) -> list[str | None]:
    """The sections that were asked for alone; the screen itself looks at all of them by the real clock."""
    return [r.section for r in c.station.requests if isinstance(r, GetSetup) and r.only]


async def test_a_chosen_section_is_asked_for_alone_and_once() -> None:
    async with console(WIDE, known) as c:
        await opened(c, *range(1, 9))
        await c.press("tab", "home")
        c.station.requests.clear()
        await c.press("down", "down")
        assert alone(c) == ["sensors", "radio"]
        assert lines(c) == ["rc"]
        await c.press("end")
        c.station.requests.clear()
        await c.press("down", "down", "down")
        assert alone(c) == [], "the last section stays chosen"


async def test_the_footer_names_what_enter_does_and_d_only_while_a_prompt_waits() -> None:
    async with console(NARROW, known) as c:
        await opened(c, *range(1, 9))
        assert "Enter set" in c.line(-1) and "d done" not in c.line(-1) and "Del cancel" not in c.line(-1)
        await c.press("left")
        assert "Enter open" in c.line(-1)
        calibrating(c.station)
        await look(c)
        assert "d done" in c.line(-1) and "Del cancel" in c.line(-1)
