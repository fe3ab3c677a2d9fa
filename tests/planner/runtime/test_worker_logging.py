"""Log records of a planner worker: the level stands before each line."""

import logging

from tui_gcs.planner.runtime.worker_logging import PriorityFormatter


def test_every_line_of_a_record_has_its_priority() -> None:
    formatter = PriorityFormatter("%(name)s: %(message)s")

    def text(level: int, message: str) -> str:
        return formatter.format(logging.LogRecord("mine", level, "", 0, message, None, None))

    assert text(logging.WARNING, "low\non ideas") == "<4>mine: low\n<4>on ideas"
    levels = (logging.DEBUG, logging.INFO, 25, logging.ERROR, logging.CRITICAL)
    assert [text(level, "")[:3] for level in levels] == ["<7>", "<6>", "<6>", "<3>", "<2>"]
