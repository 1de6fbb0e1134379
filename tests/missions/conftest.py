"""Empty; makes the small mission importable from the folders below."""
