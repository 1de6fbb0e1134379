"""Tables of a run as columns of whole numbers: names become numbers, times and lengths steps.

Columns of whole numbers as bytes that compress well; ``assets/data.js`` reads them back.

A column is kept as its differences of some order, each difference as a whole number without sign (0, -1, 1, -2, ...),
seven bits to a byte, the lowest first; the eighth bit says that more follow.
"""

from __future__ import annotations

import json
import re
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from visualisation.run_records import packets_refused

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Numbers = NDArray[Any] | Sequence[float]


def in_steps(values: Numbers, step: float) -> Ints:
    """Numbers as whole multiples of a step; what is missing or not finite counts as 0."""
    numbers = np.nan_to_num(np.asarray(values, dtype=float), nan=0.0, posinf=0.0, neginf=0.0)
    whole: Ints = np.rint(numbers / step).astype(np.int64)
    return whole


def packed(numbers: Ints, order: int) -> bytes:
    """A column as bytes.

    Args:
        numbers: of the column.
        order: of the differences: 0 keeps the numbers, 1 what each is more than the one before, 2 how that changes.

    >>> packed(np.array([5, 6, 7, 8]), 1)
    b'\\n\\x02\\x02\\x02'
    """
    for _ in range(order):
        numbers = np.diff(numbers, prepend=0)
    unsigned = ((numbers << 1) ^ (numbers >> 63)).astype(np.uint64)
    longest = max(1, -(-int(unsigned.max(initial=0)).bit_length() // 7))
    bytes_of = np.empty((unsigned.size, longest), dtype=np.uint8)
    used = np.empty((unsigned.size, longest), dtype=bool)
    for place in range(longest):
        rest = unsigned >> np.uint64(7 * place)
        used[:, place] = rest > 0 if place else True
        bytes_of[:, place] = (rest & np.uint64(127)).astype(np.uint8)
    bytes_of[:, :-1] |= used[:, 1:].astype(np.uint8) << 7
    return bytes_of[used].tobytes()


class Columns:
    """Columns by name, which become one block of bytes."""

    def __init__(self) -> None:
        self._entries: list[list[Any]] = []
        self._parts: list[bytes] = []

    def add(self, name: str, numbers: Numbers, order: int = 0, step: float = 1.0) -> None:
        """Take a column.

        Args:
            name: by which it is found again.
            numbers: of it, floats where there is a step.
            order: of the differences that are kept, see ``packed``.
            step: to which it is kept.
        """
        whole = in_steps(numbers, step) if step != 1.0 else np.asarray(numbers, dtype=np.int64)
        self._entries.append([name, int(whole.size), order, step])
        self._parts.append(packed(whole, order))

    def block(self, about: dict[str, Any]) -> bytes:
        """All columns and a JSON value beside them, compressed (raw deflate): the same bytes for the same content."""
        head = json.dumps({**about, "columns": self._entries}, separators=(",", ":"), allow_nan=False).encode()
        squeezed = zlib.compressobj(9, zlib.DEFLATED, -15)
        return squeezed.compress(struct.pack("<I", len(head)) + head + b"".join(self._parts)) + squeezed.flush()


TIME_STEP_S = 2.0**-12
"""Times are recorded to this step, so none is changed here: before and after stay what they were."""
PLACE_STEP_M = 2.0**-5
TURN_STEP_RAD = 2.0 * np.pi / 256.0
SPEED_STEP_MPS = 0.02
SHARE_STEP = 0.00001
"""Steps of what is drawn: finer than a screen shows."""
ENERGY_STEPS = 4096
"""In so many steps the energy is kept that the neediest vehicle used."""
POINT_STEP_M = 2.0**-6
"""Points in facts that are no multiple of this are kept as text."""
NOBODY = -1
"""Number of what is no vehicle."""
POINT = re.compile(r"POINT \((\S+) (\S+)\)")
TEXT_FORM, WHOLE_FORM, POINT_FORM, DECIMAL_FORM = range(4)
"""How the value of a fact is kept: number of a text; whole number; two coordinates; millionths."""
MILLION = 1_000_000

Kinds = Mapping[str, str]
EVENTS: Mapping[str, Kinds] = {
    "roles": {"time_s": "time", "vehicle": "vehicle", "group": "text", "role": "text", "event": "text"},
    "organisation": {
        "time_s": "time", "vehicle": "vehicle", "peer": "vehicle", "group": "text", "role": "text", "event": "text",
        "issuer": "vehicle", "act": "text", "objective": "text", "argument": "text", "outcome": "text",
    },
    "membership": {"time_s": "time", "vehicle": "vehicle", "peer": "vehicle", "event": "text"},
    "activities": {"time_s": "time", "vehicle": "vehicle", "type": "text", "name": "text", "role": "text"},
    "decisions": {
        "time_s": "time", "vehicle": "vehicle", "group": "text", "role": "text", "objective": "text",
        "argument": "text", "activities": "texts", "stimulus": "share", "own": "share", "external": "share",
        "source": "vehicle", "slot": "whole", "chosen": "whole", "best_mean": "mean",
    },
    "plans": {
        "time_s": "time", "vehicle": "vehicle", "group": "text", "role": "text", "objective": "text",
        "argument": "text", "node": "whole", "parent": "whole", "task": "text", "method": "text", "status": "text",
        "expected_time_s": "span",
    },
    "faults": {"time_s": "time", "vehicle": "vehicle", "kind": "text", "detail": "text"},
    "refused": {
        "time_s": "time", "vehicle": "vehicle", "sender": "vehicle", "slot": "whole", "reason": "text",
    },
    "links": {
        "time_s": "time", "vehicle": "vehicle", "peer": "vehicle", "direction": "text", "p_loss": "rate", "n": "whole",
    },
    "peers": {"time_s": "time", "vehicle": "vehicle", "peer": "vehicle", "event": "text"},
}  # fmt: skip
"""Tables of which every row is something that happened, with the kinds of their columns; a ``mean``, a ``span``
or a ``rate`` may be missing."""
MISSING = -1000.0
"""Stands for a number that is missing; none that is kept so is as low."""
ORDER = {"time": 1}
"""Order of the differences that are kept, by kind of column; 0 of others."""
STEP = {"time": TIME_STEP_S, "share": SHARE_STEP, "mean": SHARE_STEP, "span": 0.125, "rate": 2.0**-7}
"""Step to which columns are kept, by kind; whole numbers else."""


class Names(NamedTuple):
    """Vehicles by name, and all other texts by the numbers that they get when they are met."""

    vehicles: Mapping[str, int]
    texts: dict[str, int]

    def vehicle(self, name: str | None) -> int:
        """Index of a vehicle; ``NOBODY`` where there is none of that name."""
        return self.vehicles.get(name or "", NOBODY)

    def text(self, text: str) -> int:
        """Number of a text."""
        return self.texts.setdefault(text, len(self.texts))


def array(column: Any) -> NDArray[Any]:
    """A column of numbers (Arrow); what is missing is not a number."""
    whole = column.combine_chunks() if hasattr(column, "combine_chunks") else column
    # Not to_numpy: it loads pandas, which takes longer than all that is done here.
    if whole.null_count:
        return np.array(whole.to_pylist(), dtype=float)
    return np.from_dlpack(whole)


def numbered(column: Any, number_of: Callable[[str], int]) -> Ints:
    """A column of texts (Arrow) as numbers; each different text is asked for once, what is missing is ``NOBODY``."""
    numbers: dict[str | None, int] = {None: NOBODY}
    texts = column.to_pylist()
    for text in dict.fromkeys(texts):
        if text is not None:
            numbers[text] = number_of(text)
    return np.array([numbers[text] for text in texts], dtype=np.int64)


def add_events(columns: Columns, names: Names, table: Any, called: str, kinds: Kinds) -> None:
    """Columns of a table of events, one for each of ``kinds``: ``called.column``."""
    for column, kind in kinds.items():
        values = table[column]
        if kind == "vehicle":
            numbers: Any = numbered(values, names.vehicle)
        elif kind == "text":
            numbers = numbered(values, names.text)
        elif kind == "texts":
            numbers = [names.text(" + ".join(several)) for several in values.to_pylist()]
        elif kind == "whole":
            numbers = [NOBODY if value is None else int(value) for value in values.to_pylist()]
        elif kind in ("mean", "span", "rate"):
            numbers = np.nan_to_num(np.array(values.to_pylist(), dtype=float), nan=MISSING)
        else:
            numbers = array(values)
        columns.add(f"{called}.{column}", numbers, ORDER.get(kind, 0), STEP.get(kind, 1.0))


def add_tracks(columns: Columns, names: Names, table: Any) -> list[int]:
    """Columns of the trajectories, vehicle after vehicle; returns the number of rows of each."""
    vehicle = numbered(table["vehicle"], names.vehicle)
    order = np.argsort(vehicle, kind="stable")
    order = order[vehicle[order] >= 0]
    counts = np.bincount(vehicle[order], minlength=len(names.vehicles))

    def values(name: str) -> Any:
        return array(table[name])[order]

    columns.add("track.time", values("time_s"), 2, TIME_STEP_S)
    columns.add("track.x", values("x_m"), 2, PLACE_STEP_M)
    columns.add("track.y", values("y_m"), 2, PLACE_STEP_M)
    columns.add("track.heading", values("heading_rad"), 1, TURN_STEP_RAD)
    columns.add("track.speed", values("speed_mps"), 1, SPEED_STEP_MPS)
    energy_j = values("energy_j")
    columns.add("track.energy", energy_j, 1, max(1.0, float(np.max(energy_j, initial=0.0)) / ENERGY_STEPS))
    return [int(count) for count in counts]


ITEM_NAME = re.compile(
    r"\d+(?:\.e(?P<epoch>\d+))?(?:-(?P<kept>p?)(?P<sequence>\d+)(?:\.(?P<part>\d+))?"
    r"|@[^:]+:(?P<subject>\d+)\.(?P<attribute>\d+))"
)
"""Names of items, of what is kept, and of statuses, see ``remoras.recorder.ITEMS``."""
TOLD_FORM, KEPT_FORM, STATUS_FORM = range(3)


def read_name(uid: str) -> tuple[int, dict[str, int]]:
    """The form of a name, and the numbers in it; those that it lacks are 0.

    >>> read_name("2@1.5:7.3")[0], read_name("2.e1-17.4")[1]["sequence"]
    (2, 17)
    """
    found = ITEM_NAME.fullmatch(uid)
    said = found.groupdict() if found is not None else dict.fromkeys(ITEM_NAME.groupindex)
    form = STATUS_FORM if said["subject"] else KEPT_FORM if said.pop("kept") else TOLD_FORM
    return form, {key: int(value or 0) for key, value in said.items() if key != "kept"}


def by_item(rows: Iterable[Mapping[str, Any]]) -> Iterator[list[Mapping[str, Any]]]:
    """Facts item by item; where two statuses have one name, the second begins as the first one did."""
    item: list[Mapping[str, Any]] = []
    for row in rows:
        if item and (row["uid"] != item[0]["uid"] or ("@" in row["uid"] and _begins_alike(row, item[0]))):
            yield item
            item = []
        item.append(row)
    if item:
        yield item


def _begins_alike(row: Mapping[str, Any], first: Mapping[str, Any]) -> bool:
    return row["recorded_s"] != first["recorded_s"] or (row["subject"], row["attribute"]) == (
        first["subject"],
        first["attribute"],
    )


@dataclass
class Said:
    """Items, on which packets build.

    Attributes:
        items: number of each item by its uid; of several statuses with one uid, that of the newest.
        statuses: when each status was recorded (s) and its number, by uid; the tables have two where one was at once
            replaced by another.
    """

    items: dict[str, int] = field(default_factory=dict)
    statuses: dict[str, list[tuple[float, int]]] = field(default_factory=dict)

    def number(self, uid: str, sent_s: float) -> int:
        """The item of that uid in a packet that was sent at a time (s)."""
        recorded = self.statuses.get(uid, ())
        return max((number for at_s, number in recorded if at_s <= sent_s), default=self.items.get(uid, NOBODY))


def slot_s_of(packets: Any) -> float | None:
    """Length of a TDMA slot (s), as the first and the last packet tell it; None without two of them."""
    if not packets.num_rows:
        return None
    (first, first_s), (last, last_s) = [(packets["slot"][n].as_py(), packets["time_s"][n].as_py()) for n in (0, -1)]
    return None if last <= first else (last_s - first_s) / (last - first)


def add_items(columns: Columns, names: Names, rows: Sequence[Mapping[str, Any]], said: Said) -> None:
    """Columns of the items and their facts; all facts of an item are among the rows."""
    facts = list(by_item(rows))
    heads = [of[0] for of in facts]
    forms, uids = [], []
    sequences: dict[tuple[str, int], int] = {}  # of the last item of each origin, of what it told and of what it kept
    for number, first in enumerate(heads):
        uid = first["uid"]
        form, numbers = read_name(uid)
        whose, sequence = (first["origin"], form), numbers["sequence"]
        numbers["sequence"] = sequence - sequences.get(whose, 0)
        sequences[whose] = sequence
        said.items[uid] = number
        if form == STATUS_FORM:
            said.statuses.setdefault(uid, []).append((first["recorded_s"], number))
        forms.append(form)
        uids.append(numbers)
    columns.add("items.origin", [names.vehicle(row["origin"]) for row in heads])
    columns.add("items.form", forms)
    for part_of_name in ("epoch", "sequence", "part", "subject", "attribute"):
        columns.add(f"items.{part_of_name}", [numbers[part_of_name] for numbers in uids])
    times_s = np.array([row["time_s"] for row in heads], dtype=float)
    columns.add("items.time", times_s, 1, TIME_STEP_S)
    recorded_s = np.array([row["recorded_s"] for row in heads], dtype=float)
    columns.add("items.late", recorded_s - times_s, 0, TIME_STEP_S)
    columns.add("items.kind", [names.text(row["kind"]) for row in heads])
    columns.add("items.facts", [len(of) for of in facts])
    _add_facts(columns, names, [fact for of in facts for fact in of])


def _add_facts(columns: Columns, names: Names, facts: Sequence[Mapping[str, Any]]) -> None:
    columns.add("facts.subject", [names.text(fact["subject"]) for fact in facts])
    columns.add("facts.attribute", [names.text(fact["attribute"]) for fact in facts])
    values = [_value(fact["value"], names) for fact in facts]
    for place, name in enumerate(("form", "a", "b")):
        columns.add(f"facts.{name}", [value[place] for value in values])


def _value(text: str, names: Names) -> tuple[int, int, int]:
    """The value of a fact: its form, and two numbers."""
    if point := POINT.fullmatch(text):
        try:
            steps = [float(along) / POINT_STEP_M for along in point.groups()]
        except ValueError:
            steps = [0.5]
        if all(step.is_integer() for step in steps):
            return POINT_FORM, int(steps[0]), int(steps[1])
    try:
        number = float(text)
    except ValueError:
        return TEXT_FORM, names.text(text), 0
    if number.is_integer() and abs(number) < MILLION * MILLION:
        return WHOLE_FORM, int(number), 0
    if abs(number) < MILLION and abs(number * MILLION - round(number * MILLION)) < 1e-3:
        return DECIMAL_FORM, round(number * MILLION), 0
    return TEXT_FORM, names.text(text), 0


UNREACHED, LOST, HEARD, COLLIDED, REFUSED = range(5)
"""What became of a packet at a vehicle: out of reach, sent by itself or without energy; lost on the way; heard; lost to
another packet, or to one that the vehicle was sending; arrived, and refused."""


def add_packets(
    columns: Columns,
    names: Names,
    packets: Any,
    faults: Iterable[Mapping[str, Any]],
    refused: Iterable[Mapping[str, Any]],
    said: Said,
) -> None:
    """Columns of the packets. Delays are ordered by sender, receiver and time: so neighbours are alike.

    Args:
        columns: take them.
        names: of the vehicles.
        packets: their table (Arrow).
        faults: rows of what befell the vehicles; refused: of what they refused.
        said: the items.
    """
    start_s, end_s = array(packets["time_s"]), array(packets["end_s"])
    sender = numbered(packets["sender"], names.vehicle)
    columns.add("packets.slot", array(packets["slot"]), 1)
    columns.add("packets.start", start_s, 1, TIME_STEP_S)
    columns.add("packets.length", end_s - start_s, 0, TIME_STEP_S)
    columns.add("packets.sender", sender)
    columns.add("packets.size", array(packets["size_bits"]))
    outcome = np.full((len(start_s), len(names.vehicles)), UNREACHED)
    arrival_s = np.repeat(end_s, len(names.vehicles)).reshape(outcome.shape)
    lost, by = _flat(packets["lost_by"])
    outcome[lost, numbered(by, names.vehicle)] = LOST
    collided, by = _flat(packets["collided_at"])
    outcome[collided, numbered(by, names.vehicle)] = COLLIDED
    heard, by = _flat(packets["receivers"])
    outcome[heard, numbered(by, names.vehicle)] = HEARD
    arrival_s[heard, numbered(by, names.vehicle)] = array(_flat(packets["arrivals_s"])[1])
    _leave_out(outcome, arrival_s, names, faults)
    arrivals = packets.select(["slot", "receivers", "arrivals_s"]).to_pylist()
    for row, vehicle in packets_refused(arrivals, refused):
        outcome[row, names.vehicle(vehicle)] = REFUSED
    columns.add("packets.outcome", outcome.ravel())
    packet, receiver = np.nonzero(outcome == HEARD)
    order = np.lexsort((packet, receiver, sender[packet]))
    packet, receiver = packet[order], receiver[order]
    columns.add("packets.delay", arrival_s[packet, receiver] - end_s[packet], 1, TIME_STEP_S)
    _add_contents(columns, names, packets, start_s, said)


def _leave_out(outcome: Ints, arrival_s: Floats, names: Names, faults: Iterable[Mapping[str, Any]]) -> None:
    """What reached a vehicle without energy was not heard, nor was what it could not read."""
    for fault in faults:
        v = names.vehicle(fault["vehicle"])
        if fault["kind"] == "energy":
            outcome[arrival_s[:, v] > fault["time_s"], v] = UNREACHED
        elif fault["kind"] == "bad packet":
            outcome[(outcome[:, v] == HEARD) & (arrival_s[:, v] == fault["time_s"]), v] = LOST


def _add_contents(columns: Columns, names: Names, table: Any, start_s: Floats, said: Said) -> None:
    for name, column in (("items", "item_uids"), ("status", "status_uids")):
        of_packets = table[column].to_pylist()
        columns.add(f"packets.{name}.n", [len(uids) for uids in of_packets])
        sent = [(uid, at_s) for uids, at_s in zip(of_packets, start_s, strict=True) for uid in uids]
        columns.add(f"packets.{name}", [said.number(uid, at_s) for uid, at_s in sent], 1)
    roles = table["signal_roles"].to_pylist()
    columns.add("packets.signals.n", [len(of) for of in roles])
    columns.add("signals.role", [names.text(role) for of in roles for role in of])
    columns.add("signals.to", [names.text(role) for of in table["signal_addressed"].to_pylist() for role in of])
    columns.add("signals.value", [value for of in table["signal_values"].to_pylist() for value in of])


def _flat(column: Any) -> tuple[Ints, Any]:
    """Lists of a column one after the other: the row of each element, and the elements."""
    lists = column.combine_chunks()
    offsets = array(lists.offsets)
    lengths = np.diff(offsets)
    return np.repeat(np.arange(len(lengths)), lengths), lists.values.slice(offsets[0], offsets[-1] - offsets[0])


def add_aside(columns: Columns, names: Names, rows: Sequence[Mapping[str, Any]], said: Said) -> None:
    """Items that vehicles heard without need of them, and when they took up those that they came to need."""
    aside = [row for row in rows if row["event"] == "set aside"]
    if not aside:
        return
    pairs = {(row["vehicle"], row["item"]) for row in aside}
    columns.add("aside.vehicle", [names.vehicle(row["vehicle"]) for row in aside])
    columns.add("aside.item", [said.items[row["item"]] for row in aside], 1)
    received = [row for row in rows if row["event"] == "received"]
    _add_receptions(columns, names, [row for row in received if (row["vehicle"], row["item"]) in pairs], said)


def _add_receptions(columns: Columns, names: Names, rows: Sequence[Mapping[str, Any]], said: Said) -> None:
    heard = [row for row in rows if row["item"] in said.items]
    columns.add("heard.vehicle", [names.vehicle(row["vehicle"]) for row in heard])
    columns.add("heard.item", [said.items[row["item"]] for row in heard], 1)
    columns.add("heard.time", [row["time_s"] for row in heard], 1, TIME_STEP_S)
