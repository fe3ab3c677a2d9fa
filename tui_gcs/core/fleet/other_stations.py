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
MOVING = {
    **dict.fromkeys((16, 17, 18, 19, 31, 34, 82, 192, 252), "a place"),
    **dict.fromkeys((20, 21, 22, 84, 85, 189, 190, 191), "a take-off, return or landing"),
    **dict.fromkeys((92, 176), "a mode"),
    **dict.fromkeys((177, 224, 300, 601), "another item of its mission"),
    **dict.fromkeys((113, 114, 178, 186), "a speed or height"),
    **dict.fromkeys((179, 185, 193, 400), "a home, a pause or its motors"),
}
"""MAV_CMD that change what a vehicle flies, and words for them. Others, as requests for messages, change nothing."""
OF_MISSION = frozenset({"MISSION_ITEM", "MISSION_COUNT", "MISSION_SET_CURRENT"})
"""Of `COMMANDS` those that change a mission on board, and nothing else."""
ACCEPTED, IN_PROGRESS = 0, 5
"""Values of MAV_RESULT with which a vehicle does what it is asked for."""


@dataclass(frozen=True)
class ForeignChange:
    """A change that no order of this station made: by another station, or by a source that was not heard."""

    at_s: float
    text: str
    of_mission: bool
    """Whether it concerns only a vehicle that flies its mission."""


@dataclass
class OtherStations:
    """System ids of other stations, by when they were heard."""

    own_system: int
    _last_heard_s: dict[tuple[str, int], float] = field(default_factory=dict)
    """By network and system id."""
    _commanded_s: dict[tuple[str, int, int], float] = field(default_factory=dict)
    """By network, the vehicle's system id and the station's."""
    _changes: dict[tuple[str, int], ForeignChange] = field(default_factory=dict)
    """The newest of each vehicle, by network and system id."""

    def hear(self, network: str, system: int, fields: dict[str, Any], now: float) -> None:
        """Take a heartbeat of a system that is no vehicle."""
        if fields["type"] == TYPE_GCS and system != self.own_system:
            _note(self._last_heard_s, (network, system), now)

    def hear_command(self, network: str, system: int, vehicle: int, now: float) -> None:
        """Note that `system` commanded the vehicle with that system id."""
        if system not in (0, self.own_system, vehicle):
            _note(self._commanded_s, (network, vehicle, system), now)

    def hear_frame(self, network: str, system: int, name: str, fields: dict[str, Any], now: float) -> None:
        """Take a message of `COMMANDS` that another system sent over one of our links."""
        vehicle, command = fields.get("target_system", fields.get("target", 0)), fields.get("command")
        if (command is not None and command not in MOVING) or system in (0, self.own_system, vehicle):
            return
        self.hear_command(network, system, vehicle, now)
        what = MOVING[command] if command is not None else name
        self.note(network, vehicle, f"another station sent it {what}", now, of_mission=name in OF_MISSION)

    def note(self, network: str, vehicle: int, text: str, now: float, *, of_mission: bool) -> None:
        """Note a change of a vehicle that no order of this station made."""
        self._changes.pop((network, vehicle), None)
        if len(self._changes) >= MAX_ENTRIES:
            del self._changes[next(iter(self._changes))]
        self._changes[network, vehicle] = ForeignChange(now, text, of_mission)

    def change(self, vehicle: Vehicle, now: float) -> ForeignChange | None:
        """The newest change of the vehicle that another station made within `COMMANDED_S`."""
        # A command to system 0 is for all.
        found = self._changes.get((vehicle.network, vehicle.system)) or self._changes.get((vehicle.network, 0))
        return found if found is not None and now - found.at_s < COMMANDED_S else None

    def on_ack(self, now: Callable[[], float]) -> Callable[[Vehicle, dict[str, Any]], None]:
        """A listener for COMMAND_ACK: one that is addressed to another station answers a command of that one."""
        # No lambda: a replay keeps copies of the fleet, and a copy of a lambda would still report to the original.
        return partial(self._hear_ack, now)

    def _hear_ack(self, now: Callable[[], float], vehicle: Vehicle, fields: dict[str, Any]) -> None:
        station, command = fields["target_system"], fields["command"]
        if station in (0, self.own_system, vehicle.system) or command not in MOVING:
            return
        self.hear_command(vehicle.network, station, vehicle.system, now())
        if fields["result"] in (ACCEPTED, IN_PROGRESS):
            text = f"it took {MOVING[command]} from another station"
            self.note(vehicle.network, vehicle.system, text, now(), of_mission=False)

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
