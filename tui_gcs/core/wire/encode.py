"""Making MAVLink 2 frames, through pymavlink's message classes."""

from types import SimpleNamespace
from typing import Any

from tui_gcs.core.wire import dialect

_UNSIGNED = SimpleNamespace(sign_outgoing=False)


class EncodeError(ValueError):
    """A message that cannot be sent: unknown name, missing or unknown field, value out of range."""


class Encoder:
    """Frames of one sender (system and component id), with its own sequence counter."""

    def __init__(self, system: int, component: int) -> None:
        """Send as `system`/`component`."""
        self._sender = SimpleNamespace(seq=0, srcSystem=system, srcComponent=component, signing=_UNSIGNED)

    def encode(self, name: str, /, **fields: Any) -> bytes:
        """The frame of message `name` with `fields` (MAVLink's field names and units).

        Fields that MAVLink added later (extensions) may be left out, all others must be there. Text may be `str`.

        Raises:
            EncodeError: one line saying which message and why.
        """
        try:
            kind = dialect.message_class(name)
            message = kind(**{key: v.encode() if isinstance(v, str) else v for key, v in fields.items()})
            frame: bytes = message.pack(self._sender)
        except KeyError:
            raise EncodeError(f"unknown MAVLink message {name!r}") from None
        except Exception as error:  # generated code: TypeError, struct.error, AttributeError …
            raise EncodeError(f"{name}: {error}") from error
        self._sender.seq = (self._sender.seq + 1) % 256
        return frame
