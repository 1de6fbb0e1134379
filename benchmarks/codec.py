"""Cost and size of packets: encoding and decoding against a bare loop of shifts and masks over the same fields.

The record is that by which codecs are compared: one of 64 classes of 256 instances, one of 32 attributes, a time in
seconds, a place of two coordinates to 0.1 m in a kilometre; five vehicles, policy ``ack``, 4096 items each.
"""

from __future__ import annotations

import gc
import random
import time
from collections.abc import Callable, Sequence
from functools import partial
from itertools import takewhile
from typing import Any

import numpy as np

from benchmarks.measuring import row
from exchange.packets import Fragment
from exchange.policies import POLICIES
from exchange.wire.batch import Observations, decode_observations, encode_observations
from exchange.wire.codec import Codec, Widths
from worldmodel import Attribute, Field, OntologyClass, PropertyValue, TBox, ValueKind

REPEATS = 7
N_RECORDS = 2100
"""Records of one measurement; they make whole packets of 1 and of 7."""
FRAME_S = 21.0
"""Five slots of 3.2 s with a guard of 1 s."""
WIDTHS = (6, 8, 5, 17, 14, 14, 4)
"""Of the fields of a record in the bare loop: class, instance, attribute, time of day, x, y, origin; 68 bits."""
SENDER = 2
START_S = 3600.0
"""Of the slot in which all is said."""

Record = tuple[int, ...]


def reference_codec() -> Codec:
    """The codec of the record."""
    along = Field(0.0, 1000.0, 0.1, "m")
    classes = tuple(OntologyClass(uid, f"c{uid}", f"urn:c{uid}", ()) for uid in range(64))
    attributes = tuple(
        Attribute(uid, f"a{uid}", f"urn:a{uid}", 0, ValueKind.POINT, (along, along)) for uid in range(32)
    )
    tbox = TBox(classes, attributes)
    return Codec(tbox, 64 * 256, 5, POLICIES["ack"], 4096, 86_399.0, Widths(1.0, recent_s=FRAME_S))


def records(n: int) -> list[Record]:
    """Seeded records, each some seconds old at the start of its slot."""
    draws = random.Random(14)
    return [
        (
            draws.randrange(64), draws.randrange(256), draws.randrange(32), int(START_S) - draws.randrange(21),
            draws.randrange(10_001), draws.randrange(10_001), SENDER,
        )
        for _ in range(n)
    ]  # fmt: skip


