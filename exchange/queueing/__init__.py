"""What waits to be said: lines, the choice among them, limits."""

__all__: list[str] = []
