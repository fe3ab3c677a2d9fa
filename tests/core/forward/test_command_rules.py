"""What other stations may ask of a vehicle, thing by thing. See `forward_rig` for the area and the vehicles."""

import math
from functools import cache
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.core.rigs.forward_questions import ARDUCOPTER, HERE_INT, NAN, PX4, ask, flying, landed, long, plan_of, said
from tests.core.rigs.forward_rig import vehicle
from tui_gcs.core.forward.command_rules import MESSAGES, judge, may_stop
from tui_gcs.core.mavlink.dialect import layout_named

# ---------------------------------------------------------------- stops


@pytest.mark.parametrize(
    ("command", "params", "word"),
    [
        (20, (), "return"),
        (21, (), "land"),
        (193, (0,), "hold"),
        (400, (0, 0), "disarm"),
        (176, (1, 17), "hold"),  # BRAKE
        (176, (1, 6), "return"),
        (176, (1, 21), "return"),  # SMART_RTL
        (176, (1, 9), "land"),
        (262, (5,), "return"),
        (262, (7,), "land"),
    ],
)
def test_stops_have_the_guards_words_for_stops(command: int, params: tuple[float, ...], word: str) -> None:
    for who in (flying(), landed()):
        asked = long(who, command, *params)
        assert said(asked) == word and may_stop(asked)


@pytest.mark.parametrize(("sub", "word"), [(3, "hold"), (5, "return"), (6, "land"), (9, "land")])
def test_px4_stops_by_mode(sub: int, word: str) -> None:
    assert said(long(flying(PX4), 176, 1, 4, sub)) == word
    assert said(ask("SET_MODE", flying(PX4), base_mode=209, custom_mode=4 << 16 | sub << 24)) == word


def test_a_px4_is_paused_by_repositioning_it_nowhere() -> None:
    asked = long(flying(PX4), 192, -1, 1, 0, NAN, NAN, NAN, NAN)
    assert said(asked) == "hold" and may_stop(asked)
    nowhere = ask("COMMAND_INT", flying(PX4), command=192, x=HERE_INT, y=HERE_INT, z=NAN, param1=-1, param2=1,
                  param3=0, param4=NAN)  # fmt: skip
    assert said(nowhere) == "hold"


def test_loiter_stops_a_plane_but_a_copter_with_its_stick_down_sinks_in_it() -> None:
    plane = flying()
    plane.type = 1
    assert said(long(plane, 176, 1, 12)) == "hold"
    assert said(long(flying(), 176, 1, 5)).startswith("no: mode LOITER: only modes that need no pilot's sticks")


# ---------------------------------------------------------------- arming, modes, starts


@pytest.mark.parametrize(
    ("params", "word"),
    [
        ((1, 0), "arm"),
        ((0, 0), "disarm"),
        ((1, 21196), "no: a forced arming or disarming"),
        ((0, 21196), "no: a forced arming or disarming"),
        ((1, 2989), "no: a forced arming or disarming"),
        ((0, NAN), "no: a forced arming or disarming"),
        ((0.4, 0), "no: neither arm (1) nor disarm (0): 0.4"),
        ((NAN, 0), "no: neither arm (1) nor disarm (0): nan"),
    ],
)
def test_arming_is_never_forced(params: tuple[float, float], word: str) -> None:
    assert said(long(flying(), 400, *params)) == word
    assert said(ask("COMMAND_INT", flying(), command=400, param1=params[0], param2=params[1], param3=0, param4=0,
                    x=0, y=0, z=0)) == word  # fmt: skip


@pytest.mark.parametrize(
    ("mode", "word"),
    [
        (4, "mode GUIDED"),
        (0, "no: mode STABILIZE"),
        (1, "no: mode ACRO"),
        (14, "no: mode FLIP"),
        (99, "no: mode mode 99"),
        (262, "no: 262 is no whole number within 0…255"),  # ArduPilot would make an RTL of it
        (4.5, "no: 4.5 is no whole number within 0…255"),
        (NAN, "no: nan is no whole number within 0…255"),
        (-1, "no: -1 is no whole number within 0…255"),
        (math.inf, "no: inf is no whole number within 0…255"),
    ],
)
def test_modes_of_arducopter(mode: float, word: str) -> None:
    assert said(long(flying(), 176, 1, mode)).startswith(word)


