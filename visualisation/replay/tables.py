"""Tables of a run as compressible integer columns; ``assets/data.js`` decodes them.

Names become indices, times and lengths become steps. A column stores differences of some order in zigzag encoding (0,
-1, 1, -2, ...), as base-128 varints: low bits first, the eighth bit marks continuation.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.fault import EMPTY
from missions.statements import rows_by_item
from missions.why import Line
from visualisation.run_records import HEARD, UNREACHED, Floats, Ints, Track, array, joined, packet_outcomes

Numbers = NDArray[Any] | Sequence[float]


def in_steps(values: Numbers, step: float) -> Ints:
    """Round numbers to multiples of a step; missing and infinite values become 0."""
    numbers = np.nan_to_num(np.asarray(values, dtype=float), nan=0.0, posinf=0.0, neginf=0.0)
    whole: Ints = np.rint(numbers / step).astype(np.int64)
    return whole


def packed(numbers: Ints, order: int) -> bytes:
    """Encode a column; ``order`` 0 stores values, 1 differences, 2 their differences."""
    for _ in range(order):
        numbers = np.diff(numbers, prepend=0)
    unsigned = ((numbers << 1) ^ (numbers >> 63)).astype(np.uint64)
    longest = max(1, -(-int(unsigned.max(initial=0)).bit_length() // 7))
    bytes_of = np.empty((unsigned.size, longest), dtype=np.uint8)
    used = np.empty((unsigned.size, longest), dtype=bool)
    for place in range(longest):
        rest = unsigned >> np.uint64(7 * place)
        # A zero takes one byte.
        used[:, place] = rest > 0 if place else True
        bytes_of[:, place] = (rest & np.uint64(127)).astype(np.uint8)
    bytes_of[:, :-1] |= used[:, 1:].astype(np.uint8) << 7
    return bytes_of[used].tobytes()


class Columns:
    """Named columns for one block of bytes."""

    def __init__(self) -> None:
        self._entries: list[list[Any]] = []
        self._parts: list[bytes] = []

    def add(self, name: str, numbers: Numbers, order: int = 0, step: float = 1.0) -> None:
        """Add a column; ``order`` as in ``packed``, ``step`` is its resolution."""
        whole = in_steps(numbers, step) if step != 1.0 else np.asarray(numbers, dtype=np.int64)
        self._entries.append([name, int(whole.size), order, step])
        self._parts.append(packed(whole, order))

    def block(self, about: dict[str, Any]) -> bytes:
        """Compress all columns and JSON header (raw deflate), reproducibly."""
        head = json.dumps({**about, "columns": self._entries}, separators=(",", ":"), allow_nan=False).encode()
        # Raw deflate, which browsers decompress by themselves.
        squeezed = zlib.compressobj(9, zlib.DEFLATED, -15)
        return squeezed.compress(struct.pack("<I", len(head)) + head + b"".join(self._parts)) + squeezed.flush()


TIME_STEP_S = 2.0**-12  # resolution of recorded times, so none is rounded here and their order stays
PLACE_STEP_M = 2.0**-5
TURN_STEP_RAD = 2.0 * np.pi / 256.0
SPEED_STEP_MPS = 0.02
SHARE_STEP = 0.00001
ENERGY_STEPS = 4096
NOBODY = -1  # index that is no vehicle
EVENTS = (
    "roles", "organisation", "membership", "activities", "decisions", "plans", "faults", "refused", "links", "peers",
)  # fmt: skip
VEHICLES = ("vehicle", "peer", "issuer", "source", "sender")
UNSHOWN = ("motivation", "expected_energy_j")
MISSING = -1000.0  # placeholder of a missing number, below all values
STEP = {"time_s": TIME_STEP_S, "expected_time_s": 0.125, "p_loss": 2.0**-7}
"""Resolution of columns of events; else ``SHARE_STEP``."""


class Names(NamedTuple):
    """Indices of vehicles, and of other texts in order of first use."""

    vehicles: Mapping[str, int]
    texts: dict[str, int]

    def vehicle(self, name: str | None) -> int:
        """Return the index of a vehicle, or ``NOBODY``."""
        return self.vehicles.get(name or "", NOBODY)

    def text(self, text: str) -> int:
        """Return the index of a text."""
        return self.texts.setdefault(text, len(self.texts))


def numbered(column: Any, number_of: Callable[[str], int]) -> Ints:
    """Map an Arrow column of texts to numbers, once per text; missing ones to ``NOBODY``."""
    texts = column.to_pylist()
    numbers = {text: NOBODY if text is None else number_of(text) for text in dict.fromkeys(texts)}
    return np.array([numbers[text] for text in texts], dtype=np.int64)


def add_events(columns: Columns, names: Names, table: Any, called: str) -> None:
    """Add the shown columns of an event table as ``called.column``."""
    for column in table.schema:
        name, kind, values, step = column.name, str(column.type), table[column.name], 1.0
        if name in UNSHOWN:
            continue
        if name in VEHICLES:
            numbers: Any = numbered(values, names.vehicle)
        elif kind.startswith("list"):
            numbers = [names.text(" + ".join(several)) for several in values.to_pylist()]
        elif kind == "double":
            numbers, step = np.nan_to_num(array(values), nan=MISSING), STEP.get(name, SHARE_STEP)
        elif kind in ("int64", "bool"):
            numbers = [NOBODY if value is None else int(value) for value in values.to_pylist()]
        else:
            numbers = numbered(values, names.text)
        columns.add(f"{called}.{name}", numbers, int(name == "time_s"), step)


def add_causes(columns: Columns, names: Names, moments: Iterable[tuple[str, float, Sequence[Line]]]) -> None:
    """Add answers to why a vehicle acts as it does: vehicle, time from which each holds, and lines."""
    answers = list(moments)
    lines = [line for _, _, of in answers for line in of]
    columns.add("why.vehicle", [names.vehicle(vehicle) for vehicle, _, _ in answers])
    columns.add("why.time", [from_s for _, from_s, _ in answers], 1, TIME_STEP_S)
    columns.add("why.n", [len(of) for _, _, of in answers])
    columns.add("line.text", [names.text(line.text) for line in lines], 1)
    columns.add("line.time", [line.time_s for line in lines], 1, TIME_STEP_S)
    columns.add("line.vehicle", [names.vehicle(line.vehicle) for line in lines])
    columns.add("line.slot", [NOBODY if line.slot is None else line.slot for line in lines], 1)


def add_tracks(columns: Columns, names: Names, tracks: Mapping[str, Track]) -> list[int]:
    """Add tracks, vehicle by vehicle; return the number of points of each."""
    own = [tracks[name] for name in names.vehicles if name in tracks]
    # Second differences of even ticks and of straight motion are 0.
    columns.add("track.time", joined(own, "time_s"), 2, TIME_STEP_S)
    columns.add("track.x", joined(own, "x_m"), 2, PLACE_STEP_M)
    columns.add("track.y", joined(own, "y_m"), 2, PLACE_STEP_M)
    columns.add("track.heading", joined(own, "heading_rad"), 1, TURN_STEP_RAD)
    columns.add("track.speed", joined(own, "speed_mps"), 1, SPEED_STEP_MPS)
    energy_j = joined(own, "energy_j")
    columns.add("track.energy", energy_j, 1, max(1.0, float(np.max(energy_j, initial=0.0)) / ENERGY_STEPS))
    return [tracks[name].time_s.size if name in tracks else 0 for name in names.vehicles]


@dataclass
class SentItems:
    """Items, as referenced by packets.

    ``items``: index by uid; ``statuses``: recording times (s) and indices by uid, two if a status was replaced at once.
    """

    items: dict[str, int] = field(default_factory=dict)
    statuses: dict[str, list[tuple[float, int]]] = field(default_factory=dict)

    def number(self, uid: str, sent_s: float) -> int:
        """Return the index of the item in a packet sent at ``sent_s``."""
        recorded = self.statuses.get(uid, ())
        return max((number for at_s, number in recorded if at_s <= sent_s), default=self.items.get(uid, NOBODY))


def slot_s_of(packets: Any) -> float | None:
    """Return the slot length (s) from the first and last packet; None with fewer than two."""
    if not packets.num_rows:
        return None
    (first, first_s), (last, last_s) = [(packets["slot"][n].as_py(), packets["time_s"][n].as_py()) for n in (0, -1)]
    return None if last <= first else (last_s - first_s) / (last - first)


def add_items(columns: Columns, names: Names, rows: Sequence[Mapping[str, Any]], sent_items: SentItems) -> None:
    """Add items and their facts; rows hold all facts of each item."""
    facts = list(rows_by_item(rows))
    heads = [item[0] for item in facts]
    for number, first in enumerate(heads):
        sent_items.items[first["uid"]] = number
        if "@" in first["uid"]:
            sent_items.statuses.setdefault(first["uid"], []).append((first["recorded_s"], number))
    columns.add("items.uid", [names.text(row["uid"]) for row in heads], 1)
    columns.add("items.origin", [names.vehicle(row["origin"]) for row in heads])
    times_s = np.array([row["time_s"] for row in heads], dtype=float)
    columns.add("items.time", times_s, 1, TIME_STEP_S)
    recorded_s = np.array([row["recorded_s"] for row in heads], dtype=float)
    columns.add("items.late", recorded_s - times_s, 0, TIME_STEP_S)
    columns.add("items.kind", [names.text(row["kind"]) for row in heads])
    columns.add("items.facts", [len(item) for item in facts])
    for name in ("subject", "attribute", "value"):
        columns.add(f"facts.{name}", [names.text(fact[name]) for item in facts for fact in item])


def add_packets(
    columns: Columns,
    names: Names,
    packets: Any,
    faults: Iterable[Mapping[str, Any]],
    refused: Iterable[Mapping[str, Any]],
    sent_items: SentItems,
) -> None:
    """Add packets. Delays are sorted by sender, receiver and time, for compression."""
    start_s, end_s = array(packets["time_s"]), array(packets["end_s"])
    sender = numbered(packets["sender"], names.vehicle)
    columns.add("packets.slot", array(packets["slot"]), 1)
    columns.add("packets.start", start_s, 1, TIME_STEP_S)
    columns.add("packets.length", end_s - start_s, 0, TIME_STEP_S)
    columns.add("packets.sender", sender)
    columns.add("packets.size", array(packets["size_bits"]))
    outcome = packet_outcomes(packets, refused, list(names.vehicles))
    arrival_s = np.repeat(end_s, len(names.vehicles)).reshape(outcome.shape)
    received, by = _flat(packets["receivers"])
    arrival_s[received, numbered(by, names.vehicle)] = array(_flat(packets["arrivals_s"])[1])
    for fault in faults:  # a packet under way reaches no vehicle whose energy has run out
        if fault["kind"] == EMPTY:
            vehicle = names.vehicle(fault["vehicle"])
            outcome[arrival_s[:, vehicle] > fault["time_s"], vehicle] = UNREACHED
    columns.add("packets.outcome", outcome.ravel())
    packet, receiver = np.nonzero(outcome == HEARD)
    order = np.lexsort((packet, receiver, sender[packet]))
    packet, receiver = packet[order], receiver[order]
    columns.add("packets.delay", arrival_s[packet, receiver] - end_s[packet], 1, TIME_STEP_S)
    _add_contents(columns, names, packets, start_s, sent_items)


def _add_contents(columns: Columns, names: Names, table: Any, start_s: Floats, sent_items: SentItems) -> None:
    for name, column in (("items", "item_uids"), ("status", "status_uids")):
        of_packets = table[column].to_pylist()
        columns.add(f"packets.{name}.n", [len(uids) for uids in of_packets])
        sent = [(uid, at_s) for uids, at_s in zip(of_packets, start_s, strict=True) for uid in uids]
        columns.add(f"packets.{name}", [sent_items.number(uid, at_s) for uid, at_s in sent], 1)
    roles = table["signal_roles"].to_pylist()
    columns.add("packets.signals.n", [len(row) for row in roles])
    columns.add("signals.role", [names.text(role) for row in roles for role in row])
    columns.add("signals.to", [names.text(role) for row in table["signal_addressed"].to_pylist() for role in row])
    columns.add("signals.value", [value for row in table["signal_values"].to_pylist() for value in row])


def _flat(column: Any) -> tuple[Ints, Any]:
    """Flatten a list column: row index per element, and elements."""
    lists = column.combine_chunks()
    offsets = array(lists.offsets)
    lengths = np.diff(offsets)
    return np.repeat(np.arange(len(lengths)), lengths), lists.values.slice(offsets[0], offsets[-1] - offsets[0])


def add_aside(columns: Columns, names: Names, rows: Sequence[Mapping[str, Any]], sent_items: SentItems) -> None:
    """Add items filtered out by receivers, and their later receptions."""
    aside = [row for row in rows if row["event"] == "set aside"]
    if not aside:
        return
    pairs = {(row["vehicle"], row["item"]) for row in aside}
    columns.add("aside.vehicle", [names.vehicle(row["vehicle"]) for row in aside])
    columns.add("aside.item", [sent_items.items[row["item"]] for row in aside], 1)
    later = [row for row in rows if row["event"] == "received" and (row["vehicle"], row["item"]) in pairs]
    columns.add("heard.vehicle", [names.vehicle(row["vehicle"]) for row in later])
    columns.add("heard.item", [sent_items.items[row["item"]] for row in later], 1)
    columns.add("heard.time", [row["time_s"] for row in later], 1, TIME_STEP_S)
