"""Requests about setting up vehicles, their payload, and the aircraft that they receive.

Part of `core/protocol/services.py`, which describes how requests, tasks and results go together. Calibrations and motor
tests are guided tasks: `TaskInfo.prompt` is what the operator does now, and `ConfirmStep` reports that it is done.
"""

from typing import Literal

from tui_gcs.core.protocol.base import Message
from tui_gcs.core.protocol.common import Request

Number = int | float
Vehicles = tuple[int, ...]
SensorWord = Literal["gyro", "accel", "simple-accel", "level", "compass", "baro", "airspeed", "rc"]
"""What can be calibrated; "rc": the pilot's transmitter."""


class CalibrationRow(Message, frozen=True):
    """One calibration that a vehicle has."""

    vehicle: int
    sensor: SensorWord
    prompt: str
    """What to do before it begins."""
    no_cancel: str = ""
    """Why it cannot be cancelled once it has begun; "" if it can."""


class GainRow(Message, frozen=True):
    """One gain, and what it was before it was changed here."""

    group: str
    name: str
    value: Number
    former: tuple[Number, ...] = ()
    """Earlier values, oldest first."""


class AirframeRow(Message, frozen=True):
    """One number that describes how a vehicle is built."""

    vehicle: int
    label: str
    """As people call it, e.g. "class"."""
    param: str
    least: int
    most: int
    choices: dict[int, str]
    """The names of the usual ones."""
    warning: str
    """What happens when it is changed."""
    value: int | None = None
    """What it is; None: not asked."""


class TrafficRow(Message, frozen=True):
    """One aircraft that a vehicle's ADS-B receiver hears. Numbers that are not known are NaN."""

    icao: int
    callsign: str
    lat_deg: float
    lon_deg: float
    alt_m: float
    """Above mean sea level if `is_geometric`, else by pressure."""
    is_geometric: bool
    heading_deg: float
    speed_m_s: float
    climb_m_s: float
    simulated: bool
    heard_by: int
    """The vehicle that reported it last."""
    age_s: float
    distance_m: float
    """On the ground plan from the vehicle that heard it."""
    above_m: float
    """That vehicle's height subtracted, where its own is above the sea, too."""


class RemoteIdRow(Message, frozen=True):
    """What one aircraft broadcasts by Remote ID; empty or NaN where it broadcasts nothing."""

    vehicle: int
    """The vehicle that broadcasts it; 0: another aircraft, received by `heard_by`."""
    heard_by: int
    uas_id: str
    operator_id: str
    description: str
    lat_deg: float
    lon_deg: float
    alt_m: float
    """Metres above the ellipsoid (WGS-84)."""
    operator_lat_deg: float
    operator_lon_deg: float
    may_arm: bool | None
    """Whether its transmitter allows arming; None if it has not reported that."""
    arm_error: str
    component: int
    """The transmitter; 1 is the autopilot itself."""
    age_s: float


class PayloadRow(Message, frozen=True):
    """A camera or gimbal of a vehicle that was heard."""

    vehicle: int
    kind: Literal["camera", "gimbal"]
    component: int
    name: str = ""
    images: int = 0
    """Pictures that it has reported since the station began to listen."""
    controlled_by: int | None = None
    """The system id that controls it; 0: none does, None: not known."""
    angles_deg: tuple[float, float, float] | None = None
    """Roll, pitch and yaw, as reported `age_s` ago."""
    to_north: bool = False
    """That yaw is counted from north, not from the nose."""
    age_s: float = 0.0


class GetCalibrations(Request, frozen=True, tag="get-calibrations"):
    """What can be calibrated on these vehicles (`ServiceReply.calibrations`)."""

    vehicles: Vehicles


class GetAirframes(Request, frozen=True, tag="get-airframes"):
    """What these vehicles could be built as (`ServiceReply.airframes`); `ReadAirframe` asks what they are."""

    vehicles: Vehicles


class GetTraffic(Request, frozen=True, tag="get-traffic"):
    """Aircraft that vehicles heard within the last minute (`ServiceReply.traffic`)."""


class GetRemoteIds(Request, frozen=True, tag="get-remote-ids"):
    """What these vehicles broadcast, and what all hear of others (`ServiceReply.remote_ids`)."""

    vehicles: Vehicles


class GetPayloads(Request, frozen=True, tag="get-payloads"):
    """Cameras and gimbals of these vehicles that were heard (`ServiceReply.payloads`)."""

    vehicles: Vehicles


