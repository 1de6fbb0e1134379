"""Program of a buoy: sends samples as UDP datagrams to its modem, and waits for an answer to each."""

import socket
import sys

modem = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
modem.connect(("127.0.0.1", int(sys.argv[1])))
modem.settimeout(float(sys.argv[2]) if len(sys.argv) > 2 else 3.0)
for number in range(10):
    modem.send(f"sample {number}".encode())
    try:
        print(modem.recv(2048).decode())
    except TimeoutError:
        print(f"sample {number}: no answer")
