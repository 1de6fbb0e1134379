"""Measurements of published results by calls of the program; each returns values by name."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations, permutations, product
from statistics import fmean
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from exchange.channel.network import network_of
from exchange.policy.candidates import Additive, Moment, Waiting
from exchange.schedule import TdmaSchedule
from exchange.study.parameters import ExchangeStudy
from exchange.study.study import StudyRow
from exchange.study.study import run as run_study
from missions.age_of_information import expected_s, mean_age_s, peak_age_s
from missions.mapping.jobs import SurveyJob
from missions.runs.assembly import assemble
from missions.runs.run import run
from missions.runs.setup import resolved
from missions.scenarios import load
from remoras.database import AUVDatabase
from remoras.organisation import Group, RoleSpecification
from remoras.strategies.cbba import Bidder
from remoras.strategies.cbba_plain import CbbaPlain
from remoras.strategy import Heard, Situation
from remoras.work import Outlook, Work

Values = dict[str, float | str]
PAPER = "mapping-rendezvous"


def listed(values: Iterator[str] | Sequence[str]) -> str:
    """Join names, sorted."""
    return ", ".join(sorted(values))


def tables() -> Values:
    """Tables I and II of the REMORAS paper, after the consultation over a perfect channel."""

    scenario: Any = load(PAPER)
    fleet = assemble(resolved(scenario), seed=1)
    while not fleet.truth.milestones and fleet.now_s < 60.0:
        fleet.step()
    values: Values = {"consultation_s": fleet.truth.milestones[0].time_s}
    views = {listed([f"{a.vehicle} {a.group}.{a.role}" for a in v.social.organisation.assignments])
             for v in fleet.vehicles}  # fmt: skip
    values["views"] = len(views)
    values["missions"] = "; ".join(sorted({str(dict(v.social.missions)) for v in fleet.vehicles}))
    grounds = {ground.name: ground.corners_m for ground in scenario.area}
    for vehicle in fleet.vehicles:
        name, held = vehicle.name, vehicle.social.organisation.roles_of(vehicle.name)
        values[f"roles_{name}"] = listed([f"{one.group}.{one.role}" for one in held])
        values[f"objectives_{name}"] = listed([f"{o.role}: {o.name}" for o in vehicle.social.objectives_of(name)])
        found = [(s.objective, activity) for s in vehicle.executive.sets if s.objective is not None
                 for activity in s.activities]  # fmt: skip
        values[f"activities_{name}"] = listed([f"{objective.role}: {one.name}" for objective, one in found])
        for objective, one in found:
            if one.name == "Homing":
                values[f"rally_{name}_{objective.group}"] = "({:g},{:g})".format(*one.parameters[0])
            if one.name == "ZigzagExploring":
                corners = grounds[one.parameters[0]]
                values[f"ground_{name}"] = "".join(f"({x:g},{y:g})" for x, y in corners)
            if one.name in ("Following", "Positioning"):
                first, second, *_ = one.parameters or ("", "")
                shown = ", ".join(second) if isinstance(second, tuple) else second
                values[f"{one.name}_{name}_{objective.role}"] = f"{first} {shown}"
    fleet.close()
    return values


def roles_and_tracks() -> Values:
    """Figures 6 and 7 of the REMORAS paper: tracks, and driving roles in order."""

    finished = run(load(PAPER, [("--channel", "channel.name=perfect")]))
    consulted_s = finished.milestones[0].time_s
    active: dict[str, list[str]] = {}
    for time_s, vehicle, _, role, event in finished.recorder.rows("roles"):
        spans = active.setdefault(vehicle, [])
        if event == "active" and time_s >= consulted_s:
            spans.append(role)
    values: Values = {f"order_{name}": " > ".join(dict.fromkeys(roles)) for name, roles in active.items()}
    times_s = {f"{m.name}_{m.vehicle or m.group}": m.time_s for m in finished.milestones}
    rows = finished.recorder.rows("trajectories")
    ends = {"Operational": (450.0, 450.0), "Coordination": (500.0, 500.0)}
    for group, point_m in ends.items():
        there = [row[2:4] for row in rows if row[0] == times_s[f"gathered_{group}"]]
        values[f"gathered_{group}_m"] = min(math.dist(place_m, point_m) for place_m in there)
    places = {name: [row[2:4] for row in rows if row[1] == name] for name in active}
    values["spread_m"] = max(math.dist((0.0, 0.0), track[0]) for track in places.values())
    for name, track in places.items():
        inner = [place for place in track if min(place) > 100.0 and max(place) < 600.0]
        turns = [b for a, b, c in zip(inner, inner[20:], inner[40:], strict=False)
                 if (b[0] - a[0]) * (c[0] - b[0]) < -1.0]  # fmt: skip
        values[f"zigzag_{name}"] = float(len(turns) > 0)
    return values


PER = tuple(step / 20 for step in range(1, 17))
POLICIES = ("ack-repeat", "m-ack", "m-ack-repeat", "mps-ack", "mps-ack-repeat")


class Curves:
    """Means relative to ACK of one figure, by policy and loss rate."""

    def __init__(self, rows: Sequence[StudyRow], quantity: str) -> None:
        self._mean = {(row.policy, row.per): getattr(row, quantity).mean for row in rows}

    def at(self, policy: str, per: float) -> float:
        """Return the mean of a policy at a loss rate."""
        return 1.0 if policy == "ack" else float(self._mean[policy, per])

    def n_below(self, policies: Sequence[str], others: Sequence[str], least: float = 0.0, most: float = 1.0) -> int:
        """Number of loss rates in a range at which each of ``policies`` is below each of ``others``."""
        return sum(
            max(self.at(policy, per) for policy in policies) < min(self.at(other, per) for other in others)
            for per in PER
            if least <= per <= most
        )

    def crossing(self, falling: str, rising: str) -> float:
        """Loss rate from which ``falling`` stays below ``rising``; 1 if it does not at the last one."""
        above = [per for per in (0.0, *PER) if per and self.at(falling, per) >= self.at(rising, per)]
        return min((per for per in PER if per > max(above, default=0.0)), default=1.0)


def exchange_figures(trials: int = 400) -> Values:
    """Figures 3 to 5 of the exchange paper: numbers of the 16 loss rates at which a statement holds; crossings."""

    rows = {nodes: run_study(ExchangeStudy(nodes=nodes, per=PER, trials=trials, seed=1)) for nodes in (3, 5, 10)}
    source, five, ten, three = (Curves(rows[nodes], quantity) for nodes, quantity in (
        (5, "relative_source"), (5, "relative_senders"), (10, "relative_senders"), (3, "relative_senders"),
    ))  # fmt: skip
    delivered = Curves(rows[5], "relative_delivered")
    matrix, plain = ("m-ack-repeat", "mps-ack-repeat"), ("ack", "ack-repeat", "m-ack", "mps-ack")
    others = ("ack", "ack-repeat", "m-ack", "m-ack-repeat")
    gaps = [[c.at("mps-ack", per) - c.at("mps-ack-repeat", per) for per in PER] for c in (five, ten)]
    return {
        "ack_worst": source.n_below(POLICIES, ["ack"]),
        "repeating_matrix_best": source.n_below(matrix, plain),
        "mps_passes_ack_repeat": source.n_below(["mps-ack"], ["ack-repeat"], least=0.5),
        "mps_behind": max(source.at("mps-ack", per) - source.at("m-ack-repeat", per) for per in PER if per >= 0.7),
        "matrix_alone": max(source.at("m-ack", per) for per in PER if per >= 0.5),
        "ack_repeat_worse": five.n_below(["ack"], ["ack-repeat"]),
        "low_loss_best": five.n_below(matrix, plain, most=0.1),
        "mps_dominates": five.n_below(["mps-ack", "mps-ack-repeat"], others, least=0.5),
        "crossing_3": three.crossing("mps-ack", "m-ack-repeat"),
        "crossing_5": five.crossing("mps-ack", "m-ack-repeat"),
        "crossing_10": ten.crossing("mps-ack", "m-ack-repeat"),
        "ten_ack_repeat_worse": ten.n_below(["ack"], ["ack-repeat"]),
        "larger_gap": sum(few < many for few, many in zip(*gaps, strict=True)),
        "strongest": min(c.n_below(["mps-ack-repeat"], [p for p in (*POLICIES, "ack") if p != "mps-ack-repeat"])
                         for c in (five, ten)),
        "delivery": delivered.n_below(["ack-repeat", *matrix], ["ack"]),
        "false_beliefs": sum(row.false_beliefs for of_size in rows.values() for row in of_size),
    }  # fmt: skip


def closed_forms() -> Values:
    """Expected frames of section 5.2 of the exchange paper (N = 2, loss 0.5), and bits of the headers at N = 5."""

    by_name = {row.policy: row for row in run_study(ExchangeStudy(nodes=2, per=(0.5,), trials=8000, seed=1))}
    ack = by_name["ack"]
    if ack.delivered_slots is None or ack.senders_acked_slots is None:
        raise ValueError("all trials are censored")
    # A frame has two slots. Delivery ends in the sender's slot, the first of its frame; acknowledgement in the second.
    values: Values = {"delivered_frames": (ack.delivered_slots.mean + 1.0) / 2.0,
                      "acked_frames": ack.senders_acked_slots.mean / 2.0}  # fmt: skip
    bits = {row.policy: row.header_bits for row in run_study(ExchangeStudy(nodes=5, per=(0.5,), trials=1, seed=1))}
    return {**values, **{f"header_{policy}": float(of_one) for policy, of_one in bits.items()},
            "additional_bits": float(bits["m-ack"] - bits["ack"])}  # fmt: skip


def exchange_selection() -> Values:
    """Steps 5 and 6 of the Data Exchange Manager (cooperation paper, section IV) on one queue, and the slot."""

    rule, moment = Additive(), Moment(0.0, 6)
    waiting = {"urgent": Waiting(priority=3, since_slot=4), "old": Waiting(priority=1, since_slot=0)}
    weights = {name: rule.value(one, moment) for name, one in waiting.items()}
    waiting["urgent"].note_sent(moment)
    sent = rule.value(waiting["urgent"], moment)
    schedule = resolved(load(PAPER)).schedule
    return {"urgent": weights["urgent"], "old": weights["old"], "sent": sent, "slot_s": schedule.slot_s,
            "frame_s": schedule.frame_s, "packet_s": schedule.packet_s, "guard_s": schedule.guard_s}  # fmt: skip


def ages() -> Values:
    """Mean and peak age of information of the paper's mission at three loss rates, and the formula; seeds 1 to 4."""

    values: Values = {}
    for per in (0.2, 0.5, 0.8):
        runs = [run(load(PAPER, [("--per", f"channel.per={per}")]), seed) for seed in range(1, 5)]
        packets = [row for one in runs for row in one.recorder.rows("packets")]
        delay_s = fmean(arrival_s - row[1] for row in packets for arrival_s in row[9])
        mean_s, peak_s = expected_s(runs[0].setup.schedule.frame_s, per, delay_s)
        key = f"{100 * per:.0f}"
        values |= {f"formula_mean_{key}": mean_s, f"formula_peak_{key}": peak_s}
        values[f"mean_{key}"] = fmean(mean_age_s(one) or 0.0 for one in runs)
        values[f"peak_{key}"] = fmean(peak_age_s(one) or 0.0 for one in runs)
    return values


