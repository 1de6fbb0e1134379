"""Units as the ontology names them, by IRIs of QUDT, and as people and files of tables write them."""

QUDT_UNITS = "http://qudt.org/vocab/unit/"
"""Namespace of the units of QUDT, http://qudt.org."""

_SYMBOLS = {
    "M": "m",
    "SEC": "s",
    "M-PER-SEC": "m/s",
    "HZ": "Hz",
    "KiloHZ": "kHz",
    "BIT-PER-SEC": "bit/s",
    "DEG": "deg",
    "DEG_C": "degC",
    "PPM": "ppm",
    "L": "L",
    "J": "J",
    "W": "W",
    "DeciB": "dB",
    "PERCENT": "%",
}


def symbol_of(iri: str) -> str | None:
    """Return what is written for a unit of QUDT: its symbol, or its name where none is listed; None for other IRIs.

    >>> symbol_of("http://qudt.org/vocab/unit/M"), symbol_of("http://qudt.org/vocab/unit/NanoFARAD"), symbol_of("m")
    ('m', 'NanoFARAD', None)
    """
    name = iri.removeprefix(QUDT_UNITS)
    return None if not name or name == iri else _SYMBOLS.get(name, name)
