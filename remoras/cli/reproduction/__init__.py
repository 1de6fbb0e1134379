"""Published results and the documents' tables, measured again by ``remoras reproduce``."""

__all__: list[str] = []
