"""Requests about setting up vehicles, their payload, and the aircraft that they receive.

Part of `core/protocol/services.py`, which describes how requests, tasks and results go together. Calibrations and motor
tests are guided tasks: `TaskInfo.prompt` is what the operator does now, and `ConfirmStep` reports that it is done.
"""

from typing import Literal

from tui_gcs.core.protocol.base import Message, Request, VehicleRequest

Number = int | float
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


SectionWord = Literal["airframe", "sensors", "radio", "modes", "failsafes", "motors", "battery", "tuning"]
"""The sections of setting a vehicle up, in the order in which it is done."""
FieldAct = Literal["parameter", "airframe", "gain", "calibrate", "motor", "none"]


class SetupFieldRow(Message, frozen=True):
    """One line of a section: a value, a sensor, what happens when something is lost, or a motor."""

    label: str
    act: FieldAct
    """The request that changes it: SetParams, ChooseAirframe, SetGain, Calibrate (`label` is the sensor), TestMotor."""
    param: str = ""
    """The parameter that holds it; "" if none does."""
    value: Number | None = None
    """The parameter's value, None if it was not read; the number of a motor."""
    words: str = ""
    """What it is or does, where that is more than the value."""
    needs_attention: bool = False
    choices: tuple[tuple[int, str], ...] = ()
    """Names of the parameter's usual values, or what the vehicle would do."""
    unit: str = ""
    prompt: str = ""
    """What to do before a calibration begins."""
    former: tuple[Number, ...] = ()
    """Earlier values of a gain, oldest first."""


class SetupSectionRow(Message, frozen=True):
    """How one section of a vehicle's setup stands."""

    vehicle: int
    section: SectionWord
    state: Literal["done", "needs attention", "unknown"]
    text: str
    """What it is, or what is missing."""
    fields: tuple[SetupFieldRow, ...] = ()
    """The lines of the section that was asked for."""


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


class GetCalibrations(VehicleRequest, frozen=True, tag="get-calibrations"):
    """What can be calibrated on these vehicles (`ServiceReply.calibrations`)."""


class GetAirframes(VehicleRequest, frozen=True, tag="get-airframes"):
    """What these vehicles could be built as (`ServiceReply.airframes`); `ReadAirframe` asks what they are."""


class GetSetup(VehicleRequest, frozen=True, tag="get-setup"):
    """How the setup of these vehicles stands, as far as it was read (`ServiceReply.setup_sections`)."""

    section: SectionWord | None = None
    """The section whose lines are wanted, too."""
    only: bool = False
    """Only that section is asked for: an eighth of the work."""


class GetTraffic(Request, frozen=True, tag="get-traffic"):
    """Aircraft that vehicles heard within the last minute (`ServiceReply.traffic`)."""


class GetRemoteIds(VehicleRequest, frozen=True, tag="get-remote-ids"):
    """What these vehicles broadcast, and what all hear of others (`ServiceReply.remote_ids`)."""


class GetPayloads(VehicleRequest, frozen=True, tag="get-payloads"):
    """Cameras and gimbals of these vehicles that were heard (`ServiceReply.payloads`)."""


class ReadGains(VehicleRequest, frozen=True, tag="read-gains"):
    """Read a group of gains, or all groups (`TaskResult.gains`)."""

    group: str = ""


class ReadSetup(VehicleRequest, frozen=True, tag="read-setup"):
    """Read the parameters that a section is about; of all sections if none is named. Then `GetSetup`."""

    section: SectionWord | None = None


class ReadAirframe(VehicleRequest, frozen=True, tag="read-airframe"):
    """Read what vehicles are built as (`TaskResult.airframe`)."""


class HearTraffic(VehicleRequest, frozen=True, tag="hear-traffic"):
    """Have vehicles tell what their ADS-B receivers hear, where they do not by themselves."""


class Calibrate(VehicleRequest, frozen=True, tag="calibrate"):
    """Calibrate vehicles that are not armed; led by prompts."""

    sensor: SensorWord


class CancelCalibration(VehicleRequest, frozen=True, tag="cancel-calibration"):
    """End the calibration of vehicles, also one that another principal began; done when it is over."""


class UndoRadio(VehicleRequest, frozen=True, tag="undo-radio"):
    """Set back what the last calibration of the transmitter wrote."""


class AskPayloads(VehicleRequest, frozen=True, tag="ask-payloads"):
    """Have these vehicles tell of what their autopilots carry themselves; done when they had their time."""


class SetGain(VehicleRequest, frozen=True, tag="set-gain"):
    """Set one gain that was read; what it was is kept."""

    name: str
    value: Number
    sure: bool = False
    """Though it is in the air, or the step is more than a factor of two."""
    beyond_range: bool = False
    """Set it also if the vehicle's own description of the parameter excludes the value."""


class UndoGains(VehicleRequest, frozen=True, tag="undo-gains"):
    """Take back the last change of one gain, or (name "") all changes of all gains."""

    name: str = ""


class ChooseAirframe(VehicleRequest, frozen=True, tag="choose-airframe"):
    """Say what vehicles that are not armed are built as; takes effect at their next boot."""

    words: tuple[str, ...]
    """LABEL=VALUE each, or one VALUE where there is one number only; a value is a number or the name of a choice."""


class TestMotor(VehicleRequest, frozen=True, tag="test-motor"):
    """Turn one motor of a vehicle that is not armed; done when its time is over."""

    __test__ = False
    motor: int
    """The number of the motor, counted from 1."""
    throttle: float
    """The throttle as a share, 0 to 1."""
    seconds: float
    props_removed: bool = False
    """The operator confirms that the propellers are off."""


class PointGimbal(VehicleRequest, frozen=True, tag="point-gimbal"):
    """Point the gimbals of vehicles, taking control of them."""

    pitch_deg: float
    """Degrees of pitch, up is positive."""
    yaw_deg: float
    to_north: bool = False
    """Yaw is counted from north and kept, instead of from the nose."""


class ReleaseGimbal(VehicleRequest, frozen=True, tag="release-gimbal"):
    """Give control of the gimbals of vehicles back."""


class UseCamera(VehicleRequest, frozen=True, tag="use-camera"):
    """Take one picture, or start or stop a video."""

    act: Literal["photo", "start", "stop"]


class LookAt(VehicleRequest, frozen=True, tag="look-at"):
    """Keep cameras (or noses) on a place."""

    lat_deg: float
    lon_deg: float
    alt_m: float
    above: Literal["home", "sea"] = "sea"
    """What the height is counted from: each vehicle's own home, or mean sea level."""


class LookAhead(VehicleRequest, frozen=True, tag="look-ahead"):
    """No place to look at any more."""


class SetCurrentItem(VehicleRequest, frozen=True, tag="set-current-item"):
    """Go on with another item of the mission on board."""

    item: int
    """The item, counted from 1."""
    sure: bool = False
    """Though it is in the air: it flies there, if it flies its mission."""
    meet: bool = False
    """Though its way from there on comes too close to other vehicles."""


class ConfirmStep(Request, frozen=True, tag="confirm-step"):
    """Report that the operator has done what the prompt of a task asks for."""

    number: int


Look = GetSetup | GetCalibrations | GetAirframes | GetTraffic | GetRemoteIds | GetPayloads
Fetch = ReadSetup | ReadGains | ReadAirframe | HearTraffic | AskPayloads
SetUp = Calibrate | CancelCalibration | UndoRadio | SetGain | UndoGains | ChooseAirframe | TestMotor
Carry = PointGimbal | ReleaseGimbal | UseCamera | LookAt | LookAhead | SetCurrentItem
Change = SetUp | Carry
