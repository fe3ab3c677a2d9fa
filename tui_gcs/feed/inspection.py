"""Details of the one vehicle that the operator looks at, which the fleet frame does not have."""

from collections.abc import Callable, Coroutine
from typing import Any

from tui_gcs.core.protocol.services import GetVehicles, VehicleInfo
from tui_gcs.feed.requests import ConsoleRequests


class VehicleInspection:
    """Asks the station about one vehicle, one question at a time, and keeps its last answer."""

    def __init__(
        self,
        requests: ConsoleRequests,
        spawn: Callable[[Coroutine[Any, Any, None]], None],
        may_ask: Callable[[], bool],
        on_info: Callable[[VehicleInfo], None],
    ) -> None:
        """Begin without a vehicle; `spawn` runs a coroutine in the background, `on_info` gets every answer."""
        self.info: VehicleInfo | None = None
        """The last answer; it may be about another vehicle than the one looked at now."""
        self._requests = requests
        self._spawn = spawn
        self._may_ask = may_ask
        self._on_info = on_info
        self._vehicle: int | None = None
        self._is_asking = False

    def look_at(self, vehicle: int | None) -> None:
        """Ask for all the station knows of a vehicle; `VehicleInfoUpdated` is posted when something visible changed."""
        self._vehicle = vehicle
        if vehicle is not None and not self._is_asking and self._may_ask():
            self._is_asking = True
            self._spawn(self._ask(vehicle))

    async def _ask(self, vehicle: int) -> None:
        reply = await self._requests.send(GetVehicles(vehicles=(vehicle,)))
        self._is_asking = False
        if reply.vehicles:
            self.info = reply.vehicles[0]
            self._on_info(self.info)
        if self._vehicle != vehicle:  # another one was chosen meanwhile
            self.look_at(self._vehicle)
