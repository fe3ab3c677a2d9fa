"""Message rates that an operator has asked for: they stand above the station's own set of messages."""

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.frames import SIGNATURE_BYTES
from tui_gcs.core.rates.link_budget import LinkRates
from tui_gcs.core.rates.message_sets import FRAME_BYTES

HEARTBEAT = 0
ESSENTIAL = frozenset({33, 245, 1, 24, 147})
"""Every set holds these: GLOBAL_POSITION_INT, EXTENDED_SYS_STATE, SYS_STATUS, GPS_RAW_INT, BATTERY_STATUS."""


@dataclass
class OperatorRate:
    """One rate that was asked for."""

    hz: float
    """0: not to be sent."""
    on_answer: Callable[[str], None]
    """Called with "" when the vehicle has agreed, or with its refusal; once, for it is asked again after a reboot."""
    is_answered: bool = False


class OperatorRates:
    """The rates by vehicle and message id."""

    def __init__(self) -> None:
        self._rates: defaultdict[int, dict[int, OperatorRate]] = defaultdict(dict)

    def of(self, vehicle: int) -> Mapping[int, OperatorRate]:
        """Return the rates asked of a vehicle by message id."""
        return self._rates.get(vehicle, {})

    def put(self, vehicle: int, message: int, rate: OperatorRate) -> None:
        """Keep a rate; it replaces an earlier one for the same message."""
        self._rates[vehicle][message] = rate

    def drop(self, vehicle: int, message: int) -> bool:
        """Forget a rate; returns whether there was one."""
        return self._rates[vehicle].pop(message, None) is not None

    def answered(self, vehicle: int, message: int, why_not: str) -> bool:
        """Report the vehicle's answer, if it is the first to such a rate; one that it refused is forgotten."""
        rate = self._rates[vehicle].get(message)
        if rate is None or rate.is_answered:
            return False
        rate.is_answered = True
        if why_not:
            self.drop(vehicle, message)
        rate.on_answer(why_not)
        return True


def why_never(message: int) -> str:
    """Return why the rate of a message is never changed; "" if it may be."""
    if message == HEARTBEAT:
        return "HEARTBEAT shows that the vehicle is there: its rate stays"
    if not dialect.is_known(message):
        return f"message {message} is in no dialect that the station knows"
    return ""


def doubts(link: LinkRates, vehicle: Vehicle, message: int, hz: float, rates: OperatorRates) -> str:
    """Return why an operator should think again before asking for this rate; "" if there is no reason."""
    wanted = link.set.hz.get(message, 0.0)
    if hz < wanted:
        return f"the station itself asks for {wanted:g} Hz and works with it"
    if link.budget is None:
        return ""
    others = rates.of(vehicle.id)
    more = sum(cost(link, m, r.hz - link.set.hz.get(m, 0.0)) for m, r in others.items() if m != message)
    needed = cost(link, message, hz - wanted)
    spare = link.budget - link.needed(link.place) - more
    if needed > spare:
        left = f"{max(spare, 0.0):.0f} of {link.budget:.0f} B/s are left on {link.name}"
        return f"it needs {needed:.0f} B/s more, and {left}"
    return ""


def cost(link: LinkRates, message: int, hz: float) -> float:
    """Return bytes per second of a message at a rate, with a signature where the vehicles of the link sign."""
    layout = dialect.layout(message)
    size = layout.size if layout is not None else 255
    return max(hz, 0.0) * (FRAME_BYTES + size + (SIGNATURE_BYTES if link.signed else 0))
