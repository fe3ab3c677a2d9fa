"""What is known of one vehicle's parameters: by name, for indices shift while it runs (px4.md)."""

from collections.abc import Iterable

from tui_gcs.core.services.parameters.param_values import Param

MOST_NAMES = 4096
"""Per vehicle; real ones have some 900 to 1400 (security.md B.6-69)."""


class ParamTable:
    """Parameters by name."""

    def __init__(self) -> None:
        """Nothing known."""
        self.params: dict[str, Param] = {}
        self.complete = False
        """All were fetched since it booted; what changed since was told or set by us."""

    def put(self, param: Param) -> bool:
        """Take a value that was told; a default that is known stays. False if there is no room."""
        before = self.params.get(param.name)
        if before is None and len(self.params) >= MOST_NAMES:
            return False
        if before is not None and before.default is not None and param.default is None and before.type == param.type:
            param = Param(param.name, param.value, param.type, before.default)
        self.params[param.name] = param
        return True

    def fill(self, params: Iterable[Param]) -> None:
        """These are all there are."""
        self.params = {}
        for param in params:
            self.put(param)
        self.complete = True

    def forget(self) -> None:
        """It rebooted: names and types may be other ones, and values those that were stored."""
        self.params, self.complete = {}, False
