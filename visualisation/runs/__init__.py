"""Figures of one run."""

__all__: list[str] = []
