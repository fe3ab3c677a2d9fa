"""What a station sends unasked: its heartbeat to the vehicles, fleet frames and status to the bus."""

import math
from collections.abc import Iterator

import msgspec

from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol.common import FleetFrame, StationStatus, encode
from tui_gcs.core.station.assembly import StationParts
from tui_gcs.core.station.fleet_frame import fleet_frame
from tui_gcs.core.station.frontend_protocol import StationFrontend
from tui_gcs.core.station.status import station_status

FRAME_GAP_S = 0.1
STATUS_GAP_S = 0.5


class Publisher:
    """Numbers and publishes fleet frames and the status."""

    def __init__(self, parts: StationParts) -> None:
        self.frontend: StationFrontend | None = None
        """It knows which vehicles may start and which principal is in control; None: requests are not served."""
        self._parts = parts
        self._frame_seq = self._status_seq = 0
        self._next_status_s = -math.inf
        self._last_state: object = None

    def frame(self) -> FleetFrame:
        """All vehicles as they are now, under the number of the frame published last."""
        parts, clock = self._parts, self._parts.records.clock
        picture, flight = parts.picture, parts.flight
        frame = fleet_frame(
            self._frame_seq,
            parts.config.kind,
            picture.fleet,
            flight.flights,
            flight.steering,
            clock,
            parts.services.payload,
            flight.battery_return,
            parts.comms.commands,
        )
        return msgspec.structs.replace(
            frame,
            tracks=picture.tracks.tracks(clock.now()),
            wind_m_s=picture.wind.estimate(),
            points=flight.points.open(),
            keep_out=flight.steering.keep_out(),
        )

    def status(self) -> StationStatus:
        """The station as it is now, under the number of the status published last."""
        return station_status(self._parts, self.frontend, self._status_seq)

    def frame_gap_s(self) -> float:
        """Seconds from one fleet frame to the next: planners that step faster than 10 Hz get frames as often."""
        return min(
            [
                FRAME_GAP_S,
                *(1.0 / controller.planner.rate_hz for controller in self._parts.active.team_controllers.values()),
            ]
        )

    def publish_frame(self) -> Iterator[None]:
        """Measure and publish the fleet, in pieces: each takes milliseconds with 250 vehicles."""
        self._frame_seq += 1  # without gaps: referees count the frames that the bus dropped
        for controller in self._parts.active.team_controllers.values():
            controller.measure()
        self._parts.flight.points.tick()
        self._parts.flight.monitor.look(self._parts.picture.fleet.vehicles.values())
        yield
        # Each piece takes milliseconds with 250 vehicles; a HOLD may be answered between them.
        frame = self.frame()
        yield
        self._parts.records.bus.publish(keys.FLEET, encode(frame))
        yield

    def publish_last_status(self) -> None:
        """Publish that the station ends by an operator's order: its consoles do not wait for another one."""
        self._parts.conditions.ending = True
        self._status_seq += 1
        self._parts.records.bus.publish(keys.STATUS, encode(self.status()))

    def publish_status(self) -> Iterator[None]:
        """Publish the status when something that operators wait for has changed, and every half second."""
        parts, now = self._parts, self._parts.records.clock.now()
        state = (
            parts.flight.executive.run,
            parts.active.round_index,
            parts.active.revision,
            parts.comms.uplink.refused.total(),
            parts.alarms.changes,
        )
        # Published at once on a change, so that an operator sees within a tick that a key worked.
        if now < self._next_status_s - 1e-9 and state == self._last_state:
            return
        self._next_status_s = now + STATUS_GAP_S
        self._last_state = state
        self._status_seq += 1
        parts.records.bus.publish(keys.STATUS, encode(self.status()))
        yield
