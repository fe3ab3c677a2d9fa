"""From a vehicle's values in MAVLink's units to telemetry records. No simulator: frames written by hand."""

import math

import pytest
from pymavlink.dialects.v10 import common as version1

from tests.core.rigs.heard import ARMED, BEAT, E7, LAT, LON, Heard
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.mode_names import mode_name

NORTH_M, EAST_M = 111.26, 68.68
"""A thousandth of a degree there."""


# ---------------------------------------------------------------- where it is


def test_a_position_is_metres_east_north_and_above_home() -> None:
    vehicle = Heard().is_at(LAT + 0.001, LON - 0.001, alt=127_500, relative_alt=27_500)
    assert vehicle.telemetry.position_m == pytest.approx((-EAST_M, NORTH_M, 27.5), abs=0.05)
    assert (vehicle.telemetry.lat_deg, vehicle.telemetry.lon_deg, vehicle.telemetry.alt_amsl_m) == (
        52.001,
        -0.601,
        127.5,
    )


def test_below_home_is_below_home() -> None:
    assert Heard().is_at(relative_alt=-3_200, alt=-12_000).telemetry.alt_rel_m == -3.2


def test_north_east_and_down_become_east_north_and_up() -> None:
    vehicle = Heard().is_at(vx=300, vy=-400, vz=150, hdg=27_050)
    assert vehicle.telemetry.velocity_m_s == (-4.0, 3.0, -1.5) and vehicle.telemetry.ground_speed_m_s == 5.0
    assert vehicle.telemetry.heading_deg == 270.5


def test_a_heading_that_is_not_known_is_none() -> None:
    assert math.isnan(Heard().is_at(hdg=65535).telemetry.heading_deg)
    assert Heard().is_at(hdg=36000).telemetry.heading_deg == 360.0


def test_before_a_position_came_nothing_is_known() -> None:
    vehicle = Heard().vehicle
    assert not vehicle.telemetry.has_position()
    for value in (
        vehicle.telemetry.lat_deg,
        vehicle.telemetry.alt_rel_m,
        vehicle.telemetry.alt_amsl_m,
        vehicle.telemetry.ground_speed_m_s,
        vehicle.telemetry.battery_pct,
    ):
        assert math.isnan(value)


def test_mavlink_1_says_the_same() -> None:
    sender = version1.MAVLink(None, srcSystem=2, srcComponent=1)
    heard = Heard()
    for message in (
        version1.MAVLink_heartbeat_message(2, 3, 81 | 128, 4, 3, 3),
        version1.MAVLink_global_position_int_message(400, 52 * E7, round(LON * E7), 0, 27_500, 300, -400, 150, 9),
    ):
        heard.hear(message.pack(sender), over="old radio")
    vehicle = heard.fleet.vehicles[2]
    assert vehicle.telemetry.armed and vehicle.telemetry.custom_mode == 4
    assert vehicle.telemetry.position_m == pytest.approx((0.0, 0.0, 27.5), abs=0.01)
    assert vehicle.telemetry.velocity_m_s == (-4.0, 3.0, -1.5) and vehicle.telemetry.heading_deg == 0.09


@pytest.mark.parametrize(("lat", "lon"), [(90.1, LON), (-90.1, LON), (LAT, 180.1), (LAT, -180.1)])
def test_where_nobody_can_be_is_no_position(lat: float, lon: float) -> None:
    heard = Heard()
    assert not heard.is_at(lat, lon).telemetry.has_position()
    assert heard.fleet.dropped["invalid position"] == 1


def test_zeros_before_the_first_fix_are_no_position_and_after_it_an_invalid_one() -> None:
    heard = Heard()
    assert not heard.is_at(0.0, 0.0).telemetry.has_position()
    assert heard.fleet.dropped["position before its first fix"] == 1 and not heard.fleet.dropped["invalid position"]
    vehicle = heard.is_at(LAT, LON)
    before = vehicle.telemetry.position_m
    assert heard.is_at(0.0, 0.0).telemetry.position_m == before
    assert heard.fleet.dropped["invalid position"] == 1


