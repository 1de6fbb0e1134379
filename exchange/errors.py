"""Errors of the exchange layer, by cause.

Invalid packets of peers are counted events, never exceptions for the caller: see the manager.
"""


class ExchangeError(Exception):
    """Base of every error that this package raises."""


class ConfigurationError(ExchangeError):
    """Invalid request of the user; the message has the value given and the values allowed."""


class PeerFault(ExchangeError):
    """Invalid packet of a peer; never leaves this package, as the manager counts it."""


class DefinitionFault(PeerFault):
    """Packet with a byte of another definition hash."""


class SlotConflict(PeerFault):
    """Packet of another vehicle with the id of this one."""
