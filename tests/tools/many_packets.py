"""A million random and a million mangled packets: nothing is raised, and no damaged one passes a checksum or a key.

    python -m tests.tools.many_packets --random 1000000 --mangled 1000000 --jobs 2

Packets of real missions, in eleven forms, are made bad in every way of ``mangling`` and thrown at vehicles that hear
the mission meanwhile: each goes the whole way, through ``receive`` and the merge of what it let pass. What is thrown
follows from ``--seed`` alone, whatever the number of processes. The exit status is 1 if anything was raised, or if,
under a checksum of 32 bits or a key, a damaged packet was taken, a belief was false or a block known that nobody had.
"""

from __future__ import annotations

import argparse
import gc
import random
import re
import sys
import time
import traceback
import tracemalloc
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from itertools import chain
from typing import NamedTuple

from exchange.packets import Reception
from tests.tools.mangling import MUTATIONS, STRINGS, Way, replayed
from tests.tools.mission_packets import FORMS, Form, Sent, Traffic, traffic_of
from worldmodel import merge
from worldmodel.facts import Guid

WAYS: dict[str, Sequence[Way]] = {"random": STRINGS, "mangled": MUTATIONS}
BATCH = 1000
"""Bad packets that a victim lives through, beside the good ones of its mission."""
NEAR = 24
"""In half of all cases a packet that is played again is at most so many packets old: of this frame, or a few before."""
GROWTH = 5000
"""Bad packets of which one vehicle hears ten times as many, to see what it keeps of them."""


class Task(NamedTuple):
    """A batch: of which form, which ways, how many, and by which seed."""

    form: Form
    ways: str
    n: int
    seed: int


@dataclass
class Toll:
    """What came of bad packets.

    Attributes:
        thrown, refused, taken: by form; taken are those that no vehicle had sent.
        reasons: of refusals; again: real packets at a wrong time that were taken.
        false_beliefs, unknown: by form: beliefs and blocks that are not true.
        most_half, most_waiting: blocks of which parts lack, and that wait, of one origin.
        raised: where exceptions came from.
    """

    thrown: Counter[str] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    taken: Counter[str] = field(default_factory=Counter)
    again: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    false_beliefs: Counter[str] = field(default_factory=Counter)
    unknown: Counter[str] = field(default_factory=Counter)
    raised: Counter[str] = field(default_factory=Counter)
    most_half: int = 0
    most_waiting: int = 0

    def add(self, other: Toll) -> None:
        """Count what another one counted, too."""
        for name, value in vars(other).items():
            mine = getattr(self, name)
            setattr(self, name, mine + value if isinstance(value, Counter) else max(mine, value))

    @property
    def is_well(self) -> bool:
        """True if nothing has happened that must not."""
        protected = [form.name for form in FORMS if form.is_protected]
        wrong = [count[name] for count in (self.taken, self.false_beliefs, self.unknown) for name in protected]
        return not self.raised and not any(wrong)


def reason_of(fault: str) -> str:
    """A refusal without its numbers and names."""
    text = re.sub(r"^\w+ is .*, out of its range$", "a value is out of its range", fault)
    text = re.sub(r"^\w+: .* is no text: .*$", "a text is none", text)
    text = re.sub(r"^\w+: -?\d+ of \d+$", "a value is none of its attribute", text)
    text = re.sub(r"^(uncertainty of) .*$", r"\1 a value", text)
    return re.sub(r"-?\d+(\.\d+)?(e[-+]?\d+)?", "N", text)


class Victim:
    """A vehicle that hears the mission and bad packets.

    Args:
        form: of the packets.
    """

    def __init__(self, form: Form) -> None:
        self.form = form
        self.traffic: Traffic = traffic_of(form)
        self.model, self.manager = self.traffic.victim()

    def hears(self, data: bytes, now_s: float) -> Reception:
        """Take in a packet."""
        reception = self.manager.receive(data, now_s)
        merge(self.model, reception.blocks, now_s)
        return reception

    def false_beliefs(self, reception: Reception, now_s: float) -> int:
        """What it has come to believe of peers that they did not hold by then."""
        return sum(not self.traffic.held(peer, uid, now_s) for peer, uid in reception.beliefs)

    def unknown(self) -> int:
        """Blocks that it knows, and nobody else ever had."""
        return sum(block not in self.traffic.known for block in self.model.blocks())


def bad_one(traffic: Traffic, way: Way, index: int, draws: random.Random) -> bytes:
    """A packet of a mission, made bad in one way."""
    sent = traffic.sent
    other = draws.randrange(len(sent))
    if way is replayed:  # who plays packets again cannot know those that are still to come
        other = max(0, index - draws.randint(1, NEAR if draws.random() < 0.5 else len(sent)))
    return way(draws, sent[index].data, sent[other].data)


