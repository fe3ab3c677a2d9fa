"""Which frames are believed and signed, frame by frame. Whole flights with keys are in `test_trust.py`."""

from pathlib import Path

import pytest
from pymavlink.dialects.v10 import common as version1

from tests.core.rigs.heard import BEAT, Heard
from tests.core.rigs.uplink_rig import UplinkRig
from tui_gcs.core.fleet.vehicle import Signing
from tui_gcs.core.guard.permission import PASS
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.signing import SigningKey, sign, signature_matches, ticks
from tui_gcs.core.records.tlog_reader import read_tlog
from tui_gcs.core.signing.keystore import KeyStore
from tui_gcs.core.signing.timestamp_store import TimestampStore
from tui_gcs.core.signing.trust import SigningRegistry

SECRET, OTHER, ZEROS = bytes(range(1, 33)), bytes(range(101, 133)), bytes(32)


@pytest.fixture
def keys(tmp_path: Path) -> KeyStore:
    """Vehicle 1 has the key "field"."""
    store = KeyStore(tmp_path / "keys")
    store.add(SigningKey("field", SECRET))
    store.assign("field", "", 1)
    return store


def battery(percent: int) -> bytes:
    """A frame of vehicle 1 that says this, unsigned."""
    rest = ("drop_rate_comm", "errors_comm", "errors_count1", "errors_count2", "errors_count3", "errors_count4")
    sensors = [f"onboard_control_sensors_{what}" for what in ("present", "enabled", "health")]
    fields = dict.fromkeys((*rest, *sensors, "load", "current_battery", "voltage_battery"), 0)
    return Encoder(1, 1).encode("SYS_STATUS", battery_remaining=percent, **fields)


def signed(heard: Heard, raw: bytes, secret: bytes, later_s: float = 0.1) -> bytes:
    return sign(raw, secret, 0, ticks(heard.clock.wall() + later_s))


# ---------------------------------------------------------------- vehicles with a key


def test_what_is_signed_with_its_key_is_believed(keys: KeyStore) -> None:
    vehicle = (heard := Heard(keys, SECRET)).say("SYS_STATUS", battery_remaining=60)
    assert (vehicle.telemetry.battery_pct, vehicle.identity.signing, vehicle.identity.keyed) == (
        60.0,
        Signing.OURS,
        True,
    )
    assert vehicle.why_not_commanded == "" and "its frames: signed by us" in heard.told()


def test_unsigned_frames_of_it_are_not_believed_and_that_is_told(keys: KeyStore) -> None:
    heard = Heard(keys, SECRET)
    heard.say("SYS_STATUS", battery_remaining=60)
    for number in range(15):
        vehicle = heard.hear(battery(1 + number))
    assert vehicle.telemetry.battery_pct == 60.0
    assert heard.trust.dropped["unsigned, though a key is set"] == 15
    assert "stopped signing, or its frames are forged: unsigned frames are not used" in heard.told()
    for _ in range(10):
        heard.hear(battery(1))
    assert vehicle.identity.signing is Signing.UNSIGNED
    assert vehicle.why_not_commanded == "does not sign, though we hold a key for it"


def test_who_never_signed_though_it_has_a_key_does_not_even_appear(keys: KeyStore) -> None:
    with pytest.raises(KeyError):
        Heard(keys)


def test_another_key_is_not_its_key(keys: KeyStore) -> None:
    heard = Heard(keys, SECRET)
    heard.say("SYS_STATUS", battery_remaining=60)
    for _ in range(30):
        vehicle = heard.hear(signed(heard, battery(1), OTHER))
    assert vehicle.telemetry.battery_pct == 60.0 and vehicle.identity.signing is Signing.UNKNOWN_KEY
    assert vehicle.why_not_commanded == "signed with a key that we do not hold"
    assert "frames signed with an unknown key: not used" in heard.told()
    assert heard.trust.dropped["signature: bad signature"] == 30


