"""Identity checks: vehicles that are asked for AUTOPILOT_VERSION again because their frames look restarts.

After a reboot ArduPilot sends little but heartbeats, and so does a second vehicle that has just been switched on: no
boot clock shows either. Signs are the silence before, the banner that ArduPilot boots with, positions that cease, and
sequence numbers of two counts.
"""

import math
from dataclasses import dataclass

from tui_gcs.core.fleet.identity.path import GLOBAL_POSITION_INT, PathState
from tui_gcs.core.fleet.vehicle import Vehicle

MIN_SILENCE_S = 1.2
"""Autopilots take at least this long to reboot (ArduPilot: 1 to 2 s)."""
RECENT_POSITION_S = 0.3
"""A position that came within this time makes a check unnecessary."""
POSITION_TIMEOUT_S = 2.0
"""Positions that came before and do not come for this long are missing."""
FIRST_REQUEST_S, MAX_REQUEST_S = 1.0, 30.0
"""A vehicle is asked again after 1 s, then each time after twice as long up to 30 s, while nothing is found."""
SEQUENCE_CHECK_S, SILENCE_CHECK_S = 10.0, 5.0
"""A check ends when no sign renewed it for 10 s (sequence numbers) or 5 s (silence, banner, missing positions)."""


@dataclass
class _Check:
    """A vehicle that is being asked for its identity."""

    vehicle: Vehicle
    since_s: float
    until_s: float
    next_s: float
    gap_s: float = FIRST_REQUEST_S


class IdentityMonitor:
    """Finds vehicles to be identified again and schedules the requests."""

    def __init__(self) -> None:
        self._checks: dict[int, _Check] = {}
        self._quiet: set[int] = set()
        """Vehicles that were silent at the last look."""
        self._missing: set[int] = set()
        """Vehicles that sent positions before and no longer do."""
        self._restarts: dict[int, int] = {}
        """Restarts of sequence numbers on all paths, by vehicle."""
        self._banner_bytes: dict[int, int] = {}
        """Bytes of plain text from the source at the last boot banner, by vehicle."""

    def look(self, vehicles: list[Vehicle], now: float, *, check_sequences: bool) -> list[Vehicle]:
        """Start and end checks; returns the vehicles that start or cease to be `watched`.

        With `check_sequences`, once a second, sequence numbers are checked, too.
        """
        checks, quiet, missing, known_banners = self._checks, self._quiet, self._missing, self._banner_bytes
        changed = []
        for vehicle in vehicles:
            number, path = vehicle.id, vehicle.path
            stream, slot = path.autopilot_stream, path.slots.get(GLOBAL_POSITION_INT)
            if stream is None or now - stream.last_heard_s > MIN_SILENCE_S:
                quiet.add(number)
                continue
            position_s = slot.t_s if slot is not None else -math.inf
            missing_positions = -math.inf < position_s < now - POSITION_TIMEOUT_S
            # ArduPilot sends its boot banner as plain text.
            banner = path.source.text_bytes > known_banners.get(number, 0)
            if banner or missing_positions or number in checks or number in quiet or number in missing:
                self._update(vehicle, now, position_s, banner=banner, missing_positions=missing_positions)
            if check_sequences and self._check_sequence(vehicle, now):
                changed.append(vehicle)
        return changed

    def _update(
        self, vehicle: Vehicle, now: float, position_s: float, *, banner: bool, missing_positions: bool
    ) -> None:
        """Update the check of a vehicle that showed a sign now or at the last look."""
        number = vehicle.id
        was_silent = number in self._quiet and position_s < now - RECENT_POSITION_S
        if banner or was_silent or (missing_positions and number not in self._missing):
            self._checks.setdefault(number, _Check(vehicle, now, now + SILENCE_CHECK_S, now))
        elif number in self._checks and not vehicle.identity.watched and position_s > self._checks[number].since_s:
            del self._checks[number]
        self._quiet.discard(number)
        if banner:
            self._banner_bytes[number] = vehicle.path.source.text_bytes
        if missing_positions:
            self._missing.add(number)
        else:
            self._missing.discard(number)

    def _check_sequence(self, vehicle: Vehicle, now: float) -> bool:
        """Start a check when sequence numbers restart; return whether `watched` changed."""
        restarts = 0
        for path in vehicle.paths:
            if path.state is PathState.USED:
                for stream in path.streams:
                    restarts += stream.count_restarts
        before = self._restarts.get(vehicle.id, 0)
        if restarts == before and not vehicle.identity.watched:
            return False
        self._restarts[vehicle.id] = restarts
        if restarts > before:
            check = self._checks.setdefault(vehicle.id, _Check(vehicle, now, now, now))
            check.until_s = now + SEQUENCE_CHECK_S
        watched = vehicle.identity.watched
        vehicle.identity.watched = vehicle.id in self._checks and (watched or restarts > before)
        return vehicle.identity.watched is not watched

    def confirm_conflict(self, vehicle: Vehicle, now: float) -> None:
        """Keep asking at the highest rate: two vehicles use this id."""
        check = self._checks.get(vehicle.id)
        if check is not None:
            check.gap_s, check.until_s = FIRST_REQUEST_S, now + SEQUENCE_CHECK_S

    def due_requests(self, now: float) -> list[Vehicle]:
        """Return the vehicles to ask for AUTOPILOT_VERSION now."""
        due = []
        for number, check in list(self._checks.items()):
            if now >= check.until_s:
                del self._checks[number]
            elif now >= check.next_s:
                check.next_s, check.gap_s = now + check.gap_s, min(2 * check.gap_s, MAX_REQUEST_S)
                if now - check.vehicle.path.last_heard_s < MIN_SILENCE_S:
                    due.append(check.vehicle)
        return due

    def forget(self, vehicle: Vehicle) -> None:
        """Drop what is kept of a vehicle that is removed."""
        self._checks.pop(vehicle.id, None)
        self._restarts.pop(vehicle.id, None)
        self._banner_bytes.pop(vehicle.id, None)
        self._quiet.discard(vehicle.id)
        self._missing.discard(vehicle.id)
