"""Handling of Ctrl-C and SIGTERM: the program ends with one line after cleaning up.

During imports, where an exception could surface anywhere with a traceback, the process exits at once.
"""

import os
import signal
from types import FrameType

SAID = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
LOADER = "<frozen importlib._bootstrap>"
"""File name of frames that load a module."""


class Terminated(KeyboardInterrupt):
    """Termination by the system (SIGTERM), with the same cleanup as an interruption."""


def heed() -> None:
    """Install handlers for both signals, unless ignored or handled elsewhere."""
    for number in SAID:
        if signal.getsignal(number) in (signal.default_int_handler, signal.SIG_DFL):
            signal.signal(number, _end)


def _end(number: int, frame: FrameType | None) -> None:
    while frame is not None:
        if frame.f_code.co_filename == LOADER:
            os.write(2, f"remoras: {SAID[signal.Signals(number)]}\n".encode())
            os._exit(128 + number)
        frame = frame.f_back
    raise Terminated if number == signal.SIGTERM else KeyboardInterrupt
