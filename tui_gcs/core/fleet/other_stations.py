"""Other stations that were heard on our links, and what they were heard to command.

Their frames to vehicles are seldom heard: a vehicle answers a station on that station's own link. So their heartbeats
count, too, and the acknowledgements that a vehicle sends to another station than this one.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from tui_gcs.core.fleet.vehicle import Vehicle

TYPE_GCS = 6
"""MAV_TYPE_GCS."""
HEARD_S = 10.0
"""A station whose newest heartbeat is older than this is gone."""
COMMANDED_S = 15.0
"""A command counts for what a vehicle does for this long."""
MAX_ENTRIES = 1000
"""Anyone can forge system ids: no more of them are kept."""
COMMANDS = frozenset(
    {
        *("COMMAND_LONG", "COMMAND_INT", "SET_MODE", "MISSION_ITEM", "MISSION_COUNT", "MISSION_SET_CURRENT"),
        *("SET_POSITION_TARGET_GLOBAL_INT", "SET_POSITION_TARGET_LOCAL_NED", "SET_ATTITUDE_TARGET"),
        *("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE"),
    }
)
"""Messages that move a vehicle."""


@dataclass
class OtherStations:
    """System ids of other stations, by when they were heard."""

    own_system: int
    _last_heard_s: dict[tuple[str, int], float] = field(default_factory=dict)
    """By network and system id."""
    _commanded_s: dict[tuple[str, int, int], float] = field(default_factory=dict)
    """By network, the vehicle's system id and the station's."""

    def hear(self, network: str, system: int, fields: dict[str, Any], now: float) -> None:
        """Take a heartbeat of a system that is no vehicle."""
        if fields["type"] == TYPE_GCS and system != self.own_system:
            _note(self._last_heard_s, (network, system), now)

    def hear_command(self, network: str, system: int, vehicle: int, now: float) -> None:
        """Note that `system` commanded the vehicle with that system id."""
        if system not in (0, self.own_system, vehicle):
            _note(self._commanded_s, (network, vehicle, system), now)

    def on_ack(self, now: Callable[[], float]) -> Callable[[Vehicle, dict[str, Any]], None]:
        """A listener for COMMAND_ACK: one that is addressed to another station answers a command of that one."""
        # No lambda: a replay keeps copies of the fleet, and a copy of a lambda would still report to the original.
        return partial(self._hear_ack, now)

    def _hear_ack(self, now: Callable[[], float], vehicle: Vehicle, fields: dict[str, Any]) -> None:
        self.hear_command(vehicle.network, fields["target_system"], vehicle.system, now())

    def words(self, vehicle: Vehicle, now: float) -> str:
        """Which stations may have commanded the vehicle, e.g. "commanded by system 252"; "" if none was heard."""
        commanders = sorted(
            system
            for (network, commanded, system), last_heard_s in self._commanded_s.items()
            if network == vehicle.network and commanded in (0, vehicle.system) and now - last_heard_s < COMMANDED_S
        )
        if commanders:
            return f"commanded by system {', '.join(map(str, dict.fromkeys(commanders)))}"
        heard = sorted(
            system
            for (network, system), last_heard_s in self._last_heard_s.items()
            if network == vehicle.network and now - last_heard_s < HEARD_S
        )
        return f"other station heard: system {', '.join(map(str, heard))}" if heard else ""


def _note(table: dict[Any, float], key: Any, now: float) -> None:
    table.pop(key, None)
    if len(table) >= MAX_ENTRIES:
        del table[min(table, key=lambda one: table.get(one, math.inf))]
    table[key] = now
