"""Scenario: the whole input of a run, frozen, read from TOML and checked whole.

``load`` reports every fault of a file at once, each with file, line, key, what was given and what is allowed.
Field descriptions are what ``remoras explain`` prints. Units are in the names of the keys.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError

from missions.errors import ConfigurationError, ConfigurationFault
from missions.scenarios.channel import ChannelTable, leave_aside
from missions.scenarios.checks import cross_faults, named_object
from missions.scenarios.copies import MAX_VEHICLES, SPACING_M, with_copies
from missions.scenarios.lines import Path as Path_
from missions.scenarios.lines import key_parts, line_of, lines_of, path_of
from missions.scenarios.tables import Name, NotNegative, PointM, Positive, Table, table_of
from remoras.executive.satisfaction import DecisionConstants


class About(Table):
    name: Name = Field(description="name of the scenario; used in file names and results")
    title: str = Field("", description="one line for reports")
    mission: str = Field(description="mission class as package.module:object")
    duration_s: float = Field(gt=0.0, le=604_800.0, description="end of the run if the mission has not completed")
    tick_s: float = Field(1.0, ge=0.01, le=1.0, description="motion tick")


class World(Table):
    x_m: PointM = Field(description="west and east border of the area of operations")
    y_m: PointM = Field(description="south and north border of the area of operations")
    cell_m: float = Field(ge=0.1, description="side of a seabed cell")
    sound_speed_mps: float = Field(1500.0, ge=1400.0, le=1600.0, description="speed of sound in water")


class Communication(Table):
    modem: str = Field(description="modem profile, see `remoras list modems`")
    range_m: Positive = Field(description="operating range: sets the guard of a slot; nothing is heard beyond it")
    transmit_power_w: NotNegative = Field(10.0, description="power of the modem while it sends")
    policy: str = Field(description="exchange policy, see `remoras list policies`")
    carrier_evidence: bool = Field(True, description="take a peer that sends an item as holding it")
    time_resolution_s: float = Field(
        0.1, ge=0.001, le=10.0, multiple_of=0.001, description="resolution of observation times on the wire"
    )
    needs: dict[str, Annotated[int, Field(ge=1, le=1000)]] = Field(
        description="priority of each attribute that vehicles need of each other"
    )


class StrategyTable(Table):
    name: str = Field(description="organisational strategy, a shipped name or package.module:object")
    parameters: dict[str, Any] = Field(  # the strategy itself says what it allows
        {}, description="parameters of the strategy, see `remoras list strategies`; others keep their defaults"
    )


class Uncertainty(Table):
    speed_spread: float = Field(
        0.0,
        ge=0.0,
        le=0.5,
        description="every vehicle is by up to this share slower or faster than its data, evenly, drawn once per run",
    )


class DecisionTable(Table):
    period_s: Positive = Field(2.0, description="time between two decisions of the executive layer")
    weight_continuing: NotNegative = Field(0.2, description="weight of the motivation to continue")
    weight_external: NotNegative = Field(1.0, description="weight of the motivation to answer influence signals")
    gain_per_s: NotNegative = Field(1.0, description="satisfaction gained per second of progress")
    tedium_per_s: float = Field(-1.8, le=0.0, description="satisfaction change per second without progress")
    dismay_per_s: float = Field(-2.0, le=0.0, description="satisfaction change per second of setback")
    fade_per_s: NotNegative = Field(0.5, description="how fast satisfaction in an idle role returns to 0")
    signal_memory_frames: Positive = Field(8.5, description="TDMA frames in which a heard signal fades to 1/e")

    def constants(self, frame_s: float) -> DecisionConstants:
        values = self.model_dump(exclude={"signal_memory_frames"})
        return DecisionConstants(**values, signal_memory_s=self.signal_memory_frames * frame_s)


class Area(Table):
    name: Name = Field(description="name of the area")
    corners_m: tuple[PointM, ...] = Field(min_length=3, description="corners of a convex polygon, in order")


class RallyPoint(Table):
    name: Name = Field(description="name of the rally point")
    position_m: PointM = Field(description="x east, y north")


class Role(Table):
    name: Name = Field(description="name of the role")
    minimum: int = Field(0, ge=0, description="fewest holders")
    maximum: int | None = Field(None, ge=1, description="most holders; any number if absent")
    head: bool = Field(False, description="its holder leads the group")
    founding: bool = Field(False, description="held from the start, not allocated during the mission")
    area: str | None = Field(None, description="area that its holder explores")
    played_by: str | None = Field(None, description="Group.Role whose holder must play it")
    influences: tuple[str, ...] = Field((), description="roles of the group that its influence signals address")
    position: tuple[Literal["top", "bottom"], Literal["left", "middle", "right"]] | None = Field(
        None, description="place in the formation: row and side"
    )


class GroupTable(Table):
    name: Name = Field(description="name of the group")
    rally_point: str = Field(description="where the group meets")
    mission: str | None = Field(None, description="mission it has from the start; else it is given one")
    role: tuple[Role, ...] = Field(min_length=1, description="roles of the group")


class Sensor(Table):
    swath_m: float = Field(ge=0.1, description="width that the mapping sensor covers")
    speed_limit_mps: Positive = Field(description="greatest speed at which it maps")


class VehicleTable(Table):
    name: Name = Field(description="name of the vehicle")
    vehicle_type: Literal["AUV", "ASV"] = Field(description="AUV or ASV")
    slot: int = Field(ge=0, le=63, description="TDMA slot that the vehicle owns, 0 to number of vehicles - 1")
    social_layer: bool = Field(True, description="able to lead a group")
    start_m: PointM = Field(description="position at time 0, x east, y north")
    depth_m: NotNegative = Field(0.0, description="working depth")
    depth_limit_m: NotNegative = Field(0.0, description="greatest depth the vehicle stands")
    transit_speed_mps: float = Field(gt=0.0, le=20.0, description="speed on the way")
    survey_speed_mps: float = Field(gt=0.0, le=20.0, description="speed while working")
    turn_rate_radps: Positive = Field(0.5, description="greatest rate of turn")
    acceleration_mps2: Positive = Field(0.5, description="greatest change of speed")
    energy_j: Positive = Field(description="battery capacity")
    hotel_w: NotNegative = Field(description="power at rest")
    drag_w_per_mps3: NotNegative = Field(description="power of propulsion per cubed speed")
    playable_roles: tuple[str, ...] = Field(description="roles the vehicle is able to play")
    sensor: Sensor | None = Field(None, description="mapping sensor, if it has one")


class FleetTable(Table):
    """Brings the fleet to a size; gone from the resolved scenario, which lists every vehicle."""

    size: int | None = Field(
        None,
        ge=2,
        le=MAX_VEHICLES,
        description="vehicles, listed ones and copies; those listed if absent",
    )
    copies_of: str | None = Field(None, description="vehicle that is copied to bring the fleet to its size")
    spacing_m: float = Field(SPACING_M, ge=1.0, description="distance between the starts of copies at one depth")


class Scenario(Table):
    """The whole input of a run."""

    scenario: About
    world: World
    communication: Communication
    channel: ChannelTable
    strategy: StrategyTable
    uncertainty: Uncertainty = Uncertainty()
    decision: DecisionTable = DecisionTable()
    mission: dict[str, Any] = Field({}, description="settings of the mission")
    area: tuple[Area, ...] = ()
    rally_point: tuple[RallyPoint, ...] = ()
    group: tuple[GroupTable, ...] = Field(min_length=1)
    fleet: FleetTable | None = Field(None, exclude=True)
    vehicle: tuple[VehicleTable, ...] = Field(min_length=2, max_length=MAX_VEHICLES)


def shipped() -> dict[str, Path]:
    """Scenario files that come with the package, by name."""
    folder = Path(str(resources.files("missions")))
    return {f"{path.parent.name}-{path.stem}": path for path in sorted(folder.glob("*/*.toml"))}


def load(name_or_path: str, overrides: Sequence[tuple[str, str]] = ()) -> Scenario:
    """The scenario of a shipped name or a TOML file, with overrides applied.

    Args:
        overrides: (where it comes from, ``KEY=VALUE``), for example ("--set", "decision.weight_external=0").

    Raises:
        ConfigurationError: with every fault of the file and the overrides.
    """
    path, text = _read(name_or_path)
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(path, [ConfigurationFault("TOML", "", str(error))]) from None
    own_channel = dict(table_of(raw, "channel"))
    faults = [fault for option, text_ in overrides if (fault := _override(raw, option, text_)) is not None]
    options = {".".join(key_parts(text_.partition("=")[0].strip())): option for option, text_ in overrides}
    faults += leave_aside(own_channel, raw, options)
    copies = with_copies(raw)
    faults += copies.faults
    scenario: Scenario | None = None
    try:
        scenario = Scenario.model_validate_json(json.dumps(copies.raw, default=str), strict=True)
    except ValidationError as error:
        faults += [_fault_of(detail, copies.raw) for detail in error.errors() if not _is_consequence(detail)]
    known = {(fault.key, fault.given) for fault in faults}
    faults += [fault for fault in cross_faults(copies.raw) if (fault.key, fault.given) not in known]
    if faults or scenario is None:
        lines = lines_of(text)
        located = [_located(fault, raw, lines, options) for fault in copies.attributed(faults)]
        raise ConfigurationError(path, sorted(located, key=lambda fault: fault.line or 0))
    return scenario.model_copy(update={"fleet": None})


def _read(name_or_path: str) -> tuple[str, str]:
    path = Path(name_or_path)
    known = shipped()
    if path.suffix != ".toml" and name_or_path in known:
        path = known[name_or_path]
    if not _is_file(path):
        nearest = get_close_matches(name_or_path, known, n=1)
        hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
        allowed = f"a TOML file or one of {', '.join(known)}{hint}"
        raise ConfigurationError(name_or_path, [ConfigurationFault("scenario", name_or_path, allowed)])
    try:
        return str(path), path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(str(path), [ConfigurationFault("file", "", f"cannot be read: {error}")]) from None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no file can have
        return False


def _override(raw: dict[str, Any], option: str, override: str) -> ConfigurationFault | None:
    """Apply ``decision.weight_external=0`` or ``vehicle.AUV01.survey_speed_mps=1.7``; entries of lists by name."""
    key, equals, value = override.partition("=")
    if not equals or not key:
        return ConfigurationFault(option, override, "KEY=VALUE, for example decision.weight_external=0")
    target: Any = raw
    parts = key_parts(key.strip())
    for depth, part in enumerate(parts[:-1]):
        if isinstance(target, list):
            found = [entry for entry in target if isinstance(entry, dict) and entry.get("name") == part]
            if not found:
                names = [str(entry.get("name")) for entry in target if isinstance(entry, dict)]
                return ConfigurationFault(f"{option} {key}", "", f"{part!r} is none of {', '.join(names)}")
            target = found[0]
        else:
            target = target.setdefault(part, {})
        if not isinstance(target, dict | list):
            return ConfigurationFault(f"{option} {key}", "", f"{'.'.join(parts[: depth + 1])} is no table")
    if not isinstance(target, dict):
        return ConfigurationFault(f"{option} {key}", "", "names a list: add the name of an entry and a key")
    target[parts[-1]] = _value(value.strip())
    return None


def _value(text: str) -> Any:
    """A value as TOML has it; a bare word is a string."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _fault_of(detail: Mapping[str, Any], raw: Mapping[str, Any]) -> ConfigurationFault:
    location = detail["loc"]
    key = _key_of(location, raw)
    kind, given = detail["type"], detail.get("input")
    if kind == "extra_forbidden":
        known = _known_keys(location[:-1])
        nearest = get_close_matches(str(location[-1]), known, n=1)
        hint = f"; did you mean {nearest[0]!r}?" if nearest else ""
        return ConfigurationFault(key, _shown(given), f"unknown key, allowed here: {', '.join(known)}{hint}")
    if kind == "missing":
        return ConfigurationFault(key, "", "missing")
    message = str(detail["msg"])
    return ConfigurationFault(key, _shown(given), message[0].lower() + message[1:])