def bare(groups: Sequence[Sequence[Record]]) -> None:
    """Pack each group of records into bytes, and take it apart again."""
    width_bits = sum(WIDTHS)
    masks = [(1 << width) - 1 for width in WIDTHS]
    shifts = [sum(WIDTHS[index + 1 :]) for index in range(len(WIDTHS))]
    fields = list(zip(shifts, masks, strict=True))
    for group in groups:
        bits = 0
        for record in group:
            for value, width in zip(record, WIDTHS, strict=True):
                bits = bits << width | value
        n_bits = width_bits * len(group)
        data = bits.to_bytes((n_bits + 7) // 8, "big")
        bits = int.from_bytes(data, "big")
        for index in range(len(group)):
            word = bits >> n_bits - width_bits * (index + 1)
            tuple([word >> shift & mask for shift, mask in fields])


def fragments_of(group: Sequence[Record], first: int) -> list[Fragment]:
    """The records as own observations of one packet."""
    return [
        Fragment(SENDER, first + n, float(time_s), (PropertyValue(256 * c + i, a, (x / 10, y / 10)),))
        for n, (c, i, a, time_s, x, y, _) in enumerate(group)
    ]


def round_trips(codec: Codec, packets: Sequence[Sequence[Fragment]]) -> None:
    """Encode packets and decode them again; the codec has seen none of them before."""
    rows = [0] * 5
    codec.forget()
    for fragments in packets:
        codec.decode(codec.encode(SENDER, rows, fragments, (), 0, 0, START_S), 0, START_S)


def cpu_s(work: Callable[[], object]) -> float:
    """CPU seconds of some work, without garbage collection, as ``timeit`` has it."""
    gc.collect()
    gc.disable()
    try:
        began_s = time.process_time()
        work()
        return time.process_time() - began_s
    finally:
        gc.enable()


def ratio_row(name: str, work: Callable[[], object], floor: Callable[[], object], goal: str) -> dict[str, Any]:
    """The cost of a record in some work against that in a bare loop; the two measured in turn, the best of each."""
    measured = [(cpu_s(work), cpu_s(floor)) for _ in range(REPEATS)]
    value_s, floor_s = (min(column) for column in zip(*measured, strict=True))
    value_us, floor_us = (1e6 * seconds / N_RECORDS for seconds in (value_s, floor_s))
    return row(name, value_us, "us", "bare shifts and masks", floor_us, goal=goal)


def speed_rows() -> list[dict[str, Any]]:
    """Encode and decode, a record at a time and seven to a packet."""
    codec, every = reference_codec(), records(N_RECORDS)
    found = []
    for per_packet, goal in ((1, "<= 10 x"), (7, "<= 5 x")):
        groups = [every[at : at + per_packet] for at in range(0, N_RECORDS, per_packet)]
        packets = [fragments_of(group, 0) for group in groups]
        name = f"encode + decode, {per_packet} a packet, a record"
        found.append(ratio_row(name, partial(round_trips, codec, packets), partial(bare, groups), goal))
    return found


def batch_row() -> dict[str, Any]:
    """Encode and decode all records as one table."""
    codec, every = reference_codec(), records(N_RECORDS)
    c, i, _, times_s, x, y, origins = np.array(every).T
    places = np.stack([x / 10, y / 10], axis=1)
    sequences = np.arange(N_RECORDS)
    told = Observations(0, origins, 0 * origins, sequences, times_s.astype(float), 256 * c + i, places)

    def work() -> None:
        decode_observations(codec, encode_observations(codec, told))

    floor = partial(bare, [[record] for record in every])
    return ratio_row(f"encode + decode, {N_RECORDS} a table, a record", work, floor, "<= 2 x")


def size_rows() -> list[dict[str, Any]]:
    """Bits of a head and of an observation, and how many own ones go into a packet; of DCCL as measured before."""
    codec, every = reference_codec(), records(N_RECORDS)
    head_bits = codec.overhead_bits - codec.header.largest_bits
    found = [_size_row("head and end without acknowledgements, N = 5", head_bits, "bits", "<= 18", 25.0)]
    for payload_bytes, goal, of_dccl in ((32, ">= 4", 3), (64, ">= 8", 7)):
        room_bits = 8 * payload_bytes - codec.overhead_bits
        fewest, bits = N_RECORDS, 0.0
        for at in range(0, N_RECORDS - 20, 20):
            group = sorted(every[at : at + 20], key=lambda record: record[3])
            packing = codec.packing(SENDER, 0, START_S, room_bits)
            n_fit = sum(1 for _ in takewhile(packing.add, fragments_of(group, at % 4096)))
            fewest, bits = min(fewest, n_fit), max(bits, (room_bits - packing.left_bits) / n_fit)
        found.append(_size_row(f"own observations in {payload_bytes} B, fewest", fewest, "items", goal, of_dccl))
    found.append(_size_row("own observation of 64 B, most", bits, "bits", "<= 60", 68.0))
    return found


def _size_row(name: str, value: float, unit: str, goal: str, of_dccl: float) -> dict[str, Any]:
    """A row about a size, of which the goal is about the value."""
    return row(name, value, unit, "DCCL", of_dccl, goal=goal, judged=value)


def rows() -> list[dict[str, Any]]:
    """Benchmark rows."""
    return [*size_rows(), *speed_rows(), batch_row()]
