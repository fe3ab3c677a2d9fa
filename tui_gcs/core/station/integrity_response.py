"""What the station does when a vehicle's position or mode cannot be trusted: it holds those that it steers."""

from tui_gcs.core.base.clock import WallClockMonitor, wall_clock_warning
from tui_gcs.core.fleet.integrity.navigation_integrity import NavigationIntegrityMonitor
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.flight.flights import HoldStep
from tui_gcs.core.flight.stall_detection import StallDetector
from tui_gcs.core.protocol.common import EventClass, Phase
from tui_gcs.core.records.event_log import ALERT, WARNING
from tui_gcs.core.station.alarm_finder import AlarmFinder
from tui_gcs.core.station.parts import AirPicture, FlightParts, Records

JUMPED, DOUBTED = "its position jumped", "it doubted its own position"
"""Why a vehicle that holds does not go on when the others are resumed."""


class IntegrityResponse:
    """Holds vehicles after a stall of the station, a jump of a position, or a doubt of a vehicle's own navigation."""

    def __init__(self, records: Records, picture: AirPicture, flight: FlightParts, finder: AlarmFinder) -> None:
        self.stall_detector = StallDetector()
        self._records = records
        self._picture = picture
        self._flight = flight
        self._finder = finder
        self._self_doubts = NavigationIntegrityMonitor()
        self._wall_watch = WallClockMonitor(records.clock)

    def lift_m(self, vehicle: int) -> float:
        """How many metres lower than it reports a vehicle may be: its height jumped up, or its GPS reports less."""
        return max(0.0, self._picture.jump_monitor.off(vehicle)[2], self._picture.altitude_monitor.off_m(vehicle))

    def after_stall(self) -> None:
        """Hold every vehicle that its planner still steers, once after each stall of this process."""
        if not self.stall_detector.is_over(self._records.clock.now()):
            return
        # No set-point led them during the stall, so nothing here says where they are by now.
        flying = tuple(flight.vehicle for flight in self._flight.flights.in_phase(Phase.FLYING))
        held = f"{len(flying)} {'vehicle holds' if len(flying) == 1 else 'vehicles hold'}: " if flying else ""
        # The list of events has 52 cells for it on a terminal of 80.
        text = f"{held}computer overloaded? {self.stall_detector.lasted_s:.1f} s stall"
        self._records.events.report(EventClass.CONNECTION, "station", text, ALERT)
        if flying:
            self._flight.executive.hold(flying, stays="", ordered=False)

    def look_at_clock(self) -> None:
        """Warn when the computer's wall clock was set."""
        if by_s := self._wall_watch.was_set_by():
            self._records.events.report(EventClass.CONNECTION, "station", wall_clock_warning(by_s), WARNING)

    def look_at_positions(self) -> None:
        """Hold vehicles after a position jump, and compare their heights with those of their GPS."""
        vehicles = self._picture.fleet.vehicles
        for vehicle, far_m in self._picture.jump_monitor.look(vehicles.values()):
            self._hold_jumped(vehicle, far_m)
        self._picture.altitude_monitor.look(vehicles.values(), self._records.clock.now())

    def look_at_doubts(self) -> None:
        """Hold vehicles that report to have lost their position; before that shows they still are nearly there."""
        for vehicle, why in self._self_doubts.look(self._finder.in_doubt, self._records.clock.now()):
            flight = self._flight.flights.get(vehicle)
            if flight is not None and flight.phase in (Phase.FLYING, Phase.BY_HAND):
                text = f"it doubts its own position, and holds: {why}"
                self._records.events.report(EventClass.SENSOR, f"vehicle {vehicle}", text, WARNING)
                # Only once per doubt: an operator who gives it back to its planner all the same means it.
                self._self_doubts.answer(vehicle)
                self._flight.executive.hold((vehicle,), stays=DOUBTED, ordered=False)

    def _hold_jumped(self, vehicle: Vehicle, far_m: float) -> None:
        text = f"its position jumped by {far_m:.0f} m: before or after that it is not where it reports"
        if not self._picture.jump_monitor.off_m(vehicle.id):
            text = f"its position jumped back by {far_m:.0f} m"
        self._records.events.report(EventClass.SENSOR, f"vehicle {vehicle.id}", text, WARNING)
        flight = self._flight.flights.get(vehicle.id)
        if flight is None or flight.phase not in (Phase.FLYING, Phase.BY_HAND, Phase.HOLDING):
            return
        # A vehicle found in the air gets no order before an operator gives one; it only must not be resumed with the
        # others.
        if flight.step is HoldStep.FOUND:
            flight.stays = flight.stays or JUMPED
        else:
            # Also where it holds already: it would fly back to the place where it seemed to be.
            self._flight.executive.hold((vehicle.id,), stays=JUMPED, ordered=False)
