"""An exchange policy that somebody brings, and things that are none."""

from exchange.ack import Acknowledgement, AckState, Words, learn_from_row
from exchange.policies import ACK, M_ACK, AckPolicy


def in_even_frames(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    """The sender's own row, in every second frame."""
    return frame == 0 and row == sender


def learn_in_even_frames(state: AckState, n_nodes: int, frame: int, sender: int, rows: Words) -> None:
    """Read the row where there is one."""
    if frame == 0:
        learn_from_row(state, n_nodes, sender, rows)


SPARSE = AckPolicy(
    Acknowledgement(
        "sparse", "acknowledgements in every second frame", in_even_frames, ACK.compose, learn_in_even_frames,
        period_frames=2,
    ),
    repeat=True,
)  # fmt: skip


def angry(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    """Raises."""
    raise KeyError("frame")


ANGRY = AckPolicy(ACK._replace(name="angry", carries=angry), False)
DOUBLE = AckPolicy(M_ACK._replace(name="ack"), False)
ONLY_A_KIND = ACK
