"""Command exchange-study, and descriptions of a sea: losses of a network, reach of modems in a scenario."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from missions.errors import LONGEST_VALUE, check_name, cut
from remoras.cli.app import (
    FigureFormat,
    Json,
    aligned,
    command,
    fail,
    figure_format,
    show,
    show_files,
    show_json,
)
from remoras.cli.runs import load, set_keys
from remoras.process import Progress

if TYPE_CHECKING:
    from exchange.channel.acoustic import AcousticChannel
    from exchange.channel.network import Network
    from exchange.policy.policies import AckPolicy
    from exchange.study.parameters import ExchangeStudy
    from exchange.study.study import StudyRow, TrialMean
    from missions.scenarios.scenario import Scenario
    from visualisation.reach import ModemReach


TIMES = ("delivered", "source", "senders")
"""Kinds of figures of a custom study, and names of their files."""
OF_THE_PAPER = ("figure-3", "figure-4", "figure-5")
LOADED = "loaded"
"""Kind and name of the figure of the loaded case."""


def loss_rates(text: str) -> tuple[float, ...]:
    """Parse loss rates: ``0.1,0.5`` or ``0.05:0.8:0.05`` (first, last, step).

    >>> loss_rates("0.1:0.3:0.1"), loss_rates("0.5")
    ((0.1, 0.2, 0.3), (0.5,))
    """
    try:
        if ":" not in text:
            return tuple(float(part) for part in text.split(","))
        first, last, step = (float(part) for part in text.split(":"))
        if step <= 0.0 or last < first:
            raise ValueError
    except ValueError:
        shown = cut(text, LONGEST_VALUE)
        fail(f"--per {shown!r}: allowed are rates such as 0.1,0.5 or first:last:step such as 0.05:0.8:0.05")
    # The tolerance keeps the last rate, and rounding its text: 0.3, not 0.30000000000000004.
    return tuple(round(first + number * step, 10) for number in range(int((last - first) / step + 1e-9) + 1))


def named(policies: Iterable[str]) -> list[str | AckPolicy]:
    """Resolve external policies and expand ``all`` to the six of the paper; shipped names stay."""
    from exchange.policy.policies import PAPER_POLICIES
    from missions.scenarios.communication import policy_of
    from missions.scenarios.parts import stored

    names = [stored("policy", name) for part in policies for name in (PAPER_POLICIES if part == "all" else (part,))]
    return [policy_of(name) if ":" in name else name for name in names]


@command("exchange-study", "remoras exchange-study --nodes 8 --per 0.1,0.5 --trials 300")
def exchange_study(
    nodes: int | None = None,
    per: str = "0.05:0.8:0.05",
    policies: str = "all",
    trials: int = 2000,
    load: str = "single",
    items: int = 1,
    item_bits: int = 60,
    capacity_bits: int | None = None,
    carrier_evidence: Annotated[bool, typer.Option("--carrier-evidence/--no-carrier-evidence")] = False,
    bound: bool = False,
    seed: int = 1,
    jobs: int = 1,
    out: Path | None = None,
    file_format: FigureFormat = None,
    force: bool = False,
    as_json: Json = False,
) -> None:
    """Study the exchange policies: time to delivery and to acknowledgement against packet loss.

    Options:
        nodes (N): Vehicles in the fleet, 2 to 64.  [default: 5]
        per (RATES): Packet error rates, 0 to below 1: 0.1,0.5 or first:last:step.
        policies (NAMES): Policies, comma-separated names or package.module:object; all: the paper's six.
        trials (N): Trials of each policy at each error rate.
        load (LOAD): Creation of items: single, batch or poisson:RATE (per node and slot).
        items (N): Items at every node, for load batch.
        item_bits (BITS): Size of an item.
        capacity_bits (BITS): Size of a packet including its header; default: unlimited.
        carrier_evidence: A node that sends an item acknowledges it.
        bound: Add a bound on all policies: received sets are known at no cost.
        seed (N): Seed of all random draws: 0, 1, 2, ...
        jobs (N): Threads on this machine; results do not depend on it.
        out (DIR): Folder for figures, captions and their CSV; without --nodes, those of the paper.
        force: Replace existing files in --out.
    """
    from exchange.study.parameters import ExchangeStudy, workload_named
    from missions.disk import check_output

    form = figure_format(file_format, out)
    study = ExchangeStudy(
        nodes=5 if nodes is None else nodes,
        per=loss_rates(per),
        policies=tuple(named(policies.split(","))),
        trials=trials,
        load=workload_named(load, items),
        item_bits=item_bits,
        capacity_bits=capacity_bits,
        carrier_evidence=carrier_evidence,
        seed=seed,
        bound=bound,
    )
    if out is not None:
        check_output(out, force)
    rows = _run([study], jobs)
    if out is not None:
        files = _files(study, rows, form, jobs, of_the_paper=nodes is None)
        _write(files, out)
        show_files((out / name for name, _ in files), as_json)
    if as_json:
        show_json([row.as_json() for row in rows])
    elif out is None:
        _print_study(rows)


def _run(studies: Sequence[ExchangeStudy], jobs: int) -> list[StudyRow]:
    from exchange.study.study import run

    rows: list[StudyRow] = []
    with Progress("exchange study", len(studies), "studies") as progress:
        for number, study in enumerate(studies):
            # The default binds the number of this pass.
            def at(done: int, total: int, number: int = number) -> None:
                progress.at(number + done / total)

            rows += run(study, jobs, at, lambda text: print(text, file=sys.stderr))
    return rows


def _files(
    study: ExchangeStudy, rows: Sequence[StudyRow], file_format: str, jobs: int, of_the_paper: bool
) -> list[tuple[str, bytes]]:
    from exchange.study.parameters import LoadKind
    from exchange.study.study import loaded_studies
    from visualisation.policies import as_csv, contents

    # One loss rate gives no curve.
    if study.load.kind is LoadKind.POISSON and len(study.per) == 1:
        return [(f"{LOADED}.csv", as_csv(rows))]
    if not of_the_paper or study.load.kind is LoadKind.POISSON:
        return [file for kind in TIMES for file in contents(rows, kind, kind, file_format)]
    ten = _run([replace(study, nodes=10)], jobs)
    loaded = _run(loaded_studies(seed=study.seed), jobs)
    of_figure = dict(zip(OF_THE_PAPER, (("source", rows), ("senders", rows), ("senders", ten)), strict=True))
    of_figure[LOADED] = (LOADED, loaded)
    return [file for name, (kind, shown) in of_figure.items() for file in contents(shown, kind, name, file_format)]


def _write(files: Sequence[tuple[str, bytes]], out: Path) -> None:
    from missions.disk import FIGURES, new_content
    from missions.errors import writing

    suffixes = (*FIGURES, ".txt")
    ours = {f"{name}{suffix}" for name in (*TIMES, *OF_THE_PAPER, LOADED) for suffix in suffixes}
    # The folder may have other files of the user: only those of earlier studies are replaced.
    with writing(f"--out {out}"), new_content(out, of_older=ours.intersection, last=None) as draft:
        for name, content in files:
            (draft / name).write_bytes(content)


def _print_study(rows: Sequence[StudyRow]) -> None:
    def shown(estimate: TrialMean | None) -> str:
        if estimate is None:
            return "-"
        more = "" if estimate.ci95_high is None else f" +- {estimate.ci95_high - estimate.mean:.2f}"
        return f"{estimate.mean:.2f}{more}"

    table: list[Sequence[str]] = [
        ("per", "policy", "delivered (slots)", "source acked (slots)", "senders acked (slots)", "censored")
    ]
    for row in rows:
        estimates = map(shown, (row.delivered_slots, row.source_acked_slots, row.senders_acked_slots))
        table.append((f"{row.per:g}", row.policy, *estimates, str(row.censored_senders)))
    print(*aligned(table, right=(0, 2, 3, 4, 5)), sep="\n")


DEFAULT_RANGES = "250,500,1000,2000,3000,4000,5000,6000,8000,10000"
DRAWN = 200
"""Number of ranges at which the lines of the figure are computed."""
COLUMNS = ("modem", "range / m", "loss / dB", "SNR / dB", "Eb/N0 / dB", "delivered")


def ranges_of(text: str) -> tuple[float, ...]:
    """Parse ranges in metres, ``500,1000``."""
    try:
        ranges_m = tuple(sorted(float(part) for part in text.split(",")))
    except ValueError:
        ranges_m = ()
    if not ranges_m or not all(0.0 < range_m <= 100_000.0 for range_m in ranges_m):  # a NaN is in no range
        fail(f"--ranges {cut(text, LONGEST_VALUE)!r}: allowed are metres such as 500,1000, above 0 and at most 100000")
    return ranges_m


def describe(
    name: str,
    modem: str | None,
    ranges: str | None,
    settings: list[str] | None,
    out: Path | None,
    form: str,
    as_json: bool,
) -> None:
    """Describe a measured network: source, losses, unknowns; or the reach of modems in a scenario.

    Reach is the share of delivered packets over range, on the channel acoustic.
    """
    of_scenario = {"--modem": modem, "--ranges": ranges, "--set": settings}
    if is_network(name):
        if misused := [option for option, value in of_scenario.items() if value is not None]:
            fail(f"{misused[0]}: applies to the modems of a scenario, and {name} is a network")
        _describe_network(name, out, form, as_json)
        return
    ranges_m = ranges_of(ranges or DEFAULT_RANGES)
    # The reach needs a sea, whatever channel the scenario has.
    overrides = [("sea", "channel.name=acoustic"), *set_keys(settings)]
    chosen = (
        [[]] if modem is None else [[("--modem", f"communication.modem={part.strip()}")] for part in modem.split(",")]
    )
    scenarios = [load(name, [*overrides, *more]) for more in chosen]
    reaches = [_reach(scenario, ranges_m) for scenario in scenarios]
    if out is not None:
        _draw(scenarios, ranges_m[-1], out, form, as_json)
    rows = [{"modem": reach.modem, **point._asdict()} for reach in reaches for point in reach.points]
    show(rows, as_json, _reach_lines(reaches))


def is_network(name: str) -> bool:
    """True for a network, False for a scenario; fail for an unknown name."""
    from exchange.channel.network import file_in
    from exchange.channel.network import shipped as networks
    from missions.files import has_table, shipped

    if not (file := file_in(name)):
        check_name("network or scenario", name, [*networks(), *shipped()])
        return name in networks()
    return file != name or file.endswith(".csv") or has_table(name, "network")


def _acoustic(scenario: Scenario) -> AcousticChannel:
    from exchange.channel.acoustic import AcousticChannel

    channel = scenario.channel.settings()
    if not isinstance(channel, AcousticChannel):
        fail(f"--set: sea describes the channel acoustic, not {scenario.channel.name}; allowed: keys of acoustic")
    return channel


def _reach(scenario: Scenario, ranges_m: Sequence[float]) -> ModemReach:
    from visualisation.reach import ModemReach, Point

    channel, deployment = _acoustic(scenario), scenario.deployment
    modem, links, budget = deployment.modem, channel.links(deployment), channel.budget(deployment)
    points = tuple(
        Point(
            range_m,
            budget.loss_db(range_m),
            budget.snr_db(range_m),
            budget.ebn0_db(range_m),
            1.0 - links.loss_at(range_m, modem.payload_bits),
        )
        for range_m in ranges_m
    )
    return ModemReach(modem.name, modem.range_m, points)


def _draw(scenarios: Sequence[Scenario], furthest_m: float, out: Path, file_format: str, as_json: bool) -> None:
    from visualisation import output
    from visualisation.reach import reach_contents

    lines_m = [furthest_m * (number + 1) / DRAWN for number in range(DRAWN)]
    channel = scenarios[0].channel
    sea = (
        f"Spreading exponent {channel.spreading:g}, absorption {channel.absorption}, {channel.temperature_c:g} deg C, "
        f"salinity {channel.salinity_psu:g}, shipping {channel.shipping:g}, wind {channel.wind_mps:g} m/s, "
        f"fading: {channel.fading}."
    )
    if (site := channel.site) is not None and site.is_on:
        sea += f" Mean over a site: spread {site.spread_db:g} dB, receivers {site.receiver_db:g} dB."
    drawn = reach_contents([_reach(scenario, lines_m) for scenario in scenarios], sea, file_format)
    show_files(output.write_folder(out, drawn), as_json)


def _reach_lines(reaches: Sequence[ModemReach]) -> list[str]:
    rows = [
        (reach.modem, f"{p.range_m:g}", f"{p.transmission_loss_db:.1f}", f"{p.snr_db:.1f}", f"{p.ebn0_db:.1f}",
         f"{p.delivered:.3f}")
        for reach in reaches for p in reach.points
    ]  # fmt: skip
    return aligned([COLUMNS, *rows], right=range(1, len(COLUMNS)))


def _describe_network(name: str, out: Path | None, file_format: str, as_json: bool) -> None:
    from exchange.channel.models import LinkFileError
    from exchange.channel.network import network_of

    try:
        network = network_of(name)
    except LinkFileError as error:
        fail(f"network {cut(name, LONGEST_VALUE)!r}: {error}")
    if out is not None:
        from visualisation import output
        from visualisation.networks import network_contents

        show_files(output.write_folder(out, network_contents(network, file_format)), as_json)
    lines = [f"{network.name}: {network.title}".removesuffix(": ")]
    sources = (("source", network.citation), ("packet", network.packet), ("assumed", network.assumption))
    lines += [f"  {label}: {text}" for label, text in sources if text]
    lines += [f"  unknown: {text}" for text in network.unknown]
    rows = list(_rows(network))
    lines += [f"  {line}" for line in aligned(rows, right=range(len(rows[0])))]
    show({**network.model_dump(mode="json"), "assumed": network.assumption}, as_json, lines)


def _rows(network: Network) -> Iterator[list[str]]:
    if network.per_over_range:
        yield ["range (m)", "loss"]
        yield from ([f"{range_m:g}", f"{per:.3f}"] for range_m, per in network.per_over_range)
        return
    names = network.nodes
    yield ["loss: rows send, columns receive", *names]
    for sender in names:
        yield [sender, *("-" if sender == other else f"{network.per[sender, other]:.3f}" for other in names)]
