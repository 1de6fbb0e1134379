"""Keeping a store small: what is old and was said anew since may go.

Of a slot the newest value of each origin always stays, and so does all that a ban hides. So a ban leaves what other
origins have said, and of the banned one the newest value from before the ban. An item goes as a whole or not at all:
only if every one of its facts may go, by whichever rule. Types never go, nor who is believed, nor do statuses, which
replace one another, nor what the owner keeps to itself.

The latest values and the classes of all instances are the same as before, and so are ``digest`` and ``state_hash``: a
pruned item has still arrived, is passed over when it comes again, and its content still counts. What is lost are the
old values: of history, of a value as of a time before, and of an origin that is banned later from an earlier time on.
Do not prune an attribute of which all values ever told matter, as of a list of findings. An item not held cannot be
compared with another content of the same GUID. If an origin is caught in such a contradiction, what was pruned stays
counted even where it rested on the content that went.
"""

from collections.abc import Iterable, Iterator

from worldmodel.facts import Block, Fault, Guid
from worldmodel.index import EMPTY, Entry, block_of
from worldmodel.merge import expire
from worldmodel.store import PruneRule, Store


def prune(store: Store, class_uid: int, attribute: int, before_s: float) -> int:
    """Drop the values of one attribute that are old and not the newest of their origin.

    Args:
        store: the store or world model.
        class_uid: whose instances are concerned.
        attribute: its uid; see ``store.prunable`` for those that are allowed.
        before_s: values observed at this time or later stay (s).

    Returns:
        The number of items dropped.

    Raises:
        FactError: there is no such class or attribute, or its values never go.
    """
    PruneRule(class_uid, attribute, 0.0).check(store.tbox)
    return _drop(store, [(class_uid, attribute, before_s)])


def tidy(store: Store, now_s: float) -> tuple[Fault, ...]:
    """Drop what waited for too long, with a fault for each, and what the rules of pruning say.

    Args:
        store: the store or world model.
        now_s: the time now (s).
    """
    if store.pruning:
        _drop(store, [(rule.class_uid, rule.attribute, now_s - rule.older_than_s) for rule in store.pruning])
    return expire(store, now_s)


def _drop(store: Store, limits: Iterable[tuple[int, int, float]]) -> int:
    """Drop the items of which each fact may go by one of the limits (class, attribute, before_s); return how many."""
    may_go: dict[Guid, set[int]] = {}
    blocks: dict[Guid, Block] = {}
    for class_uid, attribute, before_s in limits:
        for uid in store.instance_uids():
            if store.class_mask(uid) >> class_uid & 1:
                for entry in _outdated(store.index.slots.get(attribute, EMPTY).get(uid, []), before_s):
                    block = block_of(entry)
                    blocks[block.guid] = block
                    may_go.setdefault(block.guid, set()).add(0 if isinstance(entry, Block) else entry.position)
    gone = [block for guid, block in blocks.items() if len(may_go[guid]) == len(block.facts)]
    for block in gone:
        store.prune(block)
    return len(gone)


def _outdated(entries: list[Entry], before_s: float) -> Iterator[Entry]:
    """Of the facts that count in a slot those of items older than ``before_s`` that are not the newest of an origin."""
    if not entries or block_of(entries[0]).time_s >= before_s:
        return
    newest: set[int] = set()
    for entry in reversed(entries):
        block = block_of(entry)
        if not block.is_item:
            continue
        if block.origin in newest and block.time_s < before_s:
            yield entry
        newest.add(block.origin)
