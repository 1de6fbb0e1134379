"""Commands about named inputs and this installation: list, validate, explain, doctor."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from exchange.channel.modems import MEASURED, Modem, modems
from exchange.channel.network import shipped as shipped_networks
from exchange.channel.shipped import CHANNELS
from exchange.policy.policies import POLICIES
from missions.errors import LONGEST_VALUE, check_name, cut
from missions.files import check_named, is_study, shipped_abouts, shipped_studies
from remoras.cli import completion
from remoras.cli.app import Json, as_typed, command, fail, show, show_json
from remoras.cli.runs import Settings, set_keys
from remoras.plugins import INSTALLED_KINDS, installed_plugins
from remoras.strategies import factors_of, parameters, strategies, titles
from worldmodel import suggestion

KINDS = ("scenarios", "strategies", "policies", "channels", "modems", "networks", "plugins", "studies")


@command("list", "remoras list strategies")
def list_(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help=f"One of {', '.join(KINDS)}; all but the studies if left out.",
            autocompletion=completion.offering(*KINDS),
        ),
    ] = "",
    as_json: Json = False,
) -> None:
    """List scenarios, strategies, policies, channels, modems, networks and installed plug-ins; or studies.

    For strategies, show source, factors, messages and parameters too.
    """
    if kind:
        check_name("kind", kind, KINDS)

    listed = {name: LISTINGS[name]() for name in ([kind] if kind else KINDS[:-1])}
    if as_json:
        rows = {
            name: [
                {"name": key, "description": text, **(_of_strategy(key) if name == "strategies" else {})}
                for key, text in entries.items()
            ]
            for name, entries in listed.items()
        }
        show_json(rows[kind] if kind else rows)
        return
    for name, entries in listed.items():
        if not entries and not kind:
            continue
        print(f"{name}:")
        width = max((len(key) for key in entries), default=0)
        for key, text in entries.items():
            print(f"  {key:<{width}}  {text}")
            for line in _detail_lines(_of_strategy(key)) if kind == "strategies" else ():
                print(f"      {line}")
        if name in NOTES:
            print(f"  {NOTES[name]}")


def _detail_lines(details: Mapping[str, Any]) -> Iterator[str]:
    yield f"source: {details['source']}"
    if factors := details["factors"]:
        yield f"factors: {', '.join(f'{name} {level}' for name, level in factors.items())}"
    yield from (f"message {name}: {meaning}" for name, meaning in details["messages"].items())
    yield from (f"parameter {p['name']} = {p['default']}: {p['description']}" for p in details["parameters"])


@command("validate", "remoras validate mine.toml")
def validate(
    file: Annotated[str, typer.Argument(autocompletion=completion.scenario_or_study)],
    settings: Settings = None,
    as_json: Json = False,
) -> None:
    """Check a scenario, study or organisation file; report all faults with their lines.

    For a scenario, also warn if energy or time is hardly sufficient for the work.

    Args:
        file (FILE): Scenario, study or organisation: a file, or a shipped name.
    """
    check_named(file)
    overrides = set_keys(settings)
    if is_study(file):
        if settings:
            fail(f"--set {settings[0]}: applies to a scenario, and {file} is a study; allowed: the key below its [set]")
        _validate_study(file, as_json)
        return
    # An organisation file has no key of its own: all its tables may be in a scenario, too.
    if file.endswith(".toml") and not overrides and _validate_organisation(file, as_json):
        return
    from missions.runs.estimates import cautions
    from missions.runs.setup import resolved
    from missions.scenarios import load

    setup = resolved(load(file, overrides))
    warnings = list(cautions(setup))
    schedule, founded = setup.schedule, sorted(setup.agreement.organisation.assignments)
    reserves = [name for name in setup.database if not setup.agreement.organisation.roles_of(name)]
    report = {
        "file": file,
        "kind": "scenario",
        "ok": True,
        "slot_s": schedule.slot_s,
        "frame_s": schedule.frame_s,
        "founding": [{"vehicle": a.vehicle, "group": a.group, "role": a.role} for a in founded],
        "reserves": reserves,
        "warnings": [asdict(warning) for warning in warnings],
    }
    n_groups = len(setup.agreement.organisation.groups)
    lines = [
        f"{file}: scenario ok; {len(setup.database)} vehicles, {n_groups} groups, {len(setup.mission.jobs)} jobs, "
        f"slot {schedule.slot_s:.3f} s, frame {schedule.frame_s:.2f} s",
        *(f"  founding: {a.vehicle} plays {a.role} of {a.group}" for a in founded),
        *(f"  reserve: {name} plays no role from the start" for name in reserves),
        *(f"  warning: {warning}" for warning in warnings),
    ]
    show(report, as_json, lines)


def _validate_organisation(file: str, as_json: bool) -> bool:
    from missions.document import Document
    from missions.scenarios.organisation import checked, is_organisation

    document = Document.at(Path(file))
    if not is_organisation(document.raw):
        return False
    groups, n_templates = checked(document)
    n_roles = sum(len(group.role) for group in groups)
    roles = [{"name": group.name, "within": group.within, "roles": group.role_names} for group in groups]
    lines = [f"{file}: organisation ok; {n_templates} templates, {len(groups)} groups, {n_roles} roles"]
    for group in groups:
        within = "" if group.within is None else f" within {group.within}"
        lines.append(f"  {group.name}{within}: {', '.join(group.role_names)}")
    lines.append(f"  with mission and vehicles: remoras validate SCENARIO --set organisation={as_typed(Path(file))}")
    report = {"file": file, "kind": "organisation", "ok": True, "templates": n_templates, "groups": roles}
    show(report, as_json, lines)
    return True


def _validate_study(file: str, as_json: bool) -> None:
    from missions.comparison.ranking import too_few
    from missions.sweeps.study import load_study

    study = load_study(file)
    n_configurations, at_most = len(study.configurations), "at most " if study.file.stopping else ""
    runs = f"{at_most}{study.maximum} repeats, at most {study.n_runs} runs; equal runs are made once"
    warnings = [text for text in [too_few(study.maximum)] if text]
    report = {"configurations": n_configurations, "planned": study.n_runs, "warnings": warnings}
    lines = [
        f"{file}: study ok; {n_configurations} configurations x {runs}",
        *(f"  warning: {text}" for text in warnings),
    ]
    show({"file": file, "kind": "study", "ok": True, **report}, as_json, lines)


def _explained(key: str, known: dict[str, tuple[str, str]]) -> dict[str, tuple[str, str]]:
    return {
        name: (kind, meaning)
        for name, (kind, meaning) in known.items()
        if not key
        or f"{name}.".startswith(f"{key}.")
        or (kind.startswith("table") and key.startswith(f"{name}.") and name != "mission")
    }


@command("explain", "remoras explain communication.policy")
def explain(
    key: Annotated[str, typer.Argument(autocompletion=completion.key)] = "",
    scenario: Annotated[str, typer.Option(autocompletion=completion.scenario)] = "mapping-rendezvous",
    schema: bool = False,
    as_json: Json = False,
) -> None:
    """Explain a key of a scenario or study: type, range, default; or the content of packets.

    Args:
        key (KEY): A key such as communication.policy; a table for all its keys; codec for packets; ontology for terms.

    Options:
        scenario (SCENARIO): Scenario whose packets `explain codec` lays out, whose terms `explain ontology` lists,
            whose tables --schema describes.
        schema: Print the JSON Schema of scenarios, or with the key `study` of studies.
    """
    if schema:
        _show_schema(key, scenario)
        return
    if key == "codec":
        _explain_codec(scenario, as_json)
        return
    if key == "ontology":
        _explain_ontology(scenario, as_json)
        return
    from missions.scenarios.explanations import explanations
    from missions.sweeps.study import study_explanations

    known = {**explanations(), **study_explanations()}
    entries = _explained(key, known)
    if not entries and key.count(".") > 1:  # list entry by name, as for --set
        table, _, rest = key.split(".", 2)
        entries = _explained(f"{table}.{rest}", known)
    if not entries:  # a word of the last part
        entries = {name: entry for name, entry in known.items() if key in name.rpartition(".")[2].split("_")}
    if not entries:
        shown = cut(key, LONGEST_VALUE)
        fail(f"key {shown!r} is in no scenario and no study; `remoras explain` lists all keys{suggestion(key, known)}")
    show(
        [{"key": name, "type": kind, "meaning": meaning} for name, (kind, meaning) in entries.items()],
        as_json,
        [f"{name}  ({kind})\n    {meaning}" for name, (kind, meaning) in entries.items()],
    )


def _show_schema(key: str, scenario: str) -> None:
    from missions.scenarios import load
    from missions.scenarios.explanations import schema_of
    from missions.scenarios.parts import mission_class
    from missions.sweeps.study_file import StudyFile

    if key not in ("", "scenario", "study"):
        fail(f"--schema: applies to a whole file, scenario or study, not to {cut(key, LONGEST_VALUE)!r}")
    if key == "study":
        show_json(schema_of(StudyFile, "REMORAS study"))
        return
    mission = load(scenario).scenario.mission
    show_json(schema_of(mission_class(mission).Scenario, f"REMORAS scenario of {mission}"))


def _explain_codec(scenario: str, as_json: bool) -> None:
    from missions.runs.setup import resolved
    from missions.scenarios import load

    setup = resolved(load(scenario))
    fields = setup.codec.listing()
    width = max(len(field.field) for field in fields)
    lines = [f"{scenario}: a packet of modem {setup.modem.name} has {setup.modem.payload_bits} bits"]
    lines += [f"  {f.group:<9} {f.field:<{width}} {f.size_bits:>4}  {f.note}".rstrip() for f in fields]
    show([asdict(field) for field in fields], as_json, lines)


def _explain_ontology(scenario: str, as_json: bool) -> None:
    from missions.runs.setup import resolved
    from missions.scenarios import load
    from worldmodel.ontology import terms_of

    terms = terms_of(resolved(load(scenario)).tbox)
    lines = [f"{term.name}  ({term.kind})\n    {term.meaning}" for term in terms]
    show([term._asdict() for term in terms], as_json, lines)


@command("doctor", "remoras doctor", names_code=False)
def doctor() -> None:
    """Check this installation: versions, ontology, a short run, a figure."""
    import platform
    import tempfile

    from exchange.study.compiler import why_uncompiled
    from missions.runs.results import Results, library_versions, write_results
    from missions.runs.run import run as run_scenario
    from missions.scenarios import load
    from remoras.cli.results import draw_run
    from remoras.version import __version__

    print(f"Python {platform.python_version()} on {platform.platform()}")
    print(f"  remoras {__version__}")
    for name, version in library_versions().items():
        print(f"  {name} {version}")
    if hint := why_uncompiled():
        print(f"  {hint}")
    short = run_scenario(load("mapping-rendezvous", [("--set", "scenario.duration_s=60")]))
    print(f"a run of 60 s of mission time took {short.wall_s:.2f} s")
    with tempfile.TemporaryDirectory() as folder:
        write_results(short, Path(folder) / "run")
        drawn = draw_run(Results.read(Path(folder) / "run"), (), Path(folder), "png")
        print(f"drew {len(drawn.files)} files")
    print("ok")


UNVERIFIED = "(?)"
"""Mark of a modem number without a source."""


def _of_strategy(name: str) -> dict[str, Any]:
    strategy = strategies()[name]
    return {
        "source": strategy.declaration.source,
        "messages": dict(strategy.declaration.messages),
        "factors": None if (factors := factors_of(strategy)) is None else asdict(factors),
        "authorities": sorted(authority.value for authority in strategy.declaration.authorities),
        "parameters": [asdict(parameter) for parameter in parameters(strategy)],
    }


def _plugins() -> dict[str, str]:
    from missions.scenarios.parts import shipped_names

    listed: dict[str, str] = {}
    for plugin in installed_plugins():
        name = f"{plugin.kind}.{plugin.name}"
        if name in listed:
            listed[name] += f"; refused: {plugin} has the same name"
            continue
        listed[name] = str(plugin)
        if plugin.kind not in INSTALLED_KINDS:
            listed[name] += f"; not used: allowed kinds are {', '.join(INSTALLED_KINDS)}"
        elif plugin.kind != "sensor" and plugin.name in shipped_names(plugin.kind, {}):
            listed[name] += f"; not used: a shipped {plugin.kind} has this name"
    return listed


def _of_modem(modem: Modem) -> str:
    def marked(key: str, text: str) -> str:
        return f"{text}{UNVERIFIED}" if key in modem.unverified else text

    n_frames = -(-modem.payload_bits // modem.frame_bits)
    frames = f" ({n_frames} frames)" if n_frames > 1 else ""
    parts = [
        f"{modem.payload_bytes} B{frames} in {modem.packet_s(modem.payload_bits):.2f} s",
        marked("rate_bps", f"{modem.rate_bps:g} bit/s"),
        marked("head_s", f"head {modem.head_s:g} s"),
        marked("range_m", f"range {modem.range_m:g} m"),
        "band unknown" if modem.band_khz is None else marked("band_khz", "{:g}-{:g} kHz".format(*modem.band_khz)),
        _losses_of(modem) if modem.modulation in (None, MEASURED) else marked("modulation", modem.modulation),
        "source level unknown"
        if modem.source_level_db is None
        else marked("source_level_db", f"{modem.source_level_db:g} dB re 1 uPa at 1 m"),
    ]
    if modem.margin_db:
        parts.append(marked("margin_db", f"margin {modem.margin_db:g} dB"))
    if modem.receive_w is not None:
        parts.append(marked("receive_w", f"{modem.receive_w:g} W to receive"))
    return f"{modem.title}: {', '.join(parts)}"


def _losses_of(modem: Modem) -> str:
    if not modem.per_at_snr:
        return "modulation unknown"
    return f"measured losses from {modem.per_at_snr[0][0]:g} to {modem.per_at_snr[-1][0]:g} dB"


def _first_sentence(text: str) -> str:
    comment = itertools.takewhile(lambda line: line.startswith("#"), text.splitlines())
    return " ".join(line.strip("# ") for line in comment).partition(". ")[0]


LISTINGS: dict[str, Callable[[], dict[str, str]]] = {
    "scenarios": lambda: {name: str(table.get("title", "")) for name, table in shipped_abouts().items()},
    "strategies": titles,
    "policies": lambda: {name: policy.title for name, policy in POLICIES.items()},
    "channels": lambda: {name: model.title for name, model in CHANNELS.items()},
    "modems": lambda: {modem.name: _of_modem(modem) for modem in modems().values()},
    "networks": lambda: {name: network.title for name, network in shipped_networks().items()},
    "plugins": _plugins,
    "studies": lambda: {
        name: _first_sentence(path.read_text(encoding="utf-8")) for name, path in shipped_studies().items()
    },
}

NOTES: dict[str, str] = {
    "modems": f"{UNVERIFIED} no source was found for this number: it is an estimate",
    "networks": "source, losses and unknowns of a network: remoras sea NAME --describe",
}
