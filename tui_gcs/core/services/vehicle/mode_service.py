"""Names and numbers of flight modes, as the vehicle lists them (AVAILABLE_MODES), else from our tables.

Nothing is requested until an operator needs a list (`want`): a fleet of 250 is not asked for 24 names each at connect.
ArduPilot sends one mode per request, whatever index is requested; PX4 sends all for index 0 (measured). So index 0 is
requested first, and then, one by one, what is missing.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.commands import CMD_REQUEST_MESSAGE
from tui_gcs.core.mavlink.mode_names import STANDARD_MODES, is_named, known_modes, mode_name, other_word
from tui_gcs.core.services.context import ServiceContext
from tui_gcs.core.uplink.actions import Outcome, RetryClass, VehicleAction

AVAILABLE_MODES = 435
ADVANCED, NOT_SELECTABLE = 1, 2
"""Values of MAV_MODE_PROPERTY."""
MAX_MODES = 64
"""The most modes of one vehicle: ArduCopter has 24, PX4 26."""


@dataclass(frozen=True)
class Mode:
    """One flight mode of one vehicle."""

    number: int
    """HEARTBEAT.custom_mode."""
    name: str
    """The pilot's word for it, cleaned text from a vehicle."""
    advanced: bool = False
    """MAV_MODE_PROPERTY_ADVANCED: for experienced pilots."""


@dataclass
class _ModeList:
    """The modes that one vehicle has listed."""

    total: int = 0
    by_index: dict[int, Fields] = field(default_factory=dict)
    asked: set[int] = field(default_factory=set)
    asking: bool = False
    over: bool = False
    """Whether all have arrived, or the vehicle has no such list."""
    monitor: int | None = None


