"""Acoustic channel: reception of packets, from geometry and loss alone.

``models`` is the interface of channel models, ``shipped`` lists them; ``link``, ``acoustic``, ``trace`` and ``network``
implement their links. ``channel`` is the broadcast channel, ``loss`` draws its outcomes, ``modems`` has the profiles.
``link_budget`` and ``error_rates`` are the formulas. Packet content plays no role.
"""

__all__: list[str] = []
