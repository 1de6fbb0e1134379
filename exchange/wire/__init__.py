"""Packets as bits: fields by the TBox, their sizes, and what protects them on the way."""

__all__: list[str] = []
