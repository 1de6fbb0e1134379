"""World models as rows of plain values, for a table, and back.

One row is one fact, named so that a reader of the table needs no uids. Three kinds of rows hold no fact of a
block: a ``COMMON`` row is an instance that all vehicles knew before the mission, or a link between two such, a
``PRUNED`` row so many items, from a sequence on, that are held no longer, and a ``MODEL`` row a setting of the world
model or one of its counters. The blocks that have arrived but wait or were refused are rows too, and so are the
statuses and what the owner keeps to itself. ``models_from`` merges all of them, and merging has one outcome whatever
the order; so the models it returns answer as those that were saved, and go on counting where these had stopped.

Values are text that Python reads back exactly: numbers by ``repr``, ``true`` and ``false``, symbols as they
are, points as ``POINT (east north)``, classes by name, and linked instances by their uid and name: ``3 bay``.
"""

from collections.abc import Iterable, Iterator, Mapping
from enum import StrEnum
from itertools import groupby
from typing import NamedTuple, cast

from worldmodel.abox import WorldModel
from worldmodel.errors import SnapshotError, WorldModelError
from worldmodel.facts import Block, Instance, PropertyValue
from worldmodel.merge import merge
from worldmodel.ontology.fields import Value
from worldmodel.ontology.tbox import Attribute, TBox, ValueKind
from worldmodel.store import Keeping, PruneRule, Store

NOBODY = -1
"""The origin of rows that no vehicle recorded."""

_NUMBERS = ("owner", "epoch", "n_origins", "run_time_instances_per_origin", "time_resolution_s", "clock_tolerance_s")
_COUNTERS = ("next_sequence", "next_private")
_BOUNDS = ("waiting_s", "waiting_blocks")
_TAKEN = "own_instances"
_PRUNED = "content_of_pruned"
_PRUNING = "pruning"
_SETTINGS = ("ontology", *_NUMBERS, *_COUNTERS, *_BOUNDS, _TAKEN, _PRUNED, _PRUNING)


class RowKind(StrEnum):
    """What a row of a snapshot stands for."""

    MODEL = "model"
    COMMON = "common"
    PRUNED = "pruned"
    KNOWN = "known"
    STATUS = "status"
    WAITING = "waiting"
    REFUSED = "refused"


class Row(NamedTuple):
    """One row of a snapshot.

    Attributes:
        vehicle: the name of the vehicle whose world model it is.
        kind: a ``RowKind``, as text.
        uid: the uid of the instance that the fact is about.
        origin: the vehicle that recorded the fact, by number; -1 for an instance known to all.
        epoch: how often its origin had restarted without its memory.
        sequence: the number of the block among those of its origin and epoch; -1 for a status, below for what the
            owner keeps to itself.
        position: the place of the fact in its block.
        time_s: the time of observation on the origin's clock (s).
        waits_since_s: since when its block waits (s); 0 for one that does not.
        subject: the name of the instance.
        attribute: the name of the attribute.
        value: the value as text.
        uncertainty: the standard deviation or probability of the value as text; empty where it carries none.
    """

    vehicle: str
    kind: str
    uid: int
    origin: int
    epoch: int
    sequence: int
    position: int
    time_s: float
    waits_since_s: float
    subject: str
    attribute: str
    value: str
    uncertainty: str


def rows_of(models: Mapping[str, WorldModel]) -> Iterator[Row]:
    """Yield what world models hold, as rows.

    Args:
        models: the world models, by the names of their vehicles.
    """
    for vehicle, model in models.items():
        settings = {name: str(getattr(model, name)) for name in (*_NUMBERS, *_COUNTERS)}
        settings |= {name: str(getattr(model.arrivals, name)) for name in _BOUNDS}
        settings |= {"ontology": f"{model.tbox.hash:08x}", _TAKEN: " ".join(map(str, sorted(model.own_instances)))}
        rules = [(model.tbox.classes[c].name, model.tbox.attributes[a].name, repr(age)) for c, a, age in model.pruning]
        settings |= {_PRUNED: f"{model.content_of_pruned:x}", _PRUNING: ", ".join(map(" ".join, rules))}
        for name in _SETTINGS:
            yield _row(
                vehicle, RowKind.MODEL, origin=model.owner, subject=vehicle, attribute=name, value=settings[name]
            )
        for instance in model.common_instances:
            uid, of_class = instance.uid, model.tbox.classes[instance.class_uid].name
            yield _row(
                vehicle, RowKind.COMMON, uid, sequence=uid, subject=instance.name, attribute="type", value=of_class
            )
        for fact in model.common_facts:
            attribute = model.tbox.attributes[fact.attribute]
            yield _row(
                vehicle,
                RowKind.COMMON,
                fact.subject,
                subject=_name(model, fact.subject),
                attribute=attribute.name,
                value=as_text(model, attribute, fact.value),
            )
        for (origin, epoch, first), count in model.pruned():
            yield _row(vehicle, RowKind.PRUNED, origin=origin, epoch=epoch, sequence=first, value=str(count))
        arrivals = model.arrivals
        held = (
            (RowKind.KNOWN, (*model.blocks(), *model.private_blocks())),
            (RowKind.STATUS, model.statuses()),
            (RowKind.WAITING, arrivals.waiting.values()),
            (RowKind.REFUSED, arrivals.refused.values()),
        )
        for kind, blocks in held:
            for block in sorted(blocks, key=lambda each: each.guid):
                yield from _rows_of_block(vehicle, model, kind, block)


