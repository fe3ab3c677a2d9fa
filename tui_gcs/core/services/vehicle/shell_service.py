"""The autopilot's own command line (SERIAL_CONTROL): one user for each vehicle, lines in, cleaned lines out.

The autopilot carries out whatever is typed there. So typing is refused while a vehicle is armed, unless forced, and
every line is in the journal. Nothing is repeated: where no answer comes the operator types the line again.
"""

from collections import Counter, deque
from dataclasses import dataclass, field

from tui_gcs.core.base.text import SafeText, clean
from tui_gcs.core.firmware.shell import DEVICE, ERASE_LINE, PROMPTS, why_no_shell
from tui_gcs.core.fleet.fleet import Fields
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import Order
from tui_gcs.core.services.context import ServiceContext

REPLY, RESPOND, EXCLUSIVE = 1, 2, 4
"""Values of SERIAL_CONTROL_FLAG."""
CHUNK_BYTES = 70
MAX_LINE = 200
"""The most characters of one line, in and out."""
MAX_LINES = 1000
"""How many lines of a vehicle's answers are kept."""
MAX_LINES_PER_S = 500
"""More lines than this in a second are a flood: `help` has 60."""
ANSWER_S = 10.0
"""How long the prompt after a command is waited for."""
IDLE_S = 600.0
"""A shell in which nothing is typed for so long is closed."""


@dataclass
class _Session:
    user: str
    force: bool
    used_s: float
    lines: deque[SafeText] = field(default_factory=lambda: deque(maxlen=MAX_LINES))
    partial: bytearray = field(default_factory=bytearray)
    waits_since_s: float | None = None
    """Station time at which a line was sent that no prompt has answered yet."""
    second: int = 0
    this_second: int = 0