def test_mavlink_1_cannot_sign_and_is_not_believed(keys: KeyStore) -> None:
    heard = Heard(keys, SECRET)
    heard.clock.advance(60.0)
    old = version1.MAVLink_heartbeat_message(2, 3, 81 | 128, 4, 3, 3).pack(version1.MAVLink(None, 1, 1))
    assert not heard.hear(old).telemetry.armed
    assert heard.trust.dropped["MAVLink 1 (downgrade), though a key is set"] == 1


def test_a_modem_may_speak_unsigned_for_it_cannot_sign(keys: KeyStore) -> None:
    heard = Heard(keys, SECRET)
    fields = dict.fromkeys(("rssi", "remrssi", "txbuf", "noise", "remnoise", "rxerrors", "fixed"), 9)
    gate = heard.trust.gate(heard.vehicle.path.source, 1)
    assert gate is not None and gate(Encoder(1, 68).encode("RADIO_STATUS", **fields)) and not gate(battery(1))


def test_a_recorded_frame_is_not_believed_again(keys: KeyStore) -> None:
    heard = Heard(keys, SECRET)
    recorded = signed(heard, battery(5), SECRET)
    assert heard.hear(recorded).telemetry.battery_pct == 5.0
    reported = "frames with old signatures (recorded ones?): not used"
    for number in range(100):
        heard.say("SYS_STATUS", battery_remaining=60)
        if number >= 80:
            assert heard.hear(recorded).telemetry.battery_pct == 60.0
            assert (reported in heard.told()) is (number >= 89), "one may go astray, ten may not"
    assert heard.vehicle.identity.signing is Signing.OURS, "its own frames go on"


def test_a_recording_is_not_believed_after_a_restart_of_the_station_either(keys: KeyStore, tmp_path: Path) -> None:
    heard = Heard(keys, SECRET)
    recorded = signed(heard, battery(5), SECRET)
    heard.hear(recorded)
    before = SigningRegistry(heard.clock, heard.events, ("",), keys, TimestampStore(tmp_path / "keys"))
    gate = before.gate(heard.vehicle.path.source, 1)
    assert gate is not None and gate(recorded)
    before.close()
    for stamps, believed in ((TimestampStore(tmp_path / "keys"), False), (None, True)):
        after = SigningRegistry(heard.clock, heard.events, ("",), keys, stamps)
        gate = after.gate(heard.vehicle.path.source, 1)
        assert gate is not None and gate(recorded) is believed


def test_a_copy_that_a_second_link_brings_at_once_is_no_alarm(keys: KeyStore) -> None:
    heard = Heard(keys, SECRET)
    for _ in range(100):
        raw = signed(heard, battery(60), SECRET)
        heard.hear(raw)
        heard.hear(raw, 0.01)
    assert heard.trust.dropped["signature: copy or swapped neighbour"] == 100
    assert not [text for text in heard.told() if "old signatures" in text]


def test_a_clock_far_ahead_is_not_believed(keys: KeyStore) -> None:
    """Or the key would be worth nothing until then: every later frame would be old."""
    heard = Heard(keys, SECRET)
    vehicle = heard.hear(signed(heard, battery(5), SECRET, later_s=3600.0))
    assert vehicle.telemetry.battery_pct != 5.0
    assert "its signing clock is more than 5 min ahead: that stream is not used" in heard.told()
    assert heard.say("SYS_STATUS", battery_remaining=60).telemetry.battery_pct == 60.0


def test_whose_time_is_behind_is_told_the_time_once_a_second(keys: KeyStore) -> None:
    heard = Heard(keys, SECRET)
    heard.trust._heartbeat = lambda: Encoder(255, 190).encode("HEARTBEAT", **BEAT)
    assert heard.trust.due_time_frames() == []
    heard.clock.advance(10.0)
    gate = heard.trust.gate(heard.vehicle.path.source, 1)
    assert gate is not None and not gate(signed(heard, battery(5), SECRET, later_s=-3600.0))
    ((source, beat),) = heard.trust.due_time_frames()
    assert source is heard.vehicle.path.source and signature_matches(beat, SECRET)
    assert not gate(signed(heard, battery(5), SECRET, later_s=-3600.0)) and heard.trust.due_time_frames() == []
    assert "its signing clock is behind: the time is sent to it, its frames are not used before" in heard.told()
    heard.clock.advance(1.0)
    assert len(heard.trust.due_time_frames()) == 1


