"""Requests about single vehicles in flight: flown by an operator beside or instead of their planner.

Part of `core/protocol/services.py`, which describes how requests, tasks and results go together. The guard checks the
courses that are asked for here like those of any planner.
"""

from typing import Literal

from tui_gcs.core.protocol.base import StopRequest, Vec3, VehicleRequest

NAN = float("nan")


class Arm(VehicleRequest, frozen=True, tag="arm"):
    """Arm vehicles on the ground; they disarm themselves where no take-off follows."""


class Disarm(VehicleRequest, frozen=True, tag="disarm"):
    """Disarm vehicles on the ground."""


class Land(StopRequest, frozen=True, tag="land"):
    """Land where they are. Answered at once, repeated until it shows."""


class KillMotors(VehicleRequest, frozen=True, tag="kill-motors"):
    """Stop the motors of one vehicle, also in the air: it falls."""

    reason: str
    """The reason, for the journal."""


class TakeOff(VehicleRequest, frozen=True, tag="take-off"):
    """Arm (where it is not), climb straight up, and stay there, flown by hand."""

    alt_m: float
    """Above each vehicle's own home."""


class GoTo(VehicleRequest, frozen=True, tag="go-to"):
    """Fly to a place each, and stay there."""

    points_m: tuple[Vec3, ...]
    """One for each vehicle, ENU, z above its home; NaN: as it is (x and y: where it comes to rest)."""
    speed_m_s: float = NAN
    """NaN: the speed limit of the scenario."""
    from_home: bool = False
    """East and north are counted from each vehicle's own home instead of the scenario's origin."""


class CircleFlight(VehicleRequest, frozen=True, tag="circle"):
    """Fly round a place, at the height of it."""

    centre_m: Vec3
    """ENU; z NaN: at its own height."""
    radius_m: float
    speed_m_s: float = NAN
    clockwise: bool = True


class LimitSpeed(VehicleRequest, frozen=True, tag="limit-speed"):
    """Fly on to its place, or its mission, no faster than this."""

    speed_m_s: float


class Nudge(VehicleRequest, frozen=True, tag="nudge"):
    """Move with this velocity for one second at most; the console repeats it while a key is held down.

    Zero begins: it takes the vehicle from whatever it does. Any other velocity is only for a vehicle that is being
    nudged already.
    """

    velocity_m_s: Vec3


class Follow(VehicleRequest, frozen=True, tag="follow"):
    """Fly beside another vehicle, wherever it goes, until something else is asked."""

    leader: int
    offset_m: Vec3 = (NAN, NAN, NAN)
    """East and north from it, z above one's own home; NaN: as it is now."""


class OnBoardMission(VehicleRequest, frozen=True, tag="on-board-mission"):
    """Fly the mission that is on the vehicle, from its present item; a hold pauses it."""

    act: Literal["start", "continue"]
    sure: bool = False
    """Also if it would come too close to another vehicle on its mission."""


Flight = Arm | Disarm | KillMotors | TakeOff | GoTo | CircleFlight | LimitSpeed | OnBoardMission | Nudge | Follow
