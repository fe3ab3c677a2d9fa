"""The driver that waits for no terminal, and the parser that loses no Esc."""

import pytest
from textual.drivers import linux_driver
from textual.drivers._writer_thread import MAX_QUEUED_WRITES as TEXTUAL_MAX
from textual.drivers._writer_thread import WriterThread
from textual.drivers.linux_driver import LinuxDriver
from textual.events import Key

from tui_gcs.terminal.private.driver import MAX_QUEUED_WRITES, NonBlockingDriver, lagging, non_blocking
from tui_gcs.terminal.private.key_parser import EscapeKeyParser


@pytest.mark.parametrize("behind", ["!", ":", "h", "f", "?", "\r"])
def test_a_key_right_behind_escape_is_a_key(behind: str) -> None:
    """As tmux sends them, which holds Esc back to see whether a sequence follows."""
    assert non_blocking(LinuxDriver) is NonBlockingDriver
    assert linux_driver.XTermParser is EscapeKeyParser
    parser = EscapeKeyParser()
    read = [*parser.feed(f"\x1b{behind}"), *parser.feed("\x1b[A")]
    assert [key.character for key in read if isinstance(key, Key)] == ["\x1b", behind, None]


@pytest.mark.parametrize(("sent", "name"), [("\x1b[A", "up"), ("\x1b[1;5C", "ctrl+right"), ("\x1b[Z", "shift+tab")])
def test_sequences_are_read_as_ever(sent: str, name: str) -> None:
    assert [key.key for key in EscapeKeyParser().feed(sent) if isinstance(key, Key)] == [name]


def test_a_driver_with_more_writes_waiting_than_a_terminal_that_reads_leaves_lags() -> None:
    writer = WriterThread(None)
    assert MAX_QUEUED_WRITES < TEXTUAL_MAX
    driver = NonBlockingDriver.__new__(NonBlockingDriver)
    driver._writer_thread = writer
    assert not lagging(driver)
    for _ in range(MAX_QUEUED_WRITES + 1):
        driver.write("x")
    assert lagging(driver)
    for _ in range(TEXTUAL_MAX):
        driver.write("lost where the queue is full, and never waited for")
    assert not lagging(None)
