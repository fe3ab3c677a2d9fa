"""Cameras and gimbals: found, pointed, triggered once, whatever component answers."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.service_rig import GCS, Fields, Peer, ServiceRig
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.services.payload.camera_control import UNSEEN_PICTURE
from tui_gcs.core.services.payload.devices import MAX_DEVICES
from tui_gcs.core.services.payload.gimbal_control import UNSEEN_GIMBAL
from tui_gcs.core.services.payload.gimbal_state import angles_deg
from tui_gcs.core.services.payload.payload import PayloadService
from tui_gcs.core.uplink.actions import Outcome

CAMERA, GIMBAL = 100, 154
INFORMATION: dict[str, Any] = {
    "time_boot_ms": 0,
    "vendor_name": list(b"ACME\x1b[2J".ljust(32, b"x")),
    "model_name": list(b"One".ljust(32, b"\0")),
    "firmware_version": 0,
    "focal_length": 0.0,
    "sensor_size_h": 0.0,
    "sensor_size_v": 0.0,
    "resolution_h": 0,
    "resolution_v": 0,
    "lens_id": 0,
    "flags": 0,
    "cam_definition_version": 0,
    "cam_definition_uri": b"http://169.254.169.254/x",
}


class Carrier(Peer):
    """A vehicle whose autopilot takes orders, and whose devices speak when the test lets them."""

    def __init__(self, results: dict[int, int] | None = None) -> None:
        super().__init__(1, armed=True)
        self.results = results or {}
        self.answers = {"COMMAND_LONG": Carrier.order, "COMMAND_INT": Carrier.order}

    def order(self, fields: Fields) -> None:
        result = self.results.get(fields["command"], 0)
        if fields["target_component"] == 1:
            self.ack(fields["command"], result)
        elif fields["command"] != 512:
            self.device(fields["target_component"], "COMMAND_ACK", command=fields["command"], result=result, **TO_US)

    def device(self, component: int, name: str, **fields: Any) -> None:
        self.out.append(Encoder(1, component).encode(name, **fields))

    def beat(self, component: int, kind: int) -> None:
        self.device(
            component,
            "HEARTBEAT",
            type=kind,
            autopilot=8,
            base_mode=0,
            custom_mode=0,
            system_status=4,
            mavlink_version=3,
        )

    def orders(self, command: int, name: str = "COMMAND_LONG") -> list[Fields]:
        return [fields for fields in self.got(name) if fields["command"] == command]


ATTITUDE = {"target_system": 0, "target_component": 0, "time_boot_ms": 0, "failure_flags": 0} | {
    f"angular_velocity_{axis}": 0.0 for axis in "xyz"
}
FEEDBACK = dict.fromkeys(("lat", "lng", "flags"), 0) | dict.fromkeys(
    ("alt_msl", "alt_rel", "roll", "pitch", "yaw", "foc_len"), 0.0
)
TO_US = {"target_system": GCS, "target_component": 190}


def carrying(
    tmp_path: Path, *devices: tuple[int, int], results: dict[int, int] | None = None
) -> tuple[ServiceRig, Carrier]:
    peer = Carrier(results)
    rig = ServiceRig(tmp_path, peer).heard()
    for component, kind in devices:
        peer.beat(component, kind)
    rig.run(0.3)
    return rig, peer


def payload(rig: ServiceRig) -> PayloadService:
    found: PayloadService = rig.station.services.payload
    return found


def ended(rig: ServiceRig) -> tuple[list[Outcome], Any]:
    outcomes: list[Outcome] = []
    return outcomes, lambda outcome, why: outcomes.append(outcome)


def test_a_camera_is_found_named_and_its_address_never_fetched(tmp_path: Path) -> None:
    """B.6-94, B.6-96: the maker's name has no NUL."""
    rig, peer = carrying(tmp_path, (CAMERA, 30))
    peer.beat(CAMERA, 30)
    rig.run(0.2)
    (asked,) = [f for f in peer.orders(512) if f["param1"] == 259]
    assert asked["target_component"] == CAMERA
    peer.device(CAMERA, "CAMERA_INFORMATION", **INFORMATION)
    sent = len(peer.heard)
    rig.run(0.5)
    (camera,) = payload(rig).devices.cameras(rig.vehicle())
    assert camera.name == "ACME␛[2J" + "x" * 24 + " One"
    assert payload(rig).ignored["address of a camera's definition, never fetched"] == 1
    assert all(name in ("COMMAND_LONG", "TIMESYNC") for _, name, _ in peer.heard[sent:])


