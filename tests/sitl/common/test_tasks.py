"""Long jobs of a simulated vehicle."""

from collections.abc import Iterator

from sitl.common.tasks import NEVER_US, Tasks


def counting(done: list[int], wait_us: int, n: int) -> Iterator[int]:
    for k in range(n):
        done.append(k)
        yield wait_us


def test_rates_are_exact_whatever_the_tick():
    tasks, done = Tasks(), []
    tasks.start("list", counting(done, 700, 1000), 0)
    assert done == [0]
    tasks.run(50_000)
    assert len(done) == 1 + 50_000 // 700
    tasks.run(1_000_000)
    assert len(done) == 1000
    assert "list" not in tasks
    assert tasks.next_us == NEVER_US


def test_a_task_of_the_same_name_takes_its_place():
    tasks, old, new = Tasks(), [], []
    tasks.start("list", counting(old, 1000, 9), 0)
    tasks.start("list", counting(new, 1000, 3), 0)
    tasks.run(10_000)
    assert (old, new) == ([0], [0, 1, 2])


def test_a_task_may_stop_itself_and_start_others():
    tasks, said = Tasks(), []

    def act() -> None:
        said.append("first")
        tasks.after("again", 5, lambda: said.append("second"), 10)

    tasks.after("again", 10, act, 0)
    assert tasks.next_us == 10
    tasks.run(10)
    assert said == ["first"]
    tasks.run(15)
    assert said == ["first", "second"]
    assert tasks.next_us == NEVER_US


def test_clear_ends_all():
    tasks, done = Tasks(), []
    tasks.start("a", counting(done, 10, 5), 0)
    tasks.clear()
    tasks.run(1000)
    assert done == [0]
