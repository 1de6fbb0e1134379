import socket
import threading
import time

from exchange.drivers import Paced
from line_modem import LineModem
from missions.nodes import NodePlan, VehicleNode, alone
from missions.scenarios import load

scenario = load("mapping-rendezvous")
vehicles = [alone(NodePlan.of(scenario, name, 1, 180.0, 120.0)) for name in ("ASV00", "AUV00")]
pace = Paced(time.monotonic(), speed=60.0)
nodes = [VehicleNode(own, LineModem(line, pace), pace) for own, line in zip(vehicles, socket.socketpair())]
threads = [threading.Thread(target=node.run) for node in nodes]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print([node.outcome().items for node in nodes], len({node.outcome().state_hash for node in nodes}))
