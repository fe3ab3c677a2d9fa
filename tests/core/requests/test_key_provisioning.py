"""A vehicle gets its key in two steps, over a secure link, on the ground; the secret is nowhere to be found after."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.core.rigs.wires import Wire, Wired
from tui_gcs.core.fleet.vehicle import Signing
from tui_gcs.core.mavlink.signing import SigningKey, ticks
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import Reply
from tui_gcs.core.signing.keystore import KeyStore

MakeWired = Callable[..., Wired]
SECRET, OTHER = bytes.fromhex("c0ffee" * 10 + "beef"), bytes(range(101, 133))
SETUP_SIGNING = b"\x00\x01\x00"


@pytest.fixture
def keys(tmp_path: Path) -> KeyStore:
    store = KeyStore(tmp_path / "keys")
    store.add(SigningKey("field", SECRET))
    return store


def ready(wired: MakeWired, keys: KeyStore | None, *, secure: bool = True) -> Wired:
    return wired(1, keys=keys, wires=[Wire("usb", secure=secure)]).run(10.0)


def provision(flight: Wired, confirm: str = "", vehicle: int = 1, key: str = "field", who: str = "cli") -> Reply:
    return flight.ask(m.ProvisionKey(vehicle=vehicle, key=key, confirm=confirm), principal=who)


def code_in(reply: Reply) -> str:
    assert reply.ok, reply.text
    found = re.search(r": ([A-Z2-9]{6})$", reply.text)
    assert found, reply.text
    return found[1]


def keys_sent(flight: Wired) -> int:
    return sum(raw[7:10] == SETUP_SIGNING for wire in flight.wires for _, raw in wire.seen)


def test_the_first_step_tells_what_will_happen_and_sends_nothing(wired: MakeWired, keys: KeyStore) -> None:
    flight = ready(wired, keys)
    reply = provision(flight)
    assert code_in(reply)
    assert "field" in reply.text and "vehicle 1" in reply.text and "usb" in reply.text and "60 s" in reply.text
    flight.run(1.0)
    assert keys_sent(flight) == 0
    assert not any(code_in(reply) in text for text in flight.texts()), "the code is for who asked only"


def test_the_second_step_sends_it_and_the_vehicle_proves_it(wired: MakeWired, keys: KeyStore) -> None:
    flight = ready(wired, keys)
    reply = provision(flight, code_in(provision(flight)))
    assert reply.ok and "sent to vehicle 1" in reply.text
    flight.until(lambda: flight.vehicle().identity.signing is Signing.OURS, 3.0)
    assert keys_sent(flight) == 1
    assert KeyStore(keys.directory).vehicles_of("field") == [("", 1)]
    fingerprint = keys.key("field").fingerprint
    assert f"signs with key field ({fingerprint})" in flight.texts("vehicle 1")
    flight.run(10.0)
    assert not flight.vehicle().why_not_commanded
    flight.flying()
    assert not provision(flight).ok


def test_a_vehicle_that_signs_gets_another_key(wired: MakeWired, keys: KeyStore) -> None:
    keys.add(SigningKey("next", OTHER))
    flight = ready(wired, keys)
    provision(flight, code_in(provision(flight)))
    flight.run(5.0)
    assert provision(flight).text.startswith("it signs with key field already")
    reply = provision(flight, code_in(provision(flight, key="next")), key="next")
    assert reply.ok
    flight.run(5.0)
    assert KeyStore(keys.directory).vehicles_of("next") == [("", 1)]
    assert flight.vehicle().identity.signing is Signing.OURS and not flight.vehicle().why_not_commanded
    assert flight.clock.now() - flight.vehicle().last_heard_s < 1.0


def test_a_code_is_for_one_try_of_one_principal_for_a_minute(wired: MakeWired, keys: KeyStore) -> None:
    flight = ready(wired, keys)
    code = code_in(provision(flight))
    assert not provision(flight, code, who="console-2").ok, "somebody else's"
    code = code_in(provision(flight))
    assert not provision(flight, "AAAAAA").ok
    assert not provision(flight, code).ok, "one try"
    code = code_in(provision(flight))
    flight.run(61.0)
    assert not provision(flight, code).ok, "too late"
    code = code_in(provision(flight))
    keys.add(SigningKey("next", OTHER))
    assert not provision(flight, code, key="next").ok, "for another key"
    assert keys_sent(flight) == 0
    assert provision(flight, code_in(provision(flight)).lower()).ok


def test_what_has_changed_since_the_first_step_counts(wired: MakeWired, keys: KeyStore) -> None:
    flight = ready(wired, keys)
    flight.until(lambda: not flight.station.frontend.readiness.why_not_start(1), 60.0)
    code = code_in(provision(flight))
    flight.ask(m.Start(vehicles=(1,)))
    flight.until(lambda: flight.vehicle().telemetry.armed, 20.0)
    assert "it is armed" in provision(flight, code).text
    assert keys_sent(flight) == 0


def test_refusals_say_why(wired: MakeWired, keys: KeyStore) -> None:
    flight = ready(wired, keys, secure=False)
    assert "link usb is not marked secure" in provision(flight).text
    assert "vehicle 9 was never heard" in provision(flight, vehicle=9).text
    flight = ready(wired, keys)
    assert "no key named 'nothing'" in provision(flight, key="nothing").text
    flight.sim.silence(0)
    flight.run(5.0)
    assert "it is lost" in provision(flight).text
    assert "without keys" in provision(ready(wired, None)).text


def test_a_duplicate_a_stranger_and_a_planner_get_nothing(wired: MakeWired, keys: KeyStore) -> None:
    flight = wired(1, keys=keys, wires=[Wire("usb", secure=True, place=lambda fleet, index: ("usb", 0))]).run(20.0)
    assert "may not command" in provision(flight, who="planner-defend").text
    flight.vehicle().identity.firmware_token = "0123456789abcdef"
    assert "not one of our simulated vehicles" in provision(flight).text
    flight.vehicle().identity.firmware_token = flight.station.config.token
    flight.stranger(age_s=100.0)
    flight.run(5.0)
    assert "several vehicles use id 1" in provision(flight).text


def test_px4_that_ignores_the_key_is_told_after_ten_seconds(wired: MakeWired, keys: KeyStore) -> None:
    flight = wired(1, keys=keys, wires=[Wire("usb", secure=True)])
    flight.sim._pilots[0].platform.outbox.signer.px4 = True
    flight.run(10.0)
    assert provision(flight, code_in(provision(flight))).ok
    flight.run(9.0)
    assert not any("did not take" in text for text in flight.texts())
    flight.run(2.0)
    assert any("did not take key field" in text for text in flight.texts("vehicle 1"))
    assert KeyStore(keys.directory).vehicles_of("field") == []
    assert flight.vehicle().identity.signing is Signing.NOT_VERIFIED and not flight.vehicle().why_not_commanded


def test_the_secret_is_nowhere_but_on_the_wire_and_in_the_store(
    wired: MakeWired, keys: KeyStore, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    flight = ready(wired, keys)
    flight.sim.set_key(0, b"", ticks(flight.clock.wall()))
    replies = [provision(flight)]
    replies.append(provision(flight, code_in(replies[0])))
    replies.append(provision(flight, "WRONG2"))
    flight.run(15.0)
    flight.boot_station()
    flight.run(5.0)
    flight.close()
    station = flight.station
    trust = station.picture.trust
    shown = [repr(each) for each in (*replies, *flight.events(), trust.store, trust._keyed_vehicles)]
    shown += [
        repr(vars(station.picture.trust)),
        repr(vars(station.frontend.requests)),
        caplog.text,
        repr(flight.status()),
    ]
    texts = "".join(shown).encode()
    files = [path for path in tmp_path.rglob("*") if path.is_file() and path.name != "keys.json"]
    assert {path.suffix for path in files} >= {".tlog", ".jsonl"}
    everything = texts + b"".join(path.read_bytes() for path in files)
    for form in (SECRET, SECRET.hex().encode(), repr(SECRET)[2:-1].encode(), repr(list(SECRET))[1:-1].encode()):
        assert form not in everything
        assert form[:12] not in everything
    assert b"field" in everything and keys.key("field").fingerprint.encode() in everything
    assert SECRET in b"".join(raw for wire in flight.wires for _, raw in wire.seen), "the test would find it"
