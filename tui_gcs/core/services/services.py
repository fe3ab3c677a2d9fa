"""All MAVLink services of a station, made and ticked in one place."""

from tui_gcs.core.services.context import Context
from tui_gcs.core.services.modes import ModeService


class Services:
    """One of each; see their modules."""

    def __init__(self, context: Context) -> None:
        """Make them all; they listen from now on."""
        self.context = context
        self.modes = ModeService(context)

    def tick(self) -> None:
        """Everything that is due in the services (jobs are ticked by the desk)."""
