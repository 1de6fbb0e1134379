"""Fleets: vehicles with radios, traffic between them, and the queue that drives them."""

__all__: list[str] = []
