"""PX4 in Hold may be on its way to a place: then to hold means to be sent to where it comes to rest."""

import math
from pathlib import Path

from tests.core.rigs.service_rig import PX4, Peer, ServiceRig

HOLD, RTL = 4 << 16 | 3 << 24, 4 << 16 | 5 << 24
SET_MODE, REPOSITION = 176, 192
KEEP = 0x7FFFFFFF


def flying(tmp_path: Path, **telemetry: int) -> ServiceRig:
    peer = Peer(1, autopilot=PX4, armed=True, alt_rel_mm=20_000, **telemetry)
    rig = ServiceRig(tmp_path, peer).heard()
    v = rig.vehicle()
    steering = rig.station.flight.steering
    rig.station.comms.commands.submit(rig.station.comms.firmware.of(v).hold(v, lambda: steering.stop_place(v)))
    return rig.run(1.0)


def told(rig: ServiceRig) -> list[int]:
    heard = [f for name in ("COMMAND_LONG", "COMMAND_INT") for f in rig.peers[1].got(name)]
    return [f["command"] for f in heard if f["command"] in (SET_MODE, REPOSITION)]


def test_it_is_sent_to_where_it_comes_to_rest(tmp_path: Path) -> None:
    rig = flying(tmp_path, custom_mode=HOLD, north_cm_s=800)
    assert {SET_MODE, REPOSITION} <= set(told(rig))
    order = next(f for f in rig.peers[1].got("COMMAND_INT") if f["command"] == REPOSITION)
    stop_way_m = (order["x"] - 473_978_000) * 1e-7 * 111_319.5
    assert math.isclose(stop_way_m, 8.0**2 / (2 * 2.5), abs_tol=1.5)
    assert order["z"] == 508.0, "above mean sea level, at the height it has"
    assert order["param2"] == 1.0


def test_out_of_another_mode_the_mode_is_enough(tmp_path: Path) -> None:
    rig = flying(tmp_path, custom_mode=RTL, north_cm_s=800)
    assert set(told(rig)) == {SET_MODE}


def test_standing_in_hold_nothing_is_moved(tmp_path: Path) -> None:
    rig = flying(tmp_path, custom_mode=HOLD)
    assert set(told(rig)) == {SET_MODE}
