"""Fleets: vehicles with their radios, the traffic between them, and the queue that drives them."""

__all__: list[str] = []
