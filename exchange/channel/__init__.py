"""Acoustic channel: reception of packets, from geometry and loss alone.

``models`` is the interface of channel models, ``shipped`` lists them; ``channel`` is the broadcast channel, ``loss``
draws its outcomes; ``link_budget`` and ``error_rates`` are the formulas.
"""

__all__: list[str] = []
