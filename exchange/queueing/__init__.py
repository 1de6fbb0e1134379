"""Transmission queue: queue classes, selection, limits."""

__all__: list[str] = []
