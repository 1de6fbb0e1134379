"""How Ctrl-C and a termination by the system end the program: with one line, and what was being done is undone.

While modules are loaded nothing has to be undone, and an exception out of the middle of one comes out of wherever it
likes, with traces of it: there the process ends at once.
"""

import os
import signal
from types import FrameType

SAID = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
LOADER = "<frozen importlib._bootstrap>"
"""File that frames have while a module is loaded."""


class Terminated(KeyboardInterrupt):
    """The system ends the program (SIGTERM): what an interruption leaves whole, this leaves whole."""


def heed() -> None:
    """Let both signals end the program in this way, unless they are ignored or somebody else's."""
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
