"""Simulated vehicles that sign, against pymavlink's signer as the ground station."""

import json

import pytest
from pymavlink.dialects.v20 import ardupilotmega

from sitl.launch.fleet import SimFleet, VehicleSpec
from sitl.launch.simulated import load_spec
from sitl.links.signing import TICKS_PER_S, ZERO_KEY, SigningSpec, time_of
from sitl.links.wire import cut
from tests.sitl.conftest import GUIDED, LAT_DEG, LON_DEG, Ground, text_of

KEY, OTHER_KEY = bytes(range(32)), bytes(range(1, 33))
NOW = time_of(1_790_000_000.0)
ARMED_TEXT = "ERROR: Won't setup signing when armed"
DISARM, REBOOT = 400, 246


def flying(*signing: SigningSpec, booted: bool = True) -> Ground:
    """A station and vehicles with these keys, ready to be armed."""
    places = enumerate(signing)
    fleet = SimFleet([VehicleSpec(n + 1, LAT_DEG + 0.0002 * n, LON_DEG, 110.0, 90.0, s) for n, s in places])
    ground = Ground(fleet)
    if booted:
        ground.run(3.2)
    return ground


class Station:
    """pymavlink's encoder, signer and checker."""

    def __init__(self, key: bytes = b"", timestamp: int = NOW + TICKS_PER_S) -> None:
        self.mav = ardupilotmega.MAVLink(None, srcSystem=255, srcComponent=190)
        self.mav.robust_parsing = True
        if key:
            self.mav.signing.secret_key = key
            self.mav.signing.timestamp = timestamp
            self.mav.signing.sign_outgoing = True

    def pack(self, message: ardupilotmega.MAVLink_message) -> bytes:
        return bytes(message.pack(self.mav))

    def command(self, number: int, *p: float, system: int = 1) -> bytes:
        values = (*p, *(0.0,) * (7 - len(p)))
        return self.pack(ardupilotmega.MAVLink_command_long_message(system, 1, number, 0, *values))

    def setup_signing(self, key: bytes, timestamp: int, system: int = 1) -> bytes:
        return self.pack(ardupilotmega.MAVLink_setup_signing_message(system, 1, list(key), timestamp))

    def reads(self, datagrams: list[bytes]) -> list[str]:
        """Names of what this station can decode and believes; "BAD_DATA" for the rest."""
        return [m.get_type() for data in datagrams for m in self.mav.parse_buffer(data) or []]


def hears(ground: Ground, datagram: bytes, index: int = 0) -> list[bytes]:
    """What the vehicle sends at once."""
    ground.fleet.drain()
    ground.fleet.receive(index, datagram)
    return [data for at, data in ground.fleet.drain() if at == index]


def acks(sent: list[bytes]) -> int:
    return sum(frame.name == "COMMAND_ACK" for data in sent for frame in cut(data))


def guided(station: Station) -> bytes:
    return station.command(176, 1, GUIDED)


def test_without_a_key_nothing_is_signed_and_everybody_obeyed() -> None:
    ground = flying(SigningSpec())
    assert not any(data[2] & 1 for _, data in ground.raw if data[0] == 0xFD)
    assert acks(hears(ground, guided(Station()))) == 1
    assert acks(hears(ground, guided(Station(KEY)))) == 1


def test_all_a_keyed_vehicle_sends_can_be_checked_by_pymavlink() -> None:
    ground = flying(SigningSpec(KEY, NOW))
    frames = [data for _, data in ground.raw if data[0] == 0xFD]
    assert len(frames) > 10
    station = Station(KEY)
    assert "BAD_DATA" not in station.reads(frames)
    assert station.mav.signing.goodsig_count == len(frames)
    assert set(Station(OTHER_KEY).reads(frames)) == {"BAD_DATA"}


def test_a_keyed_vehicle_obeys_signed_commands_only() -> None:
    ground = flying(SigningSpec(KEY, NOW))
    assert acks(hears(ground, guided(Station()))) == 0
    assert acks(hears(ground, guided(Station(OTHER_KEY)))) == 0
    assert acks(hears(ground, guided(Station(ZERO_KEY)))) == 0
    version_1 = ardupilotmega.MAVLink_command_long_message(1, 1, 176, 0, 1, GUIDED, 0, 0, 0, 0, 0)
    assert acks(hears(ground, bytes(version_1.pack(Station().mav, force_mavlink1=True)))) == 0
    good = guided(Station(KEY))
    assert acks(hears(ground, good)) == 1
    assert acks(hears(ground, good)) == 0, "a replay"


def test_a_stream_has_to_grow_and_a_new_one_must_not_be_a_minute_old() -> None:
    ground = flying(SigningSpec(KEY, NOW))
    old, new = Station(KEY, NOW), Station(KEY, NOW + TICKS_PER_S)  # it loads a minute more than was stored
    assert acks(hears(ground, guided(old))) == 0
    assert acks(hears(ground, guided(new))) == 1
    new.mav.signing.timestamp = NOW + TICKS_PER_S
    assert acks(hears(ground, guided(new))) == 0


def test_its_time_is_pulled_up_by_what_it_hears() -> None:
    ground = flying(SigningSpec(KEY, NOW))
    ahead = Station(KEY, NOW + 1000 * TICKS_PER_S)
    (sent,) = hears(ground, guided(ahead))
    assert int.from_bytes(sent[-12:-6], "little") == NOW + 1000 * TICKS_PER_S + 1


