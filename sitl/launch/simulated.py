"""Simulated vehicles in real time over UDP: python -m sitl.launch.simulated --spec FILE --target HOST:PORT.

FILE is JSON: {"seed": 0, "token": "16 hex digits", "wind_m_s": [east, north], "gps_noise_m": 0.0, "vehicles": [
{"system_id": 1, "lat_deg": …, "lon_deg": …, "ground_amsl_m": …, "heading_deg": …, "signing_key": "64 hex digits",
"px4_signing": false, "autopilot": "ardupilot", "sitl_rates": false}]}; of a vehicle all after "ground_amsl_m" may be
missing; the other autopilot is "px4". Each vehicle has a socket and source port of its own, as in SITL.
"intruders": [{…}] and "sensor": {…} have the fields of `world.IntruderSpec` and `SensorSpec`, and may be missing, too.
"""

import argparse
import json
import math
import selectors
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from sitl.launch.fleet import IntruderSpec, SensorSpec, SimFleet, VehicleSpec, WeatherSpec, WorldSpec
from sitl.launch.port import VehiclePort
from sitl.launch.process import PARENT_CHECK_S, LaunchError, ProgramLoop, Starter, add_starter, parse_target, refuse
from sitl.links.signing import SigningSpec, time_of

TICK_S = 0.05
ANSWER_S = 0.005
"""Requests are answered within this time; a real ArduCopter takes 10 ms for a round trip."""
MAX_BEHIND_S = 1.0
"""A computer that is further behind does not catch up: simulated time runs slower then."""


def load_spec(path: Path, boot_s: float) -> SimFleet:
    """Return the fleet that a spec file describes.

    Raises:
        LaunchError: The file cannot be read, is not JSON, or has missing or wrong values.
    """
    try:
        raw = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise LaunchError(f"{path}: {error.strerror}") from error
    except ValueError as error:
        raise LaunchError(f"{path}: not JSON: {error}") from error
    if not isinstance(raw, dict):
        raise LaunchError(f'{path}: the spec must be an object with "vehicles"')
    try:
        vehicles = [_vehicle(entry) for entry in raw["vehicles"]]
        return SimFleet(
            vehicles,
            seed=int(raw.get("seed", 0)),
            token=str(raw.get("token", "")),
            boot_s=boot_s,
            weather=_weather(raw),
            world=_world(raw),
        )
    except KeyError as error:
        raise LaunchError(f"{path}: {error.args[0]} is missing") from error
    except (TypeError, ValueError, AttributeError) as error:
        raise LaunchError(f"{path}: {error}") from error


def _weather(raw: dict[str, Any]) -> WeatherSpec:
    east_m_s, north_m_s = (float(value) for value in raw.get("wind_m_s", (0.0, 0.0)))
    noise_m = float(raw.get("gps_noise_m", 0.0))
    if not all(math.isfinite(value) for value in (east_m_s, north_m_s, noise_m)) or noise_m < 0.0:
        raise ValueError("wind_m_s and gps_noise_m must be finite, gps_noise_m not negative")
    return WeatherSpec((east_m_s, north_m_s), noise_m)


def _world(raw: dict[str, Any]) -> WorldSpec | None:
    intruders = tuple(IntruderSpec(**{k: float(v) for k, v in one.items()}) for one in raw.get("intruders", ()))
    sensor = raw.get("sensor")
    if sensor is None and not intruders:
        return None
    return WorldSpec(intruders, None if sensor is None else SensorSpec(**{k: float(v) for k, v in sensor.items()}))


def _vehicle(entry: dict[str, Any]) -> VehicleSpec:
    return VehicleSpec(
        system_id=int(entry["system_id"]),
        lat_deg=float(entry["lat_deg"]),
        lon_deg=float(entry["lon_deg"]),
        ground_amsl_m=float(entry["ground_amsl_m"]),
        heading_deg=float(entry.get("heading_deg", 0.0)),
        signing=SigningSpec(
            key=bytes.fromhex(entry.get("signing_key", "")),
            timestamp=time_of(time.time()),
            px4=bool(entry.get("px4_signing", False)),
        ),
        autopilot=entry.get("autopilot", "ardupilot"),
        unix_epoch_us=time.time_ns() // 1000,
        sitl_rates=bool(entry.get("sitl_rates", False)),
    )


