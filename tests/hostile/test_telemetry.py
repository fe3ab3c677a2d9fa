"""Bad input B.6-100…107: impossible numbers, reported by vehicle 1 itself. One test for each case of the catalogue."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from tests.hostile.oracle import Oracle
from tests.hostile.test_framing import HEARTBEAT, raw_frame, to_home
from tui_gcs.core.flight.fleet_monitor import error_m
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol.common import Freshness, Phase

pytestmark = pytest.mark.long  # nearly each is a flight

Attack = Callable[..., Oracle]
HOME: Address = ("sim", 0)
INT32_MAX = 2**31 - 1
NUMBERS = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf, "huge": 3.0e38, "-0": -0.0}


def boot_ms(oracle: Oracle) -> int:
    """What the boot clock of vehicle 1 shows now."""
    return oracle.vehicle.path.boot_clock.boot_ms


def position(oracle: Oracle, east_m: float = 0.0, **lie: int) -> dict[str, int]:
    """Where vehicle 1 is, but for the lie."""
    x, y, z = oracle.vehicle.telemetry.position_m
    lat, lon = oracle.flight.station.picture.fleet.frame.to_geodetic(x + east_m, y)
    place = {"lat": round(float(lat) * 1e7), "lon": round(float(lon) * 1e7), "relative_alt": round(z * 1e3)}
    return {"time_boot_ms": boot_ms(oracle), "alt": 120_000, "vx": 0, "vy": 0, "vz": 0, "hdg": 0} | place | lie


def zeros(name: str, **fields: Any) -> dict[str, Any]:
    """Fields of a message, all zero but for these."""
    layout = dialect.layout_named(name)
    assert layout is not None
    made: dict[str, Any] = {f.name: b"" if f.is_text else 0 if f.count == 1 else [0] * f.count for f in layout.fields}
    return made | fields


def battery(**fields: Any) -> dict[str, Any]:
    return zeros("BATTERY_STATUS", voltages=[16_000] + [65535] * 9, battery_remaining=80) | fields


# ---------------------------------------------------------------- 100


@pytest.mark.parametrize(
    "lie",
    [{"lat": 0, "lon": 0}, {"lat": INT32_MAX}, {"lon": INT32_MAX}, {"lat": -INT32_MAX - 1}, {"lat": 900_000_001}],
    ids=str,
)
def test_b6_100_impossible_positions(attack: Attack, lie: dict[str, int]) -> None:
    oracle = attack()
    for _ in range(10):
        before = oracle.vehicle.telemetry.position_m
        oracle.say("GLOBAL_POSITION_INT", 1, **position(oracle, **lie))
        oracle.flight.station.receive()
        oracle.flight.station.picture.fleet.tick()
        assert oracle.vehicle.telemetry.position_m == before
        oracle.run(0.1)
    oracle.holds(counted="invalid position", told="frames not taken: invalid position")


def test_b6_100_a_jump_of_500_km(attack: Attack) -> None:
    """And back: never drawn, never used. A jump that stays is believed from the fourth fix on."""
    oracle = attack()
    for _ in range(20):
        before = oracle.vehicle.telemetry.position_m
        oracle.say("GLOBAL_POSITION_INT", 1, **position(oracle, 500_000.0))
        oracle.flight.station.receive()
        oracle.flight.station.picture.fleet.tick()
        assert oracle.vehicle.telemetry.position_m == before
        oracle.run(0.1)
    assert oracle.flight.phase(1) is Phase.FLYING
    oracle.holds(counted="implausible position", told="position jumped: not used until confirmed", sends=to_home)


# ---------------------------------------------------------------- 101


def test_b6_101_numbers_that_are_none(attack: Attack) -> None:
    """In every float field of every message we know. The picture of the vehicle is made of integers, so stays."""
    oracle = attack()
    for name, value in NUMBERS.items():
        _say_in_every_float(oracle, value)
        oracle.run(1.0)
        picture = oracle.vehicle.telemetry
        assert all(math.isfinite(x) for x in picture.position_m + picture.velocity_m_s), name
    assert oracle.flight.frame is not None
    oracle.holds(sends=to_home, less=to_home)


def _say_in_every_float(oracle: Oracle, value: float) -> None:
    dialect.is_known(0)
    floats = 0
    for msgid in sorted(dialect._definitions):
        layout = dialect.layout(msgid)
        assert layout is not None
        lies: dict[str, Any] = {
            f.name: value if f.count == 1 else [value] * f.count for f in layout.fields if f.type in ("float", "double")
        }
        if not lies or layout.name in ("COMMAND_ACK", "SETUP_SIGNING"):
            continue
        floats += 1
        fields = zeros(layout.name) | lies
        payload = layout.pack(*_in_wire_order(layout, fields))
        oracle.inject(raw_frame(msgid, payload), HOME)
        if floats % 20 == 0:
            oracle.run(0.05)
    assert floats > 100


def _in_wire_order(layout: dialect.MessageLayout, fields: dict[str, Any]) -> list[Any]:
    values: list[Any] = []
    for f in layout.fields:
        one = fields[f.name]
        values += [one] if f.is_text or f.count == 1 else list(one)
    return values


# ---------------------------------------------------------------- 102


@pytest.mark.parametrize("percent", [-1, -56, -128, 101, 127])
def test_b6_102_a_battery_that_is_not_known(attack: Attack, percent: int) -> None:
    """No alarm that it is low, but one that it is not known any more."""
    oracle = attack()
    assert not math.isnan(oracle.vehicle.telemetry.battery_pct)
    oracle.say("BATTERY_STATUS", 1, **battery(battery_remaining=percent, voltages=[65535] * 10, current_battery=-1))
    oracle.run(0.1)
    assert math.isnan(oracle.vehicle.telemetry.battery_pct) and math.isnan(oracle.vehicle.telemetry.battery_v)
    assert not oracle.told("battery below")
    oracle.holds(told="battery unknown")


def test_b6_102_a_battery_that_is_not_known_by_sys_status(attack: Attack) -> None:
    """Without BATTERY_STATUS; afterwards it is known again, and low."""
    oracle = attack()
    oracle.flight.on_way = lambda data, address: (
        None if address == HOME and data[7:10] in (b"\x93\0\0", b"\1\0\0") else oracle.inject(data, address)
    )
    oracle.vehicle.telemetry.has_battery_status = False
    status = zeros("SYS_STATUS", voltage_battery=65535, current_battery=-1)
    oracle.say("SYS_STATUS", 1, **status | {"battery_remaining": -1})
    oracle.run(0.1)
    assert math.isnan(oracle.vehicle.telemetry.battery_pct) and math.isnan(oracle.vehicle.telemetry.battery_v)
    assert not oracle.told("battery below")
    oracle.say("SYS_STATUS", 1, **status | {"battery_remaining": 10})
    oracle.run(0.1)
    assert oracle.vehicle.telemetry.battery_pct == 10.0
    assert oracle.told("battery below 15 %"), "unknown in between does not hide it"
    oracle.holds(told="battery unknown", sends=to_home, less=to_home)


# ---------------------------------------------------------------- 103


def test_b6_103_a_boot_clock_that_goes_back(attack: Attack) -> None:
    oracle = attack(flying=False)
    oracle.flight.sim._pilots[0].restart(oracle.flight.sim._now_us)
    oracle.run(15.0)
    assert oracle.vehicle.integrity.reboots == 1, "once"
    assert oracle.vehicle.freshness(oracle.now) is Freshness.OK and oracle.vehicle.identity.identified
    oracle.holds(told="rebooted", sends=to_home, less=to_home)


def test_b6_103_a_boot_clock_that_wraps(attack: Attack) -> None:
    """After 49.7 days: no reboot."""
    oracle = attack()
    shift = 2**32 - boot_ms(oracle) - 2000
    oracle.vehicle.path.boot_clock.boot_ms += shift

    def later(data: bytes, address: Address) -> None:
        if address == HOME and data[7:10] == b"\x21\0\0":
            time = (int.from_bytes(data[10:14], "little") + shift) % 2**32
            data = raw_frame(33, time.to_bytes(4, "little") + data[14 : 10 + data[1]], seq=data[4])
        oracle.inject(data, address)

    oracle.flight.on_way = later
    oracle.run(5.0)
    assert oracle.vehicle.integrity.reboots == 0 and boot_ms(oracle) < 5000
    assert oracle.now - oracle.vehicle.telemetry.position_s < 0.3
    oracle.holds()


def test_b6_103_a_boot_clock_that_jumps_a_day_ahead(attack: Attack) -> None:
    """And stays there: a reboot, once, after which everything is asked anew."""
    oracle = attack(flying=False)

    def ahead(data: bytes, address: Address) -> None:
        if address == HOME and data[7:10] == b"\x21\0\0":
            time = int.from_bytes(data[10:14], "little") + 86_400_000
            data = raw_frame(33, time.to_bytes(4, "little") + data[14 : 10 + data[1]], seq=data[4])
        oracle.inject(data, address)

    oracle.run(10.0)
    oracle.flight.on_way = ahead
    oracle.run(10.0)
    assert oracle.vehicle.integrity.reboots == 1
    assert oracle.vehicle.identity.identified and oracle.now - oracle.vehicle.telemetry.position_s < 0.3
    oracle.holds(told="rebooted", sends=to_home, less=to_home)


# ---------------------------------------------------------------- 104


def test_b6_104_an_armed_bit_that_flickers(attack: Attack) -> None:
    """Counted as armed: a vehicle that might be armed is treated so."""
    oracle = attack()
    for number in range(40):
        oracle.say("HEARTBEAT", 1, **{**HEARTBEAT, "base_mode": 81 + 128 * (number % 2), "custom_mode": 4})
        oracle.run(0.1)
    assert oracle.vehicle.telemetry.armed
    assert len(oracle.told("armed state flickers")) == 1
    oracle.holds(told="armed state flickers: taken as armed", sends=to_home, less=to_home)


def test_b6_104_an_unknown_mode(attack: Attack) -> None:
    oracle = attack(flying=False)
    oracle.flight.on_way = lambda data, address: (
        None if address == HOME and data[7:10] == b"\0\0\0" else oracle.inject(data, address)
    )
    for _ in range(10):
        oracle.say("HEARTBEAT", 1, **{**HEARTBEAT, "custom_mode": 0xFFFFFFFF})
        oracle.run(0.1)
    frame = oracle.flight.frame
    assert frame is not None and "4294967295" in frame.mode[0]
    oracle.holds(sends=to_home, less=to_home)


# ---------------------------------------------------------------- 105


@pytest.mark.parametrize(
    "lie", [{"fix_type": 1}, {"fix_type": 3, "eph": 9999}, {"fix_type": 3, "eph": 100, "h_acc": 80_000}], ids=str
)
def test_b6_105_a_position_that_gps_does_not_stand_for(attack: Attack, lie: dict[str, int]) -> None:
    """The vehicle's error is known and reported."""
    oracle = attack()
    oracle.flight.on_way = lambda data, address: (
        None if address == HOME and data[7:10] == b"\x18\0\0" else oracle.inject(data, address)
    )
    fields = zeros("GPS_RAW_INT", satellites_visible=4, eph=9999, epv=65535, vel=65535, cog=65535)
    oracle.say("GPS_RAW_INT", 1, **fields | lie)
    oracle.run(0.05)
    assert oracle.vehicle.integrity.position_error_m > 10.0
    oracle.holds(told="position degraded", sends=to_home)


