"""The mission protocol as far as both autopilots serve it alike: the messages, and how items are sent."""

from abc import ABC, abstractmethod

from sitl.common import missions
from sitl.common.autopilot import Handler
from sitl.common.missions import Item
from sitl.common.platform import Part
from sitl.links.wire import ReceivedFrame


class MissionServer(Part, ABC):
    """Serves the plans of one vehicle. What is stored, requested and refused is each autopilot's own."""

    _count: Handler
    _item: Handler
    _request_list: Handler
    _clear_all: Handler
    """Handlers that each autopilot has of its own."""

    def handlers(self) -> dict[str, Handler]:
        """Return the handlers of this service."""
        return {
            "MISSION_COUNT": self._count,
            "MISSION_ITEM_INT": lambda frame: self._take(frame, missions.item_of(frame.fields)),
            "MISSION_ITEM": self._item,
            "MISSION_REQUEST_LIST": self._request_list,
            "MISSION_REQUEST_INT": self._request,
            "MISSION_REQUEST": self._request,
            "MISSION_CLEAR_ALL": self._clear_all,
        }

    @abstractmethod
    def _take(self, frame: ReceivedFrame, new: Item) -> None:
        """Take an item of an upload."""

    @abstractmethod
    def _requested_item(self, frame: ReceivedFrame) -> Item | None:
        """Return the item that is requested; None after a refusal."""

    @abstractmethod
    def _as_read(self, item: Item, *, whole: bool) -> Item:
        """Return a stored item as a station reads it; `whole` is MISSION_ITEM_INT."""

    def _request(self, frame: ReceivedFrame) -> None:
        """Send an item; the old MISSION_REQUEST is answered with a rough place."""
        item, seq, kind = self._requested_item(frame), frame.fields["seq"], frame.fields["mission_type"]
        if item is None:
            return
        if frame.name == "MISSION_REQUEST_INT":
            fields = self._as_read(item, whole=True).fields(seq)
            self._outbox.reply(frame, "MISSION_ITEM_INT", mission_type=kind, **fields)
        else:
            fields = missions.float_fields(self._as_read(item, whole=False), seq)
            self._outbox.reply(frame, "MISSION_ITEM", mission_type=kind, **fields)

    def _acknowledge(self, frame: ReceivedFrame, result: int, kind: int, opaque_id: int = 0) -> None:
        self._outbox.reply(frame, "MISSION_ACK", type=result, mission_type=kind, opaque_id=opaque_id)