def link_axioms() -> Values:
    """Axioms of radio models (Kotz 2004) on the links of mission-2012."""

    network = network_of("mission-2012")
    places = {node.name: node.position_m or (0.0, 0.0) for node in network.node}
    links = list(permutations(places, 2))
    ranges_m = [math.dist(places[a], places[b]) for a, b in links]
    losses = [network.per[link] for link in links]
    rank = float(spearmanr(ranges_m, losses).statistic)
    depths_m = [node.depth_m or 0.0 for node in network.node]
    pairs = list(combinations(zip(ranges_m, losses, strict=True), 2))
    sent = {name: fmean(network.per[name, other] for other in places if other != name) for name in places}
    return {
        "depths_m": max(depths_m) - min(depths_m),
        "mean_difference": fmean(abs(network.per[a, b] - network.per[b, a]) for a, b in combinations(places, 2)),
        "largest_difference": max(abs(network.per[a, b] - network.per[b, a]) for a, b in combinations(places, 2)),
        "partial_links": sum(0.05 < loss < 0.95 for loss in losses) / len(losses),
        "explained": rank**2,
        "inversions": sum((a - b) * (p - q) < 0 for (a, p), (b, q) in pairs) / len(pairs),
        "sender_spread": max(sent.values()) - min(sent.values()),
    }  # fmt: skip


