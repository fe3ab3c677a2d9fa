"""Parameters as both autopilots were measured to handle them."""

import math
import struct

import pytest
from fastcrc import crc16

from sitl.common.parameters import ParameterTable
from sitl.links.wire import LAYOUT_BY_NAME, Encoder, cut
from tests.sitl.rigs.store_rig import Bench

REAL_PX4_HASH = 0xD70700D1
"""_HASH_CHECK of the real PX4 whose list is in sitl/data."""
INT32, REAL32, UINT32 = 6, 9, 5


def name_of(fields):
    return fields["param_id"].rstrip(b"\0").decode()


def bits(fields):
    return struct.unpack("<I", struct.pack("<f", fields["param_value"]))[0]


@pytest.fixture
def copter():
    return Bench("ardupilot")


@pytest.fixture
def px4():
    return Bench("px4")


class TestArduPilot:
    def test_list_has_1327_in_order_after_three_texts_at_1400_per_second(self, copter):
        copter.say("PARAM_REQUEST_LIST")
        assert len(copter.texts()) == 3
        copter.run(0.5)
        assert 650 < len(copter.of("PARAM_VALUE")) < 760
        copter.run(0.6)
        values = copter.of("PARAM_VALUE")
        assert [v["param_index"] for v in values] == list(range(1327))
        assert {v["param_count"] for v in values} == {1327}
        assert {v["param_type"] for v in values} == {2, 4, 6, 9}

    def test_by_name_and_set_carry_index_65535_by_index_the_true_one(self, copter):
        copter.say("PARAM_REQUEST_READ", param_id=b"WPNAV_SPEED", param_index=-1)
        copter.say("PARAM_REQUEST_READ", param_index=3)
        copter.say("PARAM_SET", param_id=b"WPNAV_SPEED", param_value=700.0)
        by_name, by_index, by_set = copter.of("PARAM_VALUE")
        assert (by_name["param_value"], by_name["param_index"]) == (1000.0, 65535)
        assert by_index["param_index"] == 3
        assert (by_set["param_value"], by_set["param_index"]) == (700.0, 65535)

    @pytest.mark.parametrize(
        ("name", "value", "stored"),
        [
            (b"FS_GCS_ENABLE", 7.6, 7.0),
            (b"FS_GCS_ENABLE", 300.0, 127.0),
            (b"RTL_ALT", -1e12, -(2.0**31)),
            (b"WPNAV_SPEED", 99999.0, 99999.0),
        ],
    )
    def test_integers_are_cut_and_clamped_ranges_are_not_checked(self, copter, name, value, stored):
        copter.say("PARAM_SET", param_id=name, param_value=value, param_type=REAL32)
        assert copter.last("PARAM_VALUE")["param_value"] == stored

    def test_unknown_names_and_nan_are_not_answered(self, copter):
        for name, value in ((b"NO_SUCH", 1.0), (b"RTL_ALT", math.nan), (b"RTL_ALT", math.inf)):
            copter.say("PARAM_SET", param_id=name, param_value=value)
        copter.say("PARAM_REQUEST_READ", param_id=b"NO_SUCH", param_index=-1)
        copter.say("PARAM_REQUEST_READ", param_index=5000)
        assert not copter.heard
        assert copter.platform.params["RTL_ALT"] == 1500

    def test_list_asked_twice_starts_anew(self, copter):
        copter.say("PARAM_REQUEST_LIST")
        copter.run(0.2)
        copter.say("PARAM_REQUEST_LIST")
        copter.forget()
        copter.run(1.2)
        assert len(copter.of("PARAM_VALUE")) == 1326  # the first one came at once


