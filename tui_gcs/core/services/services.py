"""All MAVLink services of a station, made and ticked in one place."""

from tui_gcs.core.services.context import Context


class Services:
    """One of each; see their modules."""

    def __init__(self, context: Context) -> None:
        """Make them all; they listen from now on."""
        self.context = context

    def tick(self) -> None:
        """Everything that is due in the services (jobs are ticked by the desk)."""
