"""Two UnetStack programs, by unetpy: datagrams from station 21 to 29, and the range between them."""

import sys

from unetpy import RangeNtf, RangeReq, Services, UnetSocket

port = int(sys.argv[1])
one, other = UnetSocket("127.0.0.1", port), UnetSocket("127.0.0.1", port + 4)
to = other.getLocalAddress()
print("MTU", one.agentForService(Services.PHYSICAL).MTU)
for number in range(10):
    one.send(f"sample {number}", to=to)
    heard = other.receive(timeout=2000)
    print(bytes(heard.data).decode() if heard else f"sample {number} lost")
one.agentForService(Services.RANGING).request(RangeReq(to=to))
found = one.getGateway().receive(RangeNtf, 10_000)
print(f"{found.range:.1f} m" if found else "no answer")
one.close()
other.close()
