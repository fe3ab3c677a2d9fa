"""A job that runs one line in a vehicle's shell: open, wait for the prompt, send, collect the answer, leave."""

from collections.abc import Callable

from tui_gcs.core.base.text import SafeText
from tui_gcs.core.firmware.shell import PROMPTS
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.vehicle.shell_service import ShellService
from tui_gcs.core.uplink.jobs import Job

_PROMPTS = tuple(prompt.decode() for prompt in PROMPTS)
PROMPT_S = 2.0
"""The line is sent after this time even if no prompt has come: the answer shows whether a shell is there."""


class ShellJob(Job):
    """Runs one line in a vehicle's shell; the answer is in `lines`."""

    def __init__(
        self, shell: ShellService, vehicle: int, user: str, line: str, on_done: Callable[[Job], None] | None = None
    ) -> None:
        super().__init__(vehicle, f"shell: {line}", on_done)
        self._shell, self._user, self._line = shell, user, line
        self._typed = False
        self.lines: list[SafeText] = []

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Open the shell of the vehicle."""
        why = self._shell.open(self.vehicle, self._user)
        if why:
            self.finish(why)

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Send the line as soon as the shell is ready, and end when it has answered."""
        if not self._typed:
            if self._shell.ready(self.vehicle) or now - self.begun_s > PROMPT_S:
                self._typed = True
                why = self._shell.type(self.vehicle, self._user, self._line)
                if why:
                    self.finish(why)
        elif not self._shell.waits(self.vehicle):
            self.lines = self._answer()
            ended = self._shell.answered(self.vehicle)
            self.finish("" if ended else "it has not come to an end: what came is shown")

    def abort(self) -> None:
        """Close the shell of the vehicle."""
        self._shell.close(self.vehicle, self._user)

    def finish(self, error: str = "") -> None:
        """End the job and close the shell."""
        if not self.over:
            self._shell.close(self.vehicle, self._user)
        super().finish(error)

    def _answer(self) -> list[SafeText]:
        """Return what was received after the echo of the line, without prompts."""
        lines = list(self._shell.lines(self.vehicle))
        echo = next((at for at, line in enumerate(lines) if line.endswith(self._line)), -1)
        plain = [SafeText(line.removeprefix(_PROMPTS[0]).removeprefix(_PROMPTS[1])) for line in lines[echo + 1 :]]
        return plain[:-1] if plain and not plain[-1] else plain
