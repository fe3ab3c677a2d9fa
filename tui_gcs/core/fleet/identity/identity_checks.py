"""Vehicles that are asked who they are once more, because something about what comes from them is odd.

After a reboot ArduPilot sends little but heartbeats, and so does a second vehicle that has just been switched on: no
boot clock tells of either. The silence before does, the text that ArduPilot boots with, positions that come no more,
or sequence numbers of two rows.
"""

import math
from dataclasses import dataclass

from tui_gcs.core.fleet.identity.path import GLOBAL_POSITION_INT, PathState
from tui_gcs.core.fleet.vehicle import Vehicle

MIN_SILENCE_S = 1.2
"""Nobody reboots in less (ArduPilot: 1 to 2 s)."""
RECENT_POSITION_S = 0.3
"""A position that came within this time tells what is to be known."""
POSITION_TIMEOUT_S = 2.0
"""Positions that came are missing."""
FIRST_REQUEST_S, MAX_REQUEST_S = 1.0, 30.0
"""Asked again after this time, each time after twice as long, while nothing is found."""
SEQUENCE_CHECK_S, SILENCE_CHECK_S = 10.0, 5.0
"""A doubt ends when nothing has fed it for so long."""


@dataclass
class _Check:
    vehicle: Vehicle
    since_s: float
    until_s: float
    next_s: float
    gap_s: float = FIRST_REQUEST_S


class IdentityMonitor:
    """All vehicles in doubt."""

    def __init__(self) -> None:
        """None."""
        self._doubts: dict[int, _Check] = {}
        self._quiet: set[int] = set()
        self._missing: set[int] = set()
        self._odd: dict[int, int] = {}
        self._texts: dict[int, int] = {}

    def look(self, vehicles: list[Vehicle], now: float, *, look: bool) -> list[Vehicle]:
        """Look for reasons; with `look`, once a second, at sequence numbers, too. Returns whose `watched` changed."""
        doubts, quiet, missing, known_texts = self._doubts, self._quiet, self._missing, self._texts
        changed = []
        for vehicle in vehicles:
            number, path = vehicle.id, vehicle.path
            pilot, slot = path.autopilot_stream, path.slots.get(GLOBAL_POSITION_INT)
            if pilot is None or now - pilot.heard_s > MIN_SILENCE_S:
                quiet.add(number)
                continue
            position_s = slot.t_s if slot is not None else -math.inf
            late = -math.inf < position_s < now - POSITION_TIMEOUT_S
            booted = path.source.text_bytes > known_texts.get(number, 0)
            if booted or late or number in doubts or number in quiet or number in missing:
                self._judge(vehicle, now, position_s, booted=booted, late=late)
            if look and self._look_at_numbers(vehicle, now):
                changed.append(vehicle)
        return changed

    def _judge(self, vehicle: Vehicle, now: float, position_s: float, *, booted: bool, late: bool) -> None:
        """Something was odd, now or at the last look."""
        number = vehicle.id
        back = number in self._quiet and position_s < now - RECENT_POSITION_S
        if booted or back or (late and number not in self._missing):
            self._doubts.setdefault(number, _Check(vehicle, now, now + SILENCE_CHECK_S, now))
        elif number in self._doubts and not vehicle.identity.watched and position_s > self._doubts[number].since_s:
            del self._doubts[number]
        self._quiet.discard(number)
        if booted:
            self._texts[number] = vehicle.path.source.text_bytes
        if late:
            self._missing.add(number)
        else:
            self._missing.discard(number)

    def _look_at_numbers(self, vehicle: Vehicle, now: float) -> bool:
        odd = 0
        for path in vehicle.paths:
            if path.state is PathState.USED:
                for stream in path.streams:
                    odd += stream.count_restarts
        before = self._odd.get(vehicle.id, 0)
        if odd == before and not vehicle.identity.watched:
            return False
        self._odd[vehicle.id] = odd
        if odd > before:
            doubt = self._doubts.setdefault(vehicle.id, _Check(vehicle, now, now, now))
            doubt.until_s = now + SEQUENCE_CHECK_S
        watched = vehicle.identity.watched
        vehicle.identity.watched = vehicle.id in self._doubts and (watched or odd > before)
        return vehicle.identity.watched is not watched

    def confirm_conflict(self, vehicle: Vehicle, now: float) -> None:
        """There are two: go on asking."""
        doubt = self._doubts.get(vehicle.id)
        if doubt is not None:
            doubt.gap_s, doubt.until_s = FIRST_REQUEST_S, now + SEQUENCE_CHECK_S

    def due_requests(self, now: float) -> list[Vehicle]:
        """Who is to be asked now."""
        due = []
        for number, doubt in list(self._doubts.items()):
            if now >= doubt.until_s:
                del self._doubts[number]
            elif now >= doubt.next_s:
                doubt.next_s, doubt.gap_s = now + doubt.gap_s, min(2 * doubt.gap_s, MAX_REQUEST_S)
                if now - doubt.vehicle.path.heard_s < MIN_SILENCE_S:
                    due.append(doubt.vehicle)
        return due

    def forget(self, vehicle: Vehicle) -> None:
        """The vehicle is not known any more."""
        self._doubts.pop(vehicle.id, None)
        self._odd.pop(vehicle.id, None)
        self._texts.pop(vehicle.id, None)
        self._quiet.discard(vehicle.id)
        self._missing.discard(vehicle.id)
