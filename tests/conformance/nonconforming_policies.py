"""Policies that break one rule each, and one from outside that keeps to all: they prove that the checks can fail."""

from exchange.ack import (
    Acknowledgement,
    AckState,
    MutableWords,
    Words,
    add_pseudo_acknowledgements,
    learn_from_matrix,
    learn_from_row,
)
from exchange.policies import ACK, M_ACK, MPS_ACK, AckPolicy

STATE = {"n_called": 0}


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
        period_frames=2, bit_sliced=True,
    ),
    repeat=True,
)  # fmt: skip
"""A policy from outside that keeps to all rules."""


def angry(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    """Raises."""
    raise KeyError("frame")


def claim_all(state: AckState, n_nodes: int, frame: int, me: int, rows_out: MutableWords) -> None:
    """Acknowledge what was never heard."""
    rows_out[me] = -1


def claim_with_stale_rows(state: AckState, n_nodes: int, frame: int, me: int, rows_out: MutableWords) -> None:
    """MPS-ACK without clearing the rows of nodes that have sent since: what the paper prints."""
    for i in range(n_nodes):
        rows_out[i] = 0
    not_since = 0
    for step in range(1, n_nodes):
        k = (me + step) % n_nodes
        not_since |= 1 << k
        if (state.heard[0] >> k) & 1:
            for i in range(n_nodes):
                rows_out[i] |= state.held[k * n_nodes + i] & not_since
    rows_out[me] = state.heard[0]
    add_pseudo_acknowledgements(state, n_nodes, me, rows_out)


def claim_nothing(state: AckState, n_nodes: int, frame: int, me: int, rows_out: MutableWords) -> None:
    """Acknowledge nothing."""
    rows_out[me] = 0


def learn_twice_as_much(state: AckState, n_nodes: int, frame: int, sender: int, rows: Words) -> None:
    """Take an acknowledgement for one of every other node too."""
    for peer in range(n_nodes):
        learn_from_row(state, n_nodes, peer, [rows[sender]] * n_nodes)


def learn_all_rows(state: AckState, n_nodes: int, frame: int, sender: int, rows: Words) -> None:
    """Read a whole matrix where the header has one row."""
    learn_from_matrix(state, n_nodes, sender, rows)


def stateful(state: AckState, n_nodes: int, frame: int, me: int, rows_out: MutableWords) -> None:
    """State what was heard, but not always."""
    STATE["n_called"] += 1
    rows_out[me] = state.heard[0] if STATE["n_called"] % 7 else 0


def grown(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    """A header that depends on how often it was asked for."""
    STATE["n_called"] += 1
    return row == sender and STATE["n_called"] % 5 > 0


def no_parameters() -> bool:
    """Takes nothing."""
    return True


LIAR = AckPolicy(ACK._replace(name="liar", compose=claim_all), False)
SILENT = AckPolicy(ACK._replace(name="silent", compose=claim_nothing), False)
GULLIBLE = AckPolicy(ACK._replace(name="gullible", learn=learn_twice_as_much), False)
STALE = AckPolicy(MPS_ACK._replace(name="stale", compose=claim_with_stale_rows), True)
NOSY = AckPolicy(ACK._replace(name="nosy", learn=learn_all_rows, remembers_second_last=True), False)
MOODY = AckPolicy(ACK._replace(name="moody", compose=stateful), True)
GROWING = AckPolicy(ACK._replace(name="growing", carries=grown), False)
DOUBLE = AckPolicy(M_ACK._replace(name="ack"), False)
WRONG_SIGNATURE = AckPolicy(ACK._replace(name="short", carries=no_parameters), False)  # type: ignore[arg-type]
NO_FUNCTION = AckPolicy(ACK._replace(name="hollow", learn=3), False)  # type: ignore[arg-type]
ANGRY = AckPolicy(ACK._replace(name="angry", carries=angry), False)
ONLY_A_KIND = ACK
