"""Exchange policies: acknowledgements in the header, and senders of items.

A policy is a stateless value, shared by vehicles and policy study: `Acknowledgement` composes headers, `repeat` fixes
the nodes that send an item. A new kind of acknowledgement is a value in this file or a user's. The option
`carrier_evidence` of vehicles and study, a sender of an item as its holder, is independent of the policy.
"""

from dataclasses import dataclass
from types import FunctionType

from exchange.errors import ConfigurationError
from exchange.policy.acknowledgement import Acknowledgement, fields
from exchange.policy.planning import COUNT_BITS, END_BITS
from worldmodel import suggestion

PARTS = ("carries", "header")
"""Functions of an acknowledgement."""


def own_row(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    """True for the sender's own row: a vector of N - 1 bits."""
    return row == sender


def every_row(n_nodes: int, frame: int, sender: int, row: int, column: int) -> bool:
    """True for every row: the whole matrix, N (N - 1) bits."""
    return True


def own_receptions(reported: int, own: int, received: int, holders: int) -> int:
    """Acknowledge own receptions.

    5.2: "acknowledging any messages received within the last (N-1) TDMA slots".
    """
    return own & received


def relayed_receptions(reported: int, own: int, received: int, holders: int) -> int:
    """Acknowledge own receptions, and relay those that peers report.

    5.3: "performing a boolean OR operation over the (N-1) peer ACK matrices it is holding, then replaces the row i = s
    with its own ACKs for the packets it received directly".
    """
    return own & received | reported & ~own


def inferred_receptions(reported: int, own: int, received: int, holders: int) -> int:
    """Add pseudo-acknowledgements for peers known to hold a packet's content.

    5.4: "to determine if peer i already has all the information contained in the packet. If this is the case, peer k is
    permitted to set the acknowledgement bit A_ij - a pseudo ACK".
    """
    return own & received | reported & ~own | holders & received


ACK = Acknowledgement("ack", "packet acknowledgements", own_row, own_receptions)
"""Vector of the peers whose last packets the sender received (Maurelli et al., section 5.2)."""

M_ACK = Acknowledgement("m-ack", "acknowledgement matrix", every_row, relayed_receptions, relays=True)
"""Matrix that also relays acknowledgements reported to the sender (section 5.3)."""

MPS_ACK = Acknowledgement(
    "mps-ack", "acknowledgement matrix with pseudo-acknowledgements", every_row, inferred_receptions, True, True
)
"""Matrix with pseudo-acknowledgements for peers known to hold the content (section 5.4)."""

ACKNOWLEDGEMENTS = (ACK, M_ACK, MPS_ACK)
"""Kinds of the paper in display order."""

LASTING = MPS_ACK._replace(name="lasting", title="matrix with pseudo-acknowledgements, kept for two frames", lasts=True)
"""As `MPS_ACK`, without the clearing of section 5.3: the same header reports more true bits."""

HOLDINGS = Acknowledgement(
    "holdings", "acknowledgements and statements of holdings", own_row, own_receptions, states=True
)
"""Vector with due statements of the sender's received set, see `exchange.policy.planning`."""

ADAPTIVE = HOLDINGS._replace(
    name="adaptive", title="statements of holdings, repairs coded over what they state", codes=True
)
"""As `HOLDINGS`, with coded repairs of reported items where they gain more than items."""


@dataclass(frozen=True, slots=True)
class AckPolicy:
    """Exchange policy, shipped or a user's.

    Attributes:
        repeat: nodes repeat items of other origins; else only the origin sends an item.

    >>> AckPolicy(M_ACK, repeat=True).name
    'm-ack-repeat'
    """

    acknowledgement: Acknowledgement
    repeat: bool

    @property
    def name(self) -> str:
        """Name of the acknowledgement, with `-repeat` if nodes repeat items uncoded."""
        return self.acknowledgement.name + ("-repeat" if self.repeat and not self.acknowledgement.codes else "")

    @property
    def title(self) -> str:
        """Description of one line for listings."""
        return self.acknowledgement.title + (
            ", others repeat items" if self.repeat else ", only the origin sends an item"
        )


def _by_name(*kinds: Acknowledgement) -> dict[str, AckPolicy]:
    """Return the policies of these kinds, without and with repeating, by name."""
    return {policy.name: policy for policy in (AckPolicy(kind, repeat) for kind in kinds for repeat in (False, True))}


PAPER_POLICIES = _by_name(*ACKNOWLEDGEMENTS)
"""Six policies of the paper by name."""

STATING = _by_name(HOLDINGS) | {ADAPTIVE.name: AckPolicy(ADAPTIVE, repeat=True)}
"""Policies that report received sets, by name."""

POLICIES = PAPER_POLICIES | _by_name(LASTING) | STATING
"""Shipped policies by name."""


def policy_named(name: str) -> AckPolicy:
    """Return the shipped policy of that name.

    Raises:
        ConfigurationError: unknown name; the message has all names and the nearest one.

    >>> policy_named("mps-ack").repeat
    False
    """
    if name in POLICIES:
        return POLICIES[name]
    hint = suggestion(name.lower(), POLICIES)
    raise ConfigurationError(
        f"unknown policy {name!r}: allowed are {', '.join(POLICIES)} and package.module:object{hint}"
    )


def checked_policy(policy: object, reference: str) -> AckPolicy:
    """Return the object as a valid policy; else raise ConfigurationError naming ``reference``."""
    fault = policy_fault(policy)
    if fault is None and isinstance(policy, AckPolicy):
        return policy
    raise ConfigurationError(f"policy {reference!r}: {fault}")


def policy_fault(policy: object) -> str | None:
    """Describe the fault of an object that should be a policy; None if valid."""
    if not isinstance(policy, AckPolicy):
        return f"an exchange.AckPolicy is expected, as AckPolicy(KIND, repeat=False), not {_kind_of(policy)}"
    kind = policy.acknowledgement
    if not isinstance(kind, Acknowledgement):
        return f"its acknowledgement must be an exchange.Acknowledgement, not {_kind_of(kind)}"
    if not isinstance(policy.repeat, bool):
        return f"repeat must be true or false, not {policy.repeat!r}"
    if not (isinstance(kind.name, str) and kind.name and isinstance(kind.title, str) and kind.title):
        return "its acknowledgement needs a name and a title"
    for name in ("relays", "infers", "lasts", "states", "codes"):
        if not isinstance(getattr(kind, name), bool):
            return f"{name} must be true or false, not {getattr(kind, name)!r}"
    if kind.lasts and not kind.relays:
        return "lasts = true needs relays = true: it stores acknowledgements that others report"
    if kind.codes and not kind.states:
        return "codes = true needs states = true: coded symbols combine items of reported received sets"
    if not isinstance(kind.period_frames, int) or kind.period_frames < 1:
        return f"period_frames must be a whole number of 1 or more, not {kind.period_frames!r}"
    for part in PARTS:
        function, expected = getattr(kind, part), getattr(ACK, part)
        # The policy study compiles both parts, and Numba compiles plain functions only.
        if not isinstance(function, FunctionType):
            return f"its {part} must be a plain function of a module, not {_kind_of(function)}"
        if function.__code__.co_argcount != expected.__code__.co_argcount:
            takes = ", ".join(expected.__code__.co_varnames[: expected.__code__.co_argcount])
            return f"its {part} must take ({takes})"
    if policy.name in POLICIES and policy != POLICIES[policy.name]:
        return f"the name {policy.name} is taken by a shipped policy: give its acknowledgement another"
    return None


def _kind_of(value: object) -> str:
    return f"the class {value.__name__}" if isinstance(value, type) else f"a {type(value).__name__}"


def bits_beside(kind: Acknowledgement) -> int:
    """Bits that end the holdings section, if the policy has one."""
    return (END_BITS if kind.states else 0) + (COUNT_BITS if kind.codes else 0)


def header_bits(policy: AckPolicy, n_nodes: int, frame: int | None = None, sender: int = 0) -> int:
    """Size of the acknowledgement header of a packet; statements and symbols come on top.

    Args:
        frame: TDMA frame of the packet; None for the largest header of all senders and frames.

    >>> header_bits(POLICIES["ack"], 5), header_bits(POLICIES["m-ack"], 5)
    (4, 20)
    """
    kind = policy.acknowledgement
    beside = bits_beside(kind)
    if frame is not None:
        return len(fields(kind, n_nodes, frame % kind.period_frames, sender)) + beside
    frames = range(kind.period_frames)
    return max(len(fields(kind, n_nodes, f, s)) for f in frames for s in range(n_nodes)) + beside
