"""Taking over what a world model knew into one that begins anew, in another epoch of the same owner."""

from worldmodel.abox import WorldModel
from worldmodel.facts import Merged
from worldmodel.merge import merge


def remember(model: WorldModel, kept: WorldModel, now_s: float) -> Merged:
    """Let a model know what another one knew; what waited there waits here from now on.

    Args:
        model: that knows nothing yet.
        kept: of the same fleet.
        now_s: the time now (s).

    Returns:
        What items and statuses changed, and the faults; of what the owner keeps to itself nothing is said.
    """
    merge(model, kept.private_blocks(), now_s)
    blocks = []
    for guid, block in kept.items():
        if block is None:
            model.hold(guid)
        else:
            blocks.append(block)
    model.content_of_pruned = kept.content_of_pruned
    return merge(model, [*blocks, *kept.statuses()], now_s)
