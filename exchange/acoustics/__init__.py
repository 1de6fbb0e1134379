"""The sea: who hears a packet, and when. It knows geometry and loss, never content, and imports nothing of ours.

``models`` is the seam of channel models, ``link`` has the shipped ones, ``loss`` the draws, ``channel`` the broadcast
channel, ``modems`` the modem profiles. They are imported from there.
"""

__all__: list[str] = []