@pytest.mark.parametrize(("lat", "lon"), [(0.0, 6.5), (51.5, 0.0)])
def test_on_the_equator_and_at_greenwich_one_can_be(lat: float, lon: float) -> None:
    assert Heard().is_at(lat, lon).telemetry.has_position()


def test_the_same_position_again_is_no_news() -> None:
    """A vehicle whose clock stands still repeats itself: it gets stale."""
    heard = Heard()
    here = {"time_boot_ms": 1000, "lat": 52 * E7, "lon": round(LON * E7), "vx": 10}
    first_s = heard.say("GLOBAL_POSITION_INT", **here).telemetry.position_s
    assert heard.say("GLOBAL_POSITION_INT", after_s=1.0, **here).telemetry.position_s == first_s
    assert heard.fleet.dropped["repeated position"] == 1
    assert heard.say("GLOBAL_POSITION_INT", after_s=1.0, **here | {"lat": 52 * E7 + 1}).telemetry.position_s > first_s


def test_an_older_position_that_comes_late_is_not_where_it_is() -> None:
    heard = Heard()
    heard.is_at(after_s=10.0)
    vehicle = heard.say("GLOBAL_POSITION_INT", time_boot_ms=9_000, lat=52 * E7 + 5000, lon=round(LON * E7))
    assert vehicle.telemetry.position_m[1] == 0.0 and heard.fleet.dropped["late position"] == 1


def test_a_jump_is_not_believed_until_three_more_agree() -> None:
    heard = Heard()
    heard.is_at()
    for _ in range(3):
        assert heard.is_at(LAT + 0.05).telemetry.position_m[1] == 0.0
    assert heard.is_at(LAT + 0.05).telemetry.position_m[1] == pytest.approx(50 * NORTH_M, rel=0.001)
    assert "position jumped: not used until confirmed" in heard.told()
    assert heard.fleet.dropped["implausible position"] == 3


def test_jumps_here_and_there_confirm_nothing() -> None:
    heard = Heard()
    heard.is_at()
    for number in range(10):
        assert heard.is_at(LAT + (0.05 if number % 2 else -0.05)).telemetry.position_m[1] == 0.0


def test_after_a_jump_back_to_where_it_was_it_takes_four_again() -> None:
    heard = Heard()
    heard.is_at()
    for lat in (LAT + 0.05, LAT + 0.05, LAT):
        heard.is_at(lat)
    for _ in range(3):
        assert heard.is_at(LAT + 0.05).telemetry.position_m[1] == 0.0


def test_how_far_it_may_have_come_grows_while_nothing_is_heard() -> None:
    """150 m/s and 50 m: 5 km are a jump after 32 s, and none after 34."""
    for silence_s, believed in ((32.0, False), (34.0, True)):
        heard = Heard()
        heard.is_at()
        assert (heard.is_at(LAT + 0.045, after_s=silence_s).telemetry.position_m[1] > 5000.0) is believed


def test_a_jump_to_the_other_side_of_the_origin_is_one() -> None:
    heard = Heard()
    heard.is_at(LAT + 0.02, LON + 0.02)
    x, y, _ = heard.vehicle.telemetry.position_m
    assert heard.is_at(LAT - 0.02, LON - 0.02).telemetry.position_m[:2] == (x, y)
    assert heard.is_at(LAT + 0.02, LON - 0.02).telemetry.position_m[:2] == (x, y)
    assert heard.is_at(LAT - 0.02, LON + 0.02).telemetry.position_m[:2] == (x, y)


