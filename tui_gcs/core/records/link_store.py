"""The link store: changes of links that operators made while the station ran, in one small JSON file of its kind.

A link that was added is opened at every later start, until it is closed. Closing a link of the command line and
another rate for it hold until this run ends, also after `kill -9`: at the next start the command line counts again.
"""

import logging
from pathlib import Path

import msgspec

from tui_gcs.core.base.file_replacement import replace_file

log = logging.getLogger("tui_gcs.station")

MAX_FILE_BYTES = 100_000
FILE = "links.json"


class _KeptLinks(msgspec.Struct):
    run: str = ""
    """The run in which `closed` and `rates` hold."""
    added: dict[str, str] = {}
    """By name, what was typed to open it."""
    added_rates: dict[str, int | None] = {}
    """Rates of added links, bytes per second; None: no limit."""
    closed: dict[str, str] = {}
    """Links of the command line that are closed, and by whom."""
    rates: dict[str, int | None] = {}
    """Rates of links of the command line."""


class LinkStore:
    """Reads the file once, and replaces it atomically with every change. Never raises."""

    def __init__(self, path: Path, run: str) -> None:
        """Read `path`; a file that cannot be read counts as lost, see `lost`. `run` is the name of this run."""
        self._path = path
        self.lost = ""
        """Why the changes of earlier are not known although there were some; "" otherwise."""
        self.error = ""
        """Why the newest change could not be written; "" if it could."""
        self._kept = self._read()
        if self._kept.run != run:
            self._kept = _KeptLinks(run, self._kept.added, self._kept.added_rates)

    @property
    def added(self) -> dict[str, str]:
        """By name, the text of each link that was added and not closed since."""
        return dict(self._kept.added)

    @property
    def closed(self) -> dict[str, str]:
        """By name, who closed a link of the command line in this run."""
        return dict(self._kept.closed)

    @property
    def rates(self) -> dict[str, int | None]:
        """By name, the rate that an operator gave a link, bytes per second."""
        return self._kept.rates | self._kept.added_rates

    def keep_added(self, name: str, text: str, bytes_per_s: int | None) -> None:
        """Keep a link that was opened; of one of the command line that is open again only its rate."""
        self._kept.added_rates.pop(name, None)
        if self._kept.closed.pop(name, None) is None:
            self._kept.added[name] = text
        else:
            self._kept.rates[name] = bytes_per_s
        self._write()

    def keep_closed(self, name: str, by: str) -> None:
        """Keep that a link was closed; one that was added is forgotten."""
        self._kept.added_rates.pop(name, None)
        if self._kept.added.pop(name, None) is None:
            self._kept.closed[name] = by
        self._write()

    def keep_rate(self, name: str, bytes_per_s: int | None) -> None:
        """Keep the rate of a link."""
        rates = self._kept.added_rates if name in self._kept.added else self._kept.rates
        rates[name] = bytes_per_s
        self._write()

    def forget_added(self, name: str) -> None:
        """Forget a link that the command line names now."""
        self._kept.added.pop(name, None)
        self._kept.added_rates.pop(name, None)
        self._write()

    def _read(self) -> _KeptLinks:
        try:
            with self._path.open("rb") as file:
                return msgspec.json.decode(file.read(MAX_FILE_BYTES), type=_KeptLinks)
        except FileNotFoundError:
            return _KeptLinks()
        except (OSError, msgspec.MsgspecError, UnicodeDecodeError) as error:
            self.lost = f"{self._path}: {error}"
            return _KeptLinks()

    def _write(self) -> None:
        try:
            replace_file(self._path, msgspec.json.format(msgspec.json.encode(self._kept), indent=1), sync=False)
        except OSError as error:
            self.error = f"{self._path}: {error.strerror or error}"
            log.error("changes of links cannot be kept: %s", self.error)
        else:
            self.error = ""
