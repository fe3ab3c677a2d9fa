"""The plan screen's keys for whole parts of a scenario: copies of zones, rounds, teams."""

from collections.abc import Callable

from tui_gcs.screens.common.key_feedback import KeyFeedback
from tui_gcs.widgets.basics.palette import Ink
from tui_gcs.widgets.plan.plan_draft import PlanDraft
from tui_gcs.widgets.plan.scenario_editor import Problems


class PartEdits:
    """Adds, copies and deletes zones, rounds and teams, and reports what was done. Deleting takes a second press."""

    def __init__(self, draft: PlanDraft, feedback: KeyFeedback, refill: Callable[[], None]) -> None:
        """`refill` fills the forms from the draft."""
        self._draft = draft
        self._model = draft.model
        self._feedback = feedback
        self._refill = refill
        self._asked_at = -1

    @property
    def awaits_round(self) -> bool:
        """Whether the next digit is the round that the zone is copied into."""
        return self._feedback.report_count == self._asked_at

    def add_zone(self) -> bool:
        """Add a zone in the middle of the area; return whether it was."""
        problems = self._draft.add_zone()
        if problems:
            self._feedback.report(f"not added: {problems[0]}", Ink.CAUTION)
        else:
            self._refill()
        return not problems

    def delete_zone(self) -> None:
        """Delete the edited zone, at the second press."""
        name = self._draft.zone_name
        question = f"delete zone {name}? Del again deletes it"
        if name is not None and not self._feedback.confirmed(f"delete {name}", question):
            return
        problems = self._draft.delete_zone()
        if problems:
            self._feedback.report(f"not deleted: {problems[0]}", Ink.CAUTION)
        else:
            self._refill()
            self._feedback.report(f"zone {name} deleted, u brings it back")

    def ask_copy(self) -> None:
        """Ask for the round that the edited zone is copied into."""
        name = self._draft.zone_name
        if name is None:
            self._feedback.report("choose a zone: the operating area is each round's own", Ink.CAUTION)
            return
        here = self._model.round_index + 1
        text = f"copy {name}: {here} here, another number into that round, 0 into all others"
        self._feedback.report(text, Ink.CAUTION)
        self._asked_at = self._feedback.report_count

    def copy_to_all(self) -> None:
        """Copy the edited zone into every other round, if the round was asked for."""
        scenario = self._model.scenario
        if self.awaits_round and scenario is not None:
            self.copy_zone([i for i in range(len(scenario.rounds)) if i != self._model.round_index])

    def copy_zone(self, indices: list[int]) -> None:
        """Copy the edited zone into the rounds at `indices`; into its own round as a duplicate."""
        scenario, name = self._model.scenario, self._draft.zone_name
        rounds = len(scenario.rounds) if scenario is not None else 0
        if indices == [self._model.round_index]:
            problems = self._draft.duplicate_zone()
            done = f"{self._draft.zone_name} is a copy of {name}"
        elif not indices or max(indices) >= rounds:
            problems, done = (f"there is no round {indices[0] + 1}" if indices else "there is no other round",), ""
        else:
            problems = self._draft.copy_zone(indices)
            done = f"{name} copied to round {', '.join(str(i + 1) for i in indices)}; u takes it back"
        self._refill()
        self._feedback.report(f"not copied: {problems[0]}" if problems else done, Ink.CAUTION if problems else Ink.TEXT)

    def add_round(self) -> None:
        """Add a round like the edited one."""
        self._report("added", self._draft.rounds.add_round(), "a round like the one before; u takes it back")

    def delete_round(self) -> None:
        """Delete the edited round, at the second press."""
        current = self._model.current_round
        if current is not None and self._feedback.confirmed(
            "delete round", f"delete {current.name}? X again deletes it"
        ):
            self._report("deleted", self._draft.rounds.remove_round(), f"{current.name} deleted, u brings it back")

    def add_team(self) -> None:
        """Add a team of one vehicle and put it into the form."""
        problems, name = self._draft.teams.add_team()
        self._draft.team_name = self._draft.team_name if problems else name
        self._report("added", problems, f"{name} added with a vehicle, its place and layer")

    def delete_team(self) -> None:
        """Delete the team in the form, at the second press."""
        team = self._draft.team
        if team is None:
            return
        if self._feedback.confirmed(f"delete team {team.name}", f"delete team {team.name}? Del again"):
            problems = self._draft.teams.remove_team(team.name)
            self._report("deleted", problems, f"{team.name} deleted, u brings it back")

    def _report(self, what: str, problems: Problems, done: str) -> None:
        """Fill the forms again, and report what was done or why not."""
        self._refill()
        self._feedback.report(f"not {what}: {problems[0]}" if problems else done)