def _shown(value: Any) -> str:
    text = json.dumps(value, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


def _key_of(location: Iterable[Any], raw: Any) -> str:
    """``vehicle.AUV01.slot`` for ("vehicle", 2, "slot")."""
    parts: list[str] = []
    for part in location:
        entry = raw[part] if isinstance(raw, dict | list) and _has(raw, part) else None
        if isinstance(part, int):
            parts.append(str(entry["name"]) if isinstance(entry, dict) and "name" in entry else str(part + 1))
        else:
            parts.append(str(part))
        raw = entry
    return ".".join(parts)


def _has(raw: dict[str, Any] | list[Any], part: Any) -> bool:
    return part in raw if isinstance(raw, dict) else isinstance(part, int) and part < len(raw)


def _known_keys(location: Iterable[Any]) -> list[str]:
    """Keys of the table at ``location``."""
    table: Any = Scenario
    for part in location:
        if isinstance(part, int):
            continue
        annotation = table.model_fields[part].annotation
        candidates = [annotation, *getattr(annotation, "__args__", ())]
        table = next((c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel)), None)
        if table is None:
            return []
    return list(table.model_fields)


def _is_consequence(detail: Mapping[str, Any]) -> bool:
    """A list that is only too short because an entry of it is wrong."""
    context = detail.get("ctx", {})
    given = detail.get("input")
    return detail["type"] == "too_short" and isinstance(given, list) and len(given) >= context.get("min_length", 0)