def test_setup_signing_takes_effect_at_once_without_an_answer_and_off_again() -> None:
    ground = flying(SigningSpec())
    assert hears(ground, Station().setup_signing(KEY, NOW)) == []
    assert acks(hears(ground, guided(Station()))) == 0
    station = Station(KEY, NOW + TICKS_PER_S)
    sent = hears(ground, guided(station))
    assert station.reads(sent) == ["COMMAND_ACK"]
    assert int.from_bytes(sent[0][-12:-6], "little") > NOW + 60 * TICKS_PER_S
    assert hears(ground, station.setup_signing(ZERO_KEY, 0)) == []
    assert acks(hears(ground, guided(Station()))) == 1


def test_no_new_key_while_armed() -> None:
    ground = flying(SigningSpec())
    ground.mode(GUIDED)
    ground.command(400, 1)
    sent = hears(ground, Station().setup_signing(KEY, NOW))
    assert [text_of(frame) for data in sent for frame in cut(data)] == [ARMED_TEXT]
    assert acks(hears(ground, Station().command(DISARM, 0))) == 1


def test_setup_signing_for_another_vehicle_is_not_taken() -> None:
    ground = flying(SigningSpec(), SigningSpec())
    hears(ground, Station().setup_signing(KEY, NOW, system=2), index=0)
    assert acks(hears(ground, guided(Station()))) == 1


def test_radio_status_needs_no_signature() -> None:
    ground = flying(SigningSpec(KEY, NOW))
    signer = ground.fleet._pilots[0].platform.outbox.signer
    station = Station()
    assert signer.accepts(station.pack(ardupilotmega.MAVLink_radio_status_message(0, 0, 0, 0, 0, 0, 0)))
    assert not signer.accepts(station.pack(ardupilotmega.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)))


def test_sixteen_streams_and_no_more() -> None:
    ground = flying(SigningSpec(KEY, NOW))
    results = []
    for link in range(20):
        station = Station(KEY, NOW + 70 * TICKS_PER_S)
        station.mav.signing.link_id = link
        results.append(acks(hears(ground, guided(station))))
    assert results == [1] * 16 + [0] * 4


def test_after_a_reboot_it_is_a_minute_ahead_of_what_it_stored() -> None:
    ground = flying(SigningSpec(KEY, NOW))
    station = Station(KEY, NOW + 100 * TICKS_PER_S)
    hears(ground, station.pack(ardupilotmega.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)))
    ground.run(31.0)
    before = int.from_bytes(ground.raw[-1][1][-12:-6], "little")
    assert acks(hears(ground, station.command(REBOOT, 1))) == 1
    ground.run(3.2)
    after = int.from_bytes(ground.raw[-1][1][-12:-6], "little")
    assert before + 59 * TICKS_PER_S < after < before + 61 * TICKS_PER_S
    assert acks(hears(ground, guided(station))) == 0, "more than a minute behind"
    station.mav.signing.timestamp += TICKS_PER_S
    assert acks(hears(ground, guided(station))) == 1


def test_px4_without_a_key_signs_with_zeros_and_believes_everybody() -> None:
    ground = flying(SigningSpec(px4=True))
    frames = [data for _, data in ground.raw if data[0] == 0xFD]
    zero = Station(ZERO_KEY, 0)
    assert "BAD_DATA" not in zero.reads(frames)
    assert {data[-13] for data in frames} == {255}
    assert int.from_bytes(frames[0][-12:-6], "little") == 1, "it counts from zero, not from the clock"
    for station in (Station(), Station(KEY)):
        assert acks(hears(ground, guided(station))) == 1
    hears(ground, Station().setup_signing(KEY, NOW))
    assert acks(hears(ground, guided(Station()))) == 1, "takes keys over USB only"


def test_px4_is_as_old_as_its_key_after_a_power_cycle() -> None:
    ground = flying(SigningSpec(KEY, NOW, px4=True))
    station = Station(KEY, NOW + 86400 * TICKS_PER_S)
    assert acks(hears(ground, guided(station))) == 1
    ground.run(60.0)
    assert int.from_bytes(ground.raw[-1][1][-12:-6], "little") > NOW + 86400 * TICKS_PER_S
    hears(ground, station.command(REBOOT, 1))
    ground.run(3.2)
    assert int.from_bytes(ground.raw[-1][1][-12:-6], "little") < NOW + TICKS_PER_S


def test_a_vehicle_can_stop_signing_in_flight() -> None:
    ground = flying(SigningSpec(KEY, NOW))
    ground.fleet.set_key(0, b"")
    ground.raw.clear()
    ground.run(1.1)
    assert ground.raw
    assert not any(data[2] & 1 for _, data in ground.raw)


def test_keys_do_not_show() -> None:
    spec = VehicleSpec(1, LAT_DEG, LON_DEG, 110.0, 90.0, SigningSpec(KEY))
    assert "0203" not in repr(spec).replace("\\x", "")
    with pytest.raises(ValueError, match="32 bytes"):
        SigningSpec(KEY[:31])


def test_a_spec_file_may_hold_keys(tmp_path) -> None:
    place = {"lat_deg": 52.0, "lon_deg": -0.6, "ground_amsl_m": 110.0}
    keyed = place | {"system_id": 1, "signing_key": KEY.hex()}
    px4 = place | {"system_id": 2, "px4_signing": True}
    path = tmp_path / "spec.json"
    path.write_text(json.dumps({"vehicles": [keyed, px4, place | {"system_id": 3}]}))
    specs = load_spec(path, 3.0).specs
    assert [(s.signing.key, s.signing.px4) for s in specs] == [(KEY, False), (b"", True), (b"", False)]
    assert specs[0].signing.timestamp > NOW - 3600 * 24 * 365 * TICKS_PER_S