def test_positions_that_come_ever_later_are_told_now_and_then() -> None:
    """A modem that buffers: each looks new, and is old."""
    heard = Heard()
    for _ in range(20):
        heard.is_at(after_s=0.5)
    assert [text for text in heard.told() if "late" in text] == []
    for number in range(100):
        boot_ms = round((heard.clock.now() + 0.5 - 0.1 * number) * 1e3)
        heard.say("GLOBAL_POSITION_INT", after_s=0.5, time_boot_ms=boot_ms, lat=52 * E7, lon=round(LON * E7))
    assert [text for text in heard.told() if "late" in text] == [
        "positions come 2 s late, or its clock runs slow",
        "positions come 7 s late, or its clock runs slow",
    ]


def test_a_new_origin_moves_what_is_known_and_no_vehicle() -> None:
    heard = Heard()
    heard.is_at(LAT + 0.001, LON, relative_alt=20_000)
    heard.say("HOME_POSITION", latitude=round((LAT + 0.002) * E7), longitude=round(LON * E7))
    heard.fleet.telemetry.reframe(LocalFrame(Origin(LAT + 0.001, LON, 100.0)), [heard.vehicle])
    assert heard.vehicle.telemetry.position_m == pytest.approx((0.0, 0.0, 20.0), abs=0.01)
    assert heard.vehicle.telemetry.home_m == pytest.approx((0.0, NORTH_M, 0.0), abs=0.05)


# ---------------------------------------------------------------- how well it knows that


@pytest.mark.parametrize(
    ("says", "error_m"),
    [
        ({"fix_type": 3, "eph": 120, "h_acc": 1_400}, 1.4),
        ({"fix_type": 3, "eph": 120}, 3.0),  # HDOP 1.2
        ({"fix_type": 2, "h_acc": 1_400}, math.inf),
        ({"fix_type": 0}, math.inf),
    ],
)
def test_accuracy_is_what_its_gps_claims(says: dict[str, int], error_m: float) -> None:
    vehicle = Heard().say("GPS_RAW_INT", satellites_visible=17, **says)
    assert vehicle.integrity.position_error_m == pytest.approx(error_m)
    assert (vehicle.telemetry.gps_fix, vehicle.telemetry.satellites) == (says["fix_type"], 17)


def test_what_its_gps_does_not_say_is_not_known() -> None:
    vehicle = Heard().say("GPS_RAW_INT", fix_type=3, eph=65535, satellites_visible=255)
    assert math.isnan(vehicle.integrity.position_error_m) and vehicle.telemetry.satellites == -1


def test_a_position_that_gets_bad_is_told_once_and_only_of_who_is_armed() -> None:
    for beat, reported in ((BEAT, []), (ARMED, ["position degraded: ±12 m"])):
        heard = Heard(**beat)
        heard.say("GPS_RAW_INT", fix_type=3, h_acc=900)
        heard.say("GPS_RAW_INT", fix_type=3, h_acc=10_000)
        heard.say("GPS_RAW_INT", fix_type=3, h_acc=12_000)
        heard.say("GPS_RAW_INT", fix_type=3, h_acc=13_000, after_s=60.0)
        assert [text for text in heard.told() if "degraded" in text] == reported


def test_a_fix_that_is_lost_in_flight_is_told_as_that() -> None:
    heard = Heard(**ARMED)
    heard.say("GPS_RAW_INT", fix_type=3, h_acc=900)
    heard.say("GPS_RAW_INT", fix_type=1)
    assert [text for text in heard.told() if "degraded" in text] == ["position degraded: no GPS fix"]