@pytest.mark.parametrize(
    ("main", "sub", "word"),
    [(4, 2, "mode TAKEOFF"), (6, 0, "no: mode OFFBOARD"), (10, 0, "no: mode TERMINATION")],
)
def test_modes_of_px4(main: int, sub: int, word: str) -> None:
    assert said(long(flying(PX4), 176, 1, main, sub)).startswith(word)


def test_a_mode_must_be_numbered_and_must_not_arm() -> None:
    assert said(long(flying(), 176, 0, 4)) == "no: a mode without its number (base mode only)"
    assert said(ask("SET_MODE", landed(), base_mode=129, custom_mode=4)) == "no: a mode that arms"
    assert said(ask("SET_MODE", flying(), base_mode=129, custom_mode=4)) == "mode GUIDED"
    assert said(ask("SET_MODE", flying(), base_mode=1, custom_mode=262)).startswith("no: mode mode 262")


@pytest.mark.parametrize("current", [None, 1])
def test_missions_are_started_and_stepped_if_known_and_the_way_to_them_is_free(current: int | None) -> None:
    starts = [((300,), "mission start"), ((224, 1), "mission item"), ((193, 1), "continue"), ((176, 1, 3), "mode AUTO"),
              ((262, 6), "mode MISSION")]  # fmt: skip
    unknown = "no: which mission is on board is not known: upload it through this station first"
    blocked = "no: mission: to (150, 150) m: the straight way there leaves the operating area"
    for params, word in starts:
        near, far = plan_of(None, (60.0, 60.0)), plan_of(None, (150.0, 150.0))
        for plan in (near, far):
            if current is not None:
                plan.on_current(current, 0.0)
        assert said(long(flying(), *params, plan=near)) == word
        assert said(long(flying(), *params, plan=far)).startswith(blocked)
        assert said(long(flying(), *params)) == unknown
        assert said(long(flying(), *params, plan=plan_of((60.0, 60.0), accepted=False))) == unknown
    assert said(ask("MISSION_SET_CURRENT", flying(), plan=far, seq=1)).startswith(blocked)
    assert said(ask("SET_MODE", flying(PX4), base_mode=209, custom_mode=4 << 16 | 4 << 24)) == unknown


def test_a_mission_goes_on_where_the_vehicle_says_it_is() -> None:
    round_the_pond = plan_of((60.0, 60.0), (60.0, 140.0), (150.0, 150.0))
    assert said(long(flying(), 193, 1, plan=round_the_pond)) == (
        "no: mission: to (150, 150) m: the straight way there leaves the operating area, "
        "and it has not reported which item is next"
    )
    round_the_pond.on_current(1, 0.0)
    assert said(long(flying(), 193, 1, plan=round_the_pond)) == "continue"
    assert said(long(flying(), 224, -1, plan=round_the_pond)) == "mission item"
    assert said(long(flying(), 224, 2, plan=round_the_pond)).startswith("no: mission: to (150, 150) m")
    assert said(long(flying(), 300, 2, plan=round_the_pond)).startswith("no: mission: to (150, 150) m")
    assert said(long(flying(), 224, NAN, plan=round_the_pond)).startswith("no: nan is no whole number")
    round_the_pond.on_current(1, -6.0)
    assert "has not reported which item" in said(long(flying(), 193, 1, plan=round_the_pond))


