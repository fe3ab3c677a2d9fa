"""A station's fleet and one vehicle, written by hand: each frame it says is one call. No simulator, no link."""

from typing import Any

from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.signing import sign, ticks
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.signing.keystore import KeyStore
from tui_gcs.core.signing.trust import SigningRegistry

LAT, LON, E7 = 52.0, -0.6, 10**7
BEAT = {"type": 2, "autopilot": 3, "base_mode": 81, "custom_mode": 4, "system_status": 3, "mavlink_version": 3}
ARMED = BEAT | {"base_mode": 81 | 128}


class Heard:
    """Vehicle 1 says hello over the link "radio", with these fields of its heartbeat.

    With `keys` the station believes what they say; the vehicle signs with `secret`, if that is not empty.
    """

    def __init__(self, keys: KeyStore | None = None, secret: bytes = b"", **beat: int) -> None:
        self.clock = VirtualClock()
        self.events = EventLog(self.clock)
        self.secret = secret
        self.trust = SigningRegistry(self.clock, self.events, ("",), keys, heartbeat=lambda: b"")
        self.fleet = VehicleRegistry(
            self.clock, self.events, LocalFrame(Origin(LAT, LON, 100.0)), 255, gates=self.trust
        )
        self.sender = Encoder(1, 1)
        for _ in range(2):
            self.say("HEARTBEAT", **BEAT | beat)

    @property
    def vehicle(self) -> Vehicle:
        return self.fleet.vehicles[1]

    def say(self, name: str, *, after_s: float = 0.1, over: str = "radio", **fields: Any) -> Vehicle:
        """It says this, `after_s` after the last; what is not given is 0."""
        layout = dialect.layout_named(name)
        assert layout is not None
        zeros: dict[str, Any] = {
            part.name: b"" if part.is_text else 0 if part.count == 1 else [0] * part.count for part in layout.fields
        }
        raw = self.sender.encode(name, **zeros | fields)
        if self.secret:
            raw = sign(raw, self.secret, 0, ticks(self.clock.wall() + after_s))
        return self.hear(raw, after_s, over)

    def hear(self, raw: bytes, after_s: float = 0.1, over: str = "radio") -> Vehicle:
        """This datagram comes from it."""
        self.clock.advance(after_s)
        self.fleet.intakes[""].datagrams(over, [(raw, "there")], self.clock.now())
        self.fleet.tick()
        self.trust.tick(self.fleet.in_order())
        return self.vehicle

    def is_at(self, lat: float = LAT, lon: float = LON, *, after_s: float = 0.1, **fields: int) -> Vehicle:
        """GLOBAL_POSITION_INT of its boot clock, which shows our time."""
        boot_ms = round((self.clock.now() + after_s) * 1e3)
        place = {"time_boot_ms": boot_ms, "lat": round(lat * E7), "lon": round(lon * E7)}
        return self.say("GLOBAL_POSITION_INT", after_s=after_s, **place | fields)

    def told(self) -> list[str]:
        """Events so far, all of them of a vehicle."""
        events = self.events.since(0)
        assert {event.source for event in events} <= {"vehicle 1", "vehicle 2"}
        return [event.text for event in events]