def open_ports(fleet: SimFleet, target: tuple[str, int]) -> list[VehiclePort]:
    """Open one port per vehicle.

    Raises:
        LaunchError: The host is unknown, or no sockets can be opened; then none stays open.
    """
    with ExitStack() as undo:
        # A port that cannot be opened closes those before it.
        ports = [undo.enter_context(VehiclePort(target, latches=spec.autopilot == "px4")) for spec in fleet.specs]
        undo.pop_all()
    return ports


class RealTimeLoop(ProgramLoop):
    """Steps the fleet at 20 Hz of simulated time, `speed` times real time."""

    def __init__(self, fleet: SimFleet, ports: list[VehiclePort], *, speed: float, starter: Starter) -> None:
        super().__init__(starter)
        self.fleet = fleet
        self.ports = ports
        self.period_s = TICK_S / speed
        self._ready = selectors.DefaultSelector()
        for index, port in enumerate(ports):
            self._ready.register(port.socket, selectors.EVENT_READ, index)

    def run(self) -> None:
        """Step the fleet until a signal comes, or the starter is gone."""
        due_s = time.monotonic()
        check_s = due_s
        while self.running:
            now_s = time.monotonic()
            if now_s < due_s:
                self._answer_until(due_s)
            # Catching up would make the fleet run faster than real time for a while, and stations lose their timing.
            elif now_s - due_s > MAX_BEHIND_S:
                due_s = now_s
            due_s += self.period_s
            self._receive()
            self.fleet.step(TICK_S)
            self._send()
            if now_s >= check_s:
                check_s = now_s + PARENT_CHECK_S
                self.running = self.running and self.starter.is_there

    def _answer_until(self, due_s: float) -> None:
        """Answer requests between two ticks, at most every ANSWER_S, so that transfers do not wait for ticks."""
        while self.running and (left_s := due_s - time.monotonic()) > 0.0:
            if self._ready.select(left_s):
                time.sleep(min(ANSWER_S, left_s))
                self._receive()
                self._send()

    def _receive(self) -> None:
        for key, _ in self._ready.select(0.0):
            while (data := self.ports[key.data].receive()) is not None:
                self.fleet.receive(key.data, data)

    def _send(self) -> None:
        for index, datagram in self.fleet.drain():
            self.ports[index].send(datagram)


def _arguments(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m sitl.launch.simulated", description="Simulated vehicles over UDP.")
    parser.add_argument("--spec", type=Path, required=True, help="JSON file: seed, token, vehicles")
    parser.add_argument("--target", required=True, metavar="HOST:PORT", help="where the ground station listens")
    parser.add_argument("--speed", type=float, default=1.0, help="times real time (default 1)")
    parser.add_argument("--boot-s", type=float, default=3.0, help="seconds from power-on to readiness (default 3)")
    add_starter(parser)
    return parser.parse_args(argv)


def main(argv: list[str] | None = None) -> int:
    """Run the program; return 0 after a signal or the starter's end, 2 for bad input."""
    args = _arguments(argv)
    try:
        if not 0.01 <= args.speed <= 100.0:
            raise LaunchError(f"--speed {args.speed:g}: must be 0.01 to 100")
        target, starter = parse_target(args.target), Starter(args.parent, args.lifeline)
        fleet = load_spec(args.spec, args.boot_s)
        ports = open_ports(fleet, target)
    except LaunchError as error:
        return refuse(error)
    loop = RealTimeLoop(fleet, ports, speed=args.speed, starter=starter)
    loop.catch_signals()
    try:
        loop.run()
    finally:
        for port in ports:
            port.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
