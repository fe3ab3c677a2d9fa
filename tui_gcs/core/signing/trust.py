"""Signatures: which frames are believed, and what we sign (docs/threats.md A, B.6-14, 16, 27…37).

A vehicle that we hold a key for is *keyed*: only frames signed with its key count, and everything for it is signed.
For the others a signature proves nothing; what it is worth is shown as it is. PX4 signs with a zero key while signing
is off, so "signed" is never taken for "authenticated".
"""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.vehicle import IDS_PER_NETWORK, Signing, Vehicle
from tui_gcs.core.mavlink.frames import MAGIC_V2, SIGNED
from tui_gcs.core.mavlink.signing import (
    MAX_TIMESTAMP,
    MAY_BE_UNSIGNED,
    SignatureResult,
    SignatureVerifier,
    SignedBy,
    SigningClock,
    SigningKey,
    sign,
    signature_matches,
    signed_by,
    timestamp,
)
from tui_gcs.core.mavlink.sources import Source
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ALERT, NOTICE, WARNING, EventLog
from tui_gcs.core.signing.keystore import KeyStore, KeyStoreError
from tui_gcs.core.signing.timestamp_store import TimestampStore

HEARTBEAT = 0
CHECK_S = 0.5
RECENT_REJECTION_S = 3.0
"""What was refused within this time tells how a vehicle signs now."""
SIGNATURE_TIMEOUT_S = 1.2
"""No good signature for so long, and frames without one: it does not sign any more (alarm within 2 s, B.6-37)."""
KEY_PROOF_TIMEOUT_S = 10.0
"""A vehicle that was given a key must sign with it within this time, else it did not take it."""
MIN_OLD_SIGNATURES, OLD_SIGNATURE_WINDOW_S = 10, 5.0
"""So many old signatures in this time are told."""
MAX_COPY_AGE_S = 3.0
"""Less old may be what a second link brings, or neighbours that PX4's two threads swapped: refused without a word."""
TIME_FRAME_INTERVAL_S = 1.0
LINK_ID = 0
"""One stream per vehicle and key: we sign with one growing clock, whatever the link."""


@dataclass
class _KeyedVehicle:
    """One keyed vehicle."""

    key: SigningKey
    verifier: SignatureVerifier
    clock: SigningClock
    good_s: float = -math.inf
    newest: int = 0
    """Signing time of the newest good frame."""
    lately: int = MAX_TIMESTAMP
    long_ago: int = MAX_TIMESTAMP
    """What that was 3 to 6 s ago: autopilots count frames, so the times themselves do not tell how old they are."""
    marked_s: float = -math.inf
    unsigned_s: float = -math.inf
    bad_s: float = -math.inf
    old_s: list[float] = field(default_factory=list)
    """When signatures came that were not newer than what had come."""

    def hear(self, timestamp: int, now: float) -> None:
        """A good frame with this signing time."""
        if now - self.marked_s > MAX_COPY_AGE_S:
            self.long_ago, self.lately, self.marked_s = min(self.lately, timestamp), timestamp, now
        self.newest, self.good_s = timestamp, now


@dataclass
class _PendingKey:
    """A key that was sent to a vehicle, and has to be proven."""

    vehicle: Vehicle
    key: SigningKey
    until_s: float
    proven: bool = False