def _located(
    fault: ConfigurationFault, raw: Mapping[str, Any], lines: Mapping[Path_, int], options: Mapping[str, str]
) -> ConfigurationFault:
    """The fault with the option it was given by, or with the line of its key."""
    if fault.key.startswith("--"):
        return fault
    for key, option in options.items():
        if f"{fault.key}.".startswith(f"{key}.") or f"{key}.".startswith(f"{fault.key}."):
            return ConfigurationFault(f"{option} ({fault.key})", fault.given, fault.allowed)
    return ConfigurationFault(fault.key, fault.given, fault.allowed, line_of(path_of(fault.key, raw), lines))


def _limit(constraint: Any) -> str:
    """A constraint of pydantic in words."""
    words = {
        "gt": "above",
        "ge": "at least",
        "lt": "below",
        "le": "at most",
        "min_length": "at least",
        "max_length": "at most",
    }
    return ", ".join(
        f"{text} {getattr(constraint, name):g}" for name, text in words.items() if hasattr(constraint, name)
    )


def explanations_of(root: type[BaseModel], prefix: str = "") -> dict[str, tuple[str, str]]:
    """(type and range, meaning) of every key of a table and of the tables in it, by dotted key."""
    found: dict[str, tuple[str, str]] = {}
    for name, info in root.model_fields.items():
        annotation: Any = info.annotation
        inner = [annotation, *getattr(annotation, "__args__", ())]
        nested = next((c for c in inner if isinstance(c, type) and issubclass(c, BaseModel)), None)
        if nested is not None:
            found |= explanations_of(nested, f"{prefix}{name}.")
            continue
        limits = [text for m in info.metadata if (text := _limit(m))]
        default = "" if info.is_required() else f", default {info.default!r}"
        kind = getattr(annotation, "__name__", str(annotation)).replace("typing.", "")
        found[prefix + name] = (", ".join([kind, *limits]) + default, info.description or "")
    return found


def explanations() -> dict[str, tuple[str, str]]:
    """(type and range, meaning) of every key of a scenario; entries of lists without their name."""
    found = explanations_of(Scenario)
    for name in shipped():
        found |= explanations_of(named_object(load(name).scenario.mission).Settings, "mission.")
    return found