@pytest.mark.parametrize(
    ("first", "second", "later_s", "error_m"),
    [
        ({}, {"north": 0.001}, 1.0, 101.3),  # 111 m, of which it flew 10
        ({}, {"north": 0.00005}, 1.0, 0.5),  # 6 m: nothing but its flight
        ({}, {"north": -0.0002}, 0.0, 22.3),
        ({}, {"east": 0.001}, 0.0, 68.7),
        ({}, {"north": 0.00008}, 0.0, 0.5),  # 9 m apart is what plain receivers are
        ({"h_acc": 200_000}, {"north": 0.001}, 0.0, 200.0),  # it says worse itself
        ({}, {"north": 0.001, "fix_type": 2}, 0.0, 0.5),  # that one has no place
        ({"fix_type": 2}, {"north": 0.001}, 0.0, math.inf),
        ({}, {"north": 0.001}, 3.1, 0.5),  # that one has said nothing for long
    ],
)
def test_two_receivers_that_disagree_leave_so_much_doubt(
    first: dict[str, float], second: dict[str, float], later_s: float, error_m: float
) -> None:
    """At 10 m/s; the second one speaks first, so that the vehicle flies on in between."""
    heard = Heard()
    heard.is_at(vx=1000)
    for name, said, after_s in (("GPS2_RAW", second, 0.1), ("GPS_RAW_INT", first, later_s)):
        lat, lon = LAT + said.get("north", 0.0), LON + said.get("east", 0.0)
        fields = {"fix_type": 3, "h_acc": 500} | {key: value for key, value in said.items() if "_" in key}
        heard.say(name, after_s=after_s, lat=round(lat * E7), lon=round(lon * E7), **fields)
    assert heard.vehicle.integrity.position_error_m == pytest.approx(error_m, abs=0.3)


def test_of_two_receivers_the_gap_counts() -> None:
    heard = Heard(**ARMED)
    place = {"lat": round(LAT * E7), "lon": round(LON * E7), "fix_type": 3, "h_acc": 500}
    heard.say("GPS2_RAW", **place | {"lat": round((LAT + 0.001) * E7)})
    assert heard.say("GPS_RAW_INT", **place).integrity.position_error_m == pytest.approx(NORTH_M, abs=1.0)
    assert "position degraded: its GPS receivers are 111 m apart" in heard.told()
    assert heard.say("GPS_RAW_INT", after_s=3.5, **place).integrity.position_error_m == 0.5, (
        "the second one fell silent"
    )


# ---------------------------------------------------------------- its battery


def test_a_battery_by_sys_status_until_battery_status_comes() -> None:
    heard = Heard()
    vehicle = heard.say("SYS_STATUS", voltage_battery=15_900, battery_remaining=71)
    assert (vehicle.telemetry.battery_v, vehicle.telemetry.battery_pct) == (15.9, 71.0)
    heard.say("BATTERY_STATUS", voltages=[16_200] + [65535] * 9, battery_remaining=80)
    vehicle = heard.say("SYS_STATUS", voltage_battery=15_900, battery_remaining=71)
    assert (vehicle.telemetry.battery_v, vehicle.telemetry.battery_pct) == (16.2, 80.0)


def test_cells_are_summed_and_a_second_battery_is_another() -> None:
    heard = Heard()
    vehicle = heard.say("BATTERY_STATUS", voltages=[4_100, 4_050, 4_000, 3_950] + [65535] * 6, battery_remaining=64)
    assert (vehicle.telemetry.battery_v, vehicle.telemetry.battery_pct) == (16.1, 64.0)
    vehicle = heard.say("BATTERY_STATUS", id=1, voltages=[3_000] + [65535] * 9, battery_remaining=5)
    assert (vehicle.telemetry.battery_v, vehicle.telemetry.battery_pct) == (16.1, 64.0)


@pytest.mark.parametrize("percent", [-1, 101, -128])
def test_a_charge_that_is_none_is_not_known(percent: int) -> None:
    heard = Heard()
    assert math.isnan(heard.say("SYS_STATUS", voltage_battery=65535, battery_remaining=percent).telemetry.battery_pct)
    assert math.isnan(heard.vehicle.telemetry.battery_v)
    assert math.isnan(
        heard.say("BATTERY_STATUS", voltages=[65535] * 10, battery_remaining=percent).telemetry.battery_pct
    )
    assert math.isnan(heard.vehicle.telemetry.battery_v)