def test_a_picture_is_ordered_of_the_camera_and_its_ack_counts(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path, (CAMERA, 30))
    outcomes, done = ended(rig)
    payload(rig).camera.trigger(rig.vehicle(), done)
    payload(rig).camera.trigger(rig.vehicle(), done)
    rig.run(3.0)
    orders = peer.orders(2000)
    assert {f["target_component"] for f in orders} == {CAMERA}
    assert Outcome.CONFIRMED in outcomes
    numbers = [f["param4"] for f in orders]
    assert numbers == sorted(numbers) and set(numbers) <= {1.0, 2.0}, "a copy has the number of its order"


def test_a_picture_is_reported_or_its_absence_is(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path)
    words = said(rig, lambda done: payload(rig).camera.trigger(rig.vehicle(), done), 4.0)
    assert words == (Outcome.CONFIRMED, UNSEEN_PICTURE)
    take = peer.answers["COMMAND_LONG"]

    def pictured(peer: Peer, fields: Fields) -> None:
        take(peer, fields)
        if fields["command"] == 2000:
            peer.say("CAMERA_FEEDBACK", time_usec=1, target_system=0, cam_idx=0, img_idx=1, **FEEDBACK)

    peer.answers["COMMAND_LONG"] = pictured
    words = said(rig, lambda done: payload(rig).camera.trigger(rig.vehicle(), done), 1.0)
    assert words == (Outcome.CONFIRMED, "the camera reported the picture")


def test_an_autopilot_gets_one_order_because_it_takes_a_picture_for_each_copy(tmp_path: Path) -> None:
    """ArduPilot does not look at the number of the picture."""
    rig, peer = carrying(tmp_path)
    peer.answers = {}
    words = said(rig, lambda done: payload(rig).camera.trigger(rig.vehicle(), done), 8.0)
    assert len(peer.orders(2000)) == 1 and words[0] is Outcome.EXPIRED


def test_copies_of_one_order_take_one_picture(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path, (CAMERA, 30))
    peer.answers = {}
    outcomes, done = ended(rig)
    payload(rig).camera.trigger(rig.vehicle(), done)
    rig.run(8.0)
    assert [f["param4"] for f in peer.orders(2000)] == [1.0] * 3
    assert outcomes == [Outcome.EXPIRED]


def said(rig: ServiceRig, order: Callable[[Any], None], seconds: float) -> tuple[Outcome, str]:
    """How an order ended, and what was seen of it."""
    found: list[tuple[Outcome, str]] = []
    order(lambda outcome, why: found.append((outcome, why)))
    rig.run(seconds)
    (one,) = found
    return one


def tells_angles(peer: Carrier, pitch_deg: float, yaw_deg: float, flags: int) -> None:
    """From now on it reports its angles when they are requested."""
    take, pitch, yaw = peer.answers["COMMAND_LONG"], math.radians(pitch_deg) / 2, math.radians(yaw_deg) / 2
    q = [
        math.cos(pitch) * math.cos(yaw),
        -math.sin(pitch) * math.sin(yaw),
        math.sin(pitch) * math.cos(yaw),
        math.cos(pitch) * math.sin(yaw),
    ]

    def told(peer: Peer, fields: Fields) -> None:
        take(peer, fields)
        if fields["command"] == 512 and fields["param1"] == 285:
            peer.say("GIMBAL_DEVICE_ATTITUDE_STATUS", flags=flags, q=q, **ATTITUDE)

    peer.answers["COMMAND_LONG"] = told


def test_an_autopilot_without_the_command_gets_the_old_one_once(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path, results={2000: 3})
    outcomes, done = ended(rig)
    payload(rig).camera.trigger(rig.vehicle(), done)
    rig.run(3.0)
    assert [f["param5"] for f in peer.orders(203)] == [1.0]
    assert outcomes == [Outcome.CONFIRMED]


def test_the_old_way_is_never_repeated(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path, results={2000: 3})
    take, peer.answers = peer.answers["COMMAND_LONG"], {}
    peer.answers["COMMAND_LONG"] = lambda p, f: None if f["command"] == 203 else take(p, f)
    payload(rig).camera.trigger(rig.vehicle())
    rig.run(10.0)
    assert len(peer.orders(203)) == 1, "each copy would be a picture"


