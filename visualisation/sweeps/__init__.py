"""Figures of a sweep."""

__all__: list[str] = []
