"""Policies that break one rule each, and a conforming external one: proof that checks can fail."""

from exchange.policy.acknowledgement import Acknowledgement
from exchange.policy.policies import ACK, M_ACK, MPS_ACK, AckPolicy

STATE = {"n_called": 0}


def in_even_frames(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    """The sender's own row, in every second frame."""
    return frame == 0 and row == sender


SPARSE = AckPolicy(
    Acknowledgement("sparse", "acknowledgements in every second frame", in_even_frames, ACK.header, period_frames=2),
    repeat=True,
)
"""A policy from outside that keeps to all rules."""
REPORTING = {
    f"{name}, sparse": AckPolicy(SPARSE.acknowledgement._replace(name=name, states=True, codes=codes), repeat=True)
    for name, codes in (("stating", False), ("coding", True))
}
"""The same with holdings: its vector comes in every second frame, and what is not in a header says nothing of links."""


def angry(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    """Raises."""
    raise KeyError("frame")


def claim_all(reported: int, own: int, received: int, holders: int) -> int:
    """Acknowledge items that were never received."""
    return own


def claim_for_all(reported: int, own: int, received: int, holders: int) -> int:
    """Acknowledge received items on behalf of all nodes."""
    return received


def claim_for_holders_of_nothing(reported: int, own: int, received: int, holders: int) -> int:
    """Acknowledge on behalf of those for whom peers did not."""
    return own & received | ~reported & ~own


def claim_nothing(reported: int, own: int, received: int, holders: int) -> int:
    """Acknowledge nothing."""
    return 0


def stateful(reported: int, own: int, received: int, holders: int) -> int:
    """Report received items only sometimes."""
    STATE["n_called"] += 1
    return own & received if STATE["n_called"] % 7 else 0


def own_if_any_reported(reported: int, own: int, received: int, holders: int) -> int:
    """Acknowledge what was heard, as long as peers acknowledge anything."""
    return own & received if reported else 0


def grown(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    """A header that depends on how often it was asked for."""
    STATE["n_called"] += 1
    return row == sender and STATE["n_called"] % 5 > 0


def no_parameters() -> bool:
    """Takes nothing."""
    return True


LIAR = AckPolicy(ACK._replace(name="liar", header=claim_all), False)
SILENT = AckPolicy(ACK._replace(name="silent", header=claim_nothing), False)
GULLIBLE = AckPolicy(M_ACK._replace(name="gullible", header=claim_for_all), False)
CONTRARY = AckPolicy(MPS_ACK._replace(name="contrary", header=claim_for_holders_of_nothing), True)
MOODY = AckPolicy(ACK._replace(name="moody", header=stateful), True)
MIXING = AckPolicy(M_ACK._replace(name="mixing", header=own_if_any_reported), True)
GROWING = AckPolicy(ACK._replace(name="growing", carries=grown), False)
DOUBLE = AckPolicy(M_ACK._replace(name="ack"), False)
WRONG_SIGNATURE = AckPolicy(ACK._replace(name="short", carries=no_parameters), False)  # type: ignore[arg-type]
NO_FUNCTION = AckPolicy(ACK._replace(name="hollow", header=3), False)  # type: ignore[arg-type]
ANGRY = AckPolicy(ACK._replace(name="angry", carries=angry), False)
ONLY_A_KIND = ACK
