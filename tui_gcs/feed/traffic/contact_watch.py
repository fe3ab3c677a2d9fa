"""What flies beside the fleet, as far as this console asks the station for it."""

from collections.abc import Callable

from tui_gcs.core.geometry.local_frame import LocalFrame
from tui_gcs.core.protocol.setup import GetRemoteIds, GetTraffic, RemoteIdRow, TrafficRow
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.traffic.contacts import Contact, contacts, of_remote_ids, of_tracks, of_traffic


class ContactWatch:
    """Asks for ADS-B and Remote ID; tracks are in the fleet frame anyway."""

    def __init__(self, feed: Feed, on_news: Callable[[], None]) -> None:
        """Ask the station of `feed`; `on_news` is called after every answer."""
        self._feed = feed
        self._on_news = on_news
        self._traffic: tuple[TrafficRow, ...] = ()
        self._remote_ids: tuple[RemoteIdRow, ...] = ()

    async def look(self) -> None:
        """Ask once."""
        traffic = await self._feed.requests.send(GetTraffic())
        remote_ids = await self._feed.requests.send(GetRemoteIds(()))
        if traffic.ok:
            self._traffic = traffic.traffic
        if remote_ids.ok:
            self._remote_ids = remote_ids.remote_ids
        self._on_news()

    def contacts(self) -> list[Contact]:
        """Return all contacts, the most pressing first."""
        frame, scenario = self._feed.frame, self._feed.scenario
        seen = of_tracks(frame.tracks, frame.t_s) if frame is not None else []
        if scenario is not None:
            local = LocalFrame(scenario.scenario.origin)
            seen += [*of_traffic(self._traffic, local), *of_remote_ids(self._remote_ids, local)]
        return contacts(seen, frame)
