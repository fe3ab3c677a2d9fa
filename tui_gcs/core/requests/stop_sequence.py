"""Stops in the order in which they were given: for each vehicle the newest counts, whenever the others arrive."""

from collections.abc import Callable
from functools import partial
from typing import Protocol

from tui_gcs.core.protocol.alarms import vehicles_words
from tui_gcs.core.protocol.base import StopRequest
from tui_gcs.core.protocol.common import Reply, VehicleResult


class StopFleet(Protocol):
    """How the fleet is stopped, e.g. `Executive.hold`."""

    def __call__(self, vehicles: tuple[int, ...], but: tuple[int, ...] = (), *, by: str) -> tuple[VehicleResult, ...]:
        """Stop these vehicles, or all, without those in `but`; `by` ordered it, for the journal."""
        ...


class StopSequence:
    """Carries out stops, and leaves out of a late one the vehicles that have obeyed a newer one.

    A console repeats a stop that is not answered. Without this, a HOLD ALL that was not heard would, repeated, stop a
    vehicle that was ordered to land meanwhile.
    """

    def __init__(self) -> None:
        self._newest_ns = 0
        self._obeyed_ns: dict[int, int] = {}
        """When the newest stop that a vehicle obeyed was given, by vehicle."""

    def handler(self, what: str, act: StopFleet) -> Callable[[str, StopRequest], Reply]:
        """A handler that carries out stops by `act`; `what` names them in the reply."""
        return partial(self._carry_out, what, act)

    def _carry_out(self, what: str, act: StopFleet, principal: str, request: StopRequest) -> Reply:
        given_ns = request.given_ns or self._newest_ns + 1
        self._newest_ns = max(self._newest_ns, given_ns)
        newer = tuple(vehicle for vehicle, ns in self._obeyed_ns.items() if ns > given_ns)
        results = act(request.vehicles, newer, by=principal)
        self._obeyed_ns |= {result.vehicle: given_ns for result in results if result.ok}
        return stop_reply(what, request, results, newer)


def stop_reply(
    what: str, request: StopRequest, results: tuple[VehicleResult, ...], newer: tuple[int, ...] = ()
) -> Reply:
    """The reply to a stop: ok if every vehicle concerned got it; each one that was named has a result.

    Those in `newer` obey a newer stop: they have no result.
    """
    answered = {result.vehicle for result in results}
    left_out = [v for v in request.vehicles if v not in answered and v not in newer]
    results += tuple(VehicleResult(vehicle=v, ok=False, text="is not known or not in the air") for v in left_out)
    if not results:
        return Reply(ok=False, text="all obey a newer stop" if newer else "no vehicle is in the air")
    good = [r.vehicle for r in results if r.ok]
    whole = len(good) == len(results)
    share = "" if whole else f"{len(good)} of {len(results)}" + (": " if good else "")
    confirmed = vehicles_words(good) if good else ""
    return Reply(ok=whole, text=f"{what}: {share}{confirmed}", results=results)