def _row(
    vehicle: str,
    kind: RowKind,
    uid: int = NOBODY,
    *,
    origin: int = NOBODY,
    epoch: int = 0,
    sequence: int = 0,
    subject: str = "",
    attribute: str = "",
    value: str = "",
) -> Row:
    """A row that holds no fact of a block."""
    return Row(vehicle, kind.value, uid, origin, epoch, sequence, 0, 0.0, 0.0, subject, attribute, value, "")


def models_from(rows: Iterable[Row], tbox: TBox) -> dict[str, WorldModel]:
    """Return the world models that rows hold, by vehicle.

    Args:
        rows: the rows of one or several vehicles as ``rows_of`` yields them, those of one vehicle together.
        tbox: the ontology with which the models were made.

    Raises:
        SnapshotError: the rows are of another ontology, or cannot have come from ``rows_of``.
    """
    models = {}
    for vehicle, of_vehicle in groupby(rows, key=lambda row: row.vehicle):
        try:
            models[vehicle] = _model_from(list(of_vehicle), tbox)
        except (ValueError, WorldModelError) as error:
            raise SnapshotError(
                f"the world model of {vehicle!r} cannot be read: {error}; allowed: the rows of one run, unchanged, "
                "with the ontology of that run"
            ) from error
    return models


def _rows_of_block(vehicle: str, model: Store, kind: RowKind, block: Block) -> Iterator[Row]:
    for position, fact in enumerate(block.facts):
        attribute = model.tbox.attributes[fact.attribute]
        yield Row(
            vehicle,
            kind.value,
            fact.subject,
            block.origin,
            block.epoch,
            block.sequence,
            position,
            block.time_s,
            model.arrivals.since_s(block.guid) or 0.0,
            _name(model, fact.subject),
            attribute.name,
            as_text(model, attribute, fact.value),
            uncertainty_as_text(fact),
        )


def _model_from(rows: list[Row], tbox: TBox) -> WorldModel:
    by_kind: dict[RowKind, list[Row]] = {kind: [] for kind in RowKind}
    for row in rows:
        by_kind[RowKind(row.kind)].append(row)
    settings = {row.attribute: row.value for row in by_kind[RowKind.MODEL]}
    if missing := sorted(set(_SETTINGS) - settings.keys()):
        raise ValueError(f"it lacks the setting {', '.join(missing)}")
    if settings["ontology"] != f"{tbox.hash:08x}":
        raise ValueError(f"it was made with the ontology {settings['ontology']}, and this one is {tbox.hash:08x}")
    common = by_kind[RowKind.COMMON]
    model = WorldModel(
        tbox,
        int(settings["owner"]),
        [Instance(row.uid, tbox.class_named(row.value).uid, row.subject) for row in common if row.attribute == "type"],
        float(settings["time_resolution_s"]),
        n_origins=int(settings["n_origins"]),
        run_time_instances_per_origin=int(settings["run_time_instances_per_origin"]),
        epoch=int(settings["epoch"]),
        keeping=Keeping(
            clock_tolerance_s=float(settings["clock_tolerance_s"]),
            waiting_s=float(settings["waiting_s"]),
            waiting_blocks=int(settings["waiting_blocks"]),
            pruning=tuple(_rules_from(settings[_PRUNING], tbox)),
            common_facts=[_fact_from(row, tbox) for row in common if row.attribute != "type"],
        ),
    )
    merge(model, _blocks_from([*by_kind[RowKind.KNOWN], *by_kind[RowKind.REFUSED]], tbox))
    for waits_since_s, rows_since in groupby(
        sorted(by_kind[RowKind.WAITING], key=lambda row: row.waits_since_s), key=lambda row: row.waits_since_s
    ):
        merge(model, _blocks_from(list(rows_since), tbox), waits_since_s)
    merge(model, (_block_from([row], tbox) for row in by_kind[RowKind.STATUS]))
    known = {(row.origin, row.epoch, row.sequence) for row in by_kind[RowKind.KNOWN]}
    if odd := sorted(known ^ {block.guid for block in (*model.blocks(), *model.private_blocks())}):
        raise ValueError(f"the checks do not agree that block {odd[0]} is {RowKind.KNOWN.value}")
    if len(by_kind[RowKind.STATUS]) != sum(1 for _ in model.statuses()):
        raise ValueError("the checks do not agree with its statuses")
    for row in by_kind[RowKind.PRUNED]:
        for sequence in range(row.sequence, row.sequence + int(row.value)):
            model.hold((row.origin, row.epoch, sequence))
    model.content_of_pruned = int(settings[_PRUNED], 16)
    model.next_sequence, model.next_private = (int(settings[name]) for name in _COUNTERS)
    model.own_instances = {int(uid) for uid in settings[_TAKEN].split()}
    return model


