"""The dialog of teams and planners, with everything that the panels of a small terminal have no room for."""

from textwrap import wrap

from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.common import TeamStatus
from tui_gcs.core.protocol.metric_names import all_words
from tui_gcs.feed.feed import Feed
from tui_gcs.feed.messages import StatusUpdated
from tui_gcs.screens.common.text_dialog import LINE_CELLS, ScrolledDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.lines_view import Line
from tui_gcs.widgets.basics.number_text import packed
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.fleet.planner_panel import fleet_lines, team_lines


class PlannersDialog(ScrolledDialog):
    """A dialog over any screen that follows the station's status."""

    LEAVE_KEYS = (*ScrolledDialog.LEAVE_KEYS, "M")
    title_text = "teams and planners"

    def __init__(self, feed: Feed, glyphs: GlyphSet) -> None:
        super().__init__(glyphs)
        self._feed = feed

    def on_mount(self) -> None:
        """Begin to receive the feed's messages."""
        super().on_mount()
        self._feed.listen(self)

    def on_status_updated(self, _message: StatusUpdated) -> None:
        """Show the new figures of the planners."""
        self.redraw()

    def all_lines(self) -> list[Line]:
        """Return a paragraph for each team, then the lines about the whole fleet."""
        status = self._feed.status
        if status is None:
            return [[("no station is heard yet", Ink.MUTED)]]
        paragraphs = [[*team_text(team, self.glyphs), []] for team in status.teams]
        return [*(line for lines in paragraphs for line in lines), *fleet_lines(status)]


def team_text(team: TeamStatus, glyphs: GlyphSet) -> list[Line]:
    """Return all lines about a team, with its planner's own metrics and error text."""
    whose = vehicles_words(team.members) if team.members else "no vehicles"
    title = f"{team.name}: {whose}, {team.planner} at {team.rate_hz:g} Hz {team.worker}"
    counted = packed(all_words(team.metrics), LINE_CELLS - 2)
    failed = [part for line in team.error.splitlines() for part in wrap(line, LINE_CELLS - 2)]
    return [
        [(title[:LINE_CELLS], Ink.BOLD)],
        *team_lines(team, glyphs),
        *([(f"  {line}", Ink.MUTED)] for line in counted),
        *([(f"  {line}", Ink.CAUTION)] for line in failed),
    ]
