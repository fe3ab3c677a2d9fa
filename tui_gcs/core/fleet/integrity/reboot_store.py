"""Reboot store: which vehicles must be rebooted before they fly, kept over a restart of the station.

What was set up since a vehicle booted holds only from its next boot on (`Vehicle.reboot_first`). A restarted station
assumes that no reboot has happened until the vehicle shows a later boot, or another hardware id.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle

SAME_BOOT_S = 10.0
"""Boot times that differ by more are two boots. Clocks of simulators drift; set-up takes longer than this after a boot.
"""


@dataclass
class _DueReboot:
    """A vehicle that needs a reboot, as it was when it was set up."""

    why: str
    uid: str
    """Hardware id; "" if unknown."""
    booted_s: float
    """When it booted, station time; NaN if unknown."""
    recalled: bool = False
    """From before a restart of the station, and not yet compared with the vehicle."""


class RebootStore:
    """Keeps the vehicles that need a reboot; `tick` updates it from `Vehicle.reboot_first`."""

    def __init__(self, fleet: VehicleRegistry) -> None:
        """Keep the vehicles of `fleet`."""
        self._fleet = fleet
        self._due: dict[int, _DueReboot] = {}

    def tick(self) -> None:
        """Note vehicles that need a reboot now, and drop those that do not any more."""
        for vehicle in self._fleet.vehicles.values():
            due = self._due.get(vehicle.id)
            if due is not None and due.recalled:
                self._compare(vehicle, due)
            elif not vehicle.reboot_first:
                self._due.pop(vehicle.id, None)
            elif due is None or math.isnan(due.booted_s):
                self._due[vehicle.id] = _DueReboot(
                    vehicle.reboot_first, vehicle.identity.uid, vehicle.path.boot_offset_s()
                )

    def _compare(self, vehicle: Vehicle, due: _DueReboot) -> None:
        """Set `reboot_first` again unless the vehicle has booted since, or is another one."""
        vehicle.reboot_first = due.why
        booted_s = vehicle.path.boot_offset_s()
        if math.isnan(booted_s) or not vehicle.identity.uid:
            return
        due.recalled = False
        if abs(booted_s - due.booted_s) > SAME_BOOT_S or (due.uid and due.uid != vehicle.identity.uid):
            vehicle.reboot_first = ""

    def memory(self) -> dict[str, dict[str, Any]]:
        """Return what a restarted station needs, as JSON values."""
        return {
            str(vehicle): {
                "why": due.why,
                "uid": due.uid,
                "booted_s": None if math.isnan(due.booted_s) else due.booted_s,
            }
            for vehicle, due in self._due.items()
        }

    def recall(self, held: Mapping[str, Mapping[str, Any]]) -> None:
        """Continue from what `memory` returned before a restart."""
        for vehicle, item in held.items():
            booted_s = math.nan if item["booted_s"] is None else item["booted_s"]
            self._due[int(vehicle)] = _DueReboot(item["why"], item["uid"], booted_s, recalled=True)