def known_places() -> Values:
    """Share of a TDMA frame saved by guards for known places (nodes of mission-2012) in place of the declared range."""

    places = [node.position_m or (0.0, 0.0) for node in network_of("mission-2012").node]
    setup = resolved(load(PAPER))
    modem, speed_mps = setup.scenario.deployment.modem, setup.scenario.communication.range_m / setup.schedule.guard_s
    farthest_m = [max(math.dist(place, other) for other in places) for place in places]
    values: Values = {}
    for name, bits in (("large", modem.payload_bits), ("small", 64)):
        packet_s = modem.packet_s(bits)
        declared_s = TdmaSchedule(len(places), packet_s, setup.schedule.guard_s).frame_s
        known_s = math.fsum(TdmaSchedule(1, packet_s, far_m / speed_mps).frame_s for far_m in farthest_m)
        values[name] = 100.0 * (1.0 - known_s / declared_s)
    return values


def bundle_guarantee(n_instances: int = 40) -> Values:
    """Score of plain CBBA over the greatest score (exact), each part in its best order, on drawn instances.

    Two to four vehicles share four or five surveys at drawn places; all packets arrive. Choi, Brunet, How 2009 prove
    at least one half.
    """
    ratios = [_bundle_ratio(np.random.default_rng(seed)) for seed in range(n_instances)]
    return {"n": float(n_instances), "least": min(ratios), "mean": fmean(ratios)}