# ---------------------------------------------------------------- vehicles without


@pytest.mark.parametrize(
    ("secret", "signing", "no_commands"),
    [
        (b"", Signing.UNSIGNED, ""),
        (ZEROS, Signing.NOT_VERIFIED, ""),  # PX4 while signing is off: proves nothing
        (OTHER, Signing.UNKNOWN_KEY, "signed with a key that we do not hold"),
    ],
)
def test_of_who_has_no_key_with_us_it_is_shown_what_its_signature_is_worth(
    secret: bytes, signing: Signing, no_commands: str
) -> None:
    heard = Heard(None, secret)
    vehicle = heard.say("HEARTBEAT", **BEAT, after_s=1.0)
    assert (vehicle.identity.signing, vehicle.why_not_commanded, vehicle.identity.keyed) == (
        signing,
        no_commands,
        False,
    )


# ---------------------------------------------------------------- what we say


def test_all_that_leaves_for_a_keyed_vehicle_is_signed_and_recorded_without(keys: KeyStore, tmp_path: Path) -> None:
    way = UplinkRig(tmp_path, keys=keys, secret=SECRET)
    way.heard.say("HEARTBEAT", **BEAT, after_s=1.0)
    place = dict.fromkeys(("vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate", "time_boot_ms", "alt"), 0)
    way.uplink.setpoint(1, PASS, **place, coordinate_frame=6, type_mask=0, lat_int=1, lon_int=2)
    way.uplink.ask(1, "PARAM_REQUEST_LIST")
    list(way.uplink.heartbeat())
    frames = [raw for raw, _ in way.links["radio"].sent]
    assert [raw[7] for raw in frames] == [86, 21, 0] and all(signature_matches(raw, SECRET) for raw in frames)
    times = [int.from_bytes(raw[-12:-6], "little") for raw in frames]
    assert times == sorted(set(times)), "each is newer than the one before"
    way.recorder.close()
    assert [(frame.msgid, frame.signed) for _, frame in read_tlog(way.recorder.path)] == [
        (86, False),
        (21, False),
        (0, False),
    ]


def test_a_given_key_counts_from_when_the_vehicle_signs_with_it(tmp_path: Path) -> None:
    store = KeyStore(tmp_path / "keys")
    store.add(key := SigningKey("alpha", OTHER))
    heard = Heard(store)
    heard.trust.key_sent(heard.vehicle, key)
    heard.say("HEARTBEAT", **BEAT, after_s=2.0)
    assert store.key_of("", 1) is None and not heard.vehicle.identity.keyed
    heard.secret = OTHER
    heard.say("HEARTBEAT", **BEAT, after_s=2.0)
    assert store.key_of("", 1) == key
    assert f"signs with key alpha ({key.fingerprint})" in heard.told()
    assert heard.say("HEARTBEAT", **BEAT, after_s=1.0).identity.keyed


def test_a_given_key_that_it_does_not_take_is_told_after_ten_seconds(tmp_path: Path) -> None:
    store = KeyStore(tmp_path / "keys")
    store.add(key := SigningKey("alpha", OTHER))
    heard = Heard(store)
    heard.trust.key_sent(heard.vehicle, key)
    for _ in range(12):
        heard.say("HEARTBEAT", **BEAT, after_s=1.0)
    assert "did not take key alpha: it does not sign with it. PX4 takes keys over USB only" in heard.told()
    heard.secret = OTHER
    heard.say("HEARTBEAT", **BEAT, after_s=1.0)
    assert store.key_of("", 1) is None, "nobody waits for that any more"
