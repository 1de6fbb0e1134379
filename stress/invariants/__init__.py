"""What must hold of a fleet whatever befalls it: small objects, one for each sentence."""

__all__: list[str] = []
