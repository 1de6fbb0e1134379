"""What can go wrong in the exchange layer, split by whose fault it is.

A peer's bad packet is an event and a count, never an exception: see the manager.
"""


class ExchangeError(Exception):
    """Base of every error that this package raises."""


class ConfigurationError(ExchangeError):
    """The user asked for something that cannot be: the message says what was given and what is allowed."""


class PeerFault(ExchangeError):
    """A peer's packet makes no sense. It never leaves this package: the manager counts it and goes on."""


class DefinitionFault(PeerFault):
    """A packet whose byte of the definition hash is not that of this node."""


class SlotConflict(PeerFault):
    """A packet of another vehicle that speaks under the name of this one."""
