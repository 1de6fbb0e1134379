"""JSON over TCP of fjage, by which UnetStack is used: lines, messages and bytes, for client and server.

One JSON object per line (JSON Protocol Specifications, https://fjage.readthedocs.io). An object ``message`` has class
and data, the class first:

    {"action": "send", "message": {"clazz": "org.arl.unet.phy.TxFrameReq", "data": {"data": [bytes], ...}}}

Bytes are base64 in ``{"clazz": "[B", "data": ...}``, or a list of numbers.
"""

from __future__ import annotations

import base64
import json
import uuid
from typing import Any

MOST_BYTES = 1 << 20
"""Maximum length of a line; longer input is discarded."""
Object = dict[str, Any]


class Lines:
    """Objects in a stream of bytes; ``n_bad`` counts lines that are none."""

    def __init__(self) -> None:
        self.n_bad = 0
        self._rest = b""

    def feed(self, came: bytes) -> list[Object]:
        """Return the objects that these bytes complete."""
        # A line may arrive in parts: the last one is complete once its end arrives.
        *lines, self._rest = (self._rest + came).replace(b"\r", b"\n").split(b"\n")
        if len(self._rest) > MOST_BYTES:
            self._rest, self.n_bad = b"", self.n_bad + 1
        values = [_value(line) for line in lines if line]
        objects = [value for value in values if isinstance(value, dict)]
        self.n_bad += len(values) - len(objects)
        return objects


def _value(line: bytes) -> Any:
    try:
        return json.loads(line)
    except (ValueError, RecursionError):
        return None


def line_of(value: Object) -> bytes:
    """Return an object as a line."""
    return json.dumps(value).encode() + b"\n"


def sending(clazz: str, sender: str, recipient: str, perf: str, **data: Any) -> Object:
    """Return a message of a class below ``org.arl``, in its envelope."""
    head = {"msgID": str(uuid.uuid4()), "perf": perf, "sender": sender, "recipient": recipient}
    return {"action": "send", "relay": True, "message": {"clazz": f"org.arl.{clazz}", "data": {**head, **data}}}


def message_in(value: Object) -> tuple[str, Object] | None:
    """Return the class name, without its package, and the data of a message; None if there is none."""
    match value.get("message"):
        case {"clazz": str(clazz), "data": dict(data)}:
            return clazz.rpartition(".")[2], data
    return None


def packed(data: bytes) -> Object:
    """Return bytes as a value."""
    return {"clazz": "[B", "data": base64.b64encode(data).decode()}


def unpacked(value: Any) -> bytes | None:
    """Return the bytes of a value; None if it has none."""
    try:
        if isinstance(value, dict):
            return base64.b64decode(value["data"], validate=True)
        return bytes(byte % 256 for byte in value) if isinstance(value, list) else None  # Java bytes are signed
    except (KeyError, ValueError, TypeError):
        return None
