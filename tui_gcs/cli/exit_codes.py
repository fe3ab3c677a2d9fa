"""How commands end: exit codes, and the error that is one line for the user."""

OK, FAILED, CANNOT = 0, 1, 2
"""All well; it ran and something did not hold; it could not run (one line on stderr)."""


class CommandError(Exception):
    """Why a command cannot run: one line for the user."""
