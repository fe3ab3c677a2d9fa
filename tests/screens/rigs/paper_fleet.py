"""A station made of paper in a process of its own, for measuring consoles: python -m tests.screens.rigs.paper_fleet N

N vehicles on rings of their own in the shipped scenario, at 8 m/s, with the noise that telemetry has; frames and
statuses at the station's rates on the real bus, until it is told to end.
"""

import math
import random
import sys
import time
from dataclasses import dataclass, field

import msgspec

from tests.screens.rigs.fake_station import SPEED_M_S, FakeStation
from tui_gcs.core.base.directories import socket_path
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.protocol import bus as keys
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.zenoh_bus import serve

FRAME_HZ, STATUS_HZ = 10.0, 2.0
AREA_M = (600.0, 400.0)
COLUMNS = 16


@dataclass
class PaperFleet(FakeStation):
    """Every vehicle flies; what is shown of it changes as it does in flight."""

    chance: random.Random = field(default_factory=lambda: random.Random(1))

    def publish_fleet(self, dt_s: float) -> None:
        """Move on, and publish the frame."""
        self.t_s += dt_s
        self.seq += 1
        self.bus.publish(keys.FLEET, m.encode(self.frame()))

    def publish_status(self) -> None:
        """Publish the status and the tours."""
        self.bus.publish(keys.STATUS, m.encode(self.status()))
        for team in self.scenario.teams:
            self.bus.publish(keys.PLAN.format(team=team.name), m.encode(self.plan(team.name)))

    def status(self) -> m.StationStatus:
        """The planners' figures change from status to status."""
        teams = tuple(
            msgspec.structs.replace(
                team,
                worst_idleness_s=self.chance.uniform(20.0, 28.0),
                average_idleness_s=self.chance.uniform(8.0, 10.0),
                ratio=self.chance.uniform(1.0, 1.4),
            )
            for team in super().status().teams
        )
        return msgspec.structs.replace(super().status(), teams=teams, min_separation_m=self.chance.uniform(15.0, 25.0))

    def _row(self, index: int) -> m.VehicleRow:
        row, noise = super()._row(index), self.chance.gauss
        x_m, y_m, radius_m = ring(index, self.count)
        angle = index * 2.4 + (self.t_s - 100.0) * SPEED_M_S / radius_m
        speed_m_s = SPEED_M_S + noise(0.0, 0.1)
        climb_m_s = noise(0.0, 0.05)
        return row._replace(
            position_m=(
                x_m + radius_m * math.sin(angle),
                y_m + radius_m * math.cos(angle),
                row.position_m[2] + noise(0.0, 0.1),
            ),
            velocity_m_s=(speed_m_s * math.cos(angle), -speed_m_s * math.sin(angle), climb_m_s),
            heading_deg=math.degrees(math.atan2(math.cos(angle), -math.sin(angle))) % 360.0,
            battery_pct=90.0 - 0.03 * (self.t_s - 100.0) - index % 7,
            battery_v=15.4 + noise(0.0, 0.05),
            satellites=12 + (self.chance.random() < 0.01),
            age_s=self.chance.uniform(0.0, 0.2),
            heard_age_s=self.chance.uniform(0.0, 0.1),
            slot_error_m=abs(noise(0.8, 0.3)),
        )


def ring(index: int, count: int) -> tuple[float, float, float]:
    """Centre (east, north) and radius of a vehicle's way, metres: spread evenly over the area."""
    columns = min(count, COLUMNS)
    lines = math.ceil(count / columns)
    x_m = AREA_M[0] * (index % columns + 0.5) / columns
    y_m = AREA_M[1] * (index // columns + 0.5) / lines
    return x_m, y_m, 30.0 + index % 5 * 5.0


def main(count: int) -> None:
    """Publish for ever."""
    bus = serve(socket_path(RunKind.SIM))
    station = PaperFleet(bus, count=count)
    station.fly()
    next_s, ticks = time.monotonic(), 0
    while True:
        station.publish_fleet(1.0 / FRAME_HZ)
        if ticks % round(FRAME_HZ / STATUS_HZ) == 0:
            station.publish_status()
        ticks += 1
        next_s += 1.0 / FRAME_HZ
        time.sleep(max(0.0, next_s - time.monotonic()))


if __name__ == "__main__":
    main(int(sys.argv[1]))
