"""What goes wrong on purpose in a rehearsal, and when: vehicles fall silent or grow tired, a station dies."""

import math
import re
from dataclasses import dataclass

from tui_gcs.core.judging.mission_script import Script
from tui_gcs.core.protocol import common as m
from tui_gcs.core.protocol.bus import REQUEST, BusError
from tui_gcs.core.protocol.common import encode
from tui_gcs.rehearsal.lock_step import LockStep

DOWN_S = 3.0
"""A station that was killed is back after so long (its supervisor starts it again)."""
RESUME_S = 5.0
"""So long after that the operator resumes."""
MAX_TIME_S = 86_400.0
DRAINED = 0.2
"""Share that is left in a drained battery: low, and enough to land."""
_LOSE = re.compile(r"(\d{1,6})@(\d+(?:\.\d+)?)(?:/(\d+(?:\.\d+)?))?")


class FaultScheduleError(ValueError):
    """A text that says no happening; one line."""


@dataclass(frozen=True, order=True)
class ScheduledFault:
    """One of them: `t_s` after the fleet was started."""

    t_s: float
    what: str
    """lose, find: the vehicle's link. drain: its battery. kill, start, resume: the station."""
    vehicle: int = 0

    def __str__(self) -> str:
        """For people."""
        words = {
            "lose": f"vehicle {self.vehicle} falls silent",
            "find": f"vehicle {self.vehicle} is heard again",
            "drain": f"the battery of vehicle {self.vehicle} is low",
            "kill": "the station is killed",
            "start": "the station is started again",
            "resume": "the operator resumes",
        }
        return words[self.what]


def losses(texts: list[str]) -> list[ScheduledFault]:
    """`3@120` (vehicle 3 falls silent 120 s after the start) or `3@120/30` (for 30 s).

    Raises:
        HappeningError: something else.
    """
    found = []
    for text in texts:
        match = _LOSE.fullmatch(text)
        if match is None or float(match[2]) > MAX_TIME_S:
            raise FaultScheduleError(f"{text!r}: must be ID@SECONDS or ID@SECONDS/FOR_SECONDS, for example 3@120/30")
        vehicle, begin_s = int(match[1]), float(match[2])
        found.append(ScheduledFault(begin_s, "lose", vehicle))
        if match[3] is not None:
            found.append(ScheduledFault(begin_s + float(match[3]), "find", vehicle))
    return found


def drains(texts: list[str]) -> list[ScheduledFault]:
    """`3@120`: the battery of vehicle 3 is low 120 s after the start. Raises HappeningError."""
    found = losses(texts)
    if any(happening.what == "find" for happening in found):
        raise FaultScheduleError(f"{' '.join(texts)!r}: a battery does not fill again: must be ID@SECONDS")
    return [ScheduledFault(happening.t_s, "drain", happening.vehicle) for happening in found]


def restart(t_s: float) -> list[ScheduledFault]:
    """The station dies at `t_s`, comes back, and the operator resumes. Raises HappeningError."""
    if not 0.0 <= t_s <= MAX_TIME_S:
        raise FaultScheduleError(f"{t_s:g}: must be seconds after the start")
    return [
        ScheduledFault(t_s, "kill"),
        ScheduledFault(t_s + DOWN_S, "start"),
        ScheduledFault(t_s + DOWN_S + RESUME_S, "resume"),
    ]


class FaultSchedule:
    """Lets them happen to one flight."""

    def __init__(self, planned: list[ScheduledFault], flight: LockStep, script: Script) -> None:
        """Raises HappeningError for a vehicle that is not there."""
        self.happened: list[tuple[float, ScheduledFault]] = []
        """(mission time, what)."""
        self._left = sorted(planned)
        self._flight = flight
        self._script = script
        self._begin_s = math.nan
        for happening in planned:
            if happening.vehicle and happening.vehicle not in flight.systems:
                ids = ", ".join(map(str, flight.systems))
                raise FaultScheduleError(f"vehicle {happening.vehicle} is not simulated; there are {ids}")

    def tick(self) -> None:
        """Do what is due."""
        now = self._flight.clock.now()
        if math.isnan(self._begin_s) and self._script.referee.started:
            self._begin_s = now
        while self._left and now - self._begin_s >= self._left[0].t_s:
            happening = self._left.pop(0)
            self._do(happening, now)
            self.happened.append((now - self._begin_s, happening))

    def _do(self, happening: ScheduledFault, now: float) -> None:
        referee = self._script.referee
        if happening.what == "lose":
            self._flight.sim.silence(self._flight.systems.index(happening.vehicle))
            referee.lose(happening.vehicle, now)
        elif happening.what == "find":
            self._flight.sim.unsilence(self._flight.systems.index(happening.vehicle))
            referee.find(happening.vehicle, now)
        elif happening.what == "drain":
            self._flight.sim.discharge(self._flight.systems.index(happening.vehicle), DRAINED)
        elif happening.what == "kill":
            self._flight.kill_station()
        elif happening.what == "start":
            self._flight.start_station()
        else:
            self._ask(m.Resume())
            referee.begin_again(now)

    def _ask(self, request: m.AnyRequest) -> None:
        try:
            self._flight.bus.ask(REQUEST.format(principal="rehearsal"), encode(request))
        except BusError as error:
            self._script.abort(str(error))
