"""Journal reader: reads a journal backwards, a piece at a time, for the history on the screen."""

from pathlib import Path

import msgspec

from tui_gcs.core.protocol.journal import JOURNAL_END, JournalEvent

PIECE_BYTES = 64 * 1024
"""Read for one answer: some hundred lines, a few milliseconds."""
_decoder = msgspec.json.Decoder(JournalEvent)


def events_before(path: Path, before: int, piece_bytes: int = PIECE_BYTES) -> tuple[tuple[JournalEvent, ...], int]:
    """Return the events in the piece of the file that ends at byte `before`, oldest first, and where that piece begins.

    `JOURNAL_END` is the end of the file. 0 is returned where nothing is older, or the file cannot be read. Other
    records of the journal, and a line that is longer than a piece, are left out.
    """
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            end = size if before == JOURNAL_END else max(0, min(before, size))
            begin = max(0, end - piece_bytes)
            file.seek(begin)
            piece = file.read(end - begin)
    except OSError:
        return (), 0
    if begin:
        newline = piece.find(b"\n")
        if newline < 0:
            return (), begin  # part of one huge line
        # The piece begins inside a line, which belongs to the piece before it.
        piece, begin = piece[newline + 1 :], begin + newline + 1
        if not piece:  # the piece is the end of one line
            begin = max(0, end - piece_bytes)
    return tuple(event for line in piece.splitlines() if (event := journal_event(line)) is not None), begin


def journal_event(line: bytes) -> JournalEvent | None:
    """Return the event in one line of a journal; None for other records and damaged lines."""
    try:
        return _decoder.decode(line)
    except (msgspec.MsgspecError, UnicodeDecodeError):
        return None
