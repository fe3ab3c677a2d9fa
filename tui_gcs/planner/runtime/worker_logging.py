"""Logging of a planner worker: each line of a record begins with its level, for the station's planner log.

The form is that of sd-daemon(3): `<4>text` on stderr, with the syslog priority of the level. The station reads it in
`core/process/worker_output.py` and adds time, team and planner.
"""

import logging
import sys

PRIORITIES = ((logging.CRITICAL, 2), (logging.ERROR, 3), (logging.WARNING, 4), (logging.INFO, 6))
"""Syslog priorities by the least level that has them; below are debug records."""
DEBUG_PRIORITY = 7


class PriorityFormatter(logging.Formatter):
    """Writes the syslog priority before every line of a record, those of a traceback included."""

    def format(self, record: logging.LogRecord) -> str:
        """See `logging.Formatter`."""
        priority = next((number for level, number in PRIORITIES if record.levelno >= level), DEBUG_PRIORITY)
        lines = super().format(record).splitlines() or [""]
        return "\n".join(f"<{priority}>{line}" for line in lines)


def set_up() -> None:
    """Log to stderr from level INFO on, and write what is printed line by line.

    A planner that wants its debug records lowers the level of its own logger.
    """
    handler = logging.StreamHandler()
    handler.setFormatter(PriorityFormatter("%(name)s: %(message)s"))
    logging.basicConfig(level=logging.INFO, handlers=[handler])
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(line_buffering=True)  # into a pipe it would come in blocks of 8 kB
