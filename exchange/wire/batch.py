"""Many observations of one attribute at once: columns in, bytes out, and back.

Packets hold a few observations, each in as few bits as it needs. A table of them, such as what a vehicle keeps of a
mission or a log that is read back on shore, has thousands: here each takes the same number of bits, so that arrays are
packed and unpacked without a loop. The widths are those of the fleet's codec, whose definition hash stands in front.

Layout, in bytes and then in bits, most significant first::

    table     definition hash 4 B | attribute 2 B | number of records 4 B | records | zeros to a byte
    record    origin | epoch 8 | sequence | time | subject | value [| uncertain 1 | uncertainty]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from exchange.errors import ConfigurationError, PeerFault
from exchange.wire.codec import Codec
from exchange.wire.codes import width
from worldmodel import EPOCHS, Attribute, Field

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

HEAD_BYTES = 10
EXACT = 1 << 53
"""Below it a double holds every whole number, so that one division rounds once."""
AT_ONCE = 1 << 14
"""Records that are packed at once, so that what is in between stays in the cache."""


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """Observations of one attribute, a row each; all columns have as many rows.

    Attributes:
        attribute: uid of what was observed.
        origins: node that observed, shape (n,); epochs: in which of its lives, shape (n,).
        sequences: number of the item in that life, shape (n,).
        times_s: of observation, shape (n,).
        subjects: uid of the instance, shape (n,).
        values: numbers of a number or place, shape (n, 1) or (n, 2); of any other kind the uid or index, shape (n, 1).
        uncertainties: of values that carry one, else NaN, shape (n,); None for NaN throughout.
    """

    attribute: int
    origins: Ints
    epochs: Ints
    sequences: Ints
    times_s: Floats
    subjects: Ints
    values: Floats
    uncertainties: Floats | None = None

    def __len__(self) -> int:
        return len(self.times_s)


def encode_observations(codec: Codec, told: Observations) -> bytes:
    """Bytes of many observations.

    Args:
        codec: of the fleet.
        told: of one attribute.

    Raises:
        ConfigurationError: columns differ in length, a number does not fit its width, with the row, or it is a text.

    >>> from exchange.policies import POLICIES
    >>> from worldmodel import core_ontology_paths, read_tbox
    >>> tbox = read_tbox(*core_ontology_paths())
    >>> codec = Codec(tbox, 8, 4, POLICIES["ack"], 4096, 3600.0)
    >>> row = np.arange(1000)
    >>> places = np.stack([row * 0.5, row * -2.0], axis=1)
    >>> position = tbox.attribute_named("position").uid
    >>> told = Observations(position, row % 4, row * 0, row, row * 0.1, row % 8, places)
    >>> data = encode_observations(codec, told)
    >>> len(data), bool((decode_observations(codec, data).values == places).all())
    (9135, True)
    """
    kind = codec.fragments.facts.attribute(told.attribute)
    if kind.most_bytes:
        raise ConfigurationError(f"{kind.name} is a text; allowed: attributes of a fixed width")
    layout = _Layout(codec, told.attribute)
    columns = layout.columns(told)
    n_rows = len(told)
    for name, width_bits, column in zip(layout.names, layout.widths, columns, strict=True):
        if column.shape != (n_rows,):
            raise ConfigurationError(f"column {name} has {len(column)} rows, times_s has {n_rows}")
        wrong = np.flatnonzero((column < 0) | (column >> width_bits != 0))
        if len(wrong):
            raise ConfigurationError(f"{name} of row {wrong[0]} does not fit {width_bits} bits: send it in a packet")
    head = codec.definition + told.attribute.to_bytes(2, "big") + n_rows.to_bytes(4, "big")
    parts = [
        _packed(layout.widths, [column[first : first + AT_ONCE] for column in columns])
        for first in range(0, n_rows, AT_ONCE)
    ]
    return head + b"".join(parts)


def decode_observations(codec: Codec, data: bytes) -> Observations:
    """The observations in some bytes.

    Args:
        codec: of the fleet.
        data: as ``encode_observations`` made it.

    Raises:
        PeerFault: of another definition, cut short, or with a number that means nothing.
    """
    if data[:4] != codec.definition:
        raise PeerFault("definition hash differs: the table is of another TBox or other field widths")
    attribute, n_rows = int.from_bytes(data[4:6], "big"), int.from_bytes(data[6:HEAD_BYTES], "big")
    if attribute >= codec.fragments.facts.n_attributes:
        raise PeerFault(f"attribute {attribute} is not in the TBox")
    if codec.fragments.facts.attribute(attribute).most_bytes:
        raise PeerFault(f"attribute {attribute} is a text, which has no fixed width")
    layout = _Layout(codec, attribute)
    size_bits = sum(layout.widths)
    if len(data) != HEAD_BYTES + (n_rows * size_bits + 7) // 8:
        raise PeerFault(f"{n_rows} observations of {size_bits} bits are not {len(data) - HEAD_BYTES} bytes")
    parts = []
    for first in range(0, n_rows, AT_ONCE):
        begin = HEAD_BYTES + first * size_bits // 8  # a whole byte: so many records are a multiple of 8
        n_here = min(AT_ONCE, n_rows - first)
        parts.append(_unpacked(layout.widths, data[begin : begin + (n_here * size_bits + 7) // 8], n_here))
    if not parts:
        return layout.observations([np.zeros(0, np.int64)] * len(layout.widths))
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return layout.observations(columns)


class _Layout:
    """The columns of a table and their widths.

    Args:
        codec: of the fleet.
        attribute: uid of what was observed.
    """

    def __init__(self, codec: Codec, attribute: int) -> None:
        fragments, facts = codec.fragments, codec.fragments.facts
        self._kind: Attribute = facts.attribute(attribute)
        self._time, self._n_nodes = fragments.time, fragments.n_nodes
        self._n_instances, self._n_values = facts.n_instances, facts.count(attribute)
        values = [field.size_bits for field in self._kind.fields] or [facts.value_bits(attribute)]
        names = ["origins", "epochs", "sequences", "times_s", "subjects", *["values"] * len(values)]
        widths = [fragments.origin_bits, width(EPOCHS), fragments.sequence_bits]
        widths += [self._time.size_bits, facts.subject_bits]
        if self._kind.uncertainty is not None:
            names += ["uncertainties"]
            values += [1 + self._kind.uncertainty.size_bits]
        self.names, self.widths = tuple(names), (*widths, *values)

    def columns(self, told: Observations) -> list[Ints]:
        """Whole numbers for the columns of a table."""
        if told.values.ndim != 2 or told.values.shape[1] != max(1, len(self._kind.fields)):
            shape = f"(n, {max(1, len(self._kind.fields))})"
            raise ConfigurationError(f"values of {self._kind.name} have shape {told.values.shape}; allowed: {shape}")
        columns = [np.asarray(numbers, np.int64) for numbers in (told.origins, told.epochs, told.sequences)]
        columns += [_steps(self._time, told.times_s), np.asarray(told.subjects, np.int64)]
        if self._kind.fields:
            columns += [_steps(field, told.values[:, at]) for at, field in enumerate(self._kind.fields)]
        else:
            columns.append(np.asarray(told.values[:, 0], np.int64))
        grid = self._kind.uncertainty
        if grid is not None:
            sigmas = np.full(len(told), np.nan) if told.uncertainties is None else told.uncertainties
            stated = ~np.isnan(sigmas)
            least = np.where(stated, np.maximum(sigmas, grid.minimum), grid.minimum)
            columns.append(np.where(stated, _steps(grid, least) | 1 << grid.size_bits, 0))
        return columns

    def observations(self, columns: Sequence[Ints]) -> Observations:
        """The table that has these whole numbers; raises PeerFault for one that means nothing."""
        origins, epochs, sequences, times, subjects, *rest = columns
        for name, column, n_values in (
            ("origin", origins, self._n_nodes),
            ("instance", subjects, self._n_instances),
            *([] if self._kind.fields else [(self._kind.name, rest[0], self._n_values)]),
        ):
            wrong = np.flatnonzero(column >= n_values)
            if len(wrong):
                raise PeerFault(f"{name} {column[wrong[0]]} of row {wrong[0]} is not one of {n_values}")
        n_numbers = max(1, len(self._kind.fields))
        if self._kind.fields:
            values = [_values(field, column) for field, column in zip(self._kind.fields, rest, strict=False)]
        else:
            values = [rest[0].astype(np.float64)]
        grid, sigmas = self._kind.uncertainty, None
        if grid is not None:
            told = rest[n_numbers]
            steps = told & (1 << grid.size_bits) - 1
            sigmas = np.where(told >> grid.size_bits == 1, _values(grid, steps), np.nan)
        times_s, shaped = _values(self._time, times), np.stack(values, axis=1)
        return Observations(self._kind.uid, origins, epochs, sequences, times_s, subjects, shaped, sigmas)


def _steps(field: Field, values: Floats) -> Ints:
    """The steps nearest to numbers, as ``Grid.index_of`` has them; -1 for what is no number."""
    steps = np.rint((np.asarray(values, np.float64) - field.minimum) / field.resolution)
    return np.where(np.abs(steps) < 2.0**62, steps, -1.0).astype(np.int64)


def _values(field: Field, steps: Ints) -> Floats:
    """The doubles nearest to the decimal numbers, as ``Grid.value_at`` has them."""
    start, step, denominator = field.grid.whole_numbers
    if max(abs(start), denominator, abs(start) + field.n_values * step) >= EXACT:
        return np.array([field.grid.value_at(number) for number in steps.tolist()], np.float64)
    return (start + steps * step) / denominator


def _packed(widths: Sequence[int], columns: Sequence[Ints]) -> bytes:
    """Columns as bits, record by record."""
    bits = np.empty((len(columns[0]), sum(widths)), np.uint8)
    at = 0
    for width_bits, column in zip(widths, columns, strict=True):
        n_bytes = (width_bits + 7) // 8
        octets = column.astype(">i8").view(np.uint8).reshape(-1, 8)[:, 8 - n_bytes :]
        bits[:, at : at + width_bits] = np.unpackbits(octets, axis=1)[:, 8 * n_bytes - width_bits :]
        at += width_bits
    return np.packbits(bits.reshape(-1)).tobytes()


def _unpacked(widths: Sequence[int], data: bytes, n_rows: int) -> list[Ints]:
    """The columns again."""
    n_bits = n_rows * sum(widths)
    bits = np.unpackbits(np.frombuffer(data, np.uint8), count=n_bits).reshape(n_rows, sum(widths))
    columns: list[Ints] = []
    at = 0
    for width_bits in widths:
        n_bytes = (width_bits + 7) // 8
        padded = np.zeros((n_rows, 8 * n_bytes), np.uint8)
        padded[:, 8 * n_bytes - width_bits :] = bits[:, at : at + width_bits]
        octets = np.zeros((n_rows, 8), np.uint8)
        octets[:, 8 - n_bytes :] = np.packbits(padded, axis=1)
        columns.append(octets.view(">i8").reshape(-1).astype(np.int64))
        at += width_bits
    return columns
