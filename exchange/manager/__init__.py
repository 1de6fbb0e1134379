"""Data Exchange Manager of one vehicle: items, beliefs about peers, reception and selection of packets."""

__all__: list[str] = []
