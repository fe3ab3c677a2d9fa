"""The operator's part of Remote ID: what is sent, to which vehicles, how often, and that an ArduPilot arms with it."""

import itertools
from pathlib import Path

import msgspec
import pytest

from sitl.ardupilot.remote_id import OLD_US
from tests.core.rigs.rig import Rig, scenario, toml
from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.protocol.common import Start
from tui_gcs.core.records.rehearsal_store import plan_digest
from tui_gcs.core.scenario.load import ScenarioError, parse
from tui_gcs.core.scenario.model import OperatorId

SERIAL = "1596A1234567890ABCD"
OPERATOR = OperatorId("FIN87astrdge12k8", 52.0725, -0.6275, 158.5, "survey of two fields", {1: SERIAL})
SYSTEM, BASIC_ID = "OPEN_DRONE_ID_SYSTEM", "OPEN_DRONE_ID_BASIC_ID"
FOR_ALL_OF_IT = {"target_component": 0, "id_or_mac": (0,) * 20}


def told(tmp_path: Path, operator: OperatorId | None, vehicles: int = 2) -> Rig:
    """A station of that operator and its simulated vehicles, 10 s after the first was heard."""
    return Rig(msgspec.structs.replace(scenario(vehicles), remote_id=operator), toml(), tmp_path).run(12.0)


def test_every_vehicle_gets_the_place_of_the_operator_once_a_second(tmp_path: Path) -> None:
    rig = told(tmp_path, OPERATOR)
    for vehicle in rig.ids:
        sent = [(t, fields) for t, fields in rig.sent_to(vehicle, SYSTEM) if t > 2.0]
        gaps = {round(later - t, 2) for (t, _), (later, _) in itertools.pairwise(sent)}
        assert len(sent) >= 9 and gaps == {1.0}
        fields = sent[-1][1]
        assert (fields["operator_latitude"], fields["operator_longitude"]) == (520_725_000, -6_275_000)
        assert (fields["operator_altitude_geo"], fields["operator_location_type"]) == (158.5, 2)
        assert FOR_ALL_OF_IT.items() <= fields.items()


def test_its_seconds_count_from_2019(tmp_path: Path) -> None:
    rig = told(tmp_path, OPERATOR, 1)
    t, fields = rig.sent_to(1, SYSTEM)[-1]
    assert fields["timestamp"] + 1_546_300_800 == int(rig.clock.wall() - (rig.clock.now() - t))


def test_ids_are_sent_every_three_seconds_and_serial_numbers_to_their_own_vehicle(tmp_path: Path) -> None:
    rig = told(tmp_path, OPERATOR)
    assert [f["operator_id"] for _, f in rig.sent_to(2, "OPEN_DRONE_ID_OPERATOR_ID")] == ["FIN87astrdge12k8"] * 4
    assert [f["description"] for _, f in rig.sent_to(2, "OPEN_DRONE_ID_SELF_ID")] == ["survey of two fields"] * 4
    own = [(bytes(f["uas_id"]).rstrip(b"\0"), f["id_type"], f["ua_type"]) for _, f in rig.sent_to(1, BASIC_ID)]
    assert own == [(SERIAL.encode(), 1, 2)] * 4
    assert not rig.sent_to(2, BASIC_ID)


def test_nothing_is_sent_that_is_not_configured(tmp_path: Path) -> None:
    assert not [name for _, _, name, _ in told(tmp_path, None).sent if "DRONE_ID" in name]
    rig = told(tmp_path, OperatorId(lat_deg=52.0725, lon_deg=-0.6275), 1)
    assert {name for _, _, name, _ in rig.sent if "DRONE_ID" in name} == {SYSTEM}
    assert rig.sent_to(1, SYSTEM)[-1][1]["operator_altitude_geo"] == -1000.0, "unknown"


def test_an_operator_without_a_place_is_warned_of_and_has_none_made_up(tmp_path: Path) -> None:
    rig = told(tmp_path, OperatorId("FIN87astrdge12k8"), 1)
    assert not rig.sent_to(1, SYSTEM) and rig.sent_to(1, "OPEN_DRONE_ID_OPERATOR_ID")
    assert any("NO PLACE of the operator is known" in text for text in rig.texts())


def test_a_vehicle_of_no_team_does_not_get_the_operator(tmp_path: Path) -> None:
    """Another operator's vehicle may be on the same link."""
    rig = ServiceRig(tmp_path, Peer(1), Peer(9)).heard()
    rig.station.active.set_scenario(msgspec.structs.replace(rig.station.active.scenario, remote_id=OPERATOR), toml())
    rig.run(5.0)
    assert len(rig.peers[1].got(SYSTEM)) >= 5 and not rig.peers[9].got(SYSTEM)


def test_an_applied_scenario_moves_the_operator_at_once_and_reports_it(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1)).heard()
    for lat_deg in (52.0725, 52.0730):
        moved = msgspec.structs.replace(OPERATOR, lat_deg=lat_deg)
        rig.station.active.set_scenario(msgspec.structs.replace(rig.station.active.scenario, remote_id=moved), toml())
        rig.run(1.2)
        assert rig.peers[1].got(SYSTEM)[-1]["operator_latitude"] == round(lat_deg * 1e7)
    assert rig.texts("station").count("Remote ID: operator FIN87astrdge12k8 stands at 52.07300, -0.62750") == 1
    rig.station.active.set_scenario(msgspec.structs.replace(rig.station.active.scenario, remote_id=None), toml())
    before = len(rig.peers[1].got(SYSTEM))
    rig.run(5.0)
    assert len(rig.peers[1].got(SYSTEM)) == before
    assert "Remote ID: nothing of the operator is sent any more" in rig.texts("station")


