"""Exit codes of all commands, and the error that ends a command with one line."""

OK, FAILED, CANNOT = 0, 1, 2
"""The codes for success, for a check or order that failed, and for a command that could not run."""


class CommandError(Exception):
    """Raised where a command cannot run. Its text is the one line that the user reads."""