def second_receiver(oracle: Oracle, east_m: float, **lie: int) -> None:
    """From now on vehicle 1 reports its second GPS receiver: so far east of it, but for the lie."""

    def also(data: bytes, address: Address) -> None:
        oracle.inject(data, address)
        if address == HOME and data[7:10] == b"\x18\0\0":
            place = position(oracle, east_m)
            fields = {"fix_type": 3, "h_acc": 500, "lat": place["lat"], "lon": place["lon"]} | lie
            oracle.say("GPS2_RAW", 1, **zeros("GPS2_RAW", **fields))

    oracle.flight.on_way = also


def test_b6_105_two_receivers_that_disagree(attack: Attack) -> None:
    """Which is right, is not known: the position may be wrong by as much, and the vehicle is that near to others."""
    oracle = attack()
    second_receiver(oracle, 200.0)
    oracle.run(3.0)
    assert oracle.vehicle.integrity.position_error_m == pytest.approx(200.0, abs=2.0)
    assert error_m(oracle.vehicle) == 100.0
    oracle.holds(told="position degraded: its GPS receivers are (199|200|201) m apart", sends=to_home)
    assert len(oracle.told("position degraded")) == 1
    oracle.flight.on_way = None
    oracle.run(6.0)
    assert oracle.vehicle.integrity.position_error_m < 10.0 and error_m(oracle.vehicle) == 0.0