class ReadGains(Request, frozen=True, tag="read-gains"):
    """Read a group of gains, or all groups (`TaskResult.gains`)."""

    vehicles: Vehicles
    group: str = ""


class ReadAirframe(Request, frozen=True, tag="read-airframe"):
    """Read what vehicles are built as (`TaskResult.airframe`)."""

    vehicles: Vehicles


class HearTraffic(Request, frozen=True, tag="hear-traffic"):
    """Have vehicles tell what their ADS-B receivers hear, where they do not by themselves."""

    vehicles: Vehicles


class Calibrate(Request, frozen=True, tag="calibrate"):
    """Calibrate vehicles that are not armed; led by prompts."""

    vehicles: Vehicles
    sensor: SensorWord


class CancelCalibration(Request, frozen=True, tag="cancel-calibration"):
    """End the calibration of vehicles, also one that another principal began; done when it is over."""

    vehicles: Vehicles


class UndoRadio(Request, frozen=True, tag="undo-radio"):
    """Set back what the last calibration of the transmitter wrote."""

    vehicles: Vehicles


class AskPayloads(Request, frozen=True, tag="ask-payloads"):
    """Have these vehicles tell of what their autopilots carry themselves; done when they had their time."""

    vehicles: Vehicles


class SetGain(Request, frozen=True, tag="set-gain"):
    """Set one gain that was read; what it was is kept."""

    vehicles: Vehicles
    name: str
    value: Number
    sure: bool = False
    """Though it is in the air, or the step is more than a factor of two."""


class UndoGains(Request, frozen=True, tag="undo-gains"):
    """Take back the last change of one gain, or (name "") all changes of all gains."""

    vehicles: Vehicles
    name: str = ""


class ChooseAirframe(Request, frozen=True, tag="choose-airframe"):
    """Say what vehicles that are not armed are built as; takes effect at their next boot."""

    vehicles: Vehicles
    words: tuple[str, ...]
    """LABEL=VALUE each, or one VALUE where there is one number only; a value is a number or the name of a choice."""


class TestMotor(Request, frozen=True, tag="test-motor"):
    """Turn one motor of a vehicle that is not armed; done when its time is over."""

    __test__ = False
    vehicles: Vehicles
    motor: int
    """The number of the motor, counted from 1."""
    throttle: float
    """The throttle as a share, 0 to 1."""
    seconds: float
    props_removed: bool = False
    """The operator confirms that the propellers are off."""


class PointGimbal(Request, frozen=True, tag="point-gimbal"):
    """Point the gimbals of vehicles, taking control of them."""

    vehicles: Vehicles
    pitch_deg: float
    """Degrees of pitch, up is positive."""
    yaw_deg: float
    to_north: bool = False
    """Yaw is counted from north and kept, instead of from the nose."""


class ReleaseGimbal(Request, frozen=True, tag="release-gimbal"):
    """Give control of the gimbals of vehicles back."""

    vehicles: Vehicles


class UseCamera(Request, frozen=True, tag="use-camera"):
    """Take one picture, or start or stop a video."""

    vehicles: Vehicles
    act: Literal["photo", "start", "stop"]


class LookAt(Request, frozen=True, tag="look-at"):
    """Keep cameras (or noses) on a place."""

    vehicles: Vehicles
    lat_deg: float
    lon_deg: float
    alt_m: float
    above: Literal["home", "sea"] = "sea"
    """What the height is counted from: each vehicle's own home, or mean sea level."""


class LookAhead(Request, frozen=True, tag="look-ahead"):
    """No place to look at any more."""

    vehicles: Vehicles


class SetCurrentItem(Request, frozen=True, tag="set-current-item"):
    """Go on with another item of the mission on board."""

    vehicles: Vehicles
    item: int
    """The item, counted from 1."""
    sure: bool = False
    """Though it is in the air: it flies there, if it flies its mission."""


class ConfirmStep(Request, frozen=True, tag="confirm-step"):
    """Report that the operator has done what the prompt of a task asks for."""

    number: int


Look = GetCalibrations | GetAirframes | GetTraffic | GetRemoteIds | GetPayloads
Fetch = ReadGains | ReadAirframe | HearTraffic | AskPayloads
SetUp = Calibrate | CancelCalibration | UndoRadio | SetGain | UndoGains | ChooseAirframe | TestMotor
Carry = PointGimbal | ReleaseGimbal | UseCamera | LookAt | LookAhead | SetCurrentItem
Change = SetUp | Carry
