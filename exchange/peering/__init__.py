"""What one vehicle knows of its peers: what they hold, in which life they are, whose turn it is."""

__all__: list[str] = []
