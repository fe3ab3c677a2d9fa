"""Component listeners: messages of a vehicle's other components: cameras, gimbals, Remote ID transmitters, receivers.

Messages of the autopilot go to `VehicleRegistry.on_message`. What is heard here is never taken for the autopilot's:
position, mode and state of a vehicle come from its autopilot alone.
"""

from collections.abc import Callable
from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.sources import Slot

OnComponent = Callable[[Vehicle, int, dict[str, Any]], None]
"""A listener; its arguments are vehicle, component id and fields."""


class ComponentListeners:
    """Delivers messages of components other than autopilots to their listeners."""

    def __init__(self) -> None:
        """Begin without listeners. They register before the first frame arrives."""
        self._listeners: dict[str, list[OnComponent]] = {}

    def on(self, name: str, listener: OnComponent) -> None:
        """Call `listener` for each message `name` that another component than the autopilot sends."""
        self._listeners.setdefault(name, []).append(listener)

    def has_listener(self, slot: Slot) -> bool:
        """Return whether a listener wants these messages."""
        return slot.layout is not None and slot.layout.name in self._listeners

    def deliver(self, slot: Slot, now: float) -> bool:
        """Deliver the newest frame of `slot` to its listeners. Returns True: the frame is recorded and passed on."""
        vehicle: Vehicle = slot.owner
        if slot.layout is not None and slot.component != vehicle.component:
            fields = slot.fields()
            for listener in self._listeners.get(slot.layout.name, ()):
                listener(vehicle, slot.component, fields)
        return True
