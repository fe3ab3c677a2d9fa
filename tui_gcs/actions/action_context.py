"""What an action looks at to decide whether it can do anything now."""

from dataclasses import dataclass

from tui_gcs.core.protocol.common import FleetFrame, RunPhase, StationStatus, VehicleRow


@dataclass(frozen=True)
class ActionContext:
    """Fleet, station and this console's selection, at one moment."""

    status: StationStatus | None = None
    frame: FleetFrame | None = None
    selected: tuple[int, ...] = ()
    read_only: str = ""
    """Why this console commands nothing; "" if it may."""
    station_lost: bool = False

    @property
    def run(self) -> RunPhase | None:
        """What the station does with the fleet; None while that is unknown."""
        return self.status.run if self.status is not None else None

    @property
    def silent(self) -> str:
        """Why the station cannot be asked; empty if it can."""
        if self.status is None:
            return "no station is heard yet"
        return "the station is silent" if self.station_lost else ""

    def rows(self) -> dict[int, VehicleRow]:
        """The selected vehicles that the fleet frame has, by id."""
        if self.frame is None:
            return {}
        return {row.id: row for row in self.frame.rows() if row.id in self.selected}