def test_pointing_takes_control_first_and_only_once(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path, (GIMBAL, 26))
    outcomes, done = ended(rig)
    payload(rig).gimbal.point(rig.vehicle(), -45, 90, to_north=True, on_done=done)
    rig.run(5.0)
    payload(rig).gimbal.point(rig.vehicle(), -30, 0, on_done=done)
    rig.run(5.0)
    (control,) = peer.orders(1001)
    assert (control["param1"], control["param2"], control["target_component"]) == (GCS, 190, GIMBAL)
    first, second = peer.orders(1000)
    assert (first["param1"], first["param2"], first["param5"]) == (-45.0, 90.0, 28.0) and math.isnan(first["param3"])
    assert (second["param1"], second["param5"]) == (-30.0, 12.0)
    assert outcomes == [Outcome.CONFIRMED] * 2
    payload(rig).gimbal.release(rig.vehicle())
    rig.run(1.0)
    assert [f["param1"] for f in peer.orders(1001)] == [GCS, -3.0]


@pytest.mark.parametrize(
    ("asked", "stands", "flags", "outcome", "words"),
    [
        ((-30, 20, False), (-30, 20), 44, Outcome.CONFIRMED, "it is at pitch -30, yaw 20 from the nose"),
        ((80, 0, False), (20, 0), 44, Outcome.NOT_CONFIRMED, "it is at pitch 20, yaw 0 from the nose"),
        ((-30, 20, True), (-30, 20), 60, Outcome.CONFIRMED, "it is at pitch -30, yaw 20 from the nose"),
        ((-30, 20, True), (-30, 20), 28, Outcome.CONFIRMED, "it is at pitch -30, yaw 20 from north"),
        ((-30, 20, False), (-30, 90), 12, Outcome.NOT_CONFIRMED, "it is at pitch -30, yaw 90 from the nose"),
    ],
)
def test_the_reported_angles_count_not_the_ack(
    tmp_path: Path,
    asked: tuple[float, float, bool],
    stands: tuple[float, float],
    flags: int,
    outcome: Outcome,
    words: str,
) -> None:
    """Flags as ArduPilot (44, 60) and PX4 (12, 28) set them; 80° were accepted of one that ends at 20°."""
    rig, peer = carrying(tmp_path)
    assert rig.vehicle().telemetry.heading_deg == 0.0
    tells_angles(peer, *stands, flags)
    pitch, yaw, to_north = asked
    found = said(
        rig, lambda done: payload(rig).gimbal.point(rig.vehicle(), pitch, yaw, to_north=to_north, on_done=done), 6.0
    )
    assert found == (outcome, words)


def test_a_gimbal_without_angles_is_not_reported_as_turned(tmp_path: Path) -> None:
    rig, _ = carrying(tmp_path)
    found = said(rig, lambda done: payload(rig).gimbal.point(rig.vehicle(), -30, 20, on_done=done), 6.0)
    assert found == (Outcome.CONFIRMED, UNSEEN_GIMBAL)


def test_what_an_autopilot_carries_itself_is_found_when_it_is_asked(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path)
    tells_angles(peer, -30, 20, 44)
    assert not payload(rig).devices.gimbals(rig.vehicle())
    said(rig, lambda done: payload(rig).ask(rig.vehicle(), done), 2.0)
    (gimbal,) = payload(rig).devices.gimbals(rig.vehicle())
    assert gimbal.component == 1 and gimbal.text() == "pitch -30, yaw 20 from the nose"


def test_after_a_reboot_only_devices_that_speak_for_themselves_are_known(tmp_path: Path) -> None:
    """A PX4 that had lost its gimbal at a reboot was still shown with one."""
    rig, peer = carrying(tmp_path, (CAMERA, 30))
    tells_angles(peer, -30, 20, 44)
    said(rig, lambda done: payload(rig).ask(rig.vehicle(), done), 2.0)
    payload(rig).devices._on_reboot(rig.vehicle())
    assert not payload(rig).devices.gimbals(rig.vehicle())
    assert [camera.component for camera in payload(rig).devices.cameras(rig.vehicle())] == [CAMERA]


def test_control_that_another_station_took_is_requested_again(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path, (GIMBAL, 26))
    payload(rig).gimbal.point(rig.vehicle(), -45, 90)
    rig.run(1.0)
    status = {"time_boot_ms": 0, "flags": 0, "gimbal_device_id": GIMBAL}
    owners = {f"{which}_control_{what}": 7 for which in ("primary", "secondary") for what in ("sysid", "compid")}
    peer.device(GIMBAL, "GIMBAL_MANAGER_STATUS", **status, **owners)
    rig.run(0.2)
    assert payload(rig).devices.gimbals(rig.vehicle())[0].controlled_by == 7
    payload(rig).gimbal.point(rig.vehicle(), -45, 90)
    rig.run(1.0)
    assert len(peer.orders(1001)) == 2


