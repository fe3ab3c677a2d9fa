"""What 250 simulated vehicles in flight cost, at the rates a station asks of a good link, datagrams included."""

import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sitl.launch.fleet import SimFleet, VehicleSpec
from sitl.links.wire import LAYOUT_BY_NAME, Encoder
from tests.bench.row import NotMeasured, Row

N = 250
TICK_S = 0.05
MEASURED_S = 10.0
RATES_HZ: dict[str, float] = {
    "GLOBAL_POSITION_INT": 10,
    "ATTITUDE": 4,
    "VFR_HUD": 2,
    "EXTENDED_SYS_STATE": 2,
    "SYS_STATUS": 1,
    "GPS_RAW_INT": 1,
    "EKF_STATUS_REPORT": 1,
    "BATTERY_STATUS": 0.5,
}
GUIDED = 4


def sim(_: Path) -> Iterator[Row]:
    """Share of one core for each autopilot."""
    for autopilot in ("ardupilot", "px4"):
        share, per_s = _cost(autopilot)
        yield Row(f"{N} {autopilot} vehicles in flight, {per_s:.0f} frames/s: CPU", 100.0 * share, "%", 100.0)


def _cost(autopilot: Any) -> tuple[float, float]:
    """CPU seconds per simulated second, and datagrams per simulated second."""
    specs = [
        VehicleSpec(1 + k, 52.0 + 0.001 * (k // 16), -0.6 + 0.001 * (k % 16), 100.0, autopilot=autopilot)
        for k in range(N)
    ]
    fleet = SimFleet(specs)
    station = Encoder(254, 190)
    _run(fleet, 4.0)
    for k in range(N):
        _start(fleet, station, k)
    for _ in range(25):
        _beat(fleet, station)
        _run(fleet, 1.0)
    if not (fleet.armed.all() and (fleet.alt_rel_m > 5.0).all()):
        raise NotMeasured(f"{N - int(fleet.armed.sum())} of the {autopilot} vehicles do not fly")
    for k in range(N):
        _send_away(fleet, station, k)
    began_s, sent = time.process_time(), 0
    for _ in range(round(MEASURED_S)):
        _beat(fleet, station)
        sent += _run(fleet, 1.0)
    return (time.process_time() - began_s) / MEASURED_S, sent / MEASURED_S


def _run(fleet: SimFleet, seconds: float) -> int:
    """Datagrams sent meanwhile."""
    sent = 0
    for _ in range(round(seconds / TICK_S)):
        fleet.step(TICK_S)
        sent += len(fleet.drain())
    return sent


def _beat(fleet: SimFleet, station: Encoder) -> None:
    for k in range(N):
        fleet.receive(k, station.frame("HEARTBEAT", {"type": 6}))


def _command(fleet: SimFleet, station: Encoder, k: int, number: int, *p: float, form: str = "LONG") -> None:
    values = (*p, *(0.0,) * (7 - len(p)))
    fields: dict[str, Any] = {f"param{n + 1}": value for n, value in enumerate(values[: 7 if form == "LONG" else 4])}
    if form == "INT":
        fields |= {"x": int(values[4]), "y": int(values[5]), "z": values[6], "frame": 0}
    fields |= {"command": number, "target_system": fleet.specs[k].system_id}
    fleet.receive(k, station.frame(f"COMMAND_{form}", fields))


def _start(fleet: SimFleet, station: Encoder, k: int) -> None:
    """Rates, arming and take-off."""
    for name, hz in RATES_HZ.items():
        _command(fleet, station, k, 511, LAYOUT_BY_NAME[name].msgid, 1e6 / hz)
    if fleet.specs[k].autopilot == "ardupilot":
        _command(fleet, station, k, 176, 1, GUIDED)
        _command(fleet, station, k, 400, 1)
        _command(fleet, station, k, 22, 0, 0, 0, 0, 0, 0, 10.0)
    else:
        _command(fleet, station, k, 400, 1)
        _command(fleet, station, k, 22, 0, 0, 0, math.nan, math.nan, math.nan, 110.0)


def _send_away(fleet: SimFleet, station: Encoder, k: int) -> None:
    """A kilometre to the north."""
    spec = fleet.specs[k]
    lat, lon = round((spec.lat_deg + 0.01) * 1e7), round(spec.lon_deg * 1e7)
    _command(fleet, station, k, 192, 8.0, 1, 0, math.nan, lat, lon, 110.0, form="INT")
