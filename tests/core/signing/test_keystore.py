"""The key store: private or refused, never torn, and its contents in no text."""

import hashlib
import json
import logging
import os
import traceback
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.signing import (
    TICKS_PER_S,
    ZERO_KEY,
    SignatureResult,
    SignatureVerifier,
    SigningClock,
    SigningKey,
    sign,
    ticks,
)
from tui_gcs.core.signing.key_derivation import secret_from
from tui_gcs.core.signing.keystore import KeyStore, KeyStoreError, open_store, vehicle_name
from tui_gcs.core.signing.timestamp_store import FILE, SAFE_FILE, TimestampStore

CANARY = bytes.fromhex("ca9a4ec0de" * 6 + "ca9a")
OTHER = bytes(range(32))
WALL_S = 1_790_000_000.0
NOW = ticks(WALL_S)


def canaries() -> list[str]:
    """How the secret could be shown."""
    return [CANARY.hex()[8:20], CANARY.hex()[8:20].upper(), repr(CANARY)[4:16], str(list(CANARY))[1:20]]


def assert_silent(*shown: str) -> None:
    for text in shown:
        assert [canary for canary in canaries() if canary in text] == []


@pytest.fixture
def place(tmp_path: Path) -> Path:
    return tmp_path / "keys"


def filled(place: Path) -> KeyStore:
    """A store with two keys and three vehicles."""
    store = KeyStore(place)
    store.add(SigningKey("north", CANARY))
    store.add(SigningKey("south", OTHER))
    for vehicle in (1, 2):
        store.assign("north", "", vehicle)
    store.assign("south", "coast", 1)
    return store


def test_a_new_store_is_empty_and_private(place: Path) -> None:
    assert KeyStore(place).keys == []
    assert place.stat().st_mode & 0o777 == 0o700


def test_keys_and_vehicles_are_there_again_in_the_next_process(place: Path) -> None:
    filled(place)
    again = KeyStore(place)
    assert [(key.name, key.secret) for key in again.keys] == [("north", CANARY), ("south", OTHER)]
    assert again.key_of("", 2) == SigningKey("north", CANARY)
    assert again.key_of("coast", 1) == SigningKey("south", OTHER)
    assert again.key_of("coast", 2) is None
    assert again.vehicles_of("north") == [("", 1), ("", 2)]
    assert [vehicle_name(*vehicle) for vehicle in (("", 1), ("coast", 1))] == ["1", "coast/1"]


def test_every_file_is_ours_alone_whatever_the_umask(place: Path) -> None:
    before = os.umask(0)
    try:
        filled(place)
        TimestampStore(place).write({})
    finally:
        os.umask(before)
    assert {file.name: oct(file.stat().st_mode & 0o777) for file in place.iterdir()} == {
        "keys.json": "0o600",
        "keys.lock": "0o600",
        FILE: "0o600",
        SAFE_FILE: "0o600",
    }


def test_another_process_sees_that_something_changed(place: Path) -> None:
    store = KeyStore(place)
    assert not store.changed()
    filled(place)
    assert store.changed()
    store.reload()
    assert not store.changed()
    assert len(store.keys) == 2
    store.unassign("", 1)
    assert not store.changed()
    KeyStore(place).remove("north")
    assert store.changed()
    store.reload()
    assert [key.name for key in store.keys] == ["south"]
    (place / "keys.json").unlink()
    assert store.changed()
    store.reload()
    assert store.keys == []


def test_what_two_processes_add_is_kept_by_both(place: Path) -> None:
    one, two = KeyStore(place), KeyStore(place)
    one.add(SigningKey("a", CANARY))
    two.add(SigningKey("b", OTHER))
    assert [key.name for key in KeyStore(place).keys] == ["a", "b"]


def test_a_vehicle_has_one_key(place: Path) -> None:
    store = filled(place)
    store.assign("south", "", 1)
    assert store.key_of("", 1) == SigningKey("south", OTHER)
    assert store.vehicles_of("north") == [("", 2)]
    store.unassign("", 1)
    assert store.key_of("", 1) is None
    store.remove("north")
    assert store.key_of("", 2) is None
    with pytest.raises(KeyStoreError, match="no key named 'north'"):
        store.key("north")


