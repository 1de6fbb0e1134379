"""What AGR platforms agree on (MaDKit 6, TurtleKit 4; Ferber, Gutknecht, Michel 2003; REMORAS), and what it means here.

The behaviours have numbers; tests carry them in their names. ``NOT_MEANT`` is the one list of what a broadcast radio
between vehicles cannot mean, or means otherwise, with the reason.
"""

from remoras.organisation import Outcome

BEHAVIOURS = {
    1: "creating a group in an unknown community creates that community",
    2: "the creator of a group holds its manager role immediately",
    3: "creating an existing group answers ALREADY_GROUP and changes nothing",
    4: "requesting a role in an unknown community answers NOT_COMMUNITY",
    5: "requesting a role in an unknown group answers NOT_GROUP",
    6: "the first accepted request for a new role name creates that role in that group only",
    7: "the same role name in two groups denotes two independent roles",
    8: "requesting a role already held answers ROLE_ALREADY_HANDLED and leaves membership unchanged",
    9: "a second agent asking for the manager role is refused (ACCESS_DENIED)",
    10: "a request that a gatekeeper refuses answers ACCESS_DENIED and leaves no trace",
    11: "the gatekeeper receives identity, role and key, exactly once per request",
    12: "an exception in a gatekeeper reaches the requester and leaves the organisation unchanged",
    13: "missing arguments are programming errors, never a return code",
    14: "an agent may hold several roles in one group and belong to several groups at once",
    15: "a role may have several holders; their list has no duplicates and a deterministic order",
    16: "membership is equivalent to holding at least one role",
    17: "leaving the last role in a group ends membership",
    18: "leaving a group removes all roles held there and none elsewhere",
    19: "leaving a role not held answers ROLE_NOT_HANDLED for a member and NOT_IN_GROUP for a non-member",
    20: "a role without holders ceases to exist; a group without roles, a community without groups too",
    21: "removing or losing an agent removes it from every role",
    22: "a member can send to any holder in a shared group; a non-member receives NOT_IN_GROUP",
    23: "a non-member may write to the manager only, and appears as candidate",
    24: "sending under a role that the sender does not hold answers ROLE_NOT_HANDLED",
    25: "without a stated role the sender appears under a role that it holds, preferring the recipient's",
    26: "sending to a role excludes the sender; without another holder the answer is NO_RECIPIENT_FOUND",
    27: "an address becomes invalid when its holder leaves the role",
    28: "a broadcast to a role delivers exactly one independent copy to each other holder",
    29: "a reply reaches the original sender under the conversation's id; else CANT_REPLY",
    30: "a mailbox keeps the order of arrival; a filtered read takes the first match",
    31: "a waiting read with a timeout returns nothing at expiry and consumes nothing",
    32: "a probe on a role sees every present and future holder and drops leavers",
    33: "an AUV assigns only to members of its own group, but may plan a mission for another group",
    34: "every group has a member with the social layer; each member can reach another; targets are AUV, group or role",
}

NOT_MEANT = {
    1: "one fleet is one community: there is no other to create",
    4: "one fleet is one community: no other can be named",
    25: "an influence signal always states its role, a fact its issuer; nothing has to be guessed",
    29: "nobody replies: an item is acknowledged, what follows from it is a fact of its own, with its own origin",
    30: "no mailbox: what was heard is merged into a world model, whose order is that of observation, not of arrival",
    31: "no thread waits: what has come counts at the end of the TDMA frame, what has not does not",
}
"""Behaviours without a meaning here, and why. Of others one half has none:

* 11: a request has no pass key: who issued a fact is told by the block that it came in.
* 20: a group is its specification and stays, empty; the fleet is the community.
* 22, 26: everybody in range hears every packet, so sending has no answer; it matters what counts at those who hear.
* 23: there is no candidate: who is outside gives a group its mission, if it heads one that supervises it, and no more.
* 24: a receiver holds a signal against membership alone, since it may not have heard of a role yet.
"""

AGR_CODE = {
    Outcome.SUCCESS: "SUCCESS",
    Outcome.NOT_GROUP: "NOT_GROUP",
    Outcome.ALREADY_GROUP: "ALREADY_GROUP",
    Outcome.NOT_IN_GROUP: "NOT_IN_GROUP",
    Outcome.NOT_ROLE: "NOT_ROLE",
    Outcome.ROLE_ALREADY_HANDLED: "ROLE_ALREADY_HANDLED",
    Outcome.ROLE_NOT_HANDLED: "ROLE_NOT_HANDLED",
    Outcome.OUTSIDE: "NOT_IN_GROUP",
    Outcome.NOT_OF_GROUP: "NOT_IN_GROUP",
    Outcome.NO_SOCIAL_LAYER: "ACCESS_DENIED",
    Outcome.NO_AUTHORITY: "ACCESS_DENIED",
    Outcome.UNABLE: "ACCESS_DENIED",
    Outcome.INCOMPATIBLE: "ACCESS_DENIED",
    Outcome.EXCLUDED: "ACCESS_DENIED",
    Outcome.UNAVAILABLE: "ACCESS_DENIED",
    Outcome.NO_ROOM: "ACCESS_DENIED",
    Outcome.HEAD_PRESENT: "ACCESS_DENIED",
    Outcome.TERM_LEAPS: "ACCESS_DENIED",
}
"""Return codes of MaDKit by our outcomes: it has one word for what is told apart here."""
