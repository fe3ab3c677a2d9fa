"""Signatures: made as other stations make them, believed only from the key holder, and only once."""

import json
import random
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink_all

from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.mavlink import signing
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import cut_datagram
from tui_gcs.core.mavlink.signing import (
    MAX_TIMESTAMP,
    TICKS_PER_S,
    ZERO_KEY,
    SignatureResult,
    SignatureVerifier,
    SignedBy,
    SigningClock,
    SigningError,
    SigningKey,
    sign,
    signature_matches,
    signed_by,
    strip_signature,
    ticks,
)
from tui_gcs.core.records.tlog_reader import TlogReader

SECRET = bytes(range(32))
OTHER_SECRET = bytes(range(1, 33))
WALL_S = 1_790_000_000.0
NOW = ticks(WALL_S)
HOUR, DAY = 3600, 86400
PX4_TLOG = Path(__file__).parents[2] / "data/px4-8.tlog"


def heartbeat(system: int = 1, component: int = 1) -> bytes:
    fields = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 4, "system_status": 3, "mavlink_version": 3}
    return Encoder(system, component).encode("HEARTBEAT", **fields)


def at(offset_s: float = 0.0, *, system: int = 1, component: int = 1, link: int = 1, secret: bytes = SECRET) -> bytes:
    """A heartbeat signed `offset_s` seconds after (before) WALL_S."""
    return sign(heartbeat(system, component), secret, link, NOW + round(offset_s * TICKS_PER_S))


def peer(secret: bytes = SECRET, timestamp: int = NOW, link: int = 3) -> pymavlink_all.MAVLink:
    """pymavlink's signer and checker, which shares no line with ours."""
    mav = pymavlink_all.MAVLink(None, srcSystem=7, srcComponent=1)
    mav.signing.secret_key = secret
    mav.signing.timestamp = timestamp
    mav.signing.link_id = link
    mav.signing.sign_outgoing = True
    return mav


MESSAGES = [
    pymavlink_all.MAVLink_heartbeat_message(2, 3, 81, 4, 3, 3),
    pymavlink_all.MAVLink_heartbeat_message(0, 0, 0, 0, 0, 0),
    pymavlink_all.MAVLink_attitude_message(1000, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0),
    pymavlink_all.MAVLink_statustext_message(6, b"EKF3 IMU0 is using GPS"),
    pymavlink_all.MAVLink_command_long_message(7, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
    pymavlink_all.MAVLink_param_value_message(b"WPNAV_SPEED", 500.0, 9, 30, 12),
]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda m: m.msgname)
def test_our_signature_is_byte_for_byte_pymavlinks(message: pymavlink_all.MAVLink_message) -> None:
    plain = peer()
    plain.signing.sign_outgoing = False
    unsigned = bytes(message.pack(plain))
    signed = bytes(message.pack(peer()))
    assert sign(unsigned, SECRET, 3, NOW) == signed
    assert strip_signature(signed) == unsigned
    assert strip_signature(unsigned) == unsigned


def test_pymavlink_takes_ours_and_refuses_a_wrong_key() -> None:
    clock = SigningClock(WALL_S, 0.0)
    ours = Encoder(255, 190)
    frames = [
        sign(ours.encode("SYSTEM_TIME", time_unix_usec=n, time_boot_ms=n), SECRET, 0, clock.next(WALL_S, 0.0))
        for n in range(1, 50)
    ]
    vehicle = peer()
    got = vehicle.parse_buffer(b"".join(frames))
    assert [m.time_boot_ms for m in got] == list(range(1, 50))
    assert all(m.get_signed() for m in got)
    assert vehicle.signing.goodsig_count == 49
    with pytest.raises(pymavlink_all.MAVError, match="signature"):
        peer(OTHER_SECRET).parse_buffer(frames[0])


def test_we_take_pymavlinks_and_refuse_a_wrong_key() -> None:
    vehicle = peer()
    frames = [bytes(message.pack(vehicle)) for message in MESSAGES for _ in range(10)]
    ours, stranger = SignatureVerifier(SECRET), SignatureVerifier(OTHER_SECRET)
    assert all(len(cut_datagram(frame).frames) == 1 for frame in frames)
    assert {ours.check(frame, WALL_S) for frame in frames} == {SignatureResult.GOOD}
    assert {stranger.check(frame, WALL_S) for frame in frames} == {SignatureResult.BAD_SIGNATURE}


