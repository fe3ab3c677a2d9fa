"""Links, paths and partners, as far as this console asks the station for them."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from tui_gcs.core.protocol.link_report import GetLinks, LinkRow, PartnerRow, PathRow
from tui_gcs.feed.count_rates import CountRates
from tui_gcs.feed.requests import ConsoleRequests

OLD_S = 3.0
"""A path that has been silent for this long is worse than any loss."""


@dataclass(frozen=True)
class WatchedLink:
    """A link, and how much goes over it."""

    row: LinkRow
    in_bytes_per_s: float
    """NaN until it was counted twice."""
    out_bytes_per_s: float


class LinkWatch:
    """Asks the station for its links. While nothing asks here, nothing is done there."""

    def __init__(self, requests: ConsoleRequests, on_news: Callable[[], None]) -> None:
        """Ask by `requests`; `on_news` is called after every answer."""
        self.links: tuple[WatchedLink, ...] = ()
        self.paths: tuple[PathRow, ...] = ()
        self.partners: tuple[PartnerRow, ...] = ()
        self.left_out = 0
        self._requests = requests
        self._on_news = on_news
        self._rates: CountRates[tuple[str, str]] = CountRates()

    def pause(self) -> None:
        """Begin to measure rates anew with the next answer."""
        self._rates.clear()

    async def look(self) -> None:
        """Ask once."""
        found = (await self._requests.send(GetLinks())).link_report
        if found is None:
            return
        counts = {(link.name, "in"): link.bytes_in for link in found.links}
        counts |= {(link.name, "out"): link.bytes_out for link in found.links}
        self._rates.add(found.t_s, counts)
        self.links = tuple(
            WatchedLink(link, self._rates.of((link.name, "in")), self._rates.of((link.name, "out")))
            for link in found.links
        )
        self.paths, self.partners, self.left_out = found.paths, found.partners, found.left_out
        self._on_news()


def badness(path: PathRow) -> tuple[bool, bool, float, float]:
    """Return a key by which the worst path sorts last: silent, not accepted, losses both ways, round trip."""
    losses = path.loss_pct + (0.0 if math.isnan(path.up_loss_pct) else path.up_loss_pct)
    rtt_s = 0.0 if math.isnan(path.rtt_s) else path.rtt_s
    # Rounded, so that rows do not change places with every look.
    return path.heard_age_s > OLD_S, path.state != "used", round(losses, 1), round(rtt_s, 2)
