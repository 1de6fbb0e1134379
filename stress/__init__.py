"""The whole fleet under random faults, and what must hold all the same."""

__all__: list[str] = []
