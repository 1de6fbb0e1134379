"""State of peers: received sets, incarnations, links, relaying."""

__all__: list[str] = []