def test_the_command_lines_place_goes_before_the_scenarios_and_leaves_the_ids(tmp_path: Path) -> None:
    rig = ServiceRig(tmp_path, Peer(1))
    rig.station.config.operator_at = OperatorId(lat_deg=51.5, lon_deg=-0.5)
    assert rig.station.active.operator() == rig.station.config.operator_at
    rig.station.active.scenario = msgspec.structs.replace(rig.station.active.scenario, remote_id=OPERATOR)
    operator = rig.station.active.operator()
    assert operator is not None and (operator.lat_deg, operator.alt_m) == (51.5, None)
    assert (operator.operator_id, operator.uas_ids) == (OPERATOR.operator_id, OPERATOR.uas_ids)


def test_a_plan_stays_rehearsed_when_the_operator_moves() -> None:
    plan = scenario(1)
    assert plan_digest(msgspec.structs.replace(plan, remote_id=OPERATOR), {}) == plan_digest(plan, {})


# ---------------------------------------------------------------- an ArduPilot that wants it


def wanting(tmp_path: Path, operator: OperatorId | None) -> Rig:
    """A simulated ArduCopter with DID_OPTIONS 1 and a transmitter."""
    rig = Rig(msgspec.structs.replace(scenario(1), remote_id=operator), toml(), tmp_path)
    for name, value in {"DID_ENABLE": 1, "DID_OPTIONS": 1, "DID_MAVPORT": 1}.items():
        rig.sim._pilots[0].platform.params.set(name, value)
    rig.sim._pilots[0].restart(0)
    return rig.ready().run(6.0)


def test_an_ardupilot_that_enforces_it_starts_with_it(tmp_path: Path) -> None:
    rig = wanting(tmp_path, OPERATOR)
    assert not rig.station.frontend.readiness.why_not_start(1)
    assert rig.station.services.remote_id.of(rig.station.picture.fleet.vehicles[1]).may_arm  # type: ignore[union-attr]
    rig.flying()
    assert rig.place(1)[2] > 5.0


@pytest.mark.parametrize(
    ("operator", "why"),
    [
        (None, "UA_TYPE required in BasicID"),
        (OperatorId(uas_ids={1: SERIAL}), "operator location must be set"),
        (msgspec.structs.replace(OPERATOR, uas_ids={}), "UA_TYPE required in BasicID"),
    ],
)
def test_without_it_the_start_is_refused_with_what_is_missing(
    tmp_path: Path, operator: OperatorId | None, why: str
) -> None:
    rig = wanting(tmp_path, operator)
    rig.run(30.0)
    reply = rig.ask(Start(vehicles=(1,)))
    assert not reply.ok
    assert any(f"OpenDroneID: {why}" in text for text in rig.texts("vehicle 1"))


def test_an_ardupilot_whose_station_falls_silent_does_not_arm(tmp_path: Path) -> None:
    rig = wanting(tmp_path, OPERATOR)
    rig.loses = lambda way, index: way == "down"
    rig.run(OLD_US / 1e6 + 0.2)
    assert "OpenDroneID: SYSTEM not available" in rig.sim._pilots[0].arming.problems()
    rig.run(3.0)
    assert "ODID: lost operator location" in rig.texts("vehicle 1")


# ---------------------------------------------------------------- the scenario's table


def written(*lines: str) -> str:
    return toml() + "\n[remote_id]\n" + "\n".join(lines) + "\n"


def test_a_scenario_configures_all_of_it() -> None:
    text = written(
        'operator_id = "FIN87astrdge12k8"',
        "operator_deg = [52.0725, -0.6275]",
        "operator_alt_m = 158.5",
        'description = "survey of two fields"',
        f'uas_ids = {{ 1 = "{SERIAL}" }}',
    )
    assert parse(text).remote_id == OPERATOR
    assert parse(toml()).remote_id is None


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ('operator_id = "FIN87astrdge12k8-xyz"', "its last three characters are secret"),
        ('operator_id = "FIN87astrdge12k8 and more"', "1 to 20 printable characters"),
        ('operator_id = "FIN87ästrdge"', "must be ASCII"),
        ("operator_deg = [0, 0]", "no place on the globe"),
        ("operator_deg = [52.0725, 190.0]", "no place on the globe"),
        ("operator_deg = [-0.6275, 52.0725]", "more than 20 km from the scenario's origin"),
        ("operator_alt_m = 150", "is given without a place"),
        ("operator_alt_m = -1000", "out of range"),
        ('uas_ids = { 0 = "15" }', "not a vehicle's number"),
        ('uas_ids = { 1 = "two words" }', "no serial number"),
        ("place = 1", "unknown key"),
    ],
)
def test_a_mistake_in_it_is_one_line(line: str, problem: str) -> None:
    with pytest.raises(ScenarioError) as error:
        parse(written(line), "mine.toml")
    (reported,) = error.value.problems
    assert reported.startswith("mine.toml: remote_id") and problem in reported