class TestPX4:
    def test_list_begins_with_the_hash_and_comes_in_batches(self, px4):
        px4.say("PARAM_REQUEST_LIST")
        first = px4.of("PARAM_VALUE")[0]
        assert (name_of(first), first["param_index"], first["param_type"]) == ("_HASH_CHECK", 65535, UINT32)
        assert bits(first) == REAL_PX4_HASH
        px4.run(0.95)
        values = px4.of("PARAM_VALUE")
        assert [v["param_index"] for v in values] == [65535, *range(885)]
        assert {v["param_type"] for v in values[1:]} == {INT32, REAL32}
        names = [name_of(v) for v in values[1:]]
        assert names == sorted(names)

    def test_setting_the_hash_stops_the_list(self, px4):
        px4.say("PARAM_REQUEST_LIST")
        px4.say("PARAM_SET", param_id=b"_HASH_CHECK", param_value=0.0, param_type=UINT32)
        assert px4.last("PARAM_ERROR")["error"] == 5
        px4.run(1.0)
        assert len(px4.of("PARAM_VALUE")) < 25

    @pytest.mark.parametrize("value", [3, -1, -5_000_000, 2_139_095_041])
    def test_integers_travel_byte_by_byte(self, px4, value):
        """Two of these are signalling NaNs as floats: no float may ever hold them."""
        raw = value.to_bytes(4, "little", signed=True)
        px4.ap.receive(self.set_frame(b"GF_ACTION", raw))
        assert px4.platform.params["GF_ACTION"] == value
        echo = px4.platform.outbox.datagrams[0]
        assert echo[10:14] == raw
        assert cut(echo)[0].name == "PARAM_VALUE"

    @staticmethod
    def set_frame(name, raw):
        fields = {"param_id": name, "param_type": INT32, "target_system": 1, "target_component": 1}
        frame = bytearray(Encoder(255, 190).frame("PARAM_SET", fields))
        frame[10:14] = raw
        frame[-2:] = crc16.mcrf4xx(bytes(frame[1:-2]) + LAYOUT_BY_NAME["PARAM_SET"].crc_extra).to_bytes(2, "little")
        return bytes(frame)

    def test_set_is_echoed_and_told_again_unasked_without_range_check(self, px4):
        value = struct.unpack("<f", struct.pack("<i", 77))[0]
        px4.say("PARAM_SET", param_id=b"GF_ACTION", param_value=value, param_type=INT32)
        px4.run(0.05)
        assert [bits(v) for v in px4.of("PARAM_VALUE")] == [77, 77]
        px4.forget()
        px4.say("PARAM_SET", param_id=b"GF_ACTION", param_value=value, param_type=INT32)
        px4.run(0.05)
        assert len(px4.of("PARAM_VALUE")) == 1  # nothing changed

    @pytest.mark.parametrize(
        ("message", "fields", "error"),
        [
            ("PARAM_REQUEST_READ", {"param_id": b"NO_SUCH", "param_index": -1}, 1),
            ("PARAM_SET", {"param_id": b"NO_SUCH", "param_value": 1.0, "param_type": INT32}, 1),
            ("PARAM_SET", {"param_id": b"GF_ACTION", "param_value": 1.0, "param_type": REAL32}, 7),
            ("PARAM_SET", {"param_id": b"MPC_XY_CRUISE", "param_value": 1.0, "param_type": INT32}, 7),
        ],
    )
    def test_errors_are_told_with_a_garbage_index(self, px4, message, fields, error):
        px4.say(message, **fields)
        said = px4.last("PARAM_ERROR")
        assert (said["error"], said["param_index"]) == (error, -28848)
        assert not px4.of("PARAM_VALUE")

    def test_hash_follows_values_but_not_volatile_ones(self, px4):
        px4.platform.params.set("CAL_BARO0_OFF", 3.0)
        assert px4.platform.params.hash() == REAL_PX4_HASH
        px4.platform.params.set("MPC_XY_CRUISE", 6.0)
        px4.say("PARAM_REQUEST_READ", param_id=b"_HASH_CHECK", param_index=-1)
        said = px4.last("PARAM_VALUE")
        assert (said["param_index"], said["param_type"]) == (65535, UINT32)
        assert bits(said) not in (0, REAL_PX4_HASH)

    def test_the_list_grows_and_indices_shift_once_it_was_armed(self, px4):
        px4.say("PARAM_REQUEST_READ", param_id=b"MPC_XY_CRUISE", param_index=-1)
        px4.platform.state.armed = True
        px4.say("PARAM_REQUEST_READ", param_id=b"MPC_XY_CRUISE", param_index=-1)
        before, after = px4.of("PARAM_VALUE")
        assert (before["param_count"], after["param_count"]) == (885, 888)
        assert after["param_index"] > before["param_index"]

    def test_wrong_component_is_not_answered(self, px4):
        px4.say("PARAM_REQUEST_LIST", target_component=42)
        assert not px4.heard


def test_vehicles_share_the_table_but_not_their_values():
    one, two = ParameterTable(1), ParameterTable(2)
    one.set("WPNAV_SPEED", 500.0)
    assert (one["WPNAV_SPEED"], two["WPNAV_SPEED"]) == (500.0, 1000.0)
    assert (one["MAV_SYSID"], two["MAV_SYSID"]) == (1, 2)
    assert ParameterTable(7, "px4")["MAV_SYS_ID"] == 7
    assert one.defaults is two.defaults