@pytest.mark.parametrize("percent", [0, 100])
def test_empty_and_full_are_known(percent: int) -> None:
    assert Heard().say("SYS_STATUS", battery_remaining=percent).telemetry.battery_pct == percent


def test_a_battery_that_empties_is_told_at_25_and_at_15_once() -> None:
    heard = Heard()
    for percent in (26, 25, 24, 23, 16, 15, 14, 13):
        heard.say("SYS_STATUS", battery_remaining=percent, after_s=60.0)
    assert [text for text in heard.told() if "battery" in text] == ["battery below 25 %", "battery below 15 %"]


def test_a_battery_that_is_nearly_empty_when_first_heard_is_told_as_that() -> None:
    heard = Heard()
    heard.say("SYS_STATUS", battery_remaining=9)
    assert [text for text in heard.told() if "battery" in text] == ["battery below 15 %"]


# ---------------------------------------------------------------- its state


def test_a_heartbeat_says_what_it_is_and_whether_it_is_armed() -> None:
    heard = Heard(custom_mode=4, type=13, autopilot=12, system_status=5)
    vehicle = heard.vehicle
    assert (vehicle.telemetry.custom_mode, vehicle.type, vehicle.autopilot, vehicle.telemetry.system_status) == (
        4,
        13,
        12,
        5,
    )
    assert not vehicle.telemetry.armed
    assert (
        heard.say("HEARTBEAT", **ARMED, after_s=5.0).telemetry.armed
        and vehicle.telemetry.heartbeat_s == heard.clock.now()
    )
    assert not heard.say("HEARTBEAT", **BEAT, after_s=5.0).telemetry.armed


def test_an_armed_bit_that_flickers_is_armed_until_it_rests() -> None:
    heard = Heard()
    for beat in (ARMED, BEAT, ARMED, BEAT):
        heard.say("HEARTBEAT", **beat, after_s=0.5)
    assert heard.vehicle.telemetry.armed and "armed state flickers: taken as armed" in heard.told()
    assert not heard.say("HEARTBEAT", **BEAT, after_s=1.0).telemetry.armed


def test_armed_and_disarmed_by_turns_every_second_is_no_flicker() -> None:
    heard = Heard()
    for beat in (ARMED, BEAT, ARMED, BEAT):
        heard.say("HEARTBEAT", **beat, after_s=1.0)
    assert not heard.vehicle.telemetry.armed and not [text for text in heard.told() if "flickers" in text]


def test_on_the_ground_in_the_air_and_ready_to_arm() -> None:
    heard = Heard(**ARMED)
    assert heard.say("EXTENDED_SYS_STATE", landed_state=1).telemetry.on_ground
    assert not heard.say("EXTENDED_SYS_STATE", landed_state=2).telemetry.on_ground and heard.vehicle.telemetry.airborne
    assert heard.say("SYS_STATUS", onboard_control_sensors_health=0x10000000).telemetry.prearm_ok
    assert not heard.say("SYS_STATUS", onboard_control_sensors_health=0x0FFFFFFF).telemetry.prearm_ok


def test_home_is_a_place_and_a_height_above_the_sea() -> None:
    heard = Heard()
    place = {"latitude": round((LAT + 0.001) * E7), "longitude": round((LON + 0.001) * E7), "altitude": 112_300}
    vehicle = heard.say("HOME_POSITION", **place)
    assert (
        vehicle.telemetry.home_m == pytest.approx((EAST_M, NORTH_M, 0.0), abs=0.05)
        and vehicle.telemetry.home_amsl_m == 112.3
    )


