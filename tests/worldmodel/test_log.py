"""The numbered blocks of one origin, against a plain dict of what has arrived."""

from hypothesis import given
from hypothesis import strategies as st
from small_fleet import BAY, CELL, block

from worldmodel import Block
from worldmodel.holdings import BlockLog


def item(sequence: int) -> Block:
    return block(1, sequence, sequence, (BAY, CELL, float(sequence)))


steps = st.lists(st.tuples(st.integers(0, 7), st.sampled_from(["hold", "note", "forget"])), max_size=40)


@given(steps)
def test_a_log_is_a_dict_of_what_has_arrived(steps: list[tuple[int, str]]) -> None:
    log, arrived = BlockLog(), dict[int, Block | None]()
    for sequence, what in steps:
        if what == "forget":
            if sequence in arrived:
                log.forget(sequence)
                del arrived[sequence]
        else:
            arrived[sequence] = item(sequence) if what == "hold" else None
            log.put(sequence, arrived[sequence])
        highest = next(n for n in range(-1, 8) if n + 1 not in arrived)
        assert log.digest == (highest, sum(1 << (n - highest - 1) for n in arrived if n > highest))
        assert [log.has(n) for n in range(-2, 9)] == [n in arrived for n in range(-2, 9)]
        assert [log.get(n) for n in range(-2, 9)] == [arrived.get(n) for n in range(-2, 9)]
        assert list(log) == [arrived[n] for n in sorted(arrived) if arrived[n] is not None]