class ShellService:
    """Opens, uses and closes the shells of vehicles."""

    def __init__(self, context: ServiceContext) -> None:
        self._context = context
        self._sessions: dict[int, _Session] = {}
        self.ignored: Counter[str] = Counter()
        context.fleet.on_message("SERIAL_CONTROL", self._on_serial)
        context.forget_with(self._forget, reboot=False)

    def open(self, vehicle_id: int, user: str, *, force: bool = False) -> str:
        """Open a vehicle's shell for `user`; returns "" or why not. `force` opens it although the vehicle is armed."""
        vehicle = self._context.fleet.vehicles.get(vehicle_id)
        if vehicle is None:
            return "unknown vehicle"
        why = why_no_shell(vehicle)
        if why:
            return why
        session = self._sessions.get(vehicle_id)
        if session is not None and session.user != user:
            return f"{session.user} uses this shell"
        if vehicle.telemetry.armed and not force:
            return "the vehicle is armed"
        self._sessions[vehicle_id] = _Session(user, force, self._context.clock.now())
        return self._send(vehicle, "shell: open", b"\n")

    def type(self, vehicle_id: int, user: str, line: str) -> str:
        """Send one line; returns "" or why not."""
        vehicle = self._context.fleet.vehicles.get(vehicle_id)
        session = self._sessions.get(vehicle_id)
        if vehicle is None or session is None or session.user != user:
            return "this shell is not open"
        # A shell command can stop the autopilot, so flying vehicles are protected.
        if vehicle.telemetry.armed and not session.force:
            return "the vehicle is armed"
        if len(line) > MAX_LINE or not line.isascii() or not (line.isprintable() or not line):
            return f"one line of at most {MAX_LINE} plain characters"
        session.used_s = session.waits_since_s = self._context.clock.now()
        return self._send(vehicle, f"shell: {line}", line.encode() + b"\n")

    def lines(self, vehicle_id: int) -> tuple[SafeText, ...]:
        """The newest lines, and what has arrived of the last one."""
        session = self._sessions.get(vehicle_id)
        if session is None:
            return ()
        return (*session.lines, _shown(session.partial)) if session.partial else tuple(session.lines)

    def user(self, vehicle_id: int) -> str:
        """The user of the shell, "" if it is not open."""
        session = self._sessions.get(vehicle_id)
        return session.user if session is not None else ""

    def waits(self, vehicle_id: int) -> bool:
        """Whether the last line is not answered yet."""
        session = self._sessions.get(vehicle_id)
        since_s = session.waits_since_s if session is not None else None
        return since_s is not None and self._context.clock.now() - since_s < ANSWER_S

    def answered(self, vehicle_id: int) -> bool:
        """Whether the prompt has come after the last line.

        More output may follow, e.g. of other parts of the autopilot.
        """
        session = self._sessions.get(vehicle_id)
        return session is not None and session.waits_since_s is None

    def ready(self, vehicle_id: int) -> bool:
        """Whether the prompt is the last that was received."""
        session = self._sessions.get(vehicle_id)
        return session is not None and _is_prompt(session.partial)

    def close(self, vehicle_id: int, user: str) -> None:
        """Close the shell, if `user` has it."""
        session = self._sessions.get(vehicle_id)
        vehicle = self._context.fleet.vehicles.get(vehicle_id)
        if session is not None and session.user == user:
            del self._sessions[vehicle_id]
            if vehicle is not None:
                self._put(vehicle, "shell: close", b"", flags=0)

    def tick(self) -> None:
        """Close shells that have not been used for long."""
        now = self._context.clock.now()
        for vehicle_id, session in list(self._sessions.items()):
            if now - session.used_s > IDLE_S:
                self.close(vehicle_id, session.user)

    def _send(self, vehicle: Vehicle, what: str, data: bytes) -> str:
        """Send data in chunks: the first is a journalled action, the others are its parts."""
        for start in range(0, len(data), CHUNK_BYTES):
            why = self._put(vehicle, what, data[start : start + CHUNK_BYTES], flags=RESPOND | EXCLUSIVE, part=start > 0)
            if why:
                return why
        return ""

    def _put(self, vehicle: Vehicle, what: str, data: bytes, *, flags: int, part: bool = False) -> str:
        fields = {
            "device": DEVICE,
            "flags": flags,
            "timeout": 0,
            "baudrate": 0,
            "count": len(data),
            "data": list(data.ljust(CHUNK_BYTES, b"\0")),
        }
        if part:
            return "" if self._context.uplink.transfer(vehicle.id, what, "SERIAL_CONTROL", **fields) else "not sent"
        return self._context.uplink.action(vehicle.id, Order(what), "SERIAL_CONTROL", **fields)

    def _on_serial(self, vehicle: Vehicle, fields: Fields) -> None:
        session = self._sessions.get(vehicle.id)
        if session is None or fields["device"] != DEVICE or not fields["flags"] & REPLY:
            self.ignored["serial data not requested"] += 1
            return
        if not self._context.is_for_us(fields):
            self.ignored["serial data for another station"] += 1
            return
        # An answer arrives in pieces of 70 bytes that end anywhere.
        session.partial += bytes(fields["data"][: min(fields["count"], CHUNK_BYTES)])
        while b"\n" in session.partial:
            line, _, rest = session.partial.partition(b"\n")
            session.partial = rest
            self._line(session, bytes(line))
        if len(session.partial) > 4 * MAX_LINE:
            self._line(session, bytes(session.partial))
            session.partial.clear()
        if _is_prompt(session.partial):
            session.waits_since_s = None

    def _line(self, session: _Session, raw: bytes) -> None:
        second = int(self._context.clock.now())
        session.this_second = session.this_second + 1 if second == session.second else 1
        session.second = second
        # A flood of lines must not fill the journal.
        if session.this_second > MAX_LINES_PER_S:
            self.ignored["shell lines too fast"] += 1
            return
        session.lines.append(_shown(raw))

    def _forget(self, vehicle: Vehicle) -> None:
        self._sessions.pop(vehicle.id, None)


def _is_prompt(partial: bytearray) -> bool:
    return partial.replace(ERASE_LINE, b"").endswith(PROMPTS)


def _shown(raw: bytes | bytearray) -> SafeText:
    return clean(bytes(raw).replace(ERASE_LINE, b"").rstrip(b"\r\t\0").expandtabs(), MAX_LINE)