def test_a_home_that_nobody_can_have_is_refused_and_told() -> None:
    heard = Heard()
    heard.is_at()
    heard.say("HOME_POSITION", latitude=round(LAT * E7), longitude=round(LON * E7))
    assert heard.say("HOME_POSITION", latitude=53 * E7, longitude=round(LON * E7)).telemetry.home_m is None
    assert heard.fleet.dropped["implausible home"] == 1 and "reports a home 111 km away" in heard.told()[-1]
    heard.say("HOME_POSITION", latitude=round(LAT * E7), longitude=round(LON * E7))
    heard.say("HEARTBEAT", **ARMED)
    kept = heard.say("HOME_POSITION", latitude=53 * E7, longitude=round(LON * E7)).telemetry.home_m
    assert kept == pytest.approx((0.0, 0.0, 0.0)), "it is where it took off"
    assert heard.say("HOME_POSITION", latitude=0, longitude=0).telemetry.home_m == kept


@pytest.mark.parametrize(
    ("at_deg", "home_deg", "armed", "believed"),
    [
        (None, 1.0, True, True),  # where it is, it has not said yet
        (0.0, 0.44, False, True),  # 49 km
        (0.0, 0.46, False, False),  # 51 km
        (0.0, 0.02, True, False),  # 2 km from where it took off, and from where it is
        (0.0, 0.02, False, True),
        (0.02, 0.02, True, True),  # set anew where it is
        (0.02, 0.008, True, True),  # 900 m from where it took off
    ],
)
def test_which_homes_are_believed(at_deg: float | None, home_deg: float, armed: bool, believed: bool) -> None:
    """Degrees north of where it took off, which is the home that it had told."""
    heard = Heard(**(ARMED if armed else BEAT))
    if at_deg is not None:
        heard.is_at()
        heard.say("HOME_POSITION", latitude=52 * E7, longitude=round(LON * E7))
        heard.is_at(LAT + at_deg, after_s=60.0)
    reported = heard.say(
        "HOME_POSITION", latitude=round((LAT + home_deg) * E7), longitude=round(LON * E7)
    ).telemetry.home_m
    assert (reported is not None and reported[1] == pytest.approx(1000.0 * NORTH_M * home_deg, rel=0.001)) is believed


@pytest.mark.parametrize(
    ("north_m", "up_m", "told"),
    [
        (4.5, 1.9, ""),  # homes are set from GPS
        (5.6, 0.0, "its home moved 6 m, +0 m in height"),
        (0.0, -2.1, "its home moved 0 m, -2 m in height"),
        (110.0, 30.0, "its home moved 110 m, +30 m in height"),
    ],
)
def test_a_home_that_moves_in_flight_is_told(north_m: float, up_m: float, told: str) -> None:
    for relative_alt in (20_000, 0):
        heard = Heard(**ARMED)
        heard.is_at(relative_alt=relative_alt)
        heard.say("HOME_POSITION", latitude=round(LAT * E7), longitude=round(LON * E7), altitude=100_000)
        moved = {"latitude": round((LAT + north_m / 1000 / NORTH_M) * E7), "altitude": round(1000 * (100 + up_m))}
        heard.say("HOME_POSITION", longitude=round(LON * E7), **moved)
        said = "".join(text.split(":")[0] for text in heard.told() if "home moved" in text)
        assert said == (told if relative_alt else ""), "on the ground it may be set as often as it likes"


# ---------------------------------------------------------------- over a satellite


def distant(heard: Heard, after_s: float = 10.0, **fields: int) -> Vehicle:
    """HIGH_LATENCY2, of a vehicle that said nothing else for a while."""
    place = {"latitude": round(LAT * E7), "longitude": round((LON + 0.001) * E7), "altitude": 140}
    boot_ms = round((heard.clock.now() + after_s) * 1e3)
    said = {"type": 2, "autopilot": 3, "timestamp": boot_ms} | place | fields
    return heard.say("HIGH_LATENCY2", after_s=after_s, **said)


