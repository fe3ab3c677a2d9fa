"""What the rehearsals screen does: start one, cancel it, copy the path of a report."""

import shlex
from collections.abc import Callable
from pathlib import Path

from textual.screen import Screen

from tui_gcs.client.rehearsal_job import RehearsalJob, RehearsalJobError, parsed_options
from tui_gcs.core.base.clock import Clock
from tui_gcs.core.base.text import clean
from tui_gcs.core.records.rehearsal_store import RehearsalRecord
from tui_gcs.feed.feed import Feed
from tui_gcs.screens.common.screen_edits import ScreenEdits
from tui_gcs.screens.common.sure_dialog import SureDialog
from tui_gcs.widgets.basics.glyphs import GlyphSet
from tui_gcs.widgets.basics.palette import Ink


class RehearsalRuns(ScreenEdits):
    """Works on the background rehearsal of this computer; reports by `report`."""

    def __init__(
        self,
        host: Screen[None],
        feed: Feed,
        clock: Clock,
        glyphs: GlyphSet,
        show: Callable[[], None],
        state: Path | None,
    ) -> None:
        """`state` is the state directory of SIM; None where none is known."""
        super().__init__(host, feed, clock, glyphs, show)
        self.job = RehearsalJob(state) if state is not None else None
        self.unapplied: Callable[[], int] = lambda: 0
        """How many edits of the plan screen the station does not have."""

    def why_not(self) -> str:
        """Return why no rehearsal can be started now; "" where one can."""
        if self.job is None:
            return "no state directory is known to this console: tui-gcs rehearse in a shell"
        if self._feed.status is not None and self._feed.status.replay is not None:
            return "this is a replay: it has no scenario to rehearse"
        if self._feed.scenario is None:
            return "the station's scenario is not known yet"
        if self.job.is_running:
            return "a rehearsal is under way: Del cancels it"
        return self.job.too_busy() if self._flies() else ""

    def _flies(self) -> bool:
        """Whether something flies whose planners need this computer's time; a silent station may still fly."""
        status = self._feed.status
        return status is None or self._feed.station_lost or status.armed > 0

    def default_options(self) -> str:
        """Return the option for the autopilots that are heard, if they are not all ArduPilot."""
        frame = self._feed.frame
        kinds = {name.casefold() for name in (frame.autopilot if frame is not None else ())}
        if "px4" not in kinds:
            return ""
        return "--autopilot px4" if kinds == {"px4"} else "--autopilot mixed"

    def start(self, options: str) -> None:
        """Start a rehearsal of the station's scenario with typed options."""
        why, scenario = self.why_not(), self._feed.scenario
        if why or scenario is None or self.job is None:
            self.say(why, Ink.CAUTION)
            return
        used = {team.planner for team in scenario.scenario.teams}
        planners = [info.file for name, info in self._feed.planner_files.items() if name in used]
        try:
            words = parsed_options(options)
            self.job.start(scenario.scenario.name, scenario.toml, planners, words)
        except RehearsalJobError as error:
            self.say(f"NOT STARTED: {error}", Ink.CAUTION)
            return
        edits = self.unapplied()
        left_out = f"; {edits} edits of the plan screen are not applied and NOT in it" if edits else ""
        text = f"started{' with ' + shlex.join(words) if words else ''}; it goes on when this console is left"
        left_out += "; this computer is busy: it takes longer" if self.job.too_busy() else ""
        self.say(clean(text + left_out, 400), Ink.CAUTION if edits else Ink.NORMAL)

    def cancel(self, on_done: Callable[[], None]) -> None:
        """Ask whether the rehearsal under way is to be ended; `on_done` is called with the answer."""
        job = self.job
        if job is None or not job.is_running:
            self.say("no rehearsal is under way", Ink.CAUTION)
            return

        def answered(yes: bool | None) -> None:
            self.say(job.cancel() if yes else "it goes on")
            on_done()

        reason = "what it has flown so far is lost; no vehicle of the station is concerned"
        self._host.app.push_screen(
            SureDialog("cancel the rehearsal", [reason], "cancel it", self._glyphs, self._clock), answered
        )

    def copy_report(self, record: RehearsalRecord | None) -> None:
        """Send the path of a report to the terminal's clipboard."""
        if record is None or not record.report:
            why = "no rehearsal is chosen" if record is None else "this one has no report"
            self.say(why, Ink.CAUTION)
            return
        self.copy_path(record.report)