def test_what_is_no_key_no_name_and_no_vehicle(place: Path) -> None:
    store = filled(place)
    before = (place / "keys.json").read_bytes()
    attempts = [
        lambda: store.add(SigningKey("north", bytes(31) + b"\1")),
        lambda: store.add(SigningKey("again", CANARY)),
        lambda: store.add(SigningKey("zero", ZERO_KEY)),
        lambda: store.add(SigningKey("../x", bytes(31) + b"\1")),
        lambda: store.add(SigningKey("", bytes(31) + b"\1")),
        lambda: store.add(SigningKey("x" * 33, bytes(31) + b"\1")),
        lambda: store.assign("nobody", "", 1),
        lambda: store.assign("north", "", 0),
        lambda: store.assign("north", "", 256),
        lambda: store.assign("north", "../", 1),
        lambda: store.unassign("", 77),
        lambda: store.remove("nobody"),
    ]
    for attempt in attempts:
        with pytest.raises(KeyStoreError) as caught:
            attempt()
        assert "\n" not in str(caught.value)
        assert_silent(str(caught.value))
    assert (place / "keys.json").read_bytes() == before
    assert len(store.keys) == 2


def test_live_keys_are_not_for_simulations(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TUI_GCS_STATE_DIR", str(tmp_path))
    open_store(RunKind.LIVE).add(SigningKey("real", CANARY))
    assert open_store(RunKind.SIM).keys == []
    assert open_store(RunKind.LIVE).directory == tmp_path / "live/keys"


# Fail closed


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o602, 0o644, 0o666, 0o611])
@pytest.mark.parametrize("name", ["keys.json", FILE])
def test_a_file_that_others_can_open_is_refused(place: Path, mode: int, name: str) -> None:
    filled(place)
    TimestampStore(place).write({})
    (place / name).chmod(mode)
    with pytest.raises(KeyStoreError, match=r"open to others.*chmod 600") as caught:
        KeyStore(place)
        TimestampStore(place)
    assert_silent(str(caught.value))


@pytest.mark.parametrize("mode", [0o750, 0o705, 0o755, 0o777])
def test_a_directory_that_others_can_open_is_refused(place: Path, mode: int) -> None:
    store = filled(place)
    place.chmod(mode)
    with pytest.raises(KeyStoreError, match=r"open to others.*chmod 700"):
        KeyStore(place)
    with pytest.raises(KeyStoreError, match="open to others"):
        store.add(SigningKey("new", bytes(31) + b"\1"))
    with pytest.raises(KeyStoreError, match="open to others"):
        TimestampStore(place)


def test_links_are_refused(place: Path, tmp_path: Path) -> None:
    filled(place)
    (place / "keys.json").rename(tmp_path / "elsewhere")
    (place / "keys.json").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(KeyStoreError, match="link"):
        KeyStore(place)
    (tmp_path / "other").symlink_to(place)
    with pytest.raises(KeyStoreError, match="not a directory"):
        KeyStore(tmp_path / "other")


def test_what_is_no_file_is_refused_without_waiting_for_it(place: Path) -> None:
    KeyStore(place)
    os.mkfifo(place / "keys.json", 0o600)
    with pytest.raises(KeyStoreError, match="not a file"):
        KeyStore(place)