@given(
    payload=st.binary(min_size=1, max_size=255),
    secret=st.binary(min_size=32, max_size=32),
    link=st.integers(0, 255),
    timestamp=st.integers(0, MAX_TIMESTAMP),
    flip=st.integers(0),
)
def test_any_changed_bit_breaks_the_signature(
    payload: bytes, secret: bytes, link: int, timestamp: int, flip: int
) -> None:
    header = bytes([0xFD, len(payload), 0, 0, 9, 7, 1]) + (253).to_bytes(3, "little")
    unsigned = strip_signature(sign(header + payload + b"\0\0", secret, link, timestamp))  # now with its right CRC
    signed = sign(unsigned, secret, link, timestamp)
    assert len(signed) == len(unsigned) + 13
    assert cut_datagram(signed).frames[0].signed
    assert strip_signature(signed) == unsigned
    assert signing.timestamp(signed) == timestamp
    assert signature_matches(signed, secret)
    at_bit = flip % (8 * len(signed))
    changed = bytearray(signed)
    changed[at_bit // 8] ^= 1 << at_bit % 8
    assert not signature_matches(bytes(changed), secret)


@given(st.binary(max_size=40))
def test_no_bytes_without_the_key_are_believed(junk: bytes) -> None:
    assert SignatureVerifier(SECRET).check(junk, WALL_S) is SignatureResult.BAD_SIGNATURE


def test_what_cannot_be_signed() -> None:
    mav = pymavlink_all.MAVLink(None, srcSystem=3, srcComponent=1)
    version_1 = bytes(MESSAGES[0].pack(mav, force_mavlink1=True))
    unknown = bytes([0xFD, 3, 0, 0, 9, 7, 1]) + (70001).to_bytes(3, "little") + b"abc\x12\x34"
    for frame in (version_1, unknown, at(), heartbeat()[:-1]):
        with pytest.raises(SigningError):
            sign(frame, SECRET, 0, NOW)
    assert strip_signature(version_1) == version_1


def test_a_signed_frame_of_an_unknown_message_is_logged_as_it_is() -> None:
    unknown = bytes([0xFD, 3, 1, 0, 9, 7, 1]) + (70001).to_bytes(3, "little") + b"abc\x12\x34" + bytes(13)
    assert strip_signature(unknown) == unknown


# Whose signature it is, where we hold no key


def test_px4_signs_with_a_zero_key_which_proves_nothing() -> None:
    signed = [frame.raw for _, frame in TlogReader(PX4_TLOG) if frame.signed]
    assert len(signed) > 10_000
    assert {signed_by(raw) for raw in signed} == {SignedBy.ZERO_KEY}


def test_a_signature_by_a_key_that_we_do_not_hold() -> None:
    assert signed_by(at()) is SignedBy.UNKNOWN_KEY
    assert signed_by(at(secret=ZERO_KEY)) is SignedBy.ZERO_KEY


# Forged and replayed


def test_a_hundred_thousand_forged_or_replayed_frames_among_genuine_ones() -> None:
    """None of them is accepted, and every genuine one is."""
    dice = random.Random(6)
    verifier = SignatureVerifier(SECRET)
    sent: list[bytes] = []
    timestamp = NOW
    accepted = {"genuine": 0, "forged": 0, "replayed": 0}
    tried = dict.fromkeys(accepted, 0)

    def attempt(kind: str, raw: bytes) -> None:
        tried[kind] += 1
        accepted[kind] += verifier.check(raw, WALL_S) is SignatureResult.GOOD

    for _ in range(10_000):
        timestamp += dice.randrange(1, 5000)
        genuine = sign(heartbeat(), SECRET, dice.randrange(2), timestamp)
        forgeries = [
            genuine[:-1] + bytes([genuine[-1] ^ 1 << dice.randrange(8)]),
            genuine[:-12] + (timestamp + dice.randrange(1, 1000)).to_bytes(6, "little") + genuine[-6:],
            genuine[:-12] + b"\xff" * 6 + dice.randbytes(6),
            genuine[:5] + bytes([dice.randrange(2, 256)]) + genuine[6:],
            sign(heartbeat(), OTHER_SECRET, 1, timestamp + 1),
            sign(heartbeat(), ZERO_KEY, 1, timestamp + 1),
            dice.randbytes(len(genuine)),
        ]
        for forged in forgeries[: dice.randrange(8)]:
            attempt("forged", forged)
        attempt("genuine", genuine)
        sent.append(genuine)
        for forged in forgeries:
            attempt("forged", forged)
        for _ in range(3):
            attempt("replayed", dice.choice(sent))
    assert accepted == {"genuine": 10_000, "forged": 0, "replayed": 0}
    assert tried["forged"] + tried["replayed"] > 100_000
    assert len(verifier.streams()["newest"]) == 2


def test_b6_27_a_forged_time_poisons_nothing() -> None:
    verifier = SignatureVerifier(SECRET)
    assert verifier.check(at(0), WALL_S) is SignatureResult.GOOD
    for timestamp in (NOW + 10, MAX_TIMESTAMP - 1, MAX_TIMESTAMP):
        forged = sign(heartbeat(), OTHER_SECRET, 1, timestamp)
        assert verifier.check(forged, WALL_S) is SignatureResult.BAD_SIGNATURE
    assert verifier.check(at(0.00001), WALL_S) is SignatureResult.GOOD


def test_b6_28_forged_streams_take_no_memory() -> None:
    verifier = SignatureVerifier(SECRET)
    for n in range(20_000):
        forged = sign(heartbeat(n >> 8 & 0xFF, n & 0xFF), OTHER_SECRET, n % 7, NOW)
        assert verifier.check(forged, WALL_S) is SignatureResult.BAD_SIGNATURE
    assert verifier.streams() == {"newest": {}, "ahead": [], "floor": 0}


def test_b6_28_the_key_holders_own_streams_are_bounded_and_what_is_forgotten_stays_refused() -> None:
    verifier = SignatureVerifier(SECRET, max_streams=16)
    frames = [at(n / 10, link=n) for n in range(40)]
    assert {verifier.check(frame, WALL_S) for frame in frames} == {SignatureResult.GOOD}
    assert len(verifier.streams()["newest"]) == 16
    assert {verifier.check(frame, WALL_S) for frame in frames} == {SignatureResult.OLD}


def test_b6_29_a_recording_played_back_into_the_running_station() -> None:
    verifier = SignatureVerifier(SECRET)
    recording = [at(second / 10) for second in range(100)]
    assert all(verifier.check(frame, WALL_S + 10) is SignatureResult.GOOD for frame in recording)
    assert {verifier.check(frame, WALL_S + 20) for frame in recording} == {SignatureResult.OLD}
    backwards = [at(11), at(10.5), at(10)]
    assert [verifier.check(frame, WALL_S + 11) for frame in backwards] == [
        SignatureResult.GOOD,
        SignatureResult.OLD,
        SignatureResult.OLD,
    ]


@pytest.mark.parametrize("stored_before_s", [0.0, 0.4, 1.0])
def test_b6_30_a_recording_played_back_after_a_restart(stored_before_s: float) -> None:
    """The file of a station that died is up to a second old; what came in that second is refused, too."""
    before = SignatureVerifier(SECRET)
    stored: dict[str, object] = {}
    heard = [at(offset / 10) for offset in range(600)]
    for number, frame in enumerate(heard):
        assert before.check(frame, WALL_S + number / 10) is SignatureResult.GOOD
        if number / 10 <= 59.9 - stored_before_s:
            stored = json.loads(json.dumps(before.streams()))
    after = SignatureVerifier(SECRET)
    after.restore(stored)
    assert {after.check(frame, WALL_S + 61) for frame in heard} == {SignatureResult.OLD}
    assert after.check(at(62), WALL_S + 62) is SignatureResult.GOOD


def test_b6_30_without_memory_a_fresh_recording_would_pass() -> None:
    """Why streams are stored."""
    assert SignatureVerifier(SECRET).check(at(-59), WALL_S) is SignatureResult.GOOD
    assert SignatureVerifier(SECRET).check(at(-61), WALL_S) is SignatureResult.TOO_OLD_NEW_STREAM


def test_b6_31_signed_by_an_unknown_key_is_told_apart_from_a_bad_signature_of_nobody() -> None:
    stranger = at(secret=OTHER_SECRET)
    assert SignatureVerifier(SECRET).check(stranger, WALL_S) is SignatureResult.BAD_SIGNATURE
    assert signed_by(stranger) is SignedBy.UNKNOWN_KEY


@pytest.mark.parametrize("ahead_s", [HOUR, 10 * 365 * DAY])
def test_b6_32_a_clock_far_ahead_quarantines_its_own_stream_only(ahead_s: float) -> None:
    verifier, other_vehicle = SignatureVerifier(SECRET), SignatureVerifier(OTHER_SECRET)
    assert verifier.check(at(0, link=1), WALL_S) is SignatureResult.GOOD
    for second in range(5):
        assert verifier.check(at(ahead_s + second, link=2), WALL_S + second) is SignatureResult.AHEAD
        assert verifier.check(at(ahead_s + second, link=1), WALL_S + second) is SignatureResult.AHEAD
        assert verifier.check(at(second, link=3), WALL_S + second) is SignatureResult.GOOD
        assert verifier.check(at(second, component=191), WALL_S + second) is SignatureResult.GOOD
        assert verifier.check(at(second, component=191), WALL_S + second) is SignatureResult.OLD
        assert other_vehicle.check(at(second, system=2, secret=OTHER_SECRET), WALL_S + second) is SignatureResult.GOOD
    assert verifier.check(at(6, link=1), WALL_S + 6) is SignatureResult.GOOD, "once its clock is right it is believed"
    assert verifier.check(at(6, link=2), WALL_S + 6) is SignatureResult.GOOD


def test_b6_32_what_was_too_far_ahead_cannot_be_played_back_when_its_time_comes() -> None:
    verifier = SignatureVerifier(SECRET)
    ahead = [at(HOUR + second) for second in range(30)]
    assert {verifier.check(frame, WALL_S) for frame in ahead} == {SignatureResult.AHEAD}
    after_restart = SignatureVerifier(SECRET)
    after_restart.restore(json.loads(json.dumps(verifier.streams())))
    for each in (verifier, after_restart):
        assert {each.check(frame, WALL_S + HOUR) for frame in ahead} == {SignatureResult.OLD}
        assert each.check(at(HOUR - 2), WALL_S + HOUR) is SignatureResult.GOOD, "its clock was put right"
        assert {each.check(frame, WALL_S + HOUR) for frame in ahead} == {SignatureResult.OLD}
        assert each.check(at(HOUR + 31), WALL_S + HOUR) is SignatureResult.GOOD
        assert each.streams()["ahead"] == []


def test_b6_32_a_clock_that_went_wrong_twice_does_not_lock_out_all_times_between() -> None:
    verifier = SignatureVerifier(SECRET)
    for ahead_s in (HOUR, 3 * HOUR, HOUR + 60, HOUR + 30):
        assert verifier.check(at(ahead_s), WALL_S) is SignatureResult.AHEAD
    assert verifier.check(at(HOUR + 60), WALL_S + HOUR) is SignatureResult.OLD
    assert verifier.check(at(2 * HOUR), WALL_S + 2 * HOUR) is SignatureResult.GOOD
    assert verifier.check(at(3 * HOUR), WALL_S + 3 * HOUR) is SignatureResult.OLD


def test_b6_32_quarantined_times_are_those_of_their_own_stream() -> None:
    verifier = SignatureVerifier(SECRET)
    assert verifier.check(at(HOUR, link=1), WALL_S) is SignatureResult.AHEAD
    assert verifier.check(at(HOUR + 1, link=2), WALL_S) is SignatureResult.AHEAD
    assert verifier.check(at(HOUR, link=3), WALL_S + HOUR) is SignatureResult.GOOD
    assert verifier.check(at(HOUR + 2, link=2), WALL_S + HOUR) is SignatureResult.GOOD
    assert verifier.check(at(HOUR, link=1), WALL_S + HOUR) is SignatureResult.OLD
    assert verifier.check(at(HOUR + 1, link=1), WALL_S + HOUR) is SignatureResult.GOOD


def test_b6_32_quarantined_times_are_bounded() -> None:
    verifier = SignatureVerifier(SECRET, max_streams=4)
    for hours in (5, 2, 9, 3, 4, 7):
        assert verifier.check(at(hours * HOUR), WALL_S) is SignatureResult.AHEAD
    assert [first for _, first, _ in verifier.streams()["ahead"]] == [
        NOW + h * HOUR * TICKS_PER_S for h in (5, 2, 3, 4)
    ]


@pytest.mark.parametrize("quarantined", [False, True])
def test_b6_32_a_stream_that_is_known_survives_a_jump_of_our_own_clock(quarantined: bool) -> None:
    verifier = SignatureVerifier(SECRET)
    assert verifier.check(at(0), WALL_S) is SignatureResult.GOOD
    if quarantined:
        assert verifier.check(at(HOUR, link=2), WALL_S) is SignatureResult.AHEAD
    for our_clock in (WALL_S - HOUR, WALL_S + HOUR, WALL_S + 10 * 365 * DAY, 0.0, float("nan")):
        time_s = verifier.streams()["newest"]["1/1/1"] / TICKS_PER_S - NOW / TICKS_PER_S
        assert verifier.check(at(time_s + 60), our_clock) is SignatureResult.GOOD


def test_a_station_without_a_clock_believes_whoever_holds_the_key() -> None:
    assert SignatureVerifier(SECRET).check(at(0), 12.0) is SignatureResult.GOOD


def test_b6_33_our_own_time_is_never_pulled_more_than_a_minute_ahead() -> None:
    clock = SigningClock(WALL_S, 0.0)
    for heard in (NOW + 30 * TICKS_PER_S, NOW + HOUR * TICKS_PER_S, MAX_TIMESTAMP - 1, MAX_TIMESTAMP):
        clock.follow(heard, WALL_S, 0.0)
    assert NOW + 30 * TICKS_PER_S < clock.next(WALL_S, 0.0) <= NOW + 60 * TICKS_PER_S + 1


def test_b6_34_radio_status_alone_may_come_unsigned() -> None:
    assert {pymavlink_all.MAVLINK_MSG_ID_RADIO_STATUS} == signing.MAY_BE_UNSIGNED


def test_b6_36_no_key_in_what_is_logged_or_passed_on() -> None:
    fields = {"target_system": 1, "target_component": 1, "secret_key": list(SECRET), "initial_timestamp": NOW}
    raw = Encoder(255, 190).encode("SETUP_SIGNING", **fields)
    for frame in (raw, sign(raw, OTHER_SECRET, 0, NOW)):
        shown = signing.for_log(frame)
        assert SECRET[:4] not in shown
        (seen,) = cut_datagram(shown).frames
        assert (seen.msgid, seen.signed) == (256, False)
        assert seen.payload[10:42] == b"\xff" * 32
    short = Encoder(255, 190).encode("SETUP_SIGNING", **(fields | {"secret_key": [9] + [0] * 31}))
    assert len(short) < len(raw)
    assert cut_datagram(signing.for_log(short)).frames[0].payload[10:42] == b"\xff" * 32
    assert signing.for_log(at()) == heartbeat()


# Our own time


def test_time_grows_with_every_frame_and_follows_the_wall_clock() -> None:
    time = VirtualClock(wall_start_s=WALL_S)
    clock = SigningClock(time.wall(), time.now())
    burst = [clock.next(time.wall(), time.now()) for _ in range(1000)]
    assert burst == list(range(NOW + 1, NOW + 1001))
    time.advance(3600.0)
    assert clock.next(time.wall(), time.now()) == NOW + HOUR * TICKS_PER_S


@pytest.mark.parametrize("step_s", [-HOUR, -10 * 365 * DAY, -1.0])
def test_time_goes_on_when_the_wall_clock_is_set_back(step_s: float) -> None:
    clock = SigningClock(WALL_S, 100.0)
    for second in range(1, 200):
        timestamp = clock.next(WALL_S + step_s + second, 100.0 + second)
        assert timestamp == NOW + second * TICKS_PER_S


@given(st.lists(st.tuples(st.floats(-1e10, 1e10), st.floats(0, 1e5), st.integers(0, MAX_TIMESTAMP)), max_size=30))
def test_whatever_the_clocks_do_time_grows(steps: list[tuple[float, float, int]]) -> None:
    clock = SigningClock(WALL_S, 0.0)
    last = now_s = 0.0
    for wall_s, passed_s, heard in steps:
        now_s += passed_s
        clock.follow(heard, wall_s, now_s)
        timestamp = clock.next(wall_s, now_s)
        assert last < timestamp <= MAX_TIMESTAMP
        last = timestamp


@pytest.mark.parametrize(("stored_s", "begins_s"), [(-10.0, 50.0), (0.0, 60.0), (-DAY, 0.0), (HOUR, HOUR + 60.0)])
def test_after_a_restart_time_begins_beyond_what_was_stored(stored_s: float, begins_s: float) -> None:
    clock = SigningClock(WALL_S, 0.0, NOW + round(stored_s * TICKS_PER_S))
    assert clock.next(WALL_S, 0.0) == NOW + round(begins_s * TICKS_PER_S) + 1


@pytest.mark.parametrize("unix_s", [0.0, -1.0, 1_420_070_399.0, 4.3e9, float("nan"), float("inf")])
def test_times_that_no_signature_can_have_are_no_time(unix_s: float) -> None:
    assert ticks(unix_s) == 0


def test_a_vehicle_whose_time_stands_still_is_heard_again_once_it_heard_us() -> None:
    """PX4 counts frames from the time in its key file: after a power cycle it is days behind until we speak."""
    clock, verifier = SigningClock(WALL_S, 0.0), SignatureVerifier(SECRET)
    vehicle = peer(timestamp=NOW - 3 * DAY * TICKS_PER_S)
    assert verifier.check(bytes(MESSAGES[0].pack(vehicle)), WALL_S) is SignatureResult.TOO_OLD_NEW_STREAM
    vehicle.parse_buffer(sign(heartbeat(255, 190), SECRET, 0, clock.next(WALL_S, 0.0)))
    assert verifier.check(bytes(MESSAGES[0].pack(vehicle)), WALL_S) is SignatureResult.GOOD


# Secrets


def test_nothing_shows_a_key() -> None:
    key = SigningKey("north", SECRET)
    shown = [
        repr(key),
        str(key),
        f"{key}",
        repr([key]),
        repr(SignatureVerifier(SECRET)),
        repr(vars(SignatureVerifier(SECRET))),
    ]
    with pytest.raises(SigningError) as caught:
        SigningKey("short", SECRET[:31])
    shown.append(str(caught.value))
    for text in shown:
        assert SECRET.hex()[:12] not in text
        assert repr(SECRET)[2:20] not in text
    assert key.fingerprint in repr(key)
    assert len(key.fingerprint) == 8
    assert key.fingerprint != SigningKey("north", OTHER_SECRET).fingerprint


@pytest.mark.parametrize(
    "damaged",
    [
        {},
        {"newest": [], "ahead": [], "floor": 0},
        {"newest": {"1/1": 5}, "ahead": [], "floor": 0},
        {"newest": {"1/1/256": 5}, "ahead": [], "floor": 0},
        {"newest": {"1/1/1": "x"}, "ahead": [], "floor": 0},
        {"newest": {}, "ahead": [["1/1/1", 1]], "floor": 0},
        {"newest": {}, "ahead": [], "floor": None},
    ],
)
def test_a_damaged_memory_is_refused_as_a_whole(damaged: dict[str, object]) -> None:
    verifier = SignatureVerifier(SECRET)
    verifier.check(at(0), WALL_S)
    before = verifier.streams()
    with pytest.raises(SigningError):
        verifier.restore(damaged)
    assert verifier.streams() == before
