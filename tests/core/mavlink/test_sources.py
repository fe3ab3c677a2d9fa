"""Slots of a source: one system's are forgotten, those nobody needs are taken out, and what they counted stays."""

from tui_gcs.core.mavlink.sources import Slot, Source, Stream

HEARTBEAT, UNKNOWN = 0, 50_000


def with_slots(*systems: int) -> Source:
    """Each system has sent one frame of a known and one of an unknown message."""
    source = Source("", "link", ("10.0.0.1", 14550))
    for system in systems:
        stream = source.streams[(system, 1)] = Stream(source)
        for msgid in (HEARTBEAT, UNKNOWN):
            slot = Slot(stream, system, 1, msgid)
            slot.count = 1
            source.keep(bytes((system, 1)) + msgid.to_bytes(3, "little"), slot)
    return source


def systems(source: Source) -> list[int]:
    return [slot.system for slot in (*source.slots.values(), *source.unknown.values())]


def test_one_system_is_forgotten_or_all_are() -> None:
    source = with_slots(1, 2)
    stream = source.streams[(1, 1)]
    source.forget(1)
    source.forget(1)
    assert systems(source) == [2, 2]
    assert (source.frames, stream.frames) == (2, 2)
    source.forget()
    assert systems(source) == [] and source.frames == 4


def test_what_is_not_wanted_is_taken_out_with_senders_that_have_no_vehicle() -> None:
    source = with_slots(1, 2, 3)
    table, theirs = source.slots, source.streams[(3, 1)]
    for slot in (*source.slots.values(), *source.unknown.values()):
        slot.owner = "a vehicle" if slot.system < 3 else None
    source.keep_only(lambda slot: slot.system == 1 and slot.layout is not None)
    assert source.slots is table and systems(source) == [1] and source.unknown == {}
    assert set(source.streams) == {(1, 1), (2, 1)}
    assert (source.frames, theirs.frames) == (5, 2)
    source.forget(2)
    source.forget(1)
    assert systems(source) == [] and source.frames == 6
