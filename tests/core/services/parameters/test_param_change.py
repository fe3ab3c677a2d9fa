"""Several parameters that belong together: all are there before one is set, but for those a vehicle may not have."""

from pathlib import Path

from tests.core.rigs.param_peer import INT8, ParamServer
from tests.core.rigs.service_rig import Peer, ServiceRig
from tui_gcs.core.services.parameters.param_change import ParamChange


def make(tmp_path: Path) -> tuple[ServiceRig, ParamServer]:
    peer = Peer(1)
    server = ParamServer(peer, {"ONE": (INT8, 1), "TWO": (INT8, 2)})
    return ServiceRig(tmp_path, peer).heard(), server


def changed(rig: ServiceRig, change: ParamChange) -> ParamChange:
    change.run(rig.station.services.params)
    rig.until(lambda: change.over, 30.0)
    return change


def test_where_one_is_missing_none_is_set(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    change = changed(rig, ParamChange(1, {"ONE": 5, "THREE": 3}))
    assert change.error.startswith("THREE: ") and change.changed == []
    assert server.params["ONE"][1] == 1


def test_what_it_may_not_have_is_left_out(tmp_path: Path) -> None:
    rig, server = make(tmp_path)
    change = changed(rig, ParamChange(1, {"ONE": 5, "THREE": 3, "TWO": 2}, optional=frozenset({"THREE"})))
    assert (change.error, change.changed) == ("", ["ONE"]), "TWO had its value"
    assert server.params["ONE"][1] == 5 and change.before == {"ONE": 1, "TWO": 2}
