"""The alarms of a run without a console, as lines: without them the output holds figures only."""

from collections.abc import Iterable, Iterator

from tui_gcs.core.protocol.alarms import Alarm, action_words


class AlarmLines:
    """Turns each alarm into a line when it is raised, and again when it is raised for more vehicles or anew."""

    def __init__(self) -> None:
        self._raised: dict[str, int] = {}
        """By cause: the raising that was shown last."""

    def new(self, alarms: Iterable[Alarm]) -> Iterator[str]:
        """The lines of alarms that were not shown yet."""
        for alarm in alarms:
            # Numbers begin anew with the station: another one is another raising.
            if alarm.state != "over" and self._raised.get(alarm.cause) != alarm.raised:
                self._raised[alarm.cause] = alarm.raised
                yield f"{alarm.level.name} {alarm.words()}  -> {action_words(alarm.action, {})}"
