"""Remote ID: what a transmitter sends about its vehicle and about others, and whether it allows arming."""

import math
from pathlib import Path
from typing import Any

import pytest

from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.services.payload.remote_id import MAX_OTHERS, OLD_S, RemoteIdService

TRANSMITTER = 236
NOBODY = [0] * 20
LOCATION: dict[str, Any] = {
    "status": 2,
    "direction": 9000,
    "speed_horizontal": 1250,
    "speed_vertical": 0,
    "latitude": 473_977_000,
    "longitude": 85_456_000,
    "altitude_barometric": 480.0,
    "altitude_geodetic": 535.0,
    "height_reference": 0,
    "height": 20.0,
    "horizontal_accuracy": 10,
    "vertical_accuracy": 4,
    "barometer_accuracy": 4,
    "speed_accuracy": 3,
    "timestamp": 100.0,
    "timestamp_accuracy": 1,
}


@pytest.fixture
def rig(tmp_path: Path) -> ServiceRig:
    return ServiceRig(tmp_path, Peer(1)).heard()


def said(rig: ServiceRig, name: str, *, component: int = TRANSMITTER, **fields: Any) -> None:
    if name != "OPEN_DRONE_ID_ARM_STATUS":
        fields |= {"target_system": 0, "target_component": 0, "id_or_mac": NOBODY}
    rig.peers[1].out.append(Encoder(1, component).encode(name, **fields))
    rig.run(0.1)


def service(rig: ServiceRig) -> RemoteIdService:
    found: RemoteIdService = rig.station.services.remote_id
    return found


@pytest.mark.parametrize("component", [1, 236, 238])
def test_what_a_transmitter_sends_about_its_vehicle(rig: ServiceRig, component: int) -> None:
    """It is the autopilot itself or a component of its own."""
    serial = list(b"1596A1234567890ABCD".ljust(20, b"\0"))
    said(rig, "OPEN_DRONE_ID_BASIC_ID", component=component, id_type=1, ua_type=2, uas_id=serial)
    said(rig, "OPEN_DRONE_ID_LOCATION", component=component, **LOCATION)
    said(rig, "OPEN_DRONE_ID_OPERATOR_ID", component=component, operator_id_type=0, operator_id=b"CHE87astrdge12k8")
    own = service(rig).of(rig.vehicle())
    assert own is not None and own.component == component
    assert (own.uas_id, own.operator_id) == ("1596A1234567890ABCD", "CHE87astrdge12k8")
    assert own.alt_m == 535.0


def test_px4s_empty_messages_are_unknown_not_zero(rig: ServiceRig) -> None:
    """Measured: id all zero, no ARM_STATUS."""
    empty = {"latitude": 0, "longitude": 0, "altitude_geodetic": -1000.0, "direction": 36100, "speed_horizontal": 25500}
    said(rig, "OPEN_DRONE_ID_LOCATION", component=1, **(LOCATION | empty))
    own = service(rig).of(rig.vehicle())
    assert own is not None and own.uas_id == "" and own.may_arm is None
    assert all(math.isnan(v) for v in (own.lat_deg, own.alt_m))
    assert service(rig).why_not_arm(rig.vehicle()) == ""


def test_an_id_that_is_no_text_is_shown_as_hex(rig: ServiceRig) -> None:
    said(rig, "OPEN_DRONE_ID_BASIC_ID", id_type=4, ua_type=2, uas_id=[0x1B, 0x5B, 0x32, 0x4A] + [0] * 16)
    own = service(rig).of(rig.vehicle())
    assert own is not None and own.uas_id == "1b5b324a"


def test_a_transmitter_that_forbids_arming_is_reported_and_makes_the_vehicle_unready(rig: ServiceRig) -> None:
    for _ in range(3):
        said(rig, "OPEN_DRONE_ID_ARM_STATUS", status=1, error=b"missing operator \x1b[2Jlocation")
    why = "Remote ID: missing operator ␛[2Jlocation"
    assert service(rig).why_not_arm(rig.vehicle()) == why
    assert rig.texts("vehicle 1").count(why) == 1
    assert why in [problem.text for problem in rig.station.services.health.of(rig.vehicle()).problems]
    said(rig, "OPEN_DRONE_ID_ARM_STATUS", status=0, error=b"")
    assert service(rig).why_not_arm(rig.vehicle()) == ""
    assert rig.texts("vehicle 1")[-1] == "Remote ID: ready"


def test_others_are_not_mixed_with_the_vehicle_and_are_bounded(rig: ServiceRig) -> None:
    for number in range(MAX_OTHERS + 20):
        address = [number % 256, number // 256 + 1] + [0] * 18
        encoder = Encoder(1, TRANSMITTER)
        fields = LOCATION | {"target_system": 0, "target_component": 0, "id_or_mac": address}
        rig.peers[1].out.append(encoder.encode("OPEN_DRONE_ID_LOCATION", **fields))
    rig.run(0.2)
    assert len(service(rig).others()) == MAX_OTHERS and service(rig).dropped["Remote ID table full"] == 20
    assert service(rig).of(rig.vehicle()) is None
    rig.run(OLD_S)
    assert not service(rig).others()
