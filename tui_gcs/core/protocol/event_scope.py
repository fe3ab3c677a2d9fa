"""Which vehicles an event concerns: the journal of some vehicles shows the station's and operators' events too."""

import re
from collections.abc import Collection

from tui_gcs.core.protocol.journal import EventClass, JournalEvent

_NAMED = re.compile(r"\bvehicles? \(?[0-9]{1,9}(?:-[0-9]{1,9})?(?:,? [0-9]{1,9}(?:-[0-9]{1,9})?)*")
_RANGE = re.compile(r"([0-9]+)(?:-([0-9]+))?")


def concerns(event: JournalEvent, vehicles: Collection[int]) -> bool:
    """Whether an event comes from one of `vehicles`, or the station or an operator names one of them in its text.

    What an operator orders without naming any vehicle concerns all of them.
    """
    kind, _, name = event.source.partition(" ")
    if kind == "vehicle":  # what a vehicle says of others is not believed
        return name.isdecimal() and int(name) in vehicles
    named = [match[0] for match in _NAMED.finditer(event.text)]
    # Ids stand in texts as `vehicles 1-3 6`, as `id_ranges` writes them.
    for low, high in _RANGE.findall(" ".join(named)):
        if any(int(low) <= vehicle <= int(high or low) for vehicle in vehicles):
            return True
    return not named and event.cls is EventClass.OPERATOR