@pytest.mark.parametrize(
    ("east_m", "lie"), [(3.0, {}), (200.0, {"fix_type": 1}), (0.0, {"fix_type": 0, "lat": 0, "lon": 0})], ids=str
)
def test_b6_105_two_receivers_that_agree_and_a_second_without_a_fix(
    attack: Attack, east_m: float, lie: dict[str, int]
) -> None:
    """In flight one receiver reports later than the other: the distance flown meanwhile is no disagreement."""
    oracle = attack()
    second_receiver(oracle, east_m, **lie)
    oracle.run(6.0)
    assert oracle.vehicle.integrity.position_error_m < 10.0
    assert not oracle.told("position degraded")
    oracle.holds(sends=to_home)


# ---------------------------------------------------------------- 106


def test_b6_106_ten_thousand_aircraft(attack: Attack) -> None:
    """Other traffic is not kept but for the newest message of each sender."""
    oracle = attack()
    layout = dialect.layout_named("ADSB_VEHICLE")
    assert layout is not None

    def flood() -> Any:
        for icao in range(10_000):
            values = zeros("ADSB_VEHICLE", ICAO_address=icao, callsign=b"EVIL%d" % icao, lat=520_720_000 + icao)
            payload = layout.pack(*_in_wire_order(layout, values))
            yield raw_frame(246, payload, component=156, seq=icao & 255), HOME

    oracle.flood(flood())
    assert set(oracle.flight.station.picture.fleet.vehicles) == {1, 2}
    source = oracle.vehicle.path.source
    assert sum(slot.msgid == 246 for slot in source.slots.values()) == 1
    oracle.holds()


