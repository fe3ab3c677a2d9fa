"""Orders to cameras and gimbals: MAVLink's own commands, the same for every autopilot, retried by their class."""

from collections.abc import Callable

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.permission import Order
from tui_gcs.core.services.context import ActionDone, ServiceContext
from tui_gcs.core.uplink.actions import Outcome, RetryClass, VehicleAction

Done = Callable[[Outcome, str], None]
"""Called once with how an order ended: what was seen of it if it was carried out, else why it was not."""


def ignore(outcome: Outcome, why: str) -> None:
    """Do nothing with the end of an order."""


def without_action(on_done: Done) -> ActionDone:
    """`on_done` as a callback of a `VehicleAction`, which passes itself first."""
    return lambda action, outcome, why: on_done(outcome, why)


class PayloadCommands:
    """Submits orders to the components of vehicles."""

    def __init__(self, context: ServiceContext) -> None:
        self._context = context

    def submit(
        self,
        vehicle: Vehicle,
        name: str,
        command: int,
        params: tuple[float, ...],
        on_done: ActionDone | None = None,
        *,
        start: bool = False,
        once: bool = False,
        component: int | None = None,
        shows: Callable[[VehicleAction], bool] | None = None,
        look: Callable[[], None] | None = None,
    ) -> None:
        """Send a COMMAND_LONG to a component, the autopilot by default.

        Args:
            vehicle: The vehicle that carries the component.
            name: The operator's word for the order.
            command: A MAV_CMD.
            params: Its first parameters; the rest are 0.
            on_done: Called once with how it ended.
            start: Whether it is of the start class: no copy leaves later than 2 s after the first.
            once: Whether only one frame may leave, because a second copy would do it twice.
            component: The component id that it is addressed to.
            shows: Whether the effect was seen; without it the ACK is all there is.
            look: See `VehicleAction.look`.
        """
        values = {f"param{i}": float(value) for i, value in enumerate((*params, *([0.0] * 7))[:7], start=1)}
        target = vehicle.component if component is None else component

        def send(copy: int) -> None:
            if not (once and copy):
                fields = {"command": command, "confirmation": min(copy, 255), "target_component": target} | values
                self._context.uplink.action(vehicle.id, Order(name), "COMMAND_LONG", **fields)

        self.submit_action(vehicle, name, command, send, on_done, start=start or once, shows=shows, look=look)

    def submit_action(
        self,
        vehicle: Vehicle,
        name: str,
        command: int,
        send: Callable[[int], object],
        on_done: ActionDone | None,
        *,
        start: bool = False,
        shows: Callable[[VehicleAction], bool] | None = None,
        look: Callable[[], None] | None = None,
    ) -> None:
        """The same for an order that `send` puts on the wire itself."""
        action = VehicleAction(
            vehicle.id,
            name,
            RetryClass.START if start else RetryClass.SET,
            send=send,
            confirmed=lambda _: shows(action) if shows is not None else action.acked_s is not None,
            command=command,
            on_done=on_done,
            look=look,
        )
        self._context.commands.submit(action)
