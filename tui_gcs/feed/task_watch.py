"""What goes on at the station and who is connected, as far as this console asks for it."""

from collections.abc import Callable

from tui_gcs.core.protocol.people import GetPeople, PersonRow
from tui_gcs.core.protocol.services import GetTasks, TaskInfo
from tui_gcs.feed.requests import ConsoleRequests


class TaskWatch:
    """Asks the station for its tasks and for who is connected."""

    def __init__(self, requests: ConsoleRequests, on_news: Callable[[], None]) -> None:
        """Ask by `requests`; `on_news` is called after every answer."""
        self.tasks: tuple[TaskInfo, ...] = ()
        """Those under way first, then the newest."""
        self.people: tuple[PersonRow, ...] = ()
        self._requests = requests
        self._on_news = on_news

    async def look(self) -> None:
        """Ask once."""
        tasks, people = await self._requests.send(GetTasks()), await self._requests.send(GetPeople())
        if tasks.ok:
            self.tasks = tuple(sorted(tasks.tasks, key=lambda task: (task.over, -task.number)))
        if people.ok:
            self.people = tuple(sorted(people.people, key=lambda row: (not row.is_present, row.principal)))
        self._on_news()
