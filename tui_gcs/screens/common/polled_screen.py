"""The base of list screens whose rows the station is asked for again and again while they are shown."""

from typing import ClassVar

from tui_gcs.screens.common.list_screen import ListScreen


class PolledScreen(ListScreen):
    """Asks the station every `LOOK_S` seconds, one question at a time; a screen that is not shown costs nothing."""

    LOOK_S: ClassVar[float]
    NEEDS_STATION: ClassVar[bool] = True
    """Whether the station is asked; a screen that looks at the disk also does so while none answers."""

    is_frozen = False
    """The picture stays as it is: nothing is asked."""
    _is_looking = False

    def on_mount(self) -> None:
        """Begin to receive the feed's messages, and to ask."""
        self.feed.listen(self)
        self.set_interval(self.LOOK_S, self.look)

    def look(self) -> None:
        """Ask the station; not while another screen is shown, nor while the picture is frozen."""
        unanswered = self.NEEDS_STATION and self.feed.station_lost
        if self.is_current and not self.is_frozen and not self._is_looking and not unanswered:
            self._is_looking = True
            self.run_worker(self._look(), group="look", exit_on_error=False)

    async def _look(self) -> None:
        try:
            await self.ask_station()
        finally:
            self._is_looking = False

    async def ask_station(self) -> None:
        """Ask for what the screen shows, and show it."""
        raise NotImplementedError