def thrown(task: Task) -> Toll:
    """Throw a batch at one victim, which hears the mission meanwhile."""
    form, draws, toll = task.form, random.Random(task.seed), Toll()
    victim, ways = Victim(form), WAYS[task.ways]
    traffic = victim.traffic
    real = {one.data for one in traffic.sent}
    moments = sorted(draws.randrange(len(traffic.sent)) for _ in range(task.n))
    good = iter([*traffic.heard, Sent(0, float("inf"), b"")])
    following = next(good)
    for number, index in enumerate(moments):
        now_s = traffic.sent[index].arrives_s
        while following.arrives_s < now_s:
            believed = victim.hears(following.data, following.arrives_s)
            toll.false_beliefs[form.name] += victim.false_beliefs(believed, following.arrives_s)
            following = next(good)
        data = bad_one(traffic, ways[number % len(ways)], index, draws)
        toll.thrown[form.name] += 1
        try:
            reception = victim.hears(data, now_s)
        except Exception as error:
            frame = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{frame.filename.rpartition('/')[2]}:{frame.lineno}"
            toll.raised[f"{form.name}: {type(error).__name__} in {where}: {data.hex()} at {now_s:g} s"] += 1
            return toll  # what an exception left half done is no vehicle any more
        if reception.fault is not None:
            toll.refused[form.name] += 1
            toll.reasons[reason_of(reception.fault)] += 1
        else:
            (toll.again if data in real else toll.taken)[form.name] += 1
        toll.false_beliefs[form.name] += victim.false_beliefs(reception, now_s)
    toll.unknown[form.name] += victim.unknown()
    toll.most_half = _most_of_one(victim.manager.half_blocks())
    toll.most_waiting = _most_of_one(victim.model.arrivals.waiting)
    return toll


def _most_of_one(names: Iterable[Guid]) -> int:
    """How many of these blocks are of the origin that has most."""
    return max(Counter(origin for origin, *_ in names).values(), default=0)


def kept_bytes(form: Form, seed: int, n: int = GROWTH) -> tuple[int, int]:
    """Memory that one vehicle takes more after n, and after ten times n bad packets, than before them (bytes)."""
    victim, draws = Victim(form), random.Random(seed)
    traffic = victim.traffic
    for one in traffic.heard:
        victim.hears(one.data, one.arrives_s)
    now_s, ways, found = traffic.sent[-1].arrives_s, [*STRINGS, *MUTATIONS], list[int]()
    tracemalloc.start()
    for number in range(10 * n + 1):
        if number in (0, n, 10 * n):
            gc.collect()
            found.append(tracemalloc.get_traced_memory()[0])
        index = len(traffic.sent) - 1 - draws.randrange(8)
        victim.hears(bad_one(traffic, ways[number % len(ways)], index, draws), now_s)
    tracemalloc.stop()
    return found[1] - found[0], found[2] - found[0]


def tasks(n_random: int, n_mangled: int, seed: int) -> Iterator[Task]:
    """Batches: each form gets as many."""
    number = 0
    for ways, n in (("random", n_random), ("mangled", n_mangled)):
        for left in range(n, 0, -BATCH):
            yield Task(FORMS[number % len(FORMS)], ways, min(BATCH, left), (seed << 32) + number)
            number += 1


def thrown_all(n_random: int, n_mangled: int, seed: int = 1, jobs: int = 1) -> Toll:
    """Throw them all, in so many processes; the counts do not depend on how many."""
    toll, all_tasks = Toll(), tasks(n_random, n_mangled, seed)
    if jobs == 1:
        for task in all_tasks:
            toll.add(thrown(task))
        return toll
    with ProcessPoolExecutor(jobs) as pool:
        for one in pool.map(thrown, all_tasks, chunksize=len(FORMS)):
            toll.add(one)
    return toll


def lines(toll: Toll) -> Iterator[str]:
    """The counts, for people."""
    names = "thrown", "refused", "taken", "played again and taken", "false beliefs", "unknown blocks"
    yield f"{'form':<26}" + "".join(f"{name:>{max(9, len(name) + 2)}}" for name in names)
    counts = toll.thrown, toll.refused, toll.taken, toll.again, toll.false_beliefs, toll.unknown
    for form in FORMS:
        row = "".join(f"{one[form.name]:>{max(9, len(n) + 2)}}" for n, one in zip(names, counts, strict=True))
        yield f"{form.name + ('' if form.is_protected else ' *'):<26}" + row
    yield "*: neither a checksum of 32 bits nor a key: what passes cannot be told from what was sent"
    yield f"of one origin at most {toll.most_half} blocks half, {toll.most_waiting} waiting"
    yield f"{sum(toll.raised.values())} exceptions, {sum(toll.thrown.values())} packets; refusals by reason:"
    yield from (f"  {count:>8}  {reason}" for reason, count in toll.reasons.most_common())
    yield from chain(toll.raised)


def main() -> int:
    """Throw them, print what came of it; 1 if something did that must not."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--random", type=int, default=1_000_000)
    parser.add_argument("--mangled", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    given = parser.parse_args()
    began = time.perf_counter()
    toll = thrown_all(given.random, given.mangled, given.seed, given.jobs)
    print("\n".join(lines(toll)), flush=True)
    print(f"{time.perf_counter() - began:.0f} s")
    print(f"bytes that one vehicle keeps of {GROWTH} and of {10 * GROWTH} bad packets:")
    for form in FORMS:
        print(f"  {form.name:<26} {' '.join(map(str, kept_bytes(form, given.seed)))}", flush=True)
    return int(not toll.is_well)


if __name__ == "__main__":
    sys.exit(main())
