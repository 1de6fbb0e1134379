"""The exchange policies by name: which acknowledgement travels in the header, and who repeats items.

A policy is a value and holds no state; `exchange.ack` acts on it, in the vehicles and in the policy study
alike. Whether hearing a node send an item counts as evidence that it holds the item is a separate option,
`carrier_evidence`: any policy can be had with it or without.
"""

from difflib import get_close_matches
from enum import IntEnum
from typing import NamedTuple

from exchange.errors import ConfigurationError


class Acknowledgement(IntEnum):
    """What a packet's header says about packets heard (Maurelli et al., sections 5.2 to 5.4)."""

    ACK = 0
    """A vector: which peers' last packets the sender received."""
    M_ACK = 1
    """A matrix: also what the sender was told about who received whose packets."""
    MPS_ACK = 2
    """The same matrix, with pseudo-acknowledgements for peers known to hold a packet's whole content."""


ACK, M_ACK, MPS_ACK = (int(kind) for kind in Acknowledgement)
"""The same as plain integers, for the functions that are also compiled."""


class AckPolicy(NamedTuple):
    """An exchange policy: its name, an `Acknowledgement`, and whether nodes repeat items of other origins."""

    name: str
    acknowledgement: int
    repeat: bool


POLICIES: dict[str, AckPolicy] = {
    policy.name: policy
    for policy in (
        AckPolicy("ack", Acknowledgement.ACK, False),
        AckPolicy("ack-repeat", Acknowledgement.ACK, True),
        AckPolicy("m-ack", Acknowledgement.M_ACK, False),
        AckPolicy("m-ack-repeat", Acknowledgement.M_ACK, True),
        AckPolicy("mps-ack", Acknowledgement.MPS_ACK, False),
        AckPolicy("mps-ack-repeat", Acknowledgement.MPS_ACK, True),
    )
}


def policy_named(name: str) -> AckPolicy:
    """The policy of that name.

    Raises:
        ConfigurationError: no policy has that name; the message lists the names and the nearest one.

    >>> policy_named("mps-ack").repeat
    False
    """
    if name in POLICIES:
        return POLICIES[name]
    nearest = get_close_matches(name.lower(), POLICIES, n=1)
    hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
    raise ConfigurationError(f"unknown policy {name!r}: allowed are {', '.join(POLICIES)}{hint}")


def acknowledgement_bits(acknowledgement: int, n_nodes: int) -> int:
    """Size of the acknowledgement header in the packet about to be composed, in bits.

    Asked anew in every own slot, before items are selected: a policy may choose its header slot by slot.
    """
    if acknowledgement == ACK:
        return n_nodes - 1
    return n_nodes * (n_nodes - 1)


def header_bits(policy: AckPolicy, n_nodes: int) -> int:
    """Size of the acknowledgement header of a packet under the policy, in bits.

    >>> header_bits(POLICIES["ack"], 5), header_bits(POLICIES["m-ack"], 5)
    (4, 20)
    """
    return acknowledgement_bits(policy.acknowledgement, n_nodes)
