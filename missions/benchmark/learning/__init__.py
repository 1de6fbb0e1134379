"""What a vehicle knows as arrays, its actions, and runs that wait for these; ``remoras.learn`` is the door."""

__all__: list[str] = []
