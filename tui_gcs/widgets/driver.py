"""A driver that can tell whether the terminal keeps up.

Textual writes through a queue of 30 whose `put` blocks the event loop; a terminal that stops reading would freeze the
console for seconds (facts/terminal.md B4). The feed posts nothing while this driver lags. Uses two private attributes
of Textual 8.2.8, here and nowhere else; a test fails when they are gone.
"""

from textual.driver import Driver
from textual.drivers.linux_driver import LinuxDriver

QUEUED_WRITES_MAX = 3


class PatientDriver(LinuxDriver):
    """The Unix driver, with a look at its queue of writes."""

    @property
    def lagging(self) -> bool:
        """Whether more writes wait than a terminal that reads would leave waiting."""
        writer = self._writer_thread
        return writer is not None and writer._queue.qsize() > QUEUED_WRITES_MAX


def lagging(driver: Driver | None) -> bool:
    """Whether the terminal behind `driver` is not keeping up; other drivers (headless, web) never lag."""
    return isinstance(driver, PatientDriver) and driver.lagging