def _bundle_ratio(draw: np.random.Generator) -> float:

    n_vehicles, n_jobs = int(draw.integers(2, 5)), int(draw.integers(4, 6))
    corners = [[tuple(place + side) for side in np.array([(0, 0), (0, 100), (100, 100), (100, 0)])]
               for place in draw.uniform(-600.0, 600.0, (n_jobs, 2))]  # fmt: skip
    jobs = {f"job {n}": SurveyJob(f"job {n}", tuple(own)) for n, own in enumerate(corners)}
    roles = tuple(RoleSpecification(f"Role{n}", 1, 1, job=name) for n, name in enumerate(jobs))
    head = RoleSpecification("Head", 1, 1, head=True, founding=True)
    group = Group("Team", (head, RoleSpecification("Hand", 1, founding=True), *roles), "rally")
    able = next(data for data in resolved(load(PAPER)).database.values() if data.sensors)
    fleet = AUVDatabase(tuple(
        replace(able, name=f"AUV{n:02d}", node=n, start_m=tuple(draw.uniform(-300.0, 300.0, 2)),
                playable_roles=("Hand" if n else "Head", *(role.name for role in roles)))
        for n in range(n_vehicles)
    ))  # fmt: skip
    strategy = CbbaPlain(settle_rounds=1000)  # claims never stand so long: nobody begins
    work = Work(group, strategy.form(fleet, [group]), fleet, jobs)
    bidders = {name: Bidder(name, group, strategy) for name in fleet.names}
    told: list[Heard] = []
    for number in range(1, 31):
        before, told, now_s = told, [], 10.0 * number
        for name, bidder in bidders.items():
            heard = tuple(one for one in before if one.issuer != name)
            move = bidder.negotiate(Situation(now_s, number, work, None, heard, dict.fromkeys(fleet.names, now_s)))
            told += [Heard(name, now_s, statement.facts) for statement in move.statements if statement.told]

    def score(name: str, order: Sequence[str]) -> float:
        outlook: Outlook | None = Outlook(0.0, fleet[name].start_m)
        total = 0.0
        for job in order:
            if outlook is None or (outlook := jobs[job].after(outlook, fleet[name])) is None:
                return 0.0
            total += math.exp(-outlook.free_s / strategy.discount_s)
        return total

    best = {(name, part): max(score(name, order) for order in permutations(part))
            for name in fleet.names for size in range(n_jobs + 1) for part in combinations(jobs, size)}  # fmt: skip

    def total(holders: Sequence[str | None]) -> float:
        held = dict(zip(jobs, holders, strict=True))
        return math.fsum(best[name, tuple(job for job in jobs if held[job] == name)] for name in fleet.names)

    agreed = bidders[fleet.names[0]].division()
    return total([agreed.get(role.name) for role in roles]) / max(map(total, product(fleet.names, repeat=n_jobs)))
