"""The social layer of a vehicle: organisation, missions, negotiation."""

__all__: list[str] = []