@pytest.mark.parametrize(
    ("command", "params", "why"),
    [
        (185, (1,), "command 185: flight termination"),
        (209, (1, 0, 20, 5), "command 209: motor test"),
        (179, (1,), "command 179: would move home, the zero of all heights"),
        (245, (2,), "command 245: would overwrite stored parameters"),
        (241, (0, 0, 0, 0, 0, 1), "command 241: calibration, which may run motors"),
        (420, (), "command 420: failure injection"),
        (207, (0,), "would switch the fence off"),
        (207, (2,), "would switch the fence off"),
        (92, (1,), "command 92: not on the list of what other stations may ask"),
        (43001, (1,), "command 43001: not on the list of what other stations may ask"),
        (65535, (), "command 65535: not on the list of what other stations may ask"),
        (246, (1,), "it is armed"),
        (246, (3,), "only a plain restart of the autopilot (param 1 = 1, all others 0)"),
        (246, (1, 0, 0, 0, 0, 20190226), "only a plain restart of the autopilot (param 1 = 1, all others 0)"),
        (178, (1, 50), "50.0 m/s asked, 8.0 allowed"),
        (178, (1, math.inf), "inf m/s asked, 8.0 allowed"),
        (511, (30, -1), "an interval of -1 µs would stop messages or fill the link"),
        (511, (30, 1000), "an interval of 1000 µs would stop messages or fill the link"),
        (511, (0, 10_000_000), "an interval of 1e+07 µs: this station needs message 0 at least once a second"),
        (511, (33, 1_000_001), "an interval of 1e+06 µs: this station needs message 33 at least once a second"),
        (511, (33, 0), "an interval of 0 µs: this station needs message 33 at least once a second"),
        (511, (33.4, 100_000), "33.4 is no whole number within 0…16777215"),
        (511, (30, NAN), "an interval of nan µs would stop messages or fill the link"),
    ],
)
def test_what_is_dangerous_or_unknown_is_refused_with_the_reason(
    command: int, params: tuple[float, ...], why: str
) -> None:
    assert said(long(flying(), command, *params)) == f"no: {why}"


def test_what_is_harmless() -> None:
    assert said(long(landed(), 246, 1)) == "reboot"
    assert said(long(flying(), 207, 1)) == "fence on"
    assert said(long(flying(), 178, 1, 5)) == said(long(flying(), 178, 1, -1)) == "speed"
    assert said(long(flying(), 512, 148)) == "request"
    assert said(long(flying(), 511, 33, 100_000)) == said(long(flying(), 511, 30, 0)) == "message rates"
    assert judge(long(flying(), 512, 148)).quiet and not judge(long(flying(), 20)).quiet


# ---------------------------------------------------------------- parameters, rates, logs, files


@pytest.mark.parametrize(
    "name",
    [
        "FENCE_ENABLE",
        "fence_enable",
        "SYSID_THISMAV",
        "MAV_SYS_ID",
        "FS_GCS_ENABLE",
        "ARMING_CHECK",
        "CBRK_IO_SAFETY",
        "NAV_DLL_ACT",
        *("FORMAT_VERSION", "SERIAL0_PROTOCOL", "SR0_POSITION", "MAV1_POSITION", "BRD_SAFETY_MASK", "RC_OPTIONS"),
        *("MOT_SPIN_MIN", "SERVO1_FUNCTION", "FRAME_CLASS", "BATT_LOW_VOLT", "BATT2_CRT_VOLT", "SIM_ENGINE_FAIL"),
        *("RTL_ALT", "WPNAV_SPEED", "LAND_SPEED", "GUID_TIMEOUT", "EK3_SRC1_POSXY", "AHRS_EKF_TYPE", "CRASH_CHECK"),
        *(
            "MAV_0_RATE",
            "SER_TEL1_BAUD",
            "SYS_AUTOSTART",
            "PWM_MAIN_FUNC1",
            "CA_ROTOR0_PX",
            "BAT_LOW_THR",
            "BAT1_V_DIV",
        ),
        *("COM_LOW_BAT_ACT", "RTL_RETURN_ALT", "MPC_XY_VEL_MAX"),
    ],
)
def test_parameters_that_this_station_relies_on_are_not_set(name: str) -> None:
    text = said(ask("PARAM_SET", landed(), param_id=name, param_value=0.0, param_type=9))
    assert text == f"no: parameter {name.upper()}: this station relies on it"


