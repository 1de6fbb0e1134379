"""Packet encoding: field widths derived from the TBox, checksums, encryption."""

__all__: list[str] = []
