"""Requests of inspector and plots: what is received (`core/station/received_messages.py`), and a rate for messages."""

from tui_gcs.core.firmware.base import may_be_flying
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.protocol import inspection as p
from tui_gcs.core.rates.operator_rates import ESSENTIAL, OperatorRate, doubts, why_never
from tui_gcs.core.requests.handler import Access, NotConfirmedError, RequestHandler, VehicleAct
from tui_gcs.core.requests.tasks import Task
from tui_gcs.core.station.assembly import StationParts
from tui_gcs.core.station.received_messages import ReceivedMessages


class InspectionRequests:
    """Answers what the inspector asks."""

    def __init__(self, parts: StationParts) -> None:
        self._parts = parts
        self._received = ReceivedMessages(parts.picture.fleet, parts.records.clock, self._parameter)
        self._rates = parts.comms.rates
        self.acts: dict[type, VehicleAct] = {p.SetMessageRate: VehicleAct(self._set_rate, _rate_words)}

    def handlers(self) -> dict[type, RequestHandler]:
        """The entries of the request table that only look."""
        return {
            p.GetMessages: RequestHandler(Access.LOOK, lambda _, request: self._received.messages(request)),
            p.GetValues: RequestHandler(Access.LOOK, lambda _, request: self._received.values(request)),
        }

    def _parameter(self, vehicle: Vehicle, name: str) -> float | None:
        param = self._parts.services.params.table(vehicle.id).params.get(name)
        return float(param.value) if param else None

    def _set_rate(self, vehicle: Vehicle, request: p.SetMessageRate, task: Task) -> str:
        message, hz, rates = request.msgid, request.rate_hz, self._rates
        link = rates.link_of(vehicle)
        if why := why_never(message) or ("nothing is asked over a satellite link" if link.silent else ""):
            return why
        if hz is None:
            was_set = rates.release_rate(vehicle, message)
            task.end(text="" if was_set else "no other rate was asked for")
            return ""
        if not 0.0 <= hz <= p.MAX_RATE_HZ:
            return f"a rate is from 0 to {p.MAX_RATE_HZ:g} Hz"
        if message in ESSENTIAL and hz < link.set.hz.get(message, 0.0) and may_be_flying(vehicle):
            return "it is in the air, and the station flies it by this message: only a higher rate is taken"
        if not request.sure and (why := doubts(link, vehicle, message, hz, rates.operator_rates)):
            raise NotConfirmedError(why)

        def stop() -> str:
            rates.release_rate(vehicle, message)
            task.end(cancelled=True)
            return ""

        task.stop = stop
        rates.set_rate(vehicle, message, OperatorRate(hz, task.end))
        return ""


def _rate_words(request: p.SetMessageRate) -> str:
    name = dialect.label(request.msgid)
    return f"{name} as the station asks" if request.rate_hz is None else f"{name} at {request.rate_hz:g} Hz"
