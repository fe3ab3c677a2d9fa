"""PX4's EVENTs: what is lost on the way is asked for again. And what vehicles say when they arm."""

from tests.conformance.field import Failed, Field, NotApplicable
from tests.conformance.pilot import Pilot
from tests.conformance.report import check
from tui_gcs.core.mavlink.frames import cut_datagram, decode

EVENT = 410
LISTEN_S = 4.0
"""CURRENT_EVENT_SEQUENCE comes every 3 s (docs/autopilots.md)."""


@check("events: lost ones are asked for again", takes_s=35.0)
def gap(field: Field, vehicle: int) -> str:
    """All EVENTs of an arming are lost on the way: the station notices, asks, and gets every one of them."""
    if field.air.stream:
        raise NotApplicable("a stream link loses nothing")
    v, fleet = field.vehicle(vehicle), field.station.picture.fleet
    heard: set[int] = set()
    counted: list[int] = []
    fleet.on_message("EVENT", lambda who, fields: heard.add(fields["sequence"]) if who is v else None)
    fleet.on_message("CURRENT_EVENT_SEQUENCE", lambda who, fields: counted.append(1) if who is v else None)
    field.run(LISTEN_S)
    lost_before = field.station.services.vehicle_events.lost
    pilot = Pilot(field, vehicle)
    pilot.ready()
    with field.air.hiding(v.address, EVENT) as withheld:
        pilot.must(pilot.firmware.arm(v, pilot.done))
        pilot.must(pilot.firmware.disarm(v))
        field.run(0.5)
    messages = [decode(frame) for data in withheld for frame in cut_datagram(data).frames]
    lost = {int(message.fields["sequence"]) for message in messages if message is not None}
    if not lost:
        if counted or heard:
            raise Failed("it sends EVENTs, but none when it arms")
        raise NotApplicable("it sends no EVENTs: its news are status texts, which have no numbers to miss")
    took_s = field.until(lambda: lost <= heard, 20.0, lambda: f"{len(lost - heard)} of {len(lost)} lost EVENTs")
    gone = field.station.services.vehicle_events.lost - lost_before
    if gone:
        raise Failed(f"{gone} EVENTs are given up")
    return f"{len(lost)} EVENTs were lost, all of them came {took_s:.1f} s later"