def test_somebody_elses_files_are_refused(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    filled(place)
    monkeypatch.setattr(os, "geteuid", lambda: 12345)
    with pytest.raises(KeyStoreError, match="another user"):
        KeyStore(place)


def test_a_link_laid_where_we_are_going_to_write_is_not_followed(place: Path, tmp_path: Path) -> None:
    store = KeyStore(place)
    (tmp_path / "victim").write_text("untouched")
    (place / "keys.json.new").symlink_to(tmp_path / "victim")
    store.add(SigningKey("north", CANARY))
    assert (tmp_path / "victim").read_text() == "untouched"
    assert len(KeyStore(place).keys) == 1


@given(st.binary(max_size=200))
def test_any_bytes_in_the_file_are_keys_or_an_error(tmp_path_factory: pytest.TempPathFactory, junk: bytes) -> None:
    place = tmp_path_factory.mktemp("keys")
    (place / "keys.json").touch(0o600)
    (place / "keys.json").write_bytes(junk)
    with pytest.raises(KeyStoreError, match="damaged"):
        KeyStore(place)


@pytest.mark.parametrize(
    "text",
    [
        '{"keys": {"a": "FIRST_62"}, "vehicles": []}',
        '{"keys": {"a": "FIRST_62xx"}, "vehicles": []}',
        '{"keys": {"../a": "SECRET"}, "vehicles": []}',
        '{"keys": {"a": "SECRET"}, "vehicles": [["", 1, "b"]]}',
        '{"keys": {"a": "SECRET"}, "vehicles": [["", "1", "a"]]}',
        '{"keys": {"a": "SECRET"}, "vehicles": [], "more": 1}',
        '{"keys": {"a": "SECRET"}, "vehicles": []',
        '{"keys": "SECRET"}',
    ],
)
def test_a_damaged_store_changes_nothing_and_says_nothing_of_its_contents(place: Path, text: str) -> None:
    store = filled(place)
    (place / "keys.json").write_text(text.replace("SECRET", CANARY.hex()).replace("FIRST_62", CANARY.hex()[:62]))
    try:
        store.reload()
    except KeyStoreError as error:
        assert_silent(str(error), repr(error), "".join(traceback.format_exception(error)))
        assert "damaged" in str(error)
    else:
        pytest.fail("taken")
    assert [key.name for key in store.keys] == ["north", "south"]


def test_a_full_disk_leaves_the_old_file_and_the_old_keys(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = filled(place)
    before = (place / "keys.json").read_bytes()

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(KeyStoreError, match="No space left") as caught:
        store.add(SigningKey("new", bytes(31) + b"\1"))
    assert_silent(str(caught.value))
    assert (place / "keys.json").read_bytes() == before
    assert [key.name for key in store.keys] == ["north", "south"]


def test_who_writes_at_the_same_time_is_told_to_try_again(place: Path) -> None:
    one, two = filled(place), KeyStore(place)
    with one._locked(), pytest.raises(KeyStoreError, match="try again"):
        two.remove("south")
    two.remove("south")


def test_nothing_shows_a_key(place: Path, caplog: pytest.LogCaptureFixture) -> None:
    store = filled(place)
    with caplog.at_level(logging.DEBUG):
        logging.getLogger("canary").error("%s %r %s", store, store, store.keys)
        store.reload()
    assert "north" in caplog.text
    assert_silent(caplog.text, repr(vars(store)), str(store.key_of("", 1)))


# Keys of other ground stations


def test_raw_keys_are_64_hex_digits() -> None:
    assert secret_from(CANARY.hex(), "hex") == secret_from(CANARY.hex().upper(), "hex") == CANARY
    for text in ("", CANARY.hex()[:-1], CANARY.hex() + "0", CANARY.hex()[:-1] + "g", " " + CANARY.hex()[1:]):
        with pytest.raises(KeyStoreError) as caught:
            secret_from(text, "hex")
        assert_silent(str(caught.value))


def test_mavproxy_and_mission_planner_hash_the_passphrase_once() -> None:
    assert secret_from("open sesame", "mavproxy") == hashlib.sha256(b"open sesame").digest()
    assert secret_from("Drohne grün", "missionplanner") == hashlib.sha256(b"Drohne gr\xc3\xbcn").digest()
    with pytest.raises(KeyStoreError, match="ASCII"):
        secret_from("Drohne grün", "mavproxy")


def test_qgroundcontrol_stretches_the_passphrase() -> None:
    """Salt, iterations and length as in its source; the value is OpenSSL's (`openssl kdf … PBKDF2`)."""
    expected = "ffef24c3091dd65cd2ad644614cb1e38bbc62b350f45a6a50c09a4004f2ef71a"
    assert secret_from("open sesame", "qgc").hex() == expected
    with pytest.raises(KeyStoreError, match="8 characters"):
        secret_from("sesame", "qgc")


@pytest.mark.parametrize("form", ["hex", "mavproxy", "missionplanner", "qgc"])
@pytest.mark.parametrize("text", ["", "x" * 1025, "\udcff passphrase"])
def test_what_is_no_passphrase(form: str, text: str) -> None:
    with pytest.raises(KeyStoreError):
        secret_from(text, form)  # type: ignore[arg-type]


# Timestamps


def heard(verifier: SignatureVerifier, offset_s: float) -> SignatureResult:
    raw = Encoder(1, 1).encode("SYSTEM_TIME", time_unix_usec=1, time_boot_ms=1)
    return verifier.check(sign(raw, CANARY, 0, NOW + round(offset_s * TICKS_PER_S)), WALL_S + offset_s)


def state(clock: SigningClock, verifier: SignatureVerifier) -> dict[str, object]:
    return {"/1/abcd": {"clock": clock.last, "streams": verifier.streams()}}


def test_a_restart_remembers_clock_and_streams(place: Path) -> None:
    clock, verifier = SigningClock(WALL_S, 0.0), SignatureVerifier(CANARY)
    assert heard(verifier, 5) is SignatureResult.GOOD
    TimestampStore(place).write(state(clock, verifier))
    stored = TimestampStore(place).stored["/1/abcd"]
    assert stored["clock"] == clock.last
    after = SignatureVerifier(CANARY)
    after.restore(stored["streams"])
    assert heard(after, 5) is SignatureResult.OLD
    assert heard(after, 7) is SignatureResult.GOOD


def test_written_once_a_second_and_forced_to_disk_every_half_minute(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, clock, verifier = TimestampStore(place), SigningClock(WALL_S, 0.0), SignatureVerifier(CANARY)
    writes: list[float] = []
    synced: set[float] = set()
    now_s = 0.0
    monkeypatch.setattr(os, "fsync", lambda _: synced.add(now_s))

    def collect() -> dict[str, object]:
        writes.append(now_s)
        clock.next(WALL_S, now_s)
        return state(clock, verifier)

    for tick in range(0, 700):
        now_s = tick / 10
        file.tick(now_s, collect)
    assert writes == [float(second) for second in range(70)]
    assert synced == {0.0, 30.0, 60.0}


def test_nothing_new_is_not_written_again(place: Path) -> None:
    file = TimestampStore(place)
    file.tick(0.0, dict)
    first = (place / FILE).stat().st_ino
    (place / FILE).with_suffix(".held").hardlink_to(place / FILE)  # so that its number is not used again
    file.tick(1.0, dict)
    assert (place / FILE).stat().st_ino == first


def test_b6_30_killed_at_any_moment_the_next_station_refuses_what_this_one_took(place: Path) -> None:
    """Frames come at 10 Hz, ticks at 3.3 Hz: what is stored is up to 1.2 s old."""
    file, clock, verifier = TimestampStore(place), SigningClock(WALL_S, 0.0), SignatureVerifier(CANARY)
    for step in range(100):
        assert heard(verifier, step / 10) is SignatureResult.GOOD
        if step % 3 == 0:
            file.tick(step / 10, lambda: state(clock, verifier))
        after = SignatureVerifier(CANARY)
        after.restore(TimestampStore(place).stored["/1/abcd"]["streams"])
        assert {heard(after, earlier / 10) for earlier in range(step + 1)} == {SignatureResult.OLD}
        assert heard(after, step / 10 + 1.6) is SignatureResult.GOOD


@pytest.mark.parametrize("torn", [b"", b'{"/1/abcd": {"clo', b"\0" * 100])
def test_torn_by_a_power_cut_the_copy_serves_with_a_wider_margin(place: Path, torn: bytes) -> None:
    file, clock, verifier = TimestampStore(place), SigningClock(WALL_S, 0.0), SignatureVerifier(CANARY)
    heard(verifier, 0)
    file.write(state(clock, verifier))
    heard(verifier, 29)
    file.write(state(clock, verifier), sync=False)
    (place / FILE).write_bytes(torn)
    after = SignatureVerifier(CANARY)
    after.restore(TimestampStore(place).stored["/1/abcd"]["streams"])
    assert heard(after, 29) is SignatureResult.OLD
    assert heard(after, 32) is SignatureResult.GOOD


def test_both_torn_is_told_and_not_taken_for_a_first_start(place: Path) -> None:
    TimestampStore(place).write({})
    for name in (FILE, SAFE_FILE):
        (place / name).write_bytes(b"{")
    with pytest.raises(KeyStoreError, match="damaged"):
        TimestampStore(place)
    for name in (FILE, SAFE_FILE):
        (place / name).unlink()
    assert TimestampStore(place).stored == {}


@pytest.mark.parametrize(
    "wrong",
    [
        {"x": {"clock": -1, "streams": SignatureVerifier(OTHER).streams()}},
        {"x": {"clock": 2**48, "streams": SignatureVerifier(OTHER).streams()}},
        {"x": {"clock": 1, "streams": {"newest": {"1/1": 1}, "ahead": [], "floor": 0}}},
        {"x": {"clock": 1, "streams": {}}},
        {"x": {"clock": 1}},
        {"x": 1},
        [],
    ],
)
def test_what_cannot_be_restored_is_damaged(place: Path, wrong: object) -> None:
    TimestampStore(place)
    (place / FILE).touch(0o600)
    (place / FILE).write_text(json.dumps(wrong))
    with pytest.raises(KeyStoreError, match="damaged"):
        TimestampStore(place)


def test_a_disk_that_fails_is_told_and_tried_again(place: Path) -> None:
    file, clock, verifier = TimestampStore(place), SigningClock(WALL_S, 0.0), SignatureVerifier(CANARY)
    moved = place.rename(place.with_name("gone"))
    file.tick(0.0, lambda: state(clock, verifier))
    assert "timestamps.json" in file.error
    moved.rename(place)
    file.tick(0.5, lambda: state(clock, verifier))
    assert file.error
    file.tick(1.0, lambda: state(clock, verifier))
    assert file.error == ""
    assert (place / FILE).exists()
    assert (place / SAFE_FILE).exists()


def test_no_secret_in_the_timestamps(place: Path) -> None:
    verifier = SignatureVerifier(CANARY)
    heard(verifier, 0)
    TimestampStore(place).write(state(SigningClock(WALL_S, 0.0), verifier))
    assert_silent((place / FILE).read_text(), (place / SAFE_FILE).read_text())
