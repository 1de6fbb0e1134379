"""A rough sea for exchange managers alone, without a mission."""

__all__: list[str] = []
