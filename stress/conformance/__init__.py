"""What every plug-in has to keep to, kind by kind: checks that raise ``AssertionError`` with what is wrong."""

__all__: list[str] = []