def test_one_message_of_a_satellite_says_where_it_is_and_how_fast() -> None:
    """Headings in 2 degrees, speeds in 0.2 m/s, climb rates in 0.1 m/s, the charge in percent."""
    heard = Heard()
    vehicle = distant(heard, heading=45, groundspeed=25, climb_rate=-13, battery=71, custom_mode=6)
    assert vehicle.telemetry.position_s == heard.clock.now()
    assert (
        vehicle.telemetry.position_m[:2] == pytest.approx((EAST_M, 0.0), abs=0.05)
        and vehicle.telemetry.alt_amsl_m == 140.0
    )
    assert vehicle.telemetry.velocity_m_s == (5.0, 0.0, -1.3) and vehicle.telemetry.heading_deg == 90.0
    assert (vehicle.telemetry.battery_pct, vehicle.telemetry.custom_mode) == (71.0, 6)


@pytest.mark.parametrize(("said", "mode"), [(3 << 8 | 4, "HOLD"), (5 << 8 | 4, "RTL"), (6, "OFFBOARD")])
def test_over_a_satellite_the_mode_of_a_px4_is_the_upper_half_of_its_number(said: int, mode: str) -> None:
    """PX4 puts the upper 16 bits of its custom_mode there (custom_mode_hl of px4_custom_mode.h): main and sub mode."""
    vehicle = distant(Heard(autopilot=12), autopilot=12, custom_mode=said)
    assert mode_name(12, 2, vehicle.telemetry.custom_mode) == mode


def test_over_a_satellite_an_ardupilot_says_whether_it_is_armed() -> None:
    """Its base_mode is in custom0, a signed byte (GCS_Common.cpp): 0x80 is armed, 217 of GUIDED is -39."""
    heard = Heard()
    heard.is_at()
    assert heard.say("HEARTBEAT", **BEAT | {"base_mode": 217}).telemetry.armed
    assert not distant(heard, custom0=89).telemetry.armed
    assert distant(heard, custom0=217 - 256).telemetry.armed
    assert distant(heard, after_s=1.0, custom0=217 - 256).telemetry.armed


def test_who_might_be_armed_is_taken_as_armed() -> None:
    """PX4 says nothing of it over a satellite: the last heartbeat counts, and without one nobody knows."""
    heard = Heard(autopilot=12)
    assert not distant(heard, autopilot=12).telemetry.armed
    heard.sender = Encoder(2, 1)
    distant(heard, autopilot=12)
    assert heard.fleet.vehicles[2].telemetry.armed


def test_over_a_satellite_the_height_goes_on_from_what_was_known() -> None:
    """It says metres above the sea: how much they changed, the height above home did."""
    heard = Heard()
    heard.is_at(alt=130_000, relative_alt=30_000)
    assert distant(heard, altitude=140).telemetry.alt_rel_m == pytest.approx(40.0)
    assert distant(heard, altitude=105).telemetry.alt_rel_m == pytest.approx(5.0)


def test_a_height_over_a_satellite_alone_is_above_nothing_known() -> None:
    vehicle = distant(Heard(), altitude=140)
    assert vehicle.telemetry.alt_amsl_m == 140.0 and math.isnan(vehicle.telemetry.alt_rel_m)


def test_what_the_normal_link_brings_comes_first_and_what_is_older_changes_nothing() -> None:
    heard = Heard()
    heard.is_at(alt=130_000, relative_alt=30_000)
    vehicle = distant(heard, after_s=1.0, custom_mode=9)
    assert vehicle.telemetry.position_m[0] == 0.0 and vehicle.telemetry.custom_mode == 4
    vehicle = heard.say(
        "HIGH_LATENCY2", after_s=20.0, latitude=52 * E7, longitude=0, custom_mode=9, battery=5, timestamp=50
    )
    assert (
        vehicle.telemetry.position_m[0] == 0.0
        and vehicle.telemetry.custom_mode == 4
        and math.isnan(vehicle.telemetry.battery_pct)
    )
    assert distant(heard, latitude=0, longitude=0, battery=9).telemetry.position_m[0] == 0.0
    assert heard.fleet.dropped["invalid position"] == 1
