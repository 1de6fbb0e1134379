"""Rules of the exchange, pure: acknowledgements, repeats, packet plans, coded repairs, queue and values."""

__all__: list[str] = []
