"""UnetStack API of a station, so that a program for UnetStack modems (``unetpy``, ``remoras node --unet``) runs here.

Agents and their services: ``node`` (address, name, position), ``phy`` (datagrams, frames), ``ranging``. Positions are
set as ``node.location``, in metres.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from exchange.drivers.fjage import Object, message_in, packed, sending, unpacked
from missions.nodes.sea import EVERYBODY, Packet, Received, Sea, Station
from remoras.events import Priority

SERVICES = {
    "NODE_INFO": "node", "ADDRESS_RESOLUTION": "node", "PHYSICAL": "phy", "DATAGRAM": "phy", "RANGING": "ranging",
}  # fmt: skip
AGENTS = tuple(dict.fromkeys(SERVICES.values()))
PREFIX = "org.arl.unet.Services."
TOPICS = "#phy__ntf", "#org.arl.unet.Topics.DATAGRAM"
"""Recipients of receptions: the first that a program wants."""
MOST_TOPICS, MOST_NAME, PROTOCOLS = 64, 200, 64
MICRO = 1e6  # microseconds in a second


class UnetProgram:
    """One connection of a program; ``say`` sends it an object, an answer about agents after ``pause_s`` of the sea."""

    def __init__(self, sea: Sea, station: Station, say: Callable[[Object], None], pause_s: float) -> None:
        self._sea, self._station, self._say, self._pause_s = sea, station, say, pause_s
        self._wants: frozenset[str] = frozenset()
        station.listeners.append(self._heard)

    def close(self) -> None:
        """End the reception of packets; a repeated call has no effect."""
        if self._heard in self._station.listeners:
            self._station.listeners.remove(self._heard)

    def take(self, asked: Object) -> bool:
        """Process an object; False if it is no request."""
        service = str(asked.get("service")).removeprefix(PREFIX)
        match asked:
            case {"alive": bool()} | {"inResponseTo": str()}:
                pass
            case {"action": "agents"}:
                self._answer(asked, agentIDs=AGENTS)
            case {"action": "containsAgent", "agentID": name}:
                self._answer(asked, answer=name in AGENTS)
            case {"action": "services"}:
                self._answer(asked, services=[PREFIX + name for name in SERVICES])
            case {"action": "agentForService"}:
                self._answer(asked, **({"agentID": SERVICES[service]} if service in SERVICES else {}))
            case {"action": "agentsForService"}:
                self._answer(asked, agentIDs=[SERVICES[service]] if service in SERVICES else [])
            case {"action": "wantsMessagesFor", "agentIDs": list(wanted)} if len(wanted) <= MOST_TOPICS:
                self._wants = frozenset(map(str, wanted))
            case {"action": "send"} if (message := message_in(asked)) is not None:
                return self._request(*message)
            case _:
                return False
        return True

    def _answer(self, asked: Object, **answer: Any) -> None:
        answered = {"id": asked.get("id"), "inResponseTo": asked["action"], **answer}
        self._sea.clock.schedule(self._sea.now_s + self._pause_s, Priority.SLOT, lambda: self._say(answered))

    def _request(self, clazz: str, data: Object) -> bool:
        match data:
            case {"recipient": str(agent), "sender": str(program), "msgID": str(number)}:
                if agent not in AGENTS or max(len(program), len(number)) > MOST_NAME:
                    return False
            case _:
                return False

        def reply(kind: str, perf: str, **values: Any) -> None:
            self._say(sending(kind, agent, program, perf, inReplyTo=number, **values))

        def agree(refused: str) -> None:
            if refused:
                reply("unet.RefuseRsp", "REFUSE", reason=refused)
            else:
                reply("fjage.Message", "AGREE")

        match clazz, data:
            case "ParameterReq", _:
                self._parameters(agent, data, reply)
            case "AddressResolutionReq", {"name": str(name)}:
                address = next((other.address for other in self._sea.stations if other.data.name == name), None)
                reply("unet.addr.AddressResolutionRsp", "INFORM", name=name, address=address)
            case (("DatagramReq" | "TxFrameReq"), {"data": content}) if (payload := unpacked(content)) is not None:
                to, protocol = data.get("to", EVERYBODY), data.get("protocol", 0)
                kind = "unet.phy.TxFrameNtf" if clazz == "TxFrameReq" else "unet.DatagramTransmissionNtf"
                if not (_is_whole(to, 255) and _is_whole(protocol, PROTOCOLS - 1)):
                    agree("to: allowed is 0 to 255; protocol: 0 to 63")
                elif data.get("reliability"):
                    agree("reliability: the sea delivers datagrams once or not at all")
                else:
                    sent = Packet(payload, to, protocol, lambda: reply(kind, "INFORM", to=to))
                    agree(self._sea.offer(self._station, sent))
            case "RangeReq", {"to": int(to)} if to in self._sea.by_address and to != self._station.address:

                def measured(range_m: float | None) -> None:
                    if range_m is None:
                        reply("unet.FailureNtf", "FAILURE", reason=f"no answer of {to}")
                    else:
                        ends = {"from": self._station.address, "to": to}
                        reply("unet.localization.RangeNtf", "INFORM", range=range_m, rxTime=self._now_us, **ends)

                agree(self._sea.measure(self._station, to, measured))
            case "RangeReq", _:
                agree(f"to: allowed is another of {', '.join(map(str, self._sea.by_address))}")
            case _:
                reply("fjage.Message", "NOT_UNDERSTOOD")
        return True

    @property
    def _now_us(self) -> int:
        return round(self._sea.now_s * MICRO)

    def _parameters(self, agent: str, data: Object, reply: Callable[..., None]) -> None:
        more = data.get("requests")
        listed = more[:MOST_TOPICS] if isinstance(more, list) else ()
        requests = [data, *(request for request in listed if isinstance(request, dict))]
        for request in requests:
            match request:
                case {"param": str(name), "value": [x_m, y_m, *_]} if agent == "node" and _short(name) == "location":
                    if _is_number(x_m) and _is_number(y_m):
                        self._sea.place(self._station, x_m, y_m)
        known = self._values(agent)
        asked = [_short(request["param"]) for request in requests if isinstance(request.get("param"), str)] or [*known]
        values = {name: known[name] for name in asked if name in known}
        first = next(iter(values), None)
        told = {} if first is None else {"param": first, "value": values.pop(first)}
        readonly = [name for name in known if name != "location"]
        reply(
            "fjage.param.ParameterRsp", "INFORM", index=data.get("index", -1), values=values, readonly=readonly, **told
        )

    def _values(self, agent: str) -> Object:
        station, modem = self._station, self._sea.setup.modem
        if agent == "node":
            return {"address": station.address, "nodeName": station.data.name,
                    "location": [*station.at_m, -station.data.depth_m]}  # fmt: skip
        speed_mps = self._sea.setup.scenario.sound_speed_mps
        if agent == "ranging":
            return {"propagationSpeed": speed_mps, "maxRange": self._sea.setup.scenario.communication.range_m}
        return {
            "MTU": modem.payload_bytes, "RTU": modem.payload_bytes, "time": self._now_us,
            "propagationSpeed": speed_mps, "dataRate": modem.rate_bps, "busy": self._station.is_sending,
            "frameDuration": modem.packet_s(modem.payload_bits),
        }  # fmt: skip

    def _heard(self, received: Received) -> None:
        topic = next((topic for topic in TOPICS if topic in self._wants), None)
        if topic is not None:
            packet, rx_us = received.packet, round(received.time_s * MICRO)
            fields = {"from": received.sender, "to": packet.to, "protocol": packet.protocol, "type": 2, "rxTime": rx_us}
            self._say(sending("unet.phy.RxFrameNtf", "phy", topic, "INFORM", data=packed(packet.data), **fields))


def _short(name: str) -> str:
    return name.rpartition(".")[2]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_whole(value: Any, most: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= most
