"""Ways: over which links news gets about in a sea where some links are nearly cut for the whole run.

A link carries news if both its directions do: what is told goes one way, and that it was heard the other. Where
vehicles pass on what others tell, a way may be several links long.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from itertools import permutations

from exchange.acoustics.acoustic import AcousticChannel
from exchange.acoustics.link import Matrix, Transmission
from exchange.acoustics.models import MatrixChannel
from exchange.acoustics.network import NetworkChannel
from missions.scenarios.deployment import deployment_of
from missions.scenarios.policy import policy_of
from missions.scenarios.scenario import Scenario

NEARLY_CUT = 0.9
"""Share of packets lost from which on a link is nearly cut."""
MOMENTS = 8
"""Moments over which the mean of what changes is taken."""
PlaceM = tuple[float, float]
Losses = Mapping[tuple[str, str], float]
"""Share of packets lost by (sender, receiver)."""


def losses_of(scenario: Scenario) -> Losses:
    """What each link loses for the whole run; empty where the channel has no such rates, or the run's seed draws them.

    >>> from missions.scenarios import load
    >>> own = load("mapping-rendezvous"), load("mapping-rendezvous", [("--set", "channel.name=matrix")])
    >>> [len(losses_of(scenario)) for scenario in own]
    [0, 12]
    """
    names, settings = scenario.names_by_slot, scenario.channel.settings()
    is_drawn = isinstance(settings, NetworkChannel) and not settings.nodes.keys() >= {*names}
    if is_drawn or not isinstance(settings, (MatrixChannel, NetworkChannel)):
        return {}
    deployment = deployment_of(scenario)
    model = settings.link_model(deployment, 0)
    if not isinstance(model, Matrix):
        return {}
    nodes = deployment.nodes.items()
    return {(one, other): model.per_of.get((a, b), model.per) for (one, a), (other, b) in permutations(nodes, 2)}


def losses_there(scenario: Scenario, seed: int, places_m: Sequence[PlaceM], from_s: float, until_s: float) -> Losses:
    """What each link of the channel acoustic loses, in the mean over a time in which vehicles stay; else empty.

    Args:
        scenario, seed: of the run.
        places_m: (x east, y north) of the vehicles in the order of their nodes.
        from_s, until_s: of the run; a site changes in it.
    """
    channel, deployment = scenario.channel.settings(), deployment_of(scenario)
    if not isinstance(channel, AcousticChannel):
        return {}
    link, bits, found = channel.link_model(deployment, seed), deployment.modem.payload_bits, {}
    moments_s = [from_s + (until_s - from_s) * (number + 0.5) / MOMENTS for number in range(MOMENTS)]
    for (one, a), (other, b) in permutations(deployment.nodes.items(), 2):
        range_m = math.hypot(math.dist(places_m[a], places_m[b]), deployment.depths_m[a] - deployment.depths_m[b])
        rates = (link.p_loss(Transmission(0, a, time_s, bits, places_m), b, range_m) for time_s in moments_s)
        found[one, other] = math.fsum(rates) / MOMENTS
    return found


def passes_on(scenario: Scenario) -> bool:
    """True if vehicles pass on what others tell, over links that are nearly cut at least."""
    return policy_of(scenario.communication.policy).repeat or bool(getattr(scenario.communication, "relaying", True))


def packets_each(losses: Losses, passed_on: bool, among: Collection[str]) -> float:
    """Packets that one takes, in the mean, to be heard and answered for, of the two vehicles where that takes longest.

    Args:
        losses: of all links.
        passed_on: True if ways may be several links long; no way has a link that is nearly cut.
        among: names of the vehicles.

    Returns:
        A number of 1 or more; infinite if some of the vehicles are parted.
    """
    pairs = [*permutations(among, 2)]
    each = {pair: _packets(losses, *pair) for pair in pairs}
    for relay in among if passed_on else ():
        for one, other in pairs:
            if relay not in (one, other) and is_cut(losses, one, other):
                each[one, other] = min(each[one, other], each[one, relay] + each[relay, other])
    return max(each.values(), default=1.0)


def _packets(losses: Losses, one: str, other: str) -> float:
    """Packets over one link; infinite if it is nearly cut."""
    if is_cut(losses, one, other):
        return math.inf
    return 1.0 / ((1.0 - losses[one, other]) * (1.0 - losses[other, one]))


def is_cut(losses: Losses, one: str, other: str) -> bool:
    """True if a link is nearly cut, one way or both ways."""
    return max(losses[one, other], losses[other, one]) >= NEARLY_CUT
