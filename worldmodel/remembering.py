"""Taking over what a world model knew into one that begins anew, in another epoch of the same owner."""

from collections.abc import Iterable

from worldmodel.abox import WorldModel
from worldmodel.facts import Block, Merged
from worldmodel.merge import merge


def remember(model: WorldModel, kept: WorldModel, now_s: float) -> Merged:
    """Let a model know what another one knew; what waited there waits here from now on.

    What was recorded while a clock was ahead stays known, though it is of the future now.

    Args:
        model: that knows nothing yet.
        kept: of the same fleet.
        now_s: the time now (s).

    Returns:
        What items and statuses changed, and the faults; of what the owner keeps to itself nothing is said.
    """
    private, blocks = list(kept.private_blocks()), []
    merge(model, private, _by(private, now_s))
    for guid, block in kept.items():
        if block is None:
            model.hold(guid)
        else:
            blocks.append(block)
    model.content_of_pruned = kept.content_of_pruned
    blocks += kept.statuses()
    return merge(model, blocks, _by(blocks, now_s))


def _by(blocks: Iterable[Block], now_s: float) -> float:
    """The time now, or of the newest of the blocks, whichever is later (s)."""
    return max(now_s, max((block.time_s for block in blocks), default=now_s))
