"""Real managers on a sea where everything goes wrong: any sequence of losses, delays, deaths and restarts.

Two to five vehicles, any policy, packets of any size; clocks differ by less than the slots leave free.
"""

from hypothesis import settings
from hypothesis import strategies as st
from storm_vehicles import creates, maker, maps, schedule_of

from exchange.policies import POLICIES
from remoras.testing.policies import POSITION
from stress.lives import Life
from stress.storm.fates import HEARD, LOST
from stress.storm.machine import storm_machine
from stress.storm.storm import Storm


def storm_of_any(
    n_nodes: int,
    policy: str,
    payload_bytes: int,
    carrier_evidence: bool,
    offsets: list[float],
    n_absent: int,
    crc_bits: int,
    queue_limit: int | None,
) -> Storm:
    make = maker(n_nodes, policy, payload_bytes, carrier_evidence, crc_bits, queue_limit=queue_limit)
    absent = range(n_nodes - n_absent, n_nodes)
    storm = Storm(make, schedule_of(n_nodes), offsets[:n_nodes], absent, tolerates_damage=not crc_bits)
    storm.repeats = POLICIES[policy].repeat  # type: ignore[attr-defined]
    return storm


STORMS = st.builds(
    storm_of_any,
    n_nodes=st.integers(2, 5),
    policy=st.sampled_from(sorted(POLICIES)),
    payload_bytes=st.sampled_from([24, 32, 64]),
    carrier_evidence=st.booleans(),
    offsets=st.lists(st.sampled_from([0.0, 0.2, -0.2]), min_size=5, max_size=5),
    n_absent=st.integers(0, 1),
    crc_bits=st.sampled_from([0, 32]),
    queue_limit=st.sampled_from([None, None, 2]),
)


def map_a_cell(storm: Storm, who: int | Life, number: int) -> None:
    maps(storm, who, 7 * number)


def map_seven_cells(storm: Storm, who: int | Life, number: int) -> None:
    maps(storm, who, *range(7 * number, 7 * number + 7))


def tell_position(storm: Storm, who: int | Life, number: int) -> None:
    life = storm.lives[who] if isinstance(who, int) else who
    storm.record(who, (life.node, POSITION, (float(number % 50), 1.0)))


def create_an_area(storm: Storm, who: int | Life, number: int) -> None:
    life = storm.lives[who] if isinstance(who, int) else who
    if len(life.model.own_instances) < 4:
        creates(storm, who)


TELLS = (map_a_cell, map_seven_cells, tell_position, create_an_area)
TestStorm = storm_machine(STORMS, TELLS, lambda storm: storm.repeats).TestCase  # type: ignore[attr-defined]
TestStorm.settings = settings(max_examples=40, stateful_step_count=30, deadline=None)


def test_who_holds_the_whole_of_one_twin_and_a_part_of_the_other_may_say_it_after_a_restart() -> None:
    """The part came first, so the whole was never given by the record of the storm, and saying it broke the law."""
    storm = storm_of_any(4, "adaptive", 24, True, [0.0] * 4, 0, 0, None)
    storm.die(0)
    map_seven_cells(storm, 1, 0)
    storm.run(4, [HEARD] * 10)
    storm.forgives_names = True
    map_a_cell(storm, storm.add_twin(1), 1)
    create_an_area(storm, 1, 2)
    storm.run(12, [HEARD, HEARD, LOST, *[HEARD] * 25])
    assert not storm.lives[3].is_whole((1, 0, 0))
    assert storm.lives[3].model.has_arrived((1, 0, 0))
    storm.restart(3, keeps=True)
    storm.calm(40)
    assert any(said.sender is storm.lives[3] and said.fragments for said in storm.aired)
