"""ADSB_VEHICLE: ArduPilot repeats the aircraft that stations report, if ADSB_TYPE is set and one requests them."""

from sitl.common.outbox import Fields
from sitl.common.platform import Part, Platform
from sitl.links.wire import ReceivedFrame

FORGET_US = 5_000_000
MAX_AIRCRAFT = 25


class Traffic(Part):
    """Aircraft that stations have reported, by ICAO address."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self._aircraft: dict[int, tuple[int, Fields]] = {}
        """When each was heard last, and its message; the next to be repeated comes first."""

    def hear(self, frame: ReceivedFrame) -> None:
        """Keep an aircraft, if ADSB_TYPE is set (by default it is not)."""
        if self._params["ADSB_TYPE"] <= 0:
            return
        icao, aircraft = frame.fields["ICAO_address"], self._aircraft
        if len(aircraft) >= MAX_AIRCRAFT and icao not in aircraft:
            aircraft.pop(next(iter(aircraft)))
        aircraft[icao] = (self._clock.now_us, frame.fields)

    def next_aircraft(self) -> Fields | None:
        """Return the ADSB_VEHICLE of the next aircraft in turn; None if there is none."""
        aircraft, now_us = self._aircraft, self._clock.now_us
        for icao in [icao for icao, (at_us, _) in aircraft.items() if now_us - at_us > FORGET_US]:
            del aircraft[icao]
        if not aircraft:
            return None
        icao = next(iter(aircraft))
        aircraft[icao] = kept = aircraft.pop(icao)
        return kept[1]
