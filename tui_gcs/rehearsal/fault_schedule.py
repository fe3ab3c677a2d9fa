"""Faults that are injected into a rehearsal on schedule: lost links, low batteries, a restart of the station."""

import math
import re
from dataclasses import dataclass

from tui_gcs.core.judging.mission_script import Script
from tui_gcs.core.protocol.bus import REQUEST, BusError
from tui_gcs.core.protocol.common import AnyRequest, Resume, encode
from tui_gcs.rehearsal.lock_step import LockStep

DOWN_S = 3.0
"""Time until a killed station is back; in flight its supervisor restarts it."""
RESUME_S = 5.0
"""Time after that until the operator resumes."""
MAX_TIME_S = 86_400.0
"""Latest time of a fault."""
DRAINED = 0.2
"""Share of the charge left in a drained battery: low, and enough to land."""
_LOSE = re.compile(r"(\d{1,6})@(\d+(?:\.\d+)?)(?:/(\d+(?:\.\d+)?))?")


class FaultScheduleError(ValueError):
    """A text that describes no fault; one line."""


@dataclass(frozen=True, order=True)
class ScheduledFault:
    """One fault, `t_s` after the fleet was started."""

    t_s: float
    what: str
    """lose, find: the vehicle's link; drain: its battery; kill, start, resume: the station."""
    vehicle: int = 0

    def __str__(self) -> str:
        """Describe the fault as reports list it."""
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
    """Parse `3@120` (vehicle 3 falls silent 120 s after the start) or `3@120/30` (for 30 s).

    Raises:
        FaultScheduleError: the text is something else.
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
    """Parse `3@120`: the battery of vehicle 3 is low 120 s after the start. Raises FaultScheduleError."""
    found = losses(texts)
    if any(fault.what == "find" for fault in found):
        raise FaultScheduleError(f"{' '.join(texts)!r}: a battery does not fill again: must be ID@SECONDS")
    return [ScheduledFault(fault.t_s, "drain", fault.vehicle) for fault in found]


def restart(t_s: float) -> list[ScheduledFault]:
    """Return faults that kill the station at `t_s`, start it again and let the operator resume.

    Raises FaultScheduleError.
    """
    if not 0.0 <= t_s <= MAX_TIME_S:
        raise FaultScheduleError(f"{t_s:g}: must be seconds after the start")
    return [
        ScheduledFault(t_s, "kill"),
        ScheduledFault(t_s + DOWN_S, "start"),
        ScheduledFault(t_s + DOWN_S + RESUME_S, "resume"),
    ]


class FaultSchedule:
    """Injects the scheduled faults into one flight."""

    def __init__(self, planned: list[ScheduledFault], flight: LockStep, script: Script) -> None:
        """Raises FaultScheduleError for a vehicle that is not simulated."""
        self.happened: list[tuple[float, ScheduledFault]] = []
        """(mission time, fault) of injected faults."""
        self._left = sorted(planned)
        self._flight = flight
        self._script = script
        self._begin_s = math.nan
        for fault in planned:
            if fault.vehicle and fault.vehicle not in flight.systems:
                ids = ", ".join(map(str, flight.systems))
                raise FaultScheduleError(f"vehicle {fault.vehicle} is not simulated; there are {ids}")

    def tick(self) -> None:
        """Inject the faults that are due."""
        now = self._flight.clock.now()
        if math.isnan(self._begin_s) and self._script.referee.started:
            self._begin_s = now
        while self._left and now - self._begin_s >= self._left[0].t_s:
            fault = self._left.pop(0)
            self._inject(fault, now)
            self.happened.append((now - self._begin_s, fault))

    def _inject(self, fault: ScheduledFault, now: float) -> None:
        referee = self._script.referee
        if fault.what == "lose":
            self._flight.sim.silence(self._flight.systems.index(fault.vehicle))
            referee.lose(fault.vehicle, now)
        elif fault.what == "find":
            self._flight.sim.unsilence(self._flight.systems.index(fault.vehicle))
            referee.find(fault.vehicle, now)
        elif fault.what == "drain":
            self._flight.sim.discharge(self._flight.systems.index(fault.vehicle), DRAINED)
        elif fault.what == "kill":
            self._flight.kill_station()
        elif fault.what == "start":
            self._flight.start_station()
        else:
            self._ask(Resume())
            referee.begin_again(now)

    def _ask(self, request: AnyRequest) -> None:
        try:
            self._flight.bus.ask(REQUEST.format(principal="rehearsal"), encode(request))
        except BusError as error:
            self._script.abort(str(error))
