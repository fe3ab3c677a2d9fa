"""ADSB_VEHICLE: ArduPilot repeats aircraft that a station told it of, if it is set up to and was asked for them."""

from typing import Any

from sitl.common.autopilot import Autopilot
from sitl.links.wire import Received

FORGET_US = 5_000_000
MAX_AIRCRAFT = 25


def heard(ap: Autopilot, frame: Received) -> None:
    """Kept only while ADSB_TYPE is set (the default drops it)."""
    if ap.params["ADSB_TYPE"] <= 0:
        return
    traffic = ap.stores.traffic
    if len(traffic) >= MAX_AIRCRAFT and frame.fields["ICAO_address"] not in traffic:
        traffic.pop(next(iter(traffic)))
    traffic[frame.fields["ICAO_address"]] = (ap.now_us, frame.fields)


def adsb_vehicle(ap: Autopilot) -> dict[str, Any] | None:
    """The next aircraft in turn; None if there is none."""
    traffic = ap.stores.traffic
    for icao in [icao for icao, (at_us, _) in traffic.items() if ap.now_us - at_us > FORGET_US]:
        del traffic[icao]
    if not traffic:
        return None
    icao = next(iter(traffic))
    traffic[icao] = kept = traffic.pop(icao)
    return kept[1]
