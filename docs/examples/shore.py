"""Program on the shore: answers the datagrams from its modem, until none comes for a while."""

import socket
import sys

modem = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
modem.connect(("127.0.0.1", int(sys.argv[1])))
modem.settimeout(float(sys.argv[2]) if len(sys.argv) > 2 else 30.0)
modem.send(b"")  # nothing on the air, but the modem learns where its program is
try:
    while True:
        modem.send(b"received " + modem.recv(2048))
except TimeoutError:
    pass