def _rules_from(text: str, tbox: TBox) -> Iterator[PruneRule]:
    for rule in filter(None, text.split(", ")):
        of_class, attribute, older_than_s = rule.split()
        yield PruneRule(tbox.class_named(of_class).uid, tbox.attribute_named(attribute).uid, float(older_than_s))


def _blocks_from(rows: list[Row], tbox: TBox) -> Iterator[Block]:
    in_order = sorted(rows, key=lambda row: (row.origin, row.epoch, row.sequence, row.position))
    for _, of_block in groupby(in_order, key=lambda row: (row.origin, row.epoch, row.sequence)):
        yield _block_from(list(of_block), tbox)


def _block_from(rows: list[Row], tbox: TBox) -> Block:
    first = rows[0]
    return Block(first.origin, first.sequence, first.time_s, tuple(_fact_from(row, tbox) for row in rows), first.epoch)


def _fact_from(row: Row, tbox: TBox) -> PropertyValue:
    attribute = tbox.attribute_named(row.attribute)
    value, uncertainty = from_text(tbox, attribute, row.value), uncertainty_from_text(row.uncertainty)
    return PropertyValue(row.uid, attribute.uid, value, uncertainty)


def _name(model: Store, uid: int) -> str:
    instance = model.instance(uid)
    return instance.name if instance is not None else ""


def as_text(model: Store, attribute: Attribute, value: Value) -> str:
    """The value of a fact as text that ``from_text`` reads back exactly; see the head of this module."""
    row = model.tables.rows.get(attribute.uid)
    stored = None if row is None else row.quantise(value)
    if stored is None:
        stored = attribute.quantise(value)  # says what is wrong
    return stored_as_text(model, attribute, stored)


def stored_as_text(model: Store, attribute: Attribute, stored: Value) -> str:
    """The same of a value that a world model holds."""
    match attribute.kind:
        case ValueKind.TYPE:
            return model.tbox.classes[cast(int, stored)].name
        case ValueKind.LINK:
            return f"{stored} {_name(model, cast(int, stored))}".rstrip()
        case ValueKind.SYMBOL:
            return attribute.symbols[cast(int, stored)]
        case ValueKind.TEXT:
            return cast(str, stored)
        case ValueKind.POINT:
            east, north = cast(tuple[float, float], stored)
            return f"POINT ({east!r} {north!r})"
        case ValueKind.BOOLEAN:
            return str(stored).lower()
        case ValueKind.NUMBER:
            return repr(stored)


def uncertainty_as_text(fact: PropertyValue) -> str:
    """The uncertainty of a fact as text that can be read back exactly; empty where it carries none."""
    return "" if fact.uncertainty is None else repr(fact.uncertainty)


def uncertainty_from_text(text: str) -> float | None:
    """The uncertainty that a text of ``uncertainty_as_text`` stands for; raises ValueError for any other text."""
    return float(text) if text else None


def from_text(tbox: TBox, attribute: Attribute, text: str) -> Value:
    """The value that a text of ``as_text`` stands for; raises ValueError or UnknownNameError for any other text."""
    match attribute.kind:
        case ValueKind.TYPE:
            return tbox.class_named(text).uid
        case ValueKind.LINK:
            return int(text.partition(" ")[0])
        case ValueKind.SYMBOL:
            return attribute.symbols.index(text)
        case ValueKind.TEXT:
            return text
        case ValueKind.POINT:
            east, north = text.removeprefix("POINT (").removesuffix(")").split()
            return (float(east), float(north))
        case ValueKind.BOOLEAN:
            return ("false", "true").index(text) == 1
        case ValueKind.NUMBER:
            return float(text)
