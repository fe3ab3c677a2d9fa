"""Which parameters of each autopilot are gains, by the control loop they belong to, innermost first."""

from dataclasses import dataclass

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.mavlink.enum_names import AUTOPILOT_ARDUPILOT, AUTOPILOT_PX4


@dataclass(frozen=True)
class GainGroup:
    """The gains of one loop."""

    name: str
    params: tuple[str, ...]
    either: tuple[tuple[str, ...], ...] = ()
    """Names of the same gains in different versions: a vehicle that has some of one tuple has none of the others."""

    @property
    def names(self) -> tuple[str, ...]:
        """All names that may exist."""
        return (*self.params, *(name for names in self.either for name in names))


def _each(pattern: str, *letters: str) -> tuple[str, ...]:
    """`pattern` with its * replaced by each of `letters`."""
    return tuple(pattern.replace("*", letter) for letter in letters)


_ARDUPILOT = (
    GainGroup(
        "rate",
        tuple(
            f"ATC_RAT_{axis}_{gain}"
            for axis in ("RLL", "PIT", "YAW")
            for gain in ("P", "I", "D", "FF", "IMAX", "FLTT", "FLTE", "FLTD")
        ),
    ),
    GainGroup(
        "attitude",
        (
            *_each("ATC_ANG_*_P", "RLL", "PIT", "YAW"),
            *_each("ATC_ACCEL_*_MAX", "R", "P", "Y"),
            "ATC_INPUT_TC",
        ),
    ),
    GainGroup(
        "velocity",
        (),
        (
            tuple(f"PSC_{loop}_{gain}" for loop in ("VELXY", "VELZ", "ACCZ") for gain in ("P", "I", "D", "FF")),
            tuple(f"PSC_{loop}_{gain}" for loop in ("NE_VEL", "D_VEL", "D_ACC") for gain in ("P", "I", "D", "FF")),
        ),
    ),
    GainGroup("position", (), (("PSC_POSXY_P", "PSC_POSZ_P"), ("PSC_NE_POS_P", "PSC_D_POS_P"))),
)
"""ArduCopter; PSC_NE_* and PSC_D_* are the names of 4.7."""
_PX4 = (
    GainGroup(
        "rate",
        tuple(f"MC_{axis}RATE_{gain}" for axis in ("ROLL", "PITCH", "YAW") for gain in ("P", "I", "D", "FF", "K")),
    ),
    GainGroup("attitude", ("MC_ROLL_P", "MC_PITCH_P", "MC_YAW_P", "MC_YAW_WEIGHT")),
    GainGroup(
        "velocity",
        (*_each("MPC_XY_VEL_*_ACC", "P", "I", "D"), *_each("MPC_Z_VEL_*_ACC", "P", "I", "D")),
    ),
    GainGroup("position", ("MPC_XY_P", "MPC_Z_P")),
)
_GROUPS = {AUTOPILOT_ARDUPILOT: _ARDUPILOT, AUTOPILOT_PX4: _PX4}


def gain_groups(vehicle: Vehicle) -> tuple[GainGroup, ...]:
    """The gains of this vehicle's loops; none if they are not known."""
    return _GROUPS.get(vehicle.autopilot, ())
