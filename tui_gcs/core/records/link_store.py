"""The link store: changes of links and forwarding partners that operators made while the station ran, in one file.

In LIVE a link that was added is opened at every later start, until it is closed; in SIM it holds until this run ends,
because its vehicles end with it. An added partner is treated alike, but its permission to send commands is given for
one run: at a later start it only listens. Closing what the command line named, and another rate for it, hold until this
run ends. All of it holds after `kill -9` of the station: that is the same run.
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
    """The run in which `closed`, `reopened`, `rates`, `commanding` and `partners_closed` hold."""
    added: dict[str, str] = {}
    """By name, what was typed to open it."""
    added_rates: dict[str, int | None] = {}
    """Rates of added links, bytes per second; None: no limit."""
    closed: dict[str, str] = {}
    """Links of the command line that are closed, and by whom."""
    reopened: dict[str, str] = {}
    """Links of the command line that were closed and opened again, and what was typed for that."""
    rates: dict[str, int | None] = {}
    """Rates of links of the command line."""
    partners: dict[str, str] = {}
    """By name, what was typed to forward there."""
    commanding: dict[str, bool] = {}
    """By name, whether commands of an added partner are judged, and not all refused."""
    partners_closed: dict[str, str] = {}
    """Partners of the command line that are closed, and by whom."""


class LinkStore:
    """Reads the file once, and replaces it atomically with every change. Never raises."""

    def __init__(self, path: Path, run: str, *, keeps_added: bool = True) -> None:
        """Read `path`; a file that cannot be read counts as lost, see `lost`.

        `run` is the name of this run; `keeps_added` says whether what is added is there again in later runs.
        """
        self._path = path
        self.keeps_added = keeps_added
        self.lost = ""
        """Why the changes of earlier are not known although there were some; "" otherwise."""
        self.error = ""
        """Why the newest change could not be written; "" if it could."""
        self.ended_permissions: tuple[str, ...] = ()
        """Added partners whose commands were judged in an earlier run, and that only listen in this one."""
        self._kept = self._read()
        if self._kept.run != run:
            self._begin(run)

    def _begin(self, run: str) -> None:
        """Forget what held in an earlier run only."""
        earlier, self._kept = self._kept, _KeptLinks(run)
        if self.keeps_added:
            self._kept.added, self._kept.added_rates = earlier.added, earlier.added_rates
            self._kept.partners = earlier.partners
            self.ended_permissions = tuple(name for name in earlier.partners if earlier.commanding.get(name))
        if earlier != _KeptLinks(earlier.run, earlier.added, earlier.added_rates, partners=earlier.partners):
            self._write()

    @property
    def added(self) -> dict[str, str]:
        """By name, the text of each link that was added and not closed since."""
        return dict(self._kept.added)

    @property
    def closed(self) -> dict[str, str]:
        """By name, who closed a link of the command line in this run."""
        return dict(self._kept.closed)

    @property
    def reopened(self) -> dict[str, str]:
        """By name, the text by which a link of the command line was opened again in this run."""
        return dict(self._kept.reopened)

    @property
    def rates(self) -> dict[str, int | None]:
        """By name, the rate that an operator gave a link, bytes per second."""
        return self._kept.rates | self._kept.added_rates

    @property
    def partners(self) -> dict[str, tuple[str, bool]]:
        """By name, the text of each partner that was added and not closed since, and whether it may command."""
        return {name: (text, self._kept.commanding.get(name, False)) for name, text in self._kept.partners.items()}

    @property
    def partners_closed(self) -> dict[str, str]:
        """By name, who closed a partner of the command line in this run."""
        return dict(self._kept.partners_closed)

    def keep_added(self, name: str, text: str) -> None:
        """Keep a link that was opened, with the options that were typed."""
        self._kept.added_rates.pop(name, None)
        self._kept.rates.pop(name, None)
        if self._kept.closed.pop(name, None) is None:
            self._kept.added[name] = text
        else:
            self._kept.reopened[name] = text
        self._write()

    def keep_closed(self, name: str, by: str) -> None:
        """Keep that a link was closed; one that was added is forgotten."""
        self._kept.added_rates.pop(name, None)
        self._kept.reopened.pop(name, None)
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

    def keep_partner(self, name: str, text: str, *, takes_commands: bool) -> None:
        """Keep a partner that was added, or one of the command line that was closed and added again."""
        self._kept.partners[name] = text
        self._kept.commanding[name] = takes_commands
        self._write()

    def keep_partner_closed(self, name: str, by: str, *, is_given: bool) -> None:
        """Keep that a partner was closed; one that was added is forgotten. `is_given`: the command line names it."""
        self._forget_partner(name)
        if is_given:
            self._kept.partners_closed[name] = by
        self._write()

    def forget_partner(self, name: str) -> None:
        """Forget an added partner that the command line names now."""
        self._forget_partner(name)
        self._write()

    def _forget_partner(self, name: str) -> None:
        self._kept.partners.pop(name, None)
        self._kept.commanding.pop(name, None)

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
