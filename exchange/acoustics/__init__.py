"""The sea: who hears a packet, and when. It knows geometry and loss, never content, and imports nothing of ours.

``models`` is the seam of channel models, ``shipped`` names those that are there, ``link`` has the links of the simple
ones, ``acoustic`` and ``trace`` are the others. ``loss`` has the draws, ``channel`` the broadcast channel, ``modems``
the modem profiles. Kernels of the acoustic channel: ``sound_speed``, ``absorption``, ``noise``, ``budget``,
``bit_errors`` and ``packet_errors``. They are imported from there.
"""

__all__: list[str] = []
