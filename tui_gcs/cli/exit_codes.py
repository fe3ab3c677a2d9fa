"""Exit codes of all commands, what scripts read beside them, and the error that ends a command with one line."""

from enum import StrEnum

OK, FAILED, CANNOT = 0, 1, 2
"""The codes for success, for a check or order that failed, and for a command that could not run."""


class ReportCode(StrEnum):
    """Why something is not ok, for programs: they decide by this, and never by the text beside it."""

    NONE = ""
    """It is ok."""
    FAILED = "failed"
    """It was tried and did not come about, or a check does not hold."""
    REFUSED = "refused"
    """The station, a vehicle or the user refused it; nothing was done."""
    CANCELLED = "cancelled"
    """The user cancelled it, answered no, or interrupted the command (exit code 130)."""
    NOT_CONFIRMED = "not confirmed"
    """Refused only because it may do harm: with `--yes` it would be done."""
    NOT_SEEN = "not seen"
    """The station began it, and telemetry did not show it in time."""
    NO_ANSWER = "no answer"
    """The station did not answer, so it may or may not be carried out."""
    CANNOT_RUN = "cannot run"
    """The command could not run: exit code 2, and the reason is also on stderr."""


class UsageError(SystemExit):
    """Raised for a command line that cannot be understood; its text is on stderr already. The exit code is 2."""

    def __init__(self, text: str) -> None:
        super().__init__(CANNOT)
        self.text = text


class CommandError(Exception):
    """Raised where a command cannot run. Its text is the one line that the user reads; `code` is for scripts."""

    def __init__(self, text: str, code: ReportCode = ReportCode.CANNOT_RUN) -> None:
        super().__init__(text)
        self.code = code