class ModeService:
    """Translates between names and numbers of modes, and lists the modes of a vehicle."""

    def __init__(self, context: ServiceContext) -> None:
        self._context = context
        self._offers: dict[int, _ModeList] = {}
        self.ignored: Counter[str] = Counter()
        fleet = context.fleet
        fleet.on_message("AVAILABLE_MODES", self._available)
        fleet.on_message("AVAILABLE_MODES_MONITOR", self._monitor)
        fleet.on_component(self.forget)
        context.forget_with(self.forget)

    def name(self, vehicle: Vehicle, custom_mode: int | None = None) -> str:
        """Return the name of a mode of `vehicle`, by default of the one that it is in.

        Our tables come before the vehicle's own words, so that a mode has the same name in a whole fleet.
        """
        number = vehicle.telemetry.custom_mode if custom_mode is None else custom_mode
        if not is_named(vehicle.autopilot, vehicle.type, number):
            for fields in self._listed(vehicle):
                if fields["custom_mode"] == number and _offered_name(fields):
                    return _offered_name(fields)
        return mode_name(vehicle.autopilot, vehicle.type, number)

    def list(self, vehicle: Vehicle) -> tuple[Mode, ...]:
        """The modes that an operator may choose, in the vehicle's order; from our tables until it has listed them."""
        listed = self._listed(vehicle)
        if not listed:
            table = known_modes(vehicle.autopilot, vehicle.type)
            return tuple(Mode(number, name) for number, name in table.items())
        modes = {}
        for fields in listed:
            number = fields["custom_mode"]
            if not fields["properties"] & NOT_SELECTABLE:
                modes[number] = Mode(number, self.name(vehicle, number), bool(fields["properties"] & ADVANCED))
        return tuple(modes.values())

    def number(self, vehicle: Vehicle, name: str) -> int | None:
        """Return the custom_mode of the mode called `name`, or None if there is none.

        Case, spaces, "_" and "-" do not matter. The vehicle's own names count, too, once it has listed them, and so do
        MAVLink's names of standard modes.
        """
        listed = self._listed(vehicle)
        usable = {fields["custom_mode"] for fields in listed if not fields["properties"] & NOT_SELECTABLE}
        wanted = {_plain(name), _plain(other_word(vehicle.autopilot, _plain(name).upper()))}
        for number, word in known_modes(vehicle.autopilot, vehicle.type).items():
            if _plain(word) in wanted and (number in usable or not self._complete(vehicle)):
                return number
        for fields in listed:
            words = {_plain(fields["mode_name"]), _plain(STANDARD_MODES.get(fields["standard_mode"], ""))} - {""}
            if fields["custom_mode"] in usable and words & wanted:
                return int(fields["custom_mode"])
        return None

    def want(self, vehicle: Vehicle) -> None:
        """Have the vehicle list its modes, once."""
        offer = self._offers.setdefault(vehicle.id, _ModeList())
        if not offer.asking and not offer.over and self._context.uplink.is_ours(vehicle):
            self._ask(vehicle, offer, 0)

    def asking(self, vehicle: Vehicle) -> bool:
        """Whether the vehicle is still listing its modes."""
        offer = self._offers.get(vehicle.id)
        return offer is not None and offer.asking

    def forget(self, vehicle: Vehicle) -> None:
        """Forget the list of a vehicle that rebooted or was replaced."""
        self._offers.pop(vehicle.id, None)

    def _listed(self, vehicle: Vehicle) -> Sequence[Fields]:
        offer = self._offers.get(vehicle.id)
        return [offer.by_index[index] for index in sorted(offer.by_index)] if offer is not None else []

    def _complete(self, vehicle: Vehicle) -> bool:
        offer = self._offers.get(vehicle.id)
        return offer is not None and 0 < offer.total <= len(offer.by_index)

    def _ask(self, vehicle: Vehicle, offer: _ModeList, index: int) -> None:
        offer.asking = True
        offer.asked.add(index)
        self._context.commands.submit(
            VehicleAction(
                vehicle.id,
                "list modes",
                RetryClass.SET,
                send=lambda copy: self._context.request_message(vehicle.id, AVAILABLE_MODES, index, copy=copy),
                confirmed=lambda _: index in offer.by_index or (index == 0 and bool(offer.by_index)),
                command=CMD_REQUEST_MESSAGE,
                on_done=lambda action, outcome, why: self._answered(vehicle, offer, outcome),
                ack_ends=False,
                housekeeping=True,
            )
        )

    def _answered(self, vehicle: Vehicle, offer: _ModeList, outcome: Outcome) -> None:
        """Request the next missing mode. Each index gets its five tries once."""
        offer.asking = False
        if self._offers.get(vehicle.id) is not offer or outcome is Outcome.SUPERSEDED:
            return
        wanted = range(1, min(offer.total, MAX_MODES) + 1)
        missing = [index for index in wanted if index not in offer.by_index and index not in offer.asked]
        if missing and (outcome is Outcome.CONFIRMED or offer.by_index):
            self._ask(vehicle, offer, missing[0])
        else:
            offer.over = True

    def _available(self, vehicle: Vehicle, fields: Fields) -> None:
        offer = self._offers.get(vehicle.id)
        if offer is None:
            self.ignored["modes not requested"] += 1
            return
        index = fields["mode_index"]
        # A vehicle may claim any index.
        if not 1 <= index <= min(fields["number_modes"], MAX_MODES):
            self.ignored["mode beyond the number of modes"] += 1
            return
        offer.total = fields["number_modes"]
        offer.by_index[index] = fields

    def _monitor(self, vehicle: Vehicle, fields: Fields) -> None:
        """Take AVAILABLE_MODES_MONITOR: its number changes when modes appear or vanish (a companion of PX4)."""
        offer = self._offers.get(vehicle.id)
        if offer is None:
            return
        before, offer.monitor = offer.monitor, fields["seq"]
        # Only a list that was complete is requested anew.
        if before is not None and before != offer.monitor and offer.over:
            self._offers[vehicle.id] = _ModeList(monitor=offer.monitor)
            self.want(vehicle)


def _offered_name(fields: Fields) -> str:
    return str(fields["mode_name"]) or STANDARD_MODES.get(fields["standard_mode"], "")


def _plain(name: str) -> str:
    return "".join(char for char in name.casefold() if char.isalnum())