@pytest.mark.parametrize(("pitch", "yaw"), [(91, 0), (math.nan, 0), (0, math.inf), (0, 400)])
def test_impossible_angles_are_refused_here(tmp_path: Path, pitch: float, yaw: float) -> None:
    rig, peer = carrying(tmp_path)
    outcomes, done = ended(rig)
    payload(rig).gimbal.point(rig.vehicle(), pitch, yaw, on_done=done)
    rig.run(1.0)
    assert outcomes == [Outcome.REFUSED] and not peer.orders(1000) and not peer.orders(1001)


def test_a_region_of_interest_is_above_sea_level(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path)
    outcomes, done = ended(rig)
    payload(rig).gimbal.look_at(rig.vehicle(), 47.3977, 8.5456, 500.0, done)
    rig.run(1.0)
    (order,) = peer.orders(195, "COMMAND_INT")
    assert (order["frame"], order["x"], order["y"], order["z"]) == (0, 473_977_000, 85_456_000, 500.0)
    payload(rig).gimbal.look_ahead(rig.vehicle(), done)
    rig.run(1.0)
    assert len(peer.orders(197)) == 1 and outcomes == [Outcome.CONFIRMED] * 2
    payload(rig).gimbal.look_at(rig.vehicle(), 91.0, 0.0, 0.0, done)
    assert outcomes[-1] is Outcome.REFUSED


def test_a_device_may_not_answer_for_the_autopilot(tmp_path: Path) -> None:
    """A camera's ACK of an ARM does not count, nor a strange component's ACK of a picture."""
    rig, peer = carrying(tmp_path, (CAMERA, 30))
    peer.device(CAMERA, "COMMAND_ACK", command=400, result=0, **TO_US)
    peer.device(77, "COMMAND_ACK", command=2000, result=0, **TO_US)
    rig.run(0.2)
    assert payload(rig).ignored["ack of a component for what is not its business"] == 2
    assert not rig.station.comms.commands.ignored


def test_pictures_are_counted_and_attitudes_judged(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path, (CAMERA, 30), (GIMBAL, 26))
    half = math.sqrt(0.5)
    assert angles_deg((half, 0.0, -half, 0.0))[1] == pytest.approx(-90.0)
    for q in ((0.0, 0.0, 0.0, 0.0), (math.nan,) * 4, (1e30, 0.0, 0.0, 0.0)):
        assert all(math.isnan(angle) for angle in angles_deg(q))
    shot = {"time_boot_ms": 0, "time_utc": 0, "camera_id": 0, "lat": 0, "lon": 0, "alt": 0, "relative_alt": 0}
    for result in (1, 0, -1):
        peer.device(
            CAMERA, "CAMERA_IMAGE_CAPTURED", **shot, q=[1, 0, 0, 0], image_index=1, capture_result=result, file_url=b""
        )
    rig.run(0.2)
    assert payload(rig).devices.cameras(rig.vehicle())[0].images == 1


def test_too_many_devices_are_counted(tmp_path: Path) -> None:
    rig, _ = carrying(tmp_path, *[(component, 30) for component in range(100, 100 + MAX_DEVICES + 3)])
    assert len(payload(rig).devices.cameras(rig.vehicle())) == MAX_DEVICES
    assert payload(rig).ignored["too many cameras"] == 3


def test_whether_something_showed_is_known_once_it_was_asked_and_anew_after_a_reboot(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path, (GIMBAL, 26))
    found = payload(rig)
    assert (found.devices.has_camera(rig.vehicle()), found.devices.has_gimbal(rig.vehicle())) == (None, True)
    outcomes, done = ended(rig)
    found.ask(rig.vehicle(), done)
    rig.run(1.5)
    assert outcomes == [Outcome.CONFIRMED]
    assert (found.devices.has_camera(rig.vehicle()), found.devices.has_gimbal(rig.vehicle())) == (False, True)
    frame = rig.station.publisher.frame()
    assert (frame.camera, frame.gimbal) == ((False,), (True,))
    peer.device(CAMERA, "CAMERA_INFORMATION", **INFORMATION)
    rig.run(0.2)
    assert found.devices.has_camera(rig.vehicle()) is True, "it may tell later, or of its first picture"
    found.devices._on_reboot(rig.vehicle())
    assert found.devices.has_camera(rig.vehicle()) is True, "a camera of its own address has not rebooted"


def test_who_is_not_heard_while_it_is_asked_shows_nothing(tmp_path: Path) -> None:
    rig, peer = carrying(tmp_path)
    outcomes, done = ended(rig)
    rig.station.services.payload.ask(rig.vehicle(), done)
    peer.silent = True
    rig.run(6.0)
    assert payload(rig).devices.has_camera(rig.vehicle()) is None and outcomes != [Outcome.CONFIRMED]
