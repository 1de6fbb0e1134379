"""Runs of every mission with random settings: strategy, policy, loss, faults, water, clocks."""

import random

from missions.errors import ConfigurationError
from missions.runs.run import Run, run
from missions.scenarios import load

MISSIONS = (
    "arrows-archaeology", "escort-lines", "ferry-passage", "mapping-corridor", "mapping-inspection", "mapping-objects",
    "mapping-patches", "mapping-rendezvous", "mapping-three-teams", "minehunting-contacts", "pandora-inspection",
    "recovery-field", "resupply-field", "trident-intervention",
)  # fmt: skip
STRATEGIES = (
    "remoras", "remoras-planned", "cbba", "cbba-plain", "central", "contract-net", "fixed-partition",
    "status-broadcast", "rendezvous-sync", "plan-and-dispatch", "oracle",
)  # fmt: skip
POLICIES = ("ack", "ack-repeat", "m-ack", "mps-ack", "mps-ack-repeat", "holdings", "adaptive")
FAULTS = ("lost", "mute", "deaf", "slow", "restarts", "joins", "drains")


def drawn_run(mission: str, draw: random.Random, longest_s: float) -> tuple[list[str], Run]:
    """Run a mission in settings that can be run; settings that contradict it are drawn again."""
    for _ in range(100):
        settings = _settings(mission, draw, longest_s)
        try:
            scenario = load(mission, [("--set", one) for one in settings])
            return settings, run(scenario, draw.randrange(1000))
        except ConfigurationError:
            continue
    raise AssertionError(f"no settings of {mission} can be run")


def _settings(mission: str, draw: random.Random, longest_s: float) -> list[str]:
    duration_s = draw.uniform(0.3, 1.0) * longest_s
    settings = [] if mission.startswith("pandora") else [f"scenario.duration_s={duration_s:.0f}"]
    if draw.random() < 0.6:
        settings.append(f"strategy.name={draw.choice(STRATEGIES)}")
    if draw.random() < 0.6:
        settings.append(f"communication.policy={draw.choice(POLICIES)}")
    if draw.random() < 0.8 and mission != "arrows-archaeology":
        settings.append(f"channel.per={draw.choice((0.0, 0.1, 0.3, 0.5, 0.8))}")
    if draw.random() < 0.6:
        settings.append(f"fault=[{', '.join(_fault(draw, duration_s) for _ in range(draw.randint(1, 3)))}]")
    if draw.random() < 0.2:
        settings += [f"current.east_mps={draw.uniform(-0.3, 0.3):.2f}", "current.tide_period_h=1.5"]
    if draw.random() < 0.1:
        settings += ["communication.clocks.offset_s=0.2", "communication.clocks.apart_s=1.0"]
    for key in ("communication.needs_follow=groups", "communication.relaying=false", "scenario.settle_s=60"):
        if draw.random() < 0.1:
            settings.append(key)
    return settings


def _fault(draw: random.Random, duration_s: float) -> str:
    kind, vehicle = draw.choice(FAULTS), f"AUV0{draw.randrange(4)}"
    at_s = draw.randrange(int(duration_s * 0.8) + 1)
    until = (
        f",until_s={at_s + draw.randrange(20, 200)}" if kind in ("mute", "deaf", "slow", "restarts", "drains") else ""
    )
    watts = ",drain_w=30" if kind == "drains" else ""
    return f'{{kind="{kind}",vehicle="{vehicle}",at_s={at_s}{until}{watts}}}'