def test_other_parameters_are_set_on_the_ground_and_all_are_read() -> None:
    tuning = {"param_id": "ATC_RAT_RLL_P", "param_value": NAN, "param_type": 9}
    assert said(ask("PARAM_SET", landed(), **tuning)) == "parameter ATC_RAT_RLL_P"
    assert said(ask("PARAM_SET", flying(), **tuning)) == (
        "no: parameter ATC_RAT_RLL_P: it is armed, and this station relies on its parameters in flight"
    )
    assert said(ask("PARAM_REQUEST_READ", flying(), param_id="FENCE_ENABLE", param_index=-1)) == "parameter read"
    assert said(ask("PARAM_REQUEST_LIST", flying())) == "parameter read"


@pytest.mark.parametrize(
    ("rate", "start", "ok"), [(4, 1, True), (50, 1, True), (0, 1, False), (4, 0, False), (999, 1, False)]
)
def test_streams_are_asked_for_but_not_stopped(rate: int, start: int, ok: bool) -> None:
    asked = ask("REQUEST_DATA_STREAM", flying(), req_stream_id=0, req_message_rate=rate, start_stop=start)
    assert (said(asked) == "message rates") == ok


def test_logs_are_read_on_the_ground_and_files_are_not() -> None:
    assert said(ask("LOG_REQUEST_DATA", landed(), id=1, ofs=0, count=90)) == "log read"
    assert said(ask("LOG_REQUEST_DATA", flying(), id=1, ofs=0, count=90)) == "no: it is armed"
    assert said(ask("LOG_REQUEST_END", flying())) == "log read"
    assert said(ask("FILE_TRANSFER_PROTOCOL", landed(), payload=(0,) * 251)).startswith("no: an autopilot has one file")


def test_a_stop_is_not_cancelled() -> None:
    assert said(ask("COMMAND_CANCEL", flying(), command=21)) == "no: would cancel a stop"
    assert said(ask("COMMAND_CANCEL", flying(), command=2000)) == "cancel"


# ---------------------------------------------------------------- anything

NUMBERS = st.one_of(
    st.floats(width=32),
    st.integers(-(2**31), 2**31 - 1),
    st.sampled_from([0.0, 1.0, NAN, math.inf, -math.inf, 1e38, 21196.0]),
)
KNOWN = [name for name in MESSAGES if layout_named(name) is not None]


USUAL = (0, 1, 2, 16, 22, 176, 178, 192, 193, 400, 511)
"""Commands and ids that the rules know."""


@cache
def values(kind: str, is_text: bool) -> st.SearchStrategy[Any]:
    """What a field of one type may hold. Strategies are kept: making one costs more than drawing from it."""
    if kind in ("float", "double"):
        return NUMBERS.map(float)
    if is_text:
        return st.text(max_size=16)
    bits = {"uint8_t": 8, "uint16_t": 16, "uint32_t": 32}.get(kind)
    few = st.integers(0, 2**bits - 1) if bits else st.integers(-(2**15), 2**15 - 1)
    return st.one_of(few, st.sampled_from([n for n in USUAL if not bits or n < 2**bits]))


@settings(max_examples=400)
@given(st.sampled_from(KNOWN), st.data())
def test_judging_never_raises_and_always_says_something(name: str, data: st.DataObject) -> None:
    known = layout_named(name)
    assert known is not None
    fields = {field.name: data.draw(values(field.type, field.is_text)) for field in known.fields}
    who = data.draw(st.sampled_from([flying, landed]))(data.draw(st.sampled_from([ARDUCOPTER, PX4, 0, 8])))
    asked = ask(name, who, vehicle(2, PX4, (80.0, 50.0, 30.0)), **fields)
    ruling = judge(asked)
    assert bool(ruling.what) != bool(ruling.why_not)
    assert may_stop(asked) or ruling.what not in ("hold", "land", "return", "disarm")
