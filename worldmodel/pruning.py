"""Keeping a store small: what is old and was said anew since may go.

Of a slot the newest value of each origin always stays, and of an origin of which a part is left out the newest of
that part too. So no ban takes from the view what another origin, or the same one before, has said. An item goes as a
whole or not at all: only if every one of its facts may go. Types never go, nor do statuses, which replace one another,
nor what the owner keeps to itself.

The latest values and the classes of all instances are the same as before, and so are ``digest`` and ``state_hash``: a
pruned item has still arrived, is passed over when it comes again, and its content still counts. What is lost are the
old values: of history, and of a value as of a time before. Do not prune an attribute of which all values ever told
matter, such as mappedCell. An item that is not held cannot be compared with another content of the same GUID; and if
an origin is caught in such a contradiction, what was pruned stays counted even where it rested on the content that
went.
"""

from collections.abc import Iterator

from worldmodel.facts import Block, Fault, Guid
from worldmodel.index import Entry, block_of
from worldmodel.merge import expire
from worldmodel.store import PruneRule, Store


def prune(store: Store, class_uid: int, attribute: int, before_s: float) -> int:
    """Drop the values of one attribute that are old and not the newest of their origin.

    Args:
        store: the store or world model.
        class_uid: whose instances are concerned.
        attribute: its uid; that of ``type`` is not allowed.
        before_s: values observed at this time or later stay (s).

    Returns:
        The number of items dropped.

    Raises:
        FactError: there is no such class or attribute, or it is ``type``.
    """
    PruneRule(class_uid, attribute, 0.0).check(store.tbox)
    may_go: dict[Guid, set[int]] = {}
    blocks: dict[Guid, Block] = {}
    for uid in store.instance_uids():
        if store.class_mask(uid) >> class_uid & 1:
            for entry in _outdated(store, store.index.slots.get((uid, attribute), []), before_s):
                block = block_of(entry)
                blocks[block.guid] = block
                may_go.setdefault(block.guid, set()).add(0 if isinstance(entry, Block) else entry.position)
    gone = [block for guid, block in blocks.items() if len(may_go[guid]) == len(block.facts)]
    for block in gone:
        store.prune(block)
    return len(gone)


def tidy(store: Store, now_s: float) -> tuple[Fault, ...]:
    """Drop what waited for too long, with a fault for each, and what the rules of pruning say.

    Args:
        store: the store or world model.
        now_s: the time now (s).
    """
    for rule in store.pruning:
        prune(store, rule.class_uid, rule.attribute, now_s - rule.older_than_s)
    return expire(store, now_s)


def _outdated(store: Store, entries: list[Entry], before_s: float) -> Iterator[Entry]:
    """The facts of items in a slot that are older than ``before_s`` and not the newest of their origin."""
    if not entries or block_of(entries[0]).time_s >= before_s:
        return
    newest: set[tuple[int, bool]] = set()
    for entry in reversed(entries):
        block = block_of(entry)
        if not block.is_item:
            continue
        part = block.origin, store.is_seen(block)
        if part in newest and block.time_s < before_s:
            yield entry
        newest.add(part)
