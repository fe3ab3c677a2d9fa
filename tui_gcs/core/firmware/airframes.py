"""How each autopilot's airframe is set: the parameters for it, and the names of their values."""

from dataclasses import dataclass

from tui_gcs.core.base.text import clean
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4

FRAME_CLASSES = {
    1: "quad",
    2: "hexa",
    3: "octa",
    4: "octa quad",
    5: "Y6",
    6: "helicopter",
    7: "tri",
    8: "single",
    9: "coax",
    10: "bicopter",
    11: "dual helicopter",
    12: "dodeca hexa",
    13: "heli quad",
    14: "deca",
}
"""ArduCopter's FRAME_CLASS."""
FRAME_TYPES = {
    0: "plus",
    1: "X",
    2: "V",
    3: "H",
    4: "V tail",
    5: "A tail",
    10: "Y6B",
    11: "Y6F",
    12: "BetaFlight X",
    13: "DJI X",
    14: "clockwise X",
    15: "I",
    18: "BetaFlight X reversed",
    19: "Y4",
}
"""ArduCopter's FRAME_TYPE."""
AUTOSTARTS = {
    4001: "generic quadcopter X",
    5001: "generic quadcopter plus",
    4014: "S500",
    4019: "Holybro X500 V2",
    4050: "generic 250 racer",
    4052: "Holybro QAV250",
    6001: "generic hexacopter X",
    7001: "generic hexacopter plus",
    8001: "generic octocopter X",
    9001: "generic octocopter plus",
    11001: "generic hexacopter coax",
    12001: "generic octocopter coax",
    2100: "generic plane",
    3000: "generic flying wing",
    13000: "generic standard VTOL",
    13100: "generic tiltrotor VTOL",
    13200: "generic tailsitter VTOL",
    50000: "generic differential rover",
    51000: "generic Ackermann rover",
    60000: "generic underwater vehicle",
}
"""PX4's SYS_AUTOSTART: its most common airframes; any other number is taken, too."""


@dataclass(frozen=True)
class AirframeField:
    """One parameter that sets the airframe, and its range."""

    param: str
    label: str
    choices: dict[int, str]
    least: int
    most: int

    def number(self, word: str) -> int | None:
        """The value that a number or the name of a choice stands for; None if the word is neither."""
        if word.isascii() and word.isdigit() and len(word) < 10:
            return int(word)
        return next((number for number, name in self.choices.items() if name.lower() == word.lower()), None)


@dataclass(frozen=True)
class AirframeParameters:
    """The parameters that set an airframe."""

    fields: tuple[AirframeField, ...]
    then: tuple[tuple[str, int], ...] = ()
    """Parameters, with their values, that are set after them."""
    warning: str = "takes effect at the next boot"

    def values(self, words: tuple[str, ...]) -> dict[str, int] | str:
        """Numbers by parameter for words such as ("class=quad", "type=1"), or what is wrong with them."""
        values: dict[str, int] = {}
        for word in words:
            label, equals, choice = word.rpartition("=")
            fields = [field for field in self.fields if not equals or label.strip().lower() == field.label]
            if len(fields) != 1:
                return f"expected: {', '.join(f'{field.label}=VALUE' for field in self.fields)}"
            number = fields[0].number(choice.strip())
            if number is None:
                return f"{clean(choice, 40)} is none of its names, and no number"
            values[fields[0].param] = number
        return values


_PARAMETERS = {
    AUTOPILOT_ARDUPILOT: AirframeParameters(
        (
            AirframeField("FRAME_CLASS", "class", FRAME_CLASSES, 0, 17),
            AirframeField("FRAME_TYPE", "type", FRAME_TYPES, 0, 19),
        )
    ),
    AUTOPILOT_PX4: AirframeParameters(
        (AirframeField("SYS_AUTOSTART", "airframe", AUTOSTARTS, 1, 9_999_999),),
        (("SYS_AUTOCONFIG", 1),),
        "at the next boot all parameters but calibrations, radio and flight modes go back to this airframe's defaults",
    ),
}


def airframe(vehicle: Vehicle) -> AirframeParameters | None:
    """The parameters of this vehicle's airframe; None if they are not known."""
    return _PARAMETERS.get(vehicle.autopilot)


def changes_airframe(vehicle: Vehicle, param: str) -> bool:
    """Whether a parameter sets this vehicle's airframe, so that a new value holds from the next boot only."""
    words = airframe(vehicle)
    return words is not None and any(field.param == param for field in words.fields)
