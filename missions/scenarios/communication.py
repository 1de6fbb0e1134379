"""The table ``[communication]``: modem, exchange policy, needs, and what packets carry."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from missions.scenarios.extending import with_features
from missions.scenarios.tables import QUEUE_LIMIT, NotNegative, Sparse


@with_features("communication")
class Communication(Sparse):
    """The table ``[communication]``."""

    UNSAID = frozenset(
        {
            "count_listening",
            "crc_bits",
            "guard_s",
            "key_file",
            "needs_follow",
            "queue_limit",
            "receive_power_w",
            "value",
        }
    )

    modem: str = Field(
        description="modem profile: see `remoras list modems`, a table [modem.NAME], or a TOML file with one such table"
    )
    range_m: float = Field(
        gt=0.0,
        le=100_000.0,
        description="operating range: sets the guard of a slot; nothing is heard beyond, save on the channel acoustic",
    )
    transmit_power_w: NotNegative = Field(10.0, description="power of the modem while it sends")
    receive_power_w: float | None = Field(
        None,
        gt=0.0,
        le=1000.0,
        description="power of the modem while it listens, which is all the time: counts on top of hotel_w",
    )
    count_listening: bool = Field(
        False,
        description="the modem listens with the receive power of its profile, if receive_power_w does not say more; "
        "false: hotel_w has it",
    )
    policy: str = Field(description="exchange policy, see `remoras list policies`")
    lease_frames: int = Field(
        40, ge=1, le=100_000, description="TDMA frames without word of a vehicle after which it is taken to have left"
    )
    false_absence: float = Field(
        1e-6,
        ge=0.0,
        le=0.01,
        description="probability that losses alone make a silence for which a vehicle is taken to have left: by it "
        "leases are shorter where others hear it, too, down to 10 frames and 200 s; 0: lease_frames for all",
    )
    carrier_evidence: bool = Field(True, description="take a peer that sends an item as holding it")
    time_resolution_s: float = Field(
        0.1, ge=0.001, le=10.0, multiple_of=0.001, description="resolution of observation times on the wire"
    )
    guard_s: float | None = Field(
        None,
        ge=0.0,
        le=86_400.0,
        description="silence behind the longest packet of a slot; as long as needed if absent",
    )
    clock_tolerance_s: float = Field(
        1.0,
        ge=0.0,
        le=604_800.0,
        description="how much later than its arrival a fact may be observed; with a later one a packet is refused",
    )
    crc_bits: Literal[0, 8, 16, 32] = Field(
        0, description="checksum of each packet; 0 where the modem refuses what was damaged, as modems do"
    )
    key_file: str = Field(
        "",
        description="file of 32, 48 or 64 hexadecimal digits, by whose key packets are encrypted behind their head; "
        "open to its owner alone (chmod 600); extra `crypto`",
    )
    needs_follow: Literal["all", "groups"] = Field(
        "all", description="who needs the listed attributes: all vehicles, or those whose groups what is told concerns"
    )
    value: str = Field(
        "additive",
        description="rule by which vehicles compare what waits to be said: additive, goby, age, deadline, or "
        "package.module:object",
    )
    queue_limit: int = Field(
        QUEUE_LIMIT,
        ge=1,
        le=1_000_000,
        description="most items in the queue of a vehicle; others wait outside of it until there is room",
    )
    needs: dict[str, Annotated[int, Field(ge=1, le=1000)]] = Field(
        description="priority of each attribute that vehicles need of each other"
    )
