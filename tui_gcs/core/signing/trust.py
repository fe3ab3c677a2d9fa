"""Signing registry: which signed frames are believed, and what we sign (docs/threats.md A, B.6-14, B.6-16, B.6-27…37).

A vehicle that we hold a key for is *keyed*: only frames signed with its key count, and everything for it is signed. For
the others a signature proves nothing and is only shown. PX4 signs with a zero key while signing is off, so "signed" is
never taken for "authenticated".
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
"""The registry updates every vehicle and looks for changed keys this often."""
RECENT_REJECTION_S = 3.0
"""Frames that were refused within this time show how a vehicle signs now."""
SIGNATURE_TIMEOUT_S = 1.2
"""A vehicle has ceased to sign when its last good signature is older and its frames have none (alarm within 2 s,
docs/threats.md B.6-37)."""
KEY_PROOF_TIMEOUT_S = 10.0
"""A vehicle that was sent a key must sign with it within this time, else it did not take the key."""
MIN_OLD_SIGNATURES, OLD_SIGNATURE_WINDOW_S = 10, 5.0
"""Ten old signatures within 5 s are reported."""
MAX_COPY_AGE_S = 3.0
"""A signature that is less old may be a copy over a second link, or a neighbour that PX4's two threads swapped: it is
refused without an event."""
TIME_FRAME_INTERVAL_S = 1.0
"""Key holders with a signing time behind ours get a signed heartbeat this often."""
LINK_ID = 0
"""Our link id in signatures: one stream per vehicle and key, since one growing clock signs on every link."""


@dataclass
class _KeyedVehicle:
    """A vehicle with a key: its verifier, our signing clock towards it, and when which frames came."""

    key: SigningKey
    verifier: SignatureVerifier
    clock: SigningClock
    good_s: float = -math.inf
    """When the newest good frame came, station time."""
    newest: int = 0
    """Signing time of the newest good frame, 10 µs ticks."""
    recent_timestamp: int = MAX_TIMESTAMP
    older_timestamp: int = MAX_TIMESTAMP
    """`newest` as it was 3 to 6 s ago. Autopilots count frames, so the times alone do not show how old they are."""
    shifted_s: float = -math.inf
    unsigned_s: float = -math.inf
    """When the newest unsigned frame came, station time."""
    bad_s: float = -math.inf
    """When the newest frame with an unknown key came, station time."""
    old_s: list[float] = field(default_factory=list)
    """When signatures came that were not newer than what had come."""

    def hear(self, timestamp: int, now: float) -> None:
        """Record a good frame with this signing time."""
        if now - self.shifted_s > MAX_COPY_AGE_S:
            self.older_timestamp = min(self.recent_timestamp, timestamp)
            self.recent_timestamp, self.shifted_s = timestamp, now
        self.newest, self.good_s = timestamp, now


@dataclass
class _PendingKey:
    """A key that was sent to a vehicle, which has to prove that it took it."""

    vehicle: Vehicle
    key: SigningKey
    until_s: float
    proven: bool = False


class SigningRegistry:
    """The keys in use by vehicle: checks received frames, signs sent ones.

    Without a key store every frame is believed.
    """

    def __init__(
        self,
        clock: Clock,
        events: EventLog,
        networks: tuple[str, ...],
        store: KeyStore | None = None,
        stamps: TimestampStore | None = None,
        heartbeat: Callable[[], bytes] = bytes,
    ) -> None:
        """Take the keys of `store`; `heartbeat` makes our heartbeat, `stamps` keeps signing times over restarts.

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
        self._late_holders: set[tuple[Source, int]] = set()
        self._next_time_frame_s = -math.inf
        self._keyed_vehicles: dict[tuple[str, int], _KeyedVehicle] = {}
        self._pending_keys: list[_PendingKey] = []
        self._next_check_s = -math.inf
        self.on_change: list[Callable[[], None]] = []
        """Called when keys changed: what is done with frames must be decided anew."""
        self._use_keys()

    @property
    def has_keys(self) -> bool:
        """Whether any vehicle is keyed."""
        return bool(self._keyed_vehicles)

    def gate(self, source: Source, system: int) -> Callable[[bytes], bool] | None:
        """Return the check for all frames of a system; None if it has no key, so that any frame is believed."""
        keyed = self._keyed_vehicles.get((source.network, system))
        if keyed is None:
            return None
        name = self._name(source.network, system)

        def believe(raw: bytes) -> bool:
            if raw[0] != MAGIC_V2 or not raw[2] & SIGNED:
                return self._refuse_unsigned(keyed, name, raw)
            verdict = keyed.verifier.check(raw, self._clock.wall())
            now = self._clock.now()
            if verdict is SignatureResult.GOOD:
                keyed.hear(timestamp(raw), now)
                keyed.clock.follow(keyed.newest, self._clock.wall(), now)
                return True
            if verdict is SignatureResult.BAD_SIGNATURE:
                self._match_pending_key(source.network, system, raw)
            # The key holder itself sent it, or a recording: its clock may be behind.
            elif verdict is not SignatureResult.AHEAD:
                self._late_holders.add((source, system))
            if verdict is SignatureResult.OLD and timestamp(raw) > keyed.older_timestamp:
                self.dropped["signature: copy or swapped neighbour"] += 1
                return False
            return self._refuse_signed(keyed, name, verdict, now)

        return believe

    def due_time_frames(self) -> list[tuple[Source, bytes]]:
        """Return (source, signed heartbeat) for key holders with a signing time that is behind.

        Autopilots count their signing time and are pulled up only by the frames they receive from us. After a power
        cycle, or after a restart of the station, both sides would refuse each other for ever; one signed heartbeat a
        second ends that. A replayer gets nothing else from it.
        """
        now = self._clock.now()
        if not self._late_holders or now < self._next_time_frame_s:
            return []
        self._next_time_frame_s = now + TIME_FRAME_INTERVAL_S
        frames = []
        for source, system in sorted(self._late_holders, key=lambda each: (str(each[0].address), each[1])):
            keyed = self._keyed_vehicles.get((source.network, system))
            if keyed is not None:
                frames.append((source, self._sign(keyed, self._heartbeat())))
        self._late_holders.clear()
        return frames

    def _refuse_unsigned(self, keyed: _KeyedVehicle, name: str, raw: bytes) -> bool:
        # Radios insert RADIO_STATUS and cannot sign.
        if raw[0] == MAGIC_V2 and int.from_bytes(raw[7:10], "little") in MAY_BE_UNSIGNED:
            return True
        what = "unsigned" if raw[0] == MAGIC_V2 else "MAVLink 1 (downgrade)"
        self.dropped[f"{what}, though a key is set"] += 1
        keyed.unsigned_s = self._clock.now()
        if keyed.good_s > -math.inf:
            text = "stopped signing, or its frames are forged: unsigned frames are not used"
        else:
            text = "does not sign though we hold a key for it: its frames are not used"
        self._events.report(EventClass.CONNECTION, name, text, ALERT, every_s=30)
        return False

    def _refuse_signed(self, keyed: _KeyedVehicle, name: str, verdict: SignatureResult, now: float) -> bool:
        self.dropped[f"signature: {verdict.value}"] += 1
        if verdict is SignatureResult.BAD_SIGNATURE:
            keyed.bad_s = now
            text = "frames signed with an unknown key: not used"
        elif verdict is SignatureResult.AHEAD:
            text = "its signing clock is more than 5 min ahead: that stream is not used"
        elif now - keyed.good_s > RECENT_REJECTION_S:
            text = "its signing clock is behind: the time is sent to it, its frames are not used before"
            self._events.report(EventClass.CONNECTION, name, text, NOTICE, every_s=30)
            return False
        else:
            keyed.old_s = [t for t in keyed.old_s if now - t < OLD_SIGNATURE_WINDOW_S] + [now]
            if len(keyed.old_s) < MIN_OLD_SIGNATURES:
                return False
            keyed.old_s = []
            text = "frames with old signatures (recorded ones?): not used"
        self._events.report(EventClass.CONNECTION, name, text, ALERT, every_s=30)
        return False

    def signed(self, vehicle: Vehicle, frame: bytes) -> bytes:
        """Return `frame` for `vehicle`, signed if it is keyed."""
        keyed = self._keyed_vehicles.get((vehicle.network, vehicle.system))
        if keyed is None:
            return frame
        return self._sign(keyed, frame)

    def _sign(self, keyed: _KeyedVehicle, frame: bytes) -> bytes:
        return sign(frame, keyed.key.secret, LINK_ID, keyed.clock.next(self._clock.wall(), self._clock.now()))

    def key_sent(self, vehicle: Vehicle, key: SigningKey) -> None:
        """Record that `key` was sent to `vehicle`. It is used as soon as the vehicle signs with it, and not before."""
        self._pending_keys = [each for each in self._pending_keys if each.vehicle is not vehicle]
        self._pending_keys.append(_PendingKey(vehicle, key, self._clock.now() + KEY_PROOF_TIMEOUT_S))

    def tick(self, vehicles: list[Vehicle]) -> None:
        """Update how each vehicle signs, look for changed keys and store signing times."""
        now = self._clock.now()
        if now < self._next_check_s:
            return
        self._next_check_s = now + CHECK_S
        self._reload_keys()
        if self._stamps is not None and self._keyed_vehicles:
            self._stamps.tick(now, self._to_store)
            if self._stamps.error:
                text = f"{self._stamps.error}: after a restart recordings may pass as new"
                self._events.report(EventClass.PROCESSING, "keys", text, WARNING, every_s=60)
        for given in list(self._pending_keys):
            self._prove(given, now)
        for vehicle in vehicles:
            keyed = self._keyed_vehicles.get((vehicle.network, vehicle.system))
            vehicle.identity.keyed = keyed is not None
            self._set_signing(
                vehicle,
                self._signing_of_unkeyed(vehicle)
                if keyed is None
                else _signing_of_keyed(keyed, now, vehicle.identity.signing),
            )

    def _set_signing(self, vehicle: Vehicle, signing: Signing) -> None:
        # Decided anew each time: keys come and go while the vehicle signs as before.
        vehicle.identity.untrusted = ""
        if signing is Signing.UNKNOWN_KEY:
            vehicle.identity.untrusted = "signed with a key that we do not hold"
        elif vehicle.identity.keyed and signing is not Signing.OURS:
            vehicle.identity.untrusted = "does not sign, though we hold a key for it"
        if signing is vehicle.identity.signing:
            return
        vehicle.identity.signing = signing
        severity = ALERT if vehicle.identity.untrusted else NOTICE
        self._events.report(EventClass.CONNECTION, f"vehicle {vehicle.id}", f"its frames: {signing.value}", severity)

    def _signing_of_unkeyed(self, vehicle: Vehicle) -> Signing:
        """Return what the newest heartbeat of a vehicle without a key shows."""
        slot = vehicle.path.slots.get(HEARTBEAT)
        if slot is None or not slot.raw or slot.raw[0] != MAGIC_V2 or not slot.raw[2] & SIGNED:
            return Signing.UNSIGNED
        return Signing.NOT_VERIFIED if signed_by(slot.raw) is SignedBy.ZERO_KEY else Signing.UNKNOWN_KEY

    def _match_pending_key(self, network: str, system: int, raw: bytes) -> None:
        """Check a frame that the key in use did not sign against a key that was just sent."""
        for given in self._pending_keys:
            if (given.vehicle.network, given.vehicle.system) == (network, system):
                given.proven |= signature_matches(raw, given.key.secret)

    def _prove(self, given: _PendingKey, now: float) -> None:
        slot = given.vehicle.path.slots.get(HEARTBEAT)
        name = f"vehicle {given.vehicle.id}"
        if slot is not None and slot.raw[:1] == b"\xfd" and slot.signed:
            given.proven |= signature_matches(slot.raw, given.key.secret)
        if given.proven and self.store is not None:
            self._pending_keys.remove(given)
            try:
                self.store.assign(given.key.name, given.vehicle.network, given.vehicle.system)
            except KeyStoreError as error:
                self._events.report(EventClass.CONNECTION, name, f"signs now, but: {error}", ALERT)
                return
            text = f"signs with key {given.key.name} ({given.key.fingerprint})"
            self._events.report(EventClass.CONNECTION, name, text, NOTICE)
            self._use_keys()
        elif now > given.until_s:
            self._pending_keys.remove(given)
            text = f"did not take key {given.key.name}: it does not sign with it. PX4 takes keys over USB only"
            self._events.report(EventClass.CONNECTION, name, text, WARNING)

    def _reload_keys(self) -> None:
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
        # Signing times of a key that goes stay stored: the same key may come back.
        for place in [place for place in self._keyed_vehicles if place not in wanted]:
            del self._keyed_vehicles[place]
        for place, key in wanted.items():
            keyed = self._keyed_vehicles.get(place)
            # An unchanged key keeps its streams; a new one begins with those that were stored for it.
            if keyed is None or keyed.key.fingerprint != key.fingerprint:
                self._keyed_vehicles[place] = self._keyed_vehicle(place, key)
        for listener in self.on_change:
            listener()

    def _keyed_vehicle(self, place: tuple[str, int], key: SigningKey) -> _KeyedVehicle:
        held = self._stamps.stored.get(_holder(place, key), {}) if self._stamps is not None else {}
        verifier = SignatureVerifier(key.secret)
        if "streams" in held:
            verifier.restore(held["streams"])
        return _KeyedVehicle(
            key, verifier, SigningClock(self._clock.wall(), self._clock.now(), int(held.get("clock", 0)))
        )

    def _to_store(self) -> dict[str, Any]:
        """Return the signing times for the next start; those of unused keys stay, because keys may come back."""
        if self._stamps is None:
            return {}
        for place, keyed in self._keyed_vehicles.items():
            held = {"clock": keyed.clock.last, "streams": keyed.verifier.streams()}
            self._stamps.stored[_holder(place, keyed.key)] = held
        return self._stamps.stored

    def close(self) -> None:
        """Store the signing times for the next start."""
        if self._stamps is not None and self._keyed_vehicles:
            self._stamps.write(self._to_store())

    def _name(self, network: str, system: int) -> str:
        return f"vehicle {self._networks.index(network) * IDS_PER_NETWORK + system}"


def _signing_of_keyed(keyed: _KeyedVehicle, now: float, before: Signing) -> Signing:
    """Return how a keyed vehicle signs; `before` while nothing shows it."""
    if now - keyed.good_s < SIGNATURE_TIMEOUT_S:
        return Signing.OURS
    if now - keyed.bad_s < RECENT_REJECTION_S:
        return Signing.UNKNOWN_KEY
    if now - keyed.unsigned_s < RECENT_REJECTION_S:
        return Signing.UNSIGNED
    return Signing.OURS if keyed.good_s > -math.inf else before


def _holder(place: tuple[str, int], key: SigningKey) -> str:
    """Return the name of a vehicle with one key. With another key it is another holder: the old key may come back."""
    return f"{place[0]}/{place[1]}/{key.fingerprint}"
