"""Executive layer of a vehicle: motivations, satisfaction and the decision."""

__all__: list[str] = []
