"""What a bad link does to datagrams, on a virtual clock."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.links.faults import QUEUE_S, FaultError, Faults, FaultyLink, Lane, LinkFaults, parse

ALL = "loss=0.1,delay=200ms,jitter=20%,dup=0.01,reorder=0.05,rate=5760,corrupt=1e-4,flap=2s/2s,burst=0.05/0.3"


def lane(text: str, seed: int = 1, vehicle: int = 0) -> Lane:
    return FaultyLink(parse(text), seed=seed, vehicle=vehicle).down


def run(lane: Lane, count: int, gap_s: float = 0.01, size: int = 50) -> list[tuple[float, int]]:
    """Send numbered datagrams; (when it came, its number) of each that came."""
    came: list[tuple[float, int]] = []
    tick_s = min(gap_s, 0.01)
    ticks = round(gap_s / tick_s)
    for k in range(count * ticks + 200):
        now_s = k * tick_s
        sent = k % ticks == 0 and k < count * ticks
        datagram = (k // ticks).to_bytes(4, "big") + bytes(size - 4) if sent else None
        came += [(now_s, int.from_bytes(data[:4], "big")) for data in lane.step(now_s, datagram)]
    assert lane.due_s == float("inf"), "nothing stays behind"
    return came


def numbers(came: list[tuple[float, int]]) -> list[int]:
    return [number for _, number in came]


# ---------------------------------------------------------------- the text


def test_everything_may_be_said_at_once():
    faults = Faults(0.1, (0.05, 0.3), 0.2, 0.2, 0.01, 0.05, 5760.0, 1e-4, (2.0, 2.0))
    assert parse(ALL) == LinkFaults(faults, faults)
    assert parse("") == LinkFaults()


def test_one_direction_wins_over_both():
    faults = parse("up.loss=30%, loss=0.1, down.delay=1s, down.jitter=0.5")
    assert (faults.up.loss, faults.down.loss) == (0.3, 0.1)
    assert (faults.up.delay, faults.down.delay) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("los=0.1", "names: loss, burst, delay"),
        ("loss", "NAME=VALUE"),
        ("loss=", "share of 0 to 1"),
        ("loss=1.5", "share of 0 to 1"),
        ("loss=nan", "share of 0 to 1"),
        ("loss=-0.1", "share of 0 to 1"),
        ("loss=120%", "share of 0 to 1"),
        ("left.loss=0.1", "up.NAME=VALUE"),
        ("loss=0.1,loss=0.2", "twice"),
        ("delay=200", "200ms or 2s"),
        ("delay=2h", "200ms or 2s"),
        ("delay=infs", "200ms or 2s"),
        ("delay=61s", "0 to 60 s"),
        ("jitter=20%", "give a delay"),
        ("up.delay=1s,jitter=20%", "give a delay"),
        ("rate=0", "bytes per second"),
        ("rate=57k", "bytes per second"),
        ("corrupt=2", "a bit to flip"),
        ("flap=2s", "ON/OFF"),
        ("flap=2s/0s", "ON/OFF"),
        ("burst=0.05", "ENTER/LEAVE"),
        ("burst=0.05/0", "ENTER/LEAVE"),
    ],
)
def test_a_mistake_is_one_clear_line(text, problem):
    with pytest.raises(FaultError, match=problem) as caught:
        parse(text)
    assert "\n" not in str(caught.value)


@given(st.text(alphabet="uplossdelayflaprate.=,%/0123456789mse-naif ", max_size=60))
def test_any_text_is_read_or_refused(text):
    try:
        parse(text)
    except FaultError as error:
        assert "\n" not in str(error)


# ---------------------------------------------------------------- what happens


def test_a_perfect_link_passes_everything_at_once():
    came = run(lane(""), 100)
    assert numbers(came) == list(range(100))
    assert all(abs(now_s - number * 0.01) < 1e-9 for now_s, number in came)


def test_loss_is_as_asked_and_counted():
    link = lane("loss=0.3")
    came = run(link, 10_000)
    assert len(came) == pytest.approx(7000, abs=150)
    assert link.tally.lost == 10_000 - len(came)
    assert numbers(came) == sorted(numbers(came))


def test_bursts_lose_several_in_a_row():
    """Of 0.05/0.3: a seventh of all, 3.3 at a time; single losses of a seventh would come 1.2 at a time."""
    link = lane("burst=0.05/0.3")
    got = set(numbers(run(link, 20_000)))
    lost = [n for n in range(20_000) if n not in got]
    bursts = sum(n - 1 in got for n in lost)
    assert len(lost) / 20_000 == pytest.approx(0.05 / 0.35, rel=0.1)
    assert len(lost) / bursts == pytest.approx(1 / 0.3, rel=0.1)
    assert link.tally.burst == len(lost)


def test_delay_with_jitter_stays_within_and_keeps_the_order():
    link = lane("delay=200ms,jitter=20%")
    came = run(link, 2000)
    late = [now_s - 0.01 * number for now_s, number in came]
    assert numbers(came) == list(range(2000))
    assert 0.16 - 1e-9 <= min(late) < 0.18
    assert 0.23 < max(late) <= 0.25 + 1e-9
    assert link.tally.longest_s <= 0.24 + 1e-9
    assert link.tally.overtaken == 0


def test_reordered_ones_are_overtaken_once():
    link = lane("reorder=0.05")
    came = numbers(run(link, 4000))
    assert sorted(came) == list(range(4000))
    places = [at - number for at, number in enumerate(came)]
    assert set(places) == {-1, 0, 1}
    assert link.tally.overtaken == places.count(1) == pytest.approx(200, rel=0.2)


def test_what_nobody_overtakes_is_let_go():
    link = lane("reorder=1")
    assert link.step(0.0, b"alone") == []
    assert link.due_s == 0.5
    assert link.step(0.4) == []
    assert link.step(0.5) == [b"alone"]


def test_duplicates_come_twice():
    link = lane("dup=0.1")
    came = numbers(run(link, 2000))
    assert set(came) == set(range(2000))
    assert len(came) - 2000 == link.tally.duplicated == pytest.approx(200, rel=0.2)


def test_a_narrow_channel_passes_its_rate_and_queues_for_400_ms():
    link = lane("rate=1000")
    came = run(link, 1000, size=50)  # 5000 B/s for 10 s
    assert len(came) * 50 == pytest.approx(1000 * 10, rel=0.06)
    assert link.tally.queue == 1000 - len(came)
    assert QUEUE_S <= link.tally.longest_s <= QUEUE_S + 0.05 + 1e-6
    assert all(b - a >= 0.05 - 0.011 for (a, _), (b, _) in itertools.pairwise(came)), "spread, not in heaps"


def test_a_channel_that_is_wide_enough_delays_by_its_rate_only():
    link = lane("rate=5000")
    assert len(run(link, 200, size=50)) == 200
    assert link.tally.longest_s == pytest.approx(0.01)


def test_bits_flip_as_often_as_asked():
    link = lane("corrupt=1e-3")
    flipped = 0
    for k in range(500):
        (data,) = link.step(k * 0.01, bytes(100))
        assert len(data) == 100
        flipped += sum(byte.bit_count() for byte in data)
    assert flipped == pytest.approx(500 * 800 * 1e-3, rel=0.1)
    assert link.tally.corrupted == pytest.approx(500 * (1 - (1 - 1e-3) ** 800), rel=0.1)
    assert lane("corrupt=1").step(0.0, b"\x00\xff") == [b"\xff\x00"]


def test_a_flapping_link_is_dead_by_turns_both_ways_together():
    link = FaultyLink(parse("flap=2s/1s"), seed=1, vehicle=0)
    down = [bool(link.down.step(k * 0.1, b"x")) for k in range(300)]
    up = [bool(link.up.step(k * 0.1, b"x")) for k in range(300)]
    assert up == down
    assert sum(down) == pytest.approx(200, abs=10)
    changes = [k for k in range(1, 300) if down[k] != down[k - 1]]
    assert {b - a for a, b in itertools.pairwise(changes)} <= {9, 10, 11, 19, 20, 21}


def test_the_same_seed_gives_the_same_and_vehicles_and_directions_differ():
    def outcome(seed: int, vehicle: int, direction: str) -> list[tuple[float, int]]:
        link = FaultyLink(parse(ALL), seed=seed, vehicle=vehicle)
        return run(getattr(link, direction), 300)

    assert outcome(1, 0, "down") == outcome(1, 0, "down")
    different = [outcome(1, 0, "down"), outcome(1, 0, "up"), outcome(1, 1, "down"), outcome(2, 0, "down")]
    assert all(a != b for k, a in enumerate(different) for b in different[k + 1 :])


@given(
    st.lists(st.tuples(st.floats(0.0, 0.5), st.integers(0, 300)), max_size=60),
    st.sampled_from([ALL, "reorder=0.5,dup=0.5", "delay=1s,jitter=100%,reorder=0.3", "rate=10,corrupt=0.5"]),
)
def test_every_datagram_is_accounted_for(arrivals, text):
    link = lane(text)
    now_s = 0.0
    out = 0
    for gap_s, size in arrivals:
        now_s += gap_s
        out += len(link.step(now_s, bytes(size)))
    while link.due_s < float("inf"):
        now_s = max(now_s, link.due_s)
        out += len(link.step(now_s))
    tally = link.tally
    missing = tally.lost + tally.burst + tally.flap + tally.queue
    assert tally.taken == len(arrivals)
    assert tally.passed == out == tally.taken - missing + tally.duplicated


def test_the_tally_is_a_line_for_people():
    link = lane("loss=0.5,delay=100ms")
    run(link, 100)
    text = link.tally.text()
    assert text.startswith(f"100 in, {link.tally.passed} out; lost {link.tally.lost} (")
    assert "delay 100 ms, at most 100 ms" in text
