"""Giving a vehicle its signing key in two steps: the first replies with a code, the second sends the key.

The key travels in clear, because MAVLink has nothing but SETUP_SIGNING: only over a link that the operator marked
`secure`, to one vehicle, on the ground. The vehicle proves that it took the key by signing with it; see
`SigningRegistry.given`.
"""

import secrets
from dataclasses import dataclass
from hmac import compare_digest

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.signing import SigningKey
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.common import EventClass, Freshness, Reply
from tui_gcs.core.records.event_log import NOTICE, WARNING
from tui_gcs.core.requests.handler import Access, RequestHandler
from tui_gcs.core.signing.keystore import KeyStoreError
from tui_gcs.core.signing.trust import KEY_PROOF_TIMEOUT_S
from tui_gcs.core.station.assembly import StationParts

CODE_S = 60.0
"""Seconds for which a code can be used."""
# Read from one screen and typed on another: short, and valid for a short time only.
CODE_CHARACTERS = 6
ALPHABET = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"  # no I, O, 0, 1: they look alike on a screen
"""Characters that cannot be mistaken for each other on a screen."""


@dataclass(frozen=True)
class _Offer:
    """The vehicle and key that a code stands for."""

    code: str
    vehicle: int
    fingerprint: str
    until_s: float


class KeyProvisioning:
    """Answers `ProvisionKey` requests; a code is good for one try within a minute."""

    def __init__(self, parts: StationParts) -> None:
        self._parts = parts
        self._offers: dict[str, _Offer] = {}
        """By principal, the newest offer of each."""

    def handlers(self) -> dict[type, RequestHandler]:
        """The entry of the request table that this class answers; its reply holds a code, so it journals itself."""
        return {m.ProvisionKey: RequestHandler(Access.COMMAND, self.ask, is_journalled=False)}

    def ask(self, principal: str, request: m.ProvisionKey) -> Reply:
        """Do one of the two steps, or reply why not."""
        # A code is for one try: it cannot be guessed by trying.
        offer = self._offers.pop(principal, None)
        try:
            vehicle, key = self._checked(request)
            if request.confirm:
                self._confirm(offer, request, key)
                return self._send(principal, vehicle, key)
        except _RefusedError as refused:
            self._report(principal, f"vehicle {request.vehicle}: no key given: {refused}", WARNING)
            return Reply(ok=False, text=f"{refused}; nothing was sent")
        return self._offer(principal, vehicle, key)

    def _checked(self, request: m.ProvisionKey) -> tuple[Vehicle, SigningKey]:
        """The vehicle and the key, if the key may be given; both steps check everything. Raises `_RefusedError`."""
        parts = self._parts
        store = parts.picture.trust.store
        vehicle = parts.picture.fleet.vehicles.get(request.vehicle)
        if store is None:
            raise _RefusedError("this station was started without keys")
        if vehicle is None:
            raise _RefusedError(f"vehicle {request.vehicle} was never heard")
        if vehicle.freshness(parts.records.clock.now()) is not Freshness.OK:
            raise _RefusedError(f"it is {vehicle.freshness(parts.records.clock.now())}")
        if not parts.comms.uplink.is_ours(vehicle):
            raise _RefusedError("it is not one of our simulated vehicles: this station is SIM")
        if vehicle.telemetry.armed:
            raise _RefusedError("it is armed")
        if why := vehicle.identity.blocked or vehicle.why_not_commanded:
            raise _RefusedError(why)
        if not parts.comms.links[vehicle.link].spec.secure:
            raise _RefusedError(f"link {vehicle.link} is not marked secure: others could hear the key")
        try:
            # The operator may have added the key while the station runs.
            if store.changed():
                store.reload()
            key = store.key(request.key)
        except KeyStoreError as error:
            raise _RefusedError(str(error)) from None
        held = store.key_of(vehicle.network, vehicle.system)
        if held is not None and held.fingerprint == key.fingerprint:
            raise _RefusedError(f"it signs with key {key.name} already")
        return vehicle, key

    def _offer(self, principal: str, vehicle: Vehicle, key: SigningKey) -> Reply:
        code = "".join(secrets.choice(ALPHABET) for _ in range(CODE_CHARACTERS))
        until_s = self._parts.records.clock.now() + CODE_S
        self._offers[principal] = _Offer(code, vehicle.id, key.fingerprint, until_s)
        text = (
            f"Key {key.name} ({key.fingerprint}) goes to vehicle {vehicle.id} over link {vehicle.link}, in clear. "
            f"If it takes the key it obeys only stations that hold it. Code, good for {CODE_S:.0f} s: {code}"
        )
        return Reply(ok=True, text=text)

    def _confirm(self, offer: _Offer | None, request: m.ProvisionKey, key: SigningKey) -> None:
        if offer is None or self._parts.records.clock.now() > offer.until_s:
            raise _RefusedError("there is no such code (any more): begin anew")
        same = (offer.vehicle, offer.fingerprint) == (request.vehicle, key.fingerprint)
        # Compared in constant time, and the vehicle and key must be those of the offer.
        typed = request.confirm.strip().upper().encode()
        if not (compare_digest(offer.code.encode(), typed) and same):
            raise _RefusedError("that is not the code: begin anew")

    def _send(self, principal: str, vehicle: Vehicle, key: SigningKey) -> Reply:
        why = self._parts.comms.uplink.give_key(vehicle, key)
        if why:
            raise _RefusedError(why)
        self._parts.picture.trust.key_sent(vehicle, key)
        text = f"key {key.name} ({key.fingerprint}) sent to vehicle {vehicle.id}: its signing shows whether it took it"
        self._report(principal, f"{text}, within {KEY_PROOF_TIMEOUT_S:.0f} s", NOTICE)
        return Reply(ok=True, text=f"{text}, within {KEY_PROOF_TIMEOUT_S:.0f} s")

    def _report(self, principal: str, text: str, severity: int) -> None:
        self._parts.records.events.report(EventClass.OPERATOR, principal, text, severity)


class _RefusedError(Exception):
    """The reason why no key is given."""
