"""What is said by a vehicle's other components: cameras, gimbals, Remote ID transmitters, traffic receivers.

The autopilot's word is told by `Fleet.on_message`. What is heard here is never taken for it: position, mode and state
of a vehicle are its autopilot's alone.
"""

from collections.abc import Callable
from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.sources import Slot

OnComponent = Callable[[Vehicle, int, dict[str, Any]], None]
"""(vehicle, component id, fields)."""


class ComponentListeners:
    """Who wants to hear which messages of components other than autopilots."""

    def __init__(self) -> None:
        """Nobody yet. BusHandlers register before the first frame arrives."""
        self._listeners: dict[str, list[OnComponent]] = {}

    def on(self, name: str, listener: OnComponent) -> None:
        """Call `listener` for each message `name` that another component than the autopilot sends."""
        self._listeners.setdefault(name, []).append(listener)

    def has_listener(self, slot: Slot) -> bool:
        """Whether somebody wants these messages."""
        return slot.layout is not None and slot.layout.name in self._listeners

    def deliver(self, slot: Slot, now: float) -> bool:
        """Hand the newest frame of `slot` to its listeners; see `wire.intake.Owner`."""
        vehicle: Vehicle = slot.owner
        if slot.layout is not None and slot.component != vehicle.component:
            fields = slot.fields()
            for listener in self._listeners.get(slot.layout.name, ()):
                listener(vehicle, slot.component, fields)
        return True
