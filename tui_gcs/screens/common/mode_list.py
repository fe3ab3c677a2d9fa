"""The modes that vehicles can be set to, in words, for who has to type one."""

import asyncio
from collections.abc import Sequence

from tui_gcs.core.protocol.common import VehicleRow
from tui_gcs.core.protocol.services import GetModes, ServiceReply
from tui_gcs.feed.feed import Feed

LOOKS, GAP_S = 20, 0.5
"""A vehicle tells its list within seconds; what our tables have is there at once."""
MOST_KINDS = 3
"""Kinds of vehicles whose modes there is room for."""


def one_of_each(rows: Sequence[VehicleRow]) -> list[VehicleRow]:
    """The first vehicle of every kind: vehicles of one kind have the same modes."""
    kinds = {(row.autopilot, row.vehicle_type): row for row in reversed(rows)}
    return sorted(kinds.values(), key=lambda row: row.id)[:MOST_KINDS]


async def _ask_modes(feed: Feed, vehicle: int) -> tuple[str, bool]:
    """Names of the modes a vehicle may be set to, without those for experts, and whether it told all of them."""
    reply = await feed.request(GetModes(vehicle))
    if not isinstance(reply, ServiceReply) or not reply.ok:
        return "", True
    names = [mode.name for mode in reply.modes if not mode.advanced]
    return ", ".join(names), reply.complete


async def tell_modes(feed: Feed, rows: Sequence[VehicleRow], told: dict[str, str]) -> None:
    """Fill `told`, by kind of vehicle, until each kind has told all or time is up."""
    for vehicle in one_of_each(rows):
        kind = f"{vehicle.autopilot} {vehicle.vehicle_type}".strip()
        for _ in range(LOOKS):
            told[kind], over = await _ask_modes(feed, vehicle.id)
            if over:
                break
            await asyncio.sleep(GAP_S)
