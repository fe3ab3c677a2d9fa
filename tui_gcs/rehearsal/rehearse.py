"""Flies a whole scenario in lock-step, with scheduled faults, and returns its result."""

from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path

import msgspec

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.judging.flight_result import FlightResult
from tui_gcs.core.judging.incursions import Incursions
from tui_gcs.core.judging.mission_script import Script
from tui_gcs.core.judging.referee import Referee
from tui_gcs.core.protocol.bus import FLEET, STATUS, Bus
from tui_gcs.core.protocol.common import FleetFrame, Phase, StationStatus, decode
from tui_gcs.core.scenario.model import Scenario
from tui_gcs.planner.runtime.planner_file import PlannerFile
from tui_gcs.planner.runtime.planner_subprocess import PlannerProcessError
from tui_gcs.rehearsal.class_batteries import ClassBatteries
from tui_gcs.rehearsal.fault_schedule import FaultSchedule, ScheduledFault
from tui_gcs.rehearsal.lock_step import FlightConditions, LockStep

INTRUDER_SAMPLE_S = 0.5
"""Interval at which the true places of intruders are sampled."""


class IntruderMonitor:
    """Feeds the true places of the simulator's intruders to the counter of incursions."""

    def __init__(self, flight: LockStep) -> None:
        """Create it before the start."""
        self.incursions = Incursions(flight.scenario)
        self._world, self._clock = flight.sim.world, flight.clock
        self._frame = LocalFrame(flight.scenario.origin)
        self._next_s = 0.0
        self._vehicles_m: dict[int, tuple[float, float]] = {}
        # Without intruders there is nothing to watch: decoding every frame for that was 3 % of a run.
        if self._world is not None:
            flight.bus.subscribe(STATUS, lambda _, data: self.incursions.on_status(decode(data, StationStatus)))
            flight.bus.subscribe(FLEET, lambda _, data: self._on_frame(decode(data, FleetFrame)))

    def _on_frame(self, frame: FleetFrame) -> None:
        flying = [row for row in frame.rows() if row.team and row.phase is Phase.FLYING]
        self._vehicles_m = {row.id: row.position_m[:2] for row in flying}

    def tick(self) -> None:
        """Sample the intruders if it is time."""
        if self._world is None or self._clock.now() < self._next_s:
            return
        self._next_s = self._clock.now() + INTRUDER_SAMPLE_S
        places = [self._frame.to_enu(lat_deg, lon_deg) for lat_deg, lon_deg in self._world.places_deg()]
        self.incursions.see(places, self._world.present.tolist(), self._world.met, self._vehicles_m)


def rehearse(
    scenario: Scenario,
    toml: str,
    log_dir: Path,
    on_progress: Callable[[float, str], None],
    conditions: FlightConditions | None = None,
    *,
    rounds: int | None = None,
    files: Mapping[str, PlannerFile] | None = None,
    faults: list[ScheduledFault] | None = None,
    watch: Callable[[Bus, Referee], None] = lambda _bus, _referee: None,
) -> tuple[FlightResult, str]:
    """Fly the whole scenario as fast as possible; return (result, why it ended early or "").

    `rounds` limits the flight to the first rounds. `files` are planners in files, by name. `faults` are injected on
    purpose. `watch` may subscribe to the bus before anything has happened.
    """
    if rounds is not None:
        scenario = msgspec.structs.replace(scenario, rounds=scenario.rounds[:rounds])
    conditions = conditions or FlightConditions()
    flight = LockStep(
        scenario,
        toml,
        log_dir,
        autopilots=conditions.autopilots,
        bad_links=conditions.bad_links,
        weather=conditions.weather,
        world=conditions.world,
        files=files or {},
        beside=True,
    )
    with closing(flight):
        script = Script(scenario, flight.bus, principal="rehearsal", whole_duration=False)
        watch(flight.bus, script.referee)
        intruders = IntruderMonitor(flight)
        if flight.world is not None:
            script.referee.incursions = intruders.incursions
        schedule = FaultSchedule(faults or [], flight, script)
        batteries = ClassBatteries(scenario, flight)
        problem = ""
        try:
            while not script.done:
                flight.step()
                # A dead station answers no request of the script.
                if flight.station_runs:
                    script.tick()
                schedule.tick()
                batteries.tick()
                intruders.tick()
                on_progress(script.progress, script.headline)
        except PlannerProcessError as error:
            problem = str(error)
    return script.referee.result(), problem or script.problem