class SigningRegistry:
    """The keys in use. Without a key store nobody is keyed and every gate is open."""

    def __init__(
        self,
        clock: Clock,
        events: EventLog,
        networks: tuple[str, ...],
        store: KeyStore | None = None,
        stamps: TimestampStore | None = None,
        heartbeat: Callable[[], bytes] = bytes,
    ) -> None:
        """`heartbeat` makes ours; `stamps` remembers signing times across restarts.

        Raises:
            KeyStoreError: what `stamps` holds is damaged.
        """
        self.dropped: Counter[str] = Counter()
        self.store = store
        self._clock = clock
        self._events = events
        self._networks = networks
        self._stamps = stamps
        self._heartbeat = heartbeat
        self._behind: set[tuple[Source, int]] = set()
        self._next_help_s = -math.inf
        self._trusts: dict[tuple[str, int], _KeyedVehicle] = {}
        self._given: list[_PendingKey] = []
        self._next_look_s = -math.inf
        self.on_change: list[Callable[[], None]] = []
        """Called when keys changed: what is done with frames is to be decided anew."""
        self._use_keys()

    @property
    def has_keys(self) -> bool:
        """Whether any vehicle is keyed."""
        return bool(self._trusts)

    # ---------------------------------------------------------------- in

    def gate(self, source: Source, system: int) -> Callable[[bytes], bool] | None:
        """The check for frames of a system; None if it has no key: then any frame is believed as before."""
        trust = self._trusts.get((source.network, system))
        if trust is None:
            return None
        name = self._name(source.network, system)

        def believe(raw: bytes) -> bool:
            if raw[0] != MAGIC_V2 or not raw[2] & SIGNED:
                return self._unsigned(trust, name, raw)
            verdict = trust.verifier.check(raw, self._clock.wall())
            now = self._clock.now()
            if verdict is SignatureResult.GOOD:
                trust.hear(timestamp(raw), now)
                trust.clock.follow(trust.newest, self._clock.wall(), now)
                return True
            if verdict is SignatureResult.BAD_SIGNATURE:
                self._look_for_given(source.network, system, raw)
            elif verdict is not SignatureResult.AHEAD:
                self._behind.add((source, system))
            if verdict is SignatureResult.OLD and timestamp(raw) > trust.long_ago:
                self.dropped["signature: copy or swapped neighbour"] += 1
                return False
            return self._bad(trust, name, verdict, now)

        return believe

    def due_time_frames(self) -> list[tuple[Source, bytes]]:
        """Where holders of our keys are whose time is behind, and what tells each of them the time.

        Autopilots count their signing time and are pulled up only by what they hear of us. After a power cycle, or
        after a restart of ours, both sides would be deaf to each other for ever; one signed heartbeat a second ends
        that. A replayer gets nothing else from it.
        """
        now = self._clock.now()
        if not self._behind or now < self._next_help_s:
            return []
        self._next_help_s = now + TIME_FRAME_INTERVAL_S
        told = []
        for source, system in sorted(self._behind, key=lambda each: (str(each[0].address), each[1])):
            trust = self._trusts.get((source.network, system))
            if trust is not None:
                told.append((source, self._sign(trust, self._heartbeat())))
        self._behind.clear()
        return told

    def _unsigned(self, trust: _KeyedVehicle, name: str, raw: bytes) -> bool:
        if raw[0] == MAGIC_V2 and int.from_bytes(raw[7:10], "little") in MAY_BE_UNSIGNED:
            return True
        what = "unsigned" if raw[0] == MAGIC_V2 else "MAVLink 1 (downgrade)"
        self.dropped[f"{what}, though a key is set"] += 1
        trust.unsigned_s = self._clock.now()
        if trust.good_s > -math.inf:
            text = "stopped signing, or somebody forges: unsigned frames are not believed"
        else:
            text = "does not sign though we hold a key for it: nothing it sends is believed"
        self._events.report(EventClass.CONNECTION, name, text, ALERT, every_s=30)
        return False

    def _bad(self, trust: _KeyedVehicle, name: str, verdict: SignatureResult, now: float) -> bool:
        self.dropped[f"signature: {verdict.value}"] += 1
        if verdict is SignatureResult.BAD_SIGNATURE:
            trust.bad_s = now
            text = "frames signed with an unknown key: not believed"
        elif verdict is SignatureResult.AHEAD:
            text = "its signing clock is more than 5 min ahead: that stream is not believed"
        elif now - trust.good_s > RECENT_REJECTION_S:
            text = "its signing clock is behind: it is told the time, and not believed before"
            self._events.report(EventClass.CONNECTION, name, text, NOTICE, every_s=30)
            return False
        else:
            trust.old_s = [t for t in trust.old_s if now - t < OLD_SIGNATURE_WINDOW_S] + [now]
            if len(trust.old_s) < MIN_OLD_SIGNATURES:
                return False
            trust.old_s = []
            text = "frames with old signatures (recorded ones?): not believed"
        self._events.report(EventClass.CONNECTION, name, text, ALERT, every_s=30)
        return False

    # ---------------------------------------------------------------- out

    def signed(self, vehicle: Vehicle, frame: bytes) -> bytes:
        """`frame` for `vehicle`: signed if it is keyed."""
        trust = self._trusts.get((vehicle.network, vehicle.system))
        if trust is None:
            return frame
        return self._sign(trust, frame)

    def _sign(self, trust: _KeyedVehicle, frame: bytes) -> bytes:
        return sign(frame, trust.key.secret, LINK_ID, trust.clock.next(self._clock.wall(), self._clock.now()))

    def key_sent(self, vehicle: Vehicle, key: SigningKey) -> None:
        """`key` was sent to `vehicle`: use it as soon as the vehicle signs with it, and not before."""
        self._given = [each for each in self._given if each.vehicle is not vehicle]
        self._given.append(_PendingKey(vehicle, key, self._clock.now() + KEY_PROOF_TIMEOUT_S))

    # ---------------------------------------------------------------- time

    def tick(self, vehicles: list[Vehicle]) -> None:
        """Once a second: say how each vehicle signs, look whether the keys changed."""
        now = self._clock.now()
        if now < self._next_look_s:
            return
        self._next_look_s = now + CHECK_S
        self._look_for_keys()
        if self._stamps is not None and self._trusts:
            self._stamps.tick(now, self._to_store)
            if self._stamps.error:
                text = f"{self._stamps.error}: after a restart recordings may pass as new"
                self._events.report(EventClass.PROCESSING, "keys", text, WARNING, every_s=60)
        for given in list(self._given):
            self._prove(given, now)
        for vehicle in vehicles:
            trust = self._trusts.get((vehicle.network, vehicle.system))
            vehicle.identity.keyed = trust is not None
            self._set_signing(
                vehicle, self._unkeyed(vehicle) if trust is None else _keyed(trust, now, vehicle.identity.signing)
            )

    def _set_signing(self, vehicle: Vehicle, signing: Signing) -> None:
        vehicle.identity.untrusted = ""  # anew each time: keys come and go while it signs as before
        if signing is Signing.UNKNOWN_KEY:
            vehicle.identity.untrusted = "signed with a key that we do not hold"
        elif vehicle.identity.keyed and signing is not Signing.OURS:
            vehicle.identity.untrusted = "does not sign, though we hold a key for it"
        if signing is vehicle.identity.signing:
            return
        vehicle.identity.signing = signing
        severity = ALERT if vehicle.identity.untrusted else NOTICE
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", f"its frames: {signing.value}", severity)

    def _unkeyed(self, vehicle: Vehicle) -> Signing:
        """What the newest heartbeat says of a vehicle without a key."""
        slot = vehicle.path.slots.get(HEARTBEAT)
        if slot is None or not slot.raw or slot.raw[0] != MAGIC_V2 or not slot.raw[2] & SIGNED:
            return Signing.UNSIGNED
        return Signing.NOT_VERIFIED if signed_by(slot.raw) is SignedBy.ZERO_KEY else Signing.UNKNOWN_KEY

    def _look_for_given(self, network: str, system: int, raw: bytes) -> None:
        """A frame that the key in use did not sign: perhaps the one that was just given did."""
        for given in self._given:
            if (given.vehicle.network, given.vehicle.system) == (network, system):
                given.proven |= signature_matches(raw, given.key.secret)

    def _prove(self, given: _PendingKey, now: float) -> None:
        slot = given.vehicle.path.slots.get(HEARTBEAT)
        name = f"vehicle {given.vehicle.id}"
        if slot is not None and slot.raw[:1] == b"\xfd" and slot.signed:
            given.proven |= signature_matches(slot.raw, given.key.secret)
        if given.proven and self.store is not None:
            self._given.remove(given)
            try:
                self.store.assign(given.key.name, given.vehicle.network, given.vehicle.system)
            except KeyStoreError as error:
                self._events.report(EventClass.CONNECTION, name, f"signs now, but: {error}", ALERT)
                return
            text = f"signs with key {given.key.name} ({given.key.fingerprint})"
            self._events.report(EventClass.CONNECTION, name, text, NOTICE)
            self._use_keys()
        elif now > given.until_s:
            self._given.remove(given)
            text = f"did not take key {given.key.name}: it does not sign with it. PX4 takes keys over USB only"
            self._events.report(EventClass.CONNECTION, name, text, WARNING)

    def _look_for_keys(self) -> None:
        if self.store is None or not self.store.changed():
            return
        try:
            self.store.reload()
        except KeyStoreError as error:
            self._events.report(
                EventClass.PROCESSING, "keys", f"{error}; the keys stay as they were", ALERT, every_s=60
            )
            return
        self._use_keys()

    def _use_keys(self) -> None:
        """Take the vehicles' keys from the store."""
        if self.store is None:
            return
        wanted = {vehicle: key for key in self.store.keys for vehicle in self.store.vehicles_of(key.name)}
        self._to_store()
        for place in [place for place in self._trusts if place not in wanted]:
            del self._trusts[place]
        for place, key in wanted.items():
            trust = self._trusts.get(place)
            if trust is None or trust.key.fingerprint != key.fingerprint:
                self._trusts[place] = self._begin(place, key)
        for listener in self.on_change:
            listener()

    # ---------------------------------------------------------------- across restarts

    def _begin(self, place: tuple[str, int], key: SigningKey) -> _KeyedVehicle:
        held = self._stamps.stored.get(_holder(place, key), {}) if self._stamps is not None else {}
        verifier = SignatureVerifier(key.secret)
        if "streams" in held:
            verifier.restore(held["streams"])
        return _KeyedVehicle(
            key, verifier, SigningClock(self._clock.wall(), self._clock.now(), int(held.get("clock", 0)))
        )

    def _to_store(self) -> dict[str, Any]:
        """Signing times for the next start, of keys no longer in use, too: they may come back."""
        if self._stamps is None:
            return {}
        for place, trust in self._trusts.items():
            held = {"clock": trust.clock.last, "streams": trust.verifier.streams()}
            self._stamps.stored[_holder(place, trust.key)] = held
        return self._stamps.stored

    def close(self) -> None:
        """Write down the signing times for the next start."""
        if self._stamps is not None and self._trusts:
            self._stamps.write(self._to_store())

    def _name(self, network: str, system: int) -> str:
        return f"vehicle {self._networks.index(network) * IDS_PER_NETWORK + system}"


def _keyed(trust: _KeyedVehicle, now: float, before: Signing) -> Signing:
    """How a keyed vehicle signs; `before` while nothing tells."""
    if now - trust.good_s < SIGNATURE_TIMEOUT_S:
        return Signing.OURS
    if now - trust.bad_s < RECENT_REJECTION_S:
        return Signing.UNKNOWN_KEY
    if now - trust.unsigned_s < RECENT_REJECTION_S:
        return Signing.UNSIGNED
    return Signing.OURS if trust.good_s > -math.inf else before


def _holder(place: tuple[str, int], key: SigningKey) -> str:
    """A vehicle with one key; another key is another holder, for the old one may come back."""
    return f"{place[0]}/{place[1]}/{key.fingerprint}"
