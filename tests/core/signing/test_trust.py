"""Signatures in the whole station: keyed vehicles fly, forgers do not, and no side stays deaf (docs/threats.md
B.6-27…37)."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.rigs.wires import Wire, Wired
from tui_gcs.core.fleet.vehicle import Signing
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.frames import check_frame
from tui_gcs.core.mavlink.signing import TICKS_PER_S, SigningKey, sign, ticks
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Freshness, Phase, RunPhase
from tui_gcs.core.records.event_log import ALERT, WARNING
from tui_gcs.core.records.tlog_reader import read_tlog
from tui_gcs.core.signing.keystore import KeyStore

pytestmark = pytest.mark.long  # nearly each is a flight

MakeWired = Callable[..., Wired]
SECRET, OTHER = bytes(range(1, 33)), bytes(range(101, 133))
BEAT = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 6, "system_status": 3, "mavlink_version": 3}


@pytest.fixture
def keys(tmp_path: Path) -> KeyStore:
    return KeyStore(tmp_path / "keys")


def keyed(
    wired: MakeWired, keys: KeyStore, vehicles: int = 1, *, px4: bool = False, wires: list[Wire] | None = None
) -> Wired:
    """Vehicles that all sign with one key that the station holds."""
    if not keys.keys:
        keys.add(SigningKey("field", SECRET))
    for system in range(1, vehicles + 1):
        keys.assign("field", "", system)
    flight = wired(vehicles, keys=keys, wires=wires or [Wire("near")])
    for index in range(vehicles):
        flight.sim._pilots[index].platform.outbox.signer.px4 = px4
        flight.sim.set_key(index, SECRET, ticks(flight.clock.wall()))
    return flight


def alerts(flight: Wired) -> list[str]:
    return [e.text for e in flight.events() if e.severity <= WARNING]


def recording(flight: Wired, seconds: float) -> list[bytes]:
    """What the vehicles send in the next seconds, heard by somebody else, too."""
    heard: list[bytes] = []
    wire = flight.wires[0]
    plain = wire.from_vehicle

    def listen(now: float, data: bytes, address: Address) -> None:
        heard.append(data)
        plain(now, data, address)

    wire.from_vehicle = listen  # type: ignore[method-assign]
    flight.run(seconds)
    wire.from_vehicle = plain  # type: ignore[method-assign]
    return heard


def good_frames(flight: Wired) -> int:
    return flight.station.picture.fleet.intakes[""].counts("near")["frames"]


# ---------------------------------------------------------------- flying


def test_keyed_vehicles_fly_hold_and_return(wired: MakeWired, keys: KeyStore, tmp_path: Path) -> None:
    flight = keyed(wired, keys, 2).flying().run(20.0)
    assert {flight.vehicle(v).identity.signing for v in (1, 2)} == {Signing.OURS}
    assert flight.frame is not None and set(flight.frame.signing) == {"signed by us"}
    flight.ask(m.Hold())
    flight.run(5.0)
    assert flight.phases() == {Phase.HOLDING}
    flight.ask(m.Return())
    flight.until(lambda: flight.station.flight.executive.run is RunPhase.IDLE, 150.0)
    assert not flight.sim.armed.any()
    assert not flight.station.picture.trust.dropped, "nothing was doubted"
    flight.close()
    logged = [frame.raw for _, frame in read_tlog(tmp_path / "run.tlog")]
    assert len(logged) > 1000 and not any(raw[0] == 0xFD and raw[2] & 1 for raw in logged), "logs hold no signatures"


def test_forged_and_replayed_frames_change_nothing(wired: MakeWired, keys: KeyStore) -> None:
    flight = keyed(wired, keys).flying()
    heard = recording(flight, 5.0)
    genuine = good_frames(flight)
    forger, link, here = Encoder(1, 1), flight.wires[0].link, ("sim", 0)
    far_ahead = ticks(flight.clock.wall() + 1e7)
    for k in range(100):
        beat = forger.encode("HEARTBEAT", **BEAT)
        link.inject(beat, here)
        link.inject(sign(beat, OTHER, 1, far_ahead + k), here)
        link.inject(sign(forger.encode("HEARTBEAT", **BEAT), OTHER, k, 2**48 - 2), here)
        for raw in heard[:5]:
            link.inject(raw, here)
            link.inject(raw, ("elsewhere", k))
        flight.run(0.05)
        assert flight.vehicle().telemetry.custom_mode == 4
    dropped = flight.station.picture.trust.dropped
    assert dropped["signature: bad signature"] == 200
    assert dropped["signature: old"] + dropped["signature: copy or swapped neighbour"] == 1000
    assert dropped["unsigned, though a key is set"] == 100
    assert 100 <= good_frames(flight) - genuine <= 130, "the genuine ones of 5 s, and all of them"
    assert flight.vehicle().loss_pct == 0.0
    assert flight.phase(1) is Phase.FLYING and flight.vehicle().address == ("sim", 0)
    assert len([t for t in alerts(flight) if "old signatures" in t]) == 1


def test_who_stops_signing_in_flight_is_told_and_not_believed(wired: MakeWired, keys: KeyStore) -> None:
    flight = keyed(wired, keys).flying().run(5.0)
    vehicle = flight.vehicle()
    flight.sim.set_key(0, b"")
    before_s, place = flight.clock.now(), vehicle.telemetry.position_m
    flight.until(lambda: any("stopped signing" in text for text in alerts(flight)), 2.0)
    flight.until(lambda: vehicle.identity.signing is Signing.UNSIGNED, 2.0 - (flight.clock.now() - before_s), "shown")
    flight.run(0.2)
    assert "does not sign" in flight.status().alarm
    assert vehicle.telemetry.position_m == place
    flight.run(5.0)
    assert vehicle.freshness(flight.clock.now()) is Freshness.LOST
    assert len([e for e in flight.events() if "stopped signing" in e.text]) == 1
    flight.sim.set_key(0, SECRET, ticks(flight.clock.wall()))
    flight.run(5.0)
    assert vehicle.identity.signing is Signing.OURS and not vehicle.identity.untrusted


def test_mavlink_1_does_not_get_around_the_key(wired: MakeWired, keys: KeyStore) -> None:
    from pymavlink.dialects.v10 import ardupilotmega as v10

    flight = keyed(wired, keys).ready()
    old = v10.MAVLink(None, 1, 1)
    for address in (("sim", 0), ("sim", 1)):
        for _ in range(10):
            beat = old.heartbeat_encode(2, 3, 81, 6, 3, 3).pack(old)
            assert check_frame(beat) is not None
            flight.wires[0].link.inject(bytes(beat), address)
            flight.run(0.1)
    assert flight.vehicle().telemetry.custom_mode != 6 and flight.vehicle().address == ("sim", 0)
    assert flight.station.picture.trust.dropped["MAVLink 1 (downgrade), though a key is set"] >= 1


def test_a_radio_may_speak_unsigned_but_not_with_a_wrong_signature(wired: MakeWired, keys: KeyStore) -> None:
    flight = keyed(wired, keys).ready()
    radio = Encoder(1, 68)
    said = {"rssi": 200, "remrssi": 190, "noise": 40, "remnoise": 40, "rxerrors": 0, "fixed": 0}
    flight.wires[0].link.inject(radio.encode("RADIO_STATUS", txbuf=77, **said), ("sim", 0))
    flight.run(0.1)
    assert "txbuf 77" in flight.status().links[0].radio
    flight.wires[0].link.inject(
        sign(radio.encode("RADIO_STATUS", txbuf=11, **said), OTHER, 0, ticks(flight.clock.wall())), ("sim", 0)
    )
    flight.run(0.1)
    assert "txbuf 77" in flight.status().links[0].radio
    assert flight.station.picture.trust.dropped["signature: bad signature"] == 1


# ---------------------------------------------------------------- restarts


def test_after_a_crash_recordings_are_refused_and_the_vehicle_is_believed(wired: MakeWired, keys: KeyStore) -> None:
    flight = keyed(wired, keys).ready()
    heard = recording(flight, 60.0)
    flight.boot_station()
    link = flight.wires[0].link
    for address in (("sim", 0), ("elsewhere", 0)):
        for raw in heard:
            link.inject(raw, address)
        flight.station.tick()
    while link.sent:
        link.sent.popleft()
    assert 1 not in flight.station.picture.fleet.vehicles, "not one of a minute's recordings counts"
    flight.run(5.0)
    vehicle = flight.vehicle()
    assert vehicle.identity.signing is Signing.OURS and vehicle.freshness(flight.clock.now()) is Freshness.OK
    flight.run(10.0)
    assert vehicle.identity.identified and not flight.station.frontend.readiness.why_not_start(1)


@pytest.mark.parametrize("px4", [False, True])
def test_a_power_cycle_of_the_vehicle_leaves_nobody_deaf(wired: MakeWired, keys: KeyStore, px4: bool) -> None:
    flight = keyed(wired, keys, px4=px4).run(100.0)
    for off_s in (1.0, 200.0):
        flight.sim.silence(0)
        flight.run(off_s)
        flight.sim._pilots[0].restart(flight.sim._now_us)
        flight.sim.unsilence(0)
        flight.run(15.0)
        assert flight.vehicle().freshness(flight.clock.now()) is Freshness.OK
        assert flight.vehicle().identity.signing is Signing.OURS and flight.vehicle().identity.identified


@pytest.mark.parametrize("px4", [False, True])
def test_restarts_of_the_station_leave_nobody_deaf(wired: MakeWired, keys: KeyStore, px4: bool) -> None:
    flight = keyed(wired, keys, 2, px4=px4).run(20.0)
    for _ in range(5):
        flight.boot_station()
        flight.run(8.0)
        for v in (1, 2):
            assert (
                flight.vehicle(v).freshness(flight.clock.now()) is Freshness.OK
                and flight.vehicle(v).identity.identified
            )


def test_several_vehicles_behind_one_address_are_all_told_the_time(wired: MakeWired, keys: KeyStore) -> None:
    behind = [Wire("near", place=lambda fleet, index: ("router", 1))]
    flight = keyed(wired, keys, 3, px4=True, wires=behind)
    for index in range(3):
        flight.sim.set_key(index, SECRET, ticks(flight.clock.wall() - 3 * 86400))
    flight.run(10.0)
    assert all(flight.vehicle(v).freshness(flight.clock.now()) is Freshness.OK for v in (1, 2, 3))


def test_a_wrong_clock_of_one_vehicle_harms_no_other(wired: MakeWired, keys: KeyStore) -> None:
    flight = keyed(wired, keys, 2).run(10.0)
    flight.sim.set_key(0, SECRET, ticks(flight.clock.wall() + 10 * 365 * 86400))
    flight.run(10.0)
    assert flight.vehicle(1).freshness(flight.clock.now()) is Freshness.LOST
    assert any("more than 5 min ahead" in text for text in alerts(flight))
    assert flight.vehicle(2).freshness(flight.clock.now()) is Freshness.OK
    clock = flight.station.picture.trust._keyed_vehicles["", 2].clock
    assert clock.last < ticks(flight.clock.wall()) + 60 * TICKS_PER_S


# ---------------------------------------------------------------- no key, other keys


def test_a_vehicle_with_an_unknown_key_is_shown_and_not_commanded(wired: MakeWired, keys: KeyStore) -> None:
    flight = wired(1, keys=keys, wires=[Wire("near")])
    flight.sim.set_key(0, OTHER, ticks(flight.clock.wall()))
    flight.run(15.0)
    vehicle = flight.vehicle()
    assert vehicle.identity.signing is Signing.UNKNOWN_KEY
    assert flight.frame is not None and flight.frame.signing == ("unknown key",)
    assert "a key that we do not hold" in flight.frame.problem[0]
    assert not flight.ask(m.Start(vehicles=(1,))).ok
    assert any(e.severity == ALERT for e in flight.events())


def test_px4_that_signs_with_zeros_is_as_good_as_unsigned(wired: MakeWired, keys: KeyStore) -> None:
    flight = wired(1, keys=keys, wires=[Wire("near")])
    flight.sim._pilots[0].platform.outbox.signer.px4 = True
    flight.run(15.0)
    assert flight.vehicle().identity.signing is Signing.NOT_VERIFIED
    assert not flight.vehicle().why_not_commanded
    flight.until(lambda: not flight.station.frontend.readiness.why_not_start(1), 30.0)


def test_keys_may_be_assigned_and_taken_away_while_the_station_runs(wired: MakeWired, keys: KeyStore) -> None:
    keys.add(SigningKey("field", SECRET))
    flight = wired(1, keys=keys, wires=[Wire("near")])
    flight.sim.set_key(0, SECRET, ticks(flight.clock.wall()))
    flight.run(10.0)
    vehicle = flight.vehicle()
    assert vehicle.identity.signing is Signing.UNKNOWN_KEY
    keys.assign("field", "", 1)
    flight.until(lambda: vehicle.identity.signing is Signing.OURS, 2.5)
    flight.run(10.0)
    assert not vehicle.why_not_commanded and vehicle.identity.identified
    keys.unassign("", 1)
    flight.until(lambda: vehicle.identity.signing is Signing.UNKNOWN_KEY, 2.5)
    assert not vehicle.identity.keyed and vehicle.freshness(flight.clock.now()) is Freshness.OK
    flight.sim.set_key(0, b"")
    flight.run(3.0)
    assert vehicle.identity.signing is Signing.UNSIGNED and not vehicle.why_not_commanded


def test_a_damaged_key_file_leaves_the_keys_as_they_were(wired: MakeWired, keys: KeyStore) -> None:
    flight = keyed(wired, keys).run(10.0)
    (keys.directory / "keys.json").write_text("{")
    flight.run(10.0)
    assert flight.vehicle().identity.signing is Signing.OURS
    assert any("stay as they were" in text for text in alerts(flight))


# ---------------------------------------------------------------- paths and signatures


def test_a_signed_vehicle_is_followed_to_a_new_address_when_the_old_one_is_silent(
    wired: MakeWired, keys: KeyStore
) -> None:
    now: dict[str, Address] = {"place": ("sim", 0)}
    flight = keyed(wired, keys, wires=[Wire("near", place=lambda fleet, index: now["place"])]).flying().run(3.0)
    now["place"] = ("sim", 9)
    flight.run(1.0)
    assert flight.vehicle().address == ("sim", 0), "who repeats its frames would be heard so, too"
    flight.run(0.6)
    assert flight.vehicle().address == ("sim", 9)
    since_s = flight.clock.now()
    flight.run(5.0)
    assert flight.phase(1) is Phase.FLYING and flight.vehicle().integrity.reboots == 0
    assert len(flight.sent_to(1, since_s=since_s)) >= 20


def test_signed_copies_over_two_links_are_no_replays(wired: MakeWired, keys: KeyStore) -> None:
    near, far = Wire("near", delay_s=0.02), Wire("far", delay_s=0.8)
    flight = keyed(wired, keys, wires=[near, far]).flying().run(10.0)
    assert len(flight.vehicle().used_paths()) == 2 and flight.vehicle().link == "near"
    assert not [text for text in alerts(flight) if "signature" in text]
    near.up = False
    flight.until(lambda: flight.vehicle().link == "far", 2.0)
    flight.run(5.0)
    assert flight.phase(1) is Phase.FLYING
    near.up = True
    flight.until(lambda: flight.vehicle().link == "near", 15.0)
    assert not [text for text in alerts(flight) if "signature" in text]


def test_a_signed_camera_at_its_own_address_does_not_draw_commands_there(wired: MakeWired, keys: KeyStore) -> None:
    flight = keyed(wired, keys).ready()
    camera = Encoder(1, 100)
    for _ in range(30):
        raw = camera.encode("HEARTBEAT", **BEAT | {"type": 30, "autopilot": 8})
        flight.wires[0].link.inject(sign(raw, SECRET, 3, ticks(flight.clock.wall())), ("camera", 1))
        flight.run(0.2)
    assert flight.vehicle().address == ("sim", 0)