# ---------------------------------------------------------------- 107


def test_b6_107_high_latency_beside_the_normal_streams(attack: Attack) -> None:
    """It changes nothing while they come, be its content old or wrong; and nobody is lost and found.

    Its clock is asked for a little later: not between a HIGH_LATENCY2 and the next heartbeat.
    """

    def asks_the_time(address: Address, message: str) -> bool:
        return address == HOME and message == "TIMESYNC"

    oracle = attack()
    for _ in range(60):
        far = zeros("HIGH_LATENCY2", type=2, autopilot=3, latitude=100_000_000, longitude=100_000_000, battery=1)
        oracle.say("HIGH_LATENCY2", 1, **far)
        oracle.run(0.5)
        twin = oracle.twin.station.picture.fleet.vehicles[1]
        assert oracle.vehicle.telemetry.position_m == twin.telemetry.position_m
        assert (
            oracle.vehicle.telemetry.battery_pct == twin.telemetry.battery_pct
            and oracle.vehicle.telemetry.custom_mode == twin.telemetry.custom_mode
        )
        assert oracle.vehicle.freshness(oracle.now) is Freshness.OK
    assert not oracle.told("LOST") and not oracle.told("heard again")
    oracle.holds(sends=asks_the_time, less=asks_the_time)


def test_b6_107_one_high_latency_message_hides_no_loss(attack: Attack) -> None:
    """A vehicle with normal streams that falls silent is LOST after 3.5 s, even after a last HIGH_LATENCY2."""
    oracle = attack()
    oracle.say("HIGH_LATENCY2", 1, **zeros("HIGH_LATENCY2", type=2, autopilot=3))
    oracle.run(0.05)
    oracle.flight.sim.silence(0)
    oracle.run(4.5)
    assert oracle.vehicle.freshness(oracle.now) is Freshness.LOST
    oracle.holds(told="LOST", sends=to_home, less=to_home)
