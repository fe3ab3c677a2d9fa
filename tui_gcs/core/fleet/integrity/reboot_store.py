"""Who must be rebooted before it flies, remembered over a restart of the station.

What was set up since a vehicle booted holds only from its next boot on (`Vehicle.reboot_first`). A station that begins
anew takes it for true of a vehicle until that shows that it booted later, or is another one.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle

SAME_BOOT_S = 10.0
"""Boots farther apart are two: clocks of simulators drift, and a vehicle is up for longer before it is set up."""


@dataclass
class _Due:
    """One vehicle, as it was when it was set up."""

    why: str
    uid: str
    """Hardware id; "" if it was not known."""
    booted_s: float
    """When it booted, on the station's clock; NaN if it was not known."""
    recalled: bool = False
    """Of an earlier start of the station, and not yet compared with the vehicle."""


class RebootStore:
    """By vehicle; looks at every tick."""

    def __init__(self, fleet: VehicleRegistry) -> None:
        """Nobody must."""
        self._fleet = fleet
        self._due: dict[int, _Due] = {}

    def tick(self) -> None:
        """Note what is new, and what is over."""
        for vehicle in self._fleet.vehicles.values():
            due = self._due.get(vehicle.id)
            if due is not None and due.recalled:
                self._compare(vehicle, due)
            elif not vehicle.reboot_first:
                self._due.pop(vehicle.id, None)
            elif due is None or math.isnan(due.booted_s):
                self._due[vehicle.id] = _Due(vehicle.reboot_first, vehicle.identity.uid, vehicle.path.boot_offset_s())

    def _compare(self, vehicle: Vehicle, due: _Due) -> None:
        """Whether it has booted since, or is another one: true until it shows that, or that it has not."""
        vehicle.reboot_first = due.why
        booted_s = vehicle.path.boot_offset_s()
        if math.isnan(booted_s) or not vehicle.identity.uid:
            return
        due.recalled = False
        if abs(booted_s - due.booted_s) > SAME_BOOT_S or (due.uid and due.uid != vehicle.identity.uid):
            vehicle.reboot_first = ""

    def memory(self) -> dict[str, dict[str, Any]]:
        """What the next start must know."""
        return {
            str(vehicle): {
                "why": due.why,
                "uid": due.uid,
                "booted_s": None if math.isnan(due.booted_s) else due.booted_s,
            }
            for vehicle, due in self._due.items()
        }

    def recall(self, held: Mapping[str, Mapping[str, Any]]) -> None:
        """Go on from what `memory` gave."""
        for vehicle, item in held.items():
            booted_s = math.nan if item["booted_s"] is None else item["booted_s"]
            self._due[int(vehicle)] = _Due(item["why"], item["uid"], booted_s, recalled=True)
