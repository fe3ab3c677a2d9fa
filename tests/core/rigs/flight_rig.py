"""What commands a fleet, without a simulator: vehicles are numbers that a test writes, and do nothing by themselves.

Everything between an order and the uplink is the station's own: executive, way home, steering, guard, command service,
ArduCopter's words. What would leave the uplink is kept. A test of ten seconds takes some milliseconds.
"""

from collections.abc import Iterator
from typing import Any, cast

from tests.core.rigs.vehicles import a_vehicle, set_fields
from tui_gcs.core.base.clock import VirtualClock
from tui_gcs.core.firmware.command_encoder import CommandEncoder
from tui_gcs.core.firmware.registry import FirmwareRegistry
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.executive import Executive
from tui_gcs.core.flight.flight_services import FlightServices
from tui_gcs.core.flight.flights import Flight, FlightTable
from tui_gcs.core.flight.manual_control import ManualController
from tui_gcs.core.flight.steering import Steering
from tui_gcs.core.geometry.local_frame import LocalFrame, Origin
from tui_gcs.core.geometry.zones import Rectangle
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.permission import Order, SetpointPermission
from tui_gcs.core.mavlink.sources import Stream
from tui_gcs.core.protocol.common import Phase, Vec3
from tui_gcs.core.records.event_log import EventLog
from tui_gcs.core.scenario.model import Limits, OperatingArea
from tui_gcs.core.uplink.commands import CommandService
from tui_gcs.core.uplink.uplink import Uplink

AUTO, GUIDED, RTL, LAND, BRAKE = 3, 4, 6, 9, 17
STEP_S = 0.1
FRAME = LocalFrame(Origin(52.0, -0.6, 100.0))
MODES = {AUTO: "AUTO", GUIDED: "GUIDED", RTL: "RTL", LAND: "LAND", BRAKE: "BRAKE"}


class Watch:
    """`Watch(3)`: vehicles 1 to 3 of team "red", on the ground at (0, 0), (50, 0), (100, 0); layers 30, 40, 50 m."""

    def __init__(self, count: int = 2, **vehicle: Any) -> None:
        self.clock = VirtualClock()
        self.clock.advance(1000.0)
        self.events = EventLog(self.clock)
        self.fleet = VehicleRegistry(self.clock, self.events, FRAME, 254)
        self.flights = FlightTable({i: Flight(i, "red", 20.0 + 10.0 * i) for i in range(1, count + 1)})
        self.guard = Guard(Limits(), OperatingArea(Rectangle((0.0, 0.0), 800.0, 800.0), 20.0, 90.0), ())
        self.commands = CommandService(self.clock, self.events)
        self.command_encoder = CommandEncoder(cast(Uplink, self), FRAME)
        self.firmware = FirmwareRegistry(self.command_encoder, self.fleet, self.commands, self.clock, self.events)
        self.services = FlightServices(
            self.fleet, self.flights, self.guard, self.firmware, self.commands, self.events, self.clock
        )
        self.steering = Steering(self.services)
        self.executive = Executive(self.services, self.steering, 8.0)
        self.manual_control = ManualController(self.services, self.steering)
        self.sent: list[tuple[int, str]] = []
        """(vehicle, order in words) of what left, the newest last."""
        self.silent: set[int] = set()
        """These are not heard."""
        self.blind: set[int] = set()
        """These do not know where they are."""
        for i in range(1, count + 1):
            self.place(i, (50.0 * (i - 1), 0.0, 0.0), **vehicle)

    # ---------------------------------------------------------------- the uplink

    def action(self, vehicle: int, order: Order, message: str, **fields: Any) -> str:
        """An order leaves."""
        first, second = fields["param1"], fields["param2"]
        words = {176: MODES.get(int(second), ""), 400: "arm" if first else "disarm" + " now" * (second == 21196)}
        words |= {22: f"take off to {fields.get('param7', 0):g}", 178: f"at most {second:g} m/s"}
        self.sent.append((vehicle, words.get(fields["command"], f"command {fields['command']}")))
        return ""

    def ask(self, vehicle: int, message: str, **fields: Any) -> None:
        """A question leaves: nobody's business here."""

    def setpoint(self, vehicle: int, permission: SetpointPermission, **fields: Any) -> None:
        """A set-point leaves."""
        x, y = FRAME.to_enu(fields["lat_int"] / 1e7, fields["lon_int"] / 1e7)
        moving = (
            f" at ({fields['vy']:.1f}, {fields['vx']:.1f}, {-fields['vz']:.1f})" if fields["type_mask"] == 3520 else ""
        )
        self.sent.append((vehicle, f"to ({x + 0.0:.0f}, {y + 0.0:.0f}, {fields['alt']:.0f}){moving}"))

    def orders(self, vehicle: int) -> list[str]:
        """What it was told since the last look, each once."""
        reported = list(dict.fromkeys(words for one, words in self.sent if one == vehicle))
        self.sent = [entry for entry in self.sent if entry[0] != vehicle]
        return reported

    # ---------------------------------------------------------------- vehicles

    def vehicle(self, number: int) -> Vehicle:
        return self.fleet.vehicles[number]

    def flight(self, number: int) -> Flight:
        return self.flights.by_id[number]

    def place(self, number: int, at_m: Vec3, moving: Vec3 = (0.0, 0.0, 0.0), **telemetry: Any) -> Vehicle:
        """It is there, and this is what it says of itself."""
        if number not in self.fleet.vehicles:
            new = a_vehicle(number, confirmed=True, identified=True, system_status=3, custom_mode=GUIDED)
            new.path.autopilot_stream = Stream(new.path.source)
            self.fleet.vehicles[number] = new
        vehicle = self.fleet.vehicles[number]
        east, north, up = (round(100 * speed) for speed in moving)
        vehicle.telemetry.position_m, vehicle.telemetry.fix = (
            at_m,
            (0, 520_000_000, -6_000_000, 0, 0, north, east, -up, 0),
        )
        set_fields(vehicle, **telemetry)
        self._hear()
        return vehicle

    def flies(
        self, number: int, at_m: Vec3, phase: Phase = Phase.FLYING, moving: Vec3 = (0, 0, 0), **more: Any
    ) -> None:
        """It is in the air, in GUIDED if nothing else is said, and was brought there by this station."""
        self.place(number, at_m, moving, **{"armed": True, "landed_state": 2, "custom_mode": GUIDED} | more)
        flight = self.flight(number)
        flight.home_m = flight.home_m or (50.0 * (number - 1), 0.0, 0.0)
        flight.enter(phase, self.clock.now() - 60.0)

    def _hear(self) -> None:
        now = self.clock.now()
        for number, vehicle in self.fleet.vehicles.items():
            if number not in self.silent:
                assert vehicle.path.autopilot_stream is not None
                vehicle.path.autopilot_stream.last_heard_s = vehicle.telemetry.heartbeat_s = now
                vehicle.telemetry.position_s = vehicle.telemetry.position_s if number in self.blind else now

    # ---------------------------------------------------------------- time

    def run(self, seconds: float = STEP_S) -> "Watch":
        """Vehicles are heard, and the station does what is due."""
        for _ in range(round(seconds / STEP_S)):
            self.clock.advance(STEP_S)
            self._hear()
            self.commands.tick(self.fleet.vehicles)
            self.executive.tick()
            self.steering.tick()
        return self

    def phases(self) -> list[Phase]:
        return [flight.phase for flight in self.flights]

    def told(self) -> Iterator[str]:
        """Events so far."""
        return (event.text for event in self.events.since(0))
