"""The table ``[channel]``: which loss model, with which settings, and when the channel is cut off.

Which settings there are is said by the models themselves: see ``exchange.acoustics.models``.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field, SerializationInfo, ValidationError, model_serializer

from exchange.acoustics.acoustic import AcousticChannel
from exchange.acoustics.channel import Blackout
from exchange.acoustics.link import LinkModel, Transmission
from exchange.acoustics.models import (
    ChannelModel,
    Deployment,
    GilbertElliottChannel,
    LinkFileError,
    LinkFileGoneError,
    MatrixChannel,
    OfVehicle,
    SettingFault,
    hash_of,
)
from exchange.acoustics.network import NetworkChannel, file_in
from exchange.acoustics.shipped import CHANNELS
from exchange.acoustics.trace import TraceChannel
from missions.document import Document
from missions.errors import ConfigurationError, ConfigurationFault
from missions.files import text_of
from missions.scenarios.modem import modem_in
from missions.scenarios.tables import (
    NotNegative,
    Raw,
    Section,
    Sparse,
    entries,
    is_number,
    list_of,
    names_of,
    one_of,
    table_of,
)
from remoras.errors import PluginError
from remoras.plugins import faults_of, named_object
from worldmodel import suggestion

COMPULSORY = ("link_model", "mean_per")
"""Methods that a channel model must have."""
OF_EVERY_CHANNEL = {"name", "blackout"}
"""Keys that no model may have for its own."""

FILE_KEYS = {"trace": "file", "network": "network"}
"""Key by which a channel names a file, which results repeat with its hash."""


Side = Annotated[tuple[str, ...], Field(min_length=1)]


class BlackoutTable(Sparse):
    """A time without communication."""

    UNSAID: ClassVar[frozenset[str]] = frozenset({"between"})

    from_s: NotNegative = Field(description="packets that start at this time or later are lost")
    until_s: NotNegative = Field(description="packets that start at this time or later are heard again")
    vehicle: str | None = Field(None, description="vehicle neither heard nor hearing; the whole channel if absent")
    between: tuple[Side, ...] | None = Field(
        None,
        min_length=2,
        description='in place of vehicle: lists of vehicles between which nothing passes, as [["A", "B"], ["C"]]; '
        "those of one list hear each other, and those in none hear all",
    )


class NamedTable(Section):
    """The name of a channel."""

    name: str = Field(
        description="loss model, see `remoras list channels`, or package.module:Class. A key that the model does not "
        "use is refused, with two exceptions: perfect leaves the settings aside that a file has for other "
        "models, and a model named by --channel, --set or a study those that the scenario has for its own"
    )


class ChannelTable(TraceChannel, NetworkChannel, AcousticChannel, GilbertElliottChannel, MatrixChannel, NamedTable):
    """The channel of a scenario: it has the settings of all shipped models, and acts as the one that is named.

    Settings of a model from outside are kept as they are; its own class checks them.
    """

    model_config = ConfigDict(extra="allow")

    blackout: tuple[BlackoutTable, ...] = ()

    @model_serializer(mode="plain")
    def _what_is_used(self, info: SerializationInfo) -> dict[str, Any]:
        """Without the settings of other models: what is written can be read again, and what is alike looks alike."""
        blackouts = [table.model_dump(mode=info.mode, exclude_none=bool(info.exclude_none)) for table in self.blackout]
        model = self.settings()
        unsaid = {key for key in model.UNSAID if getattr(model, key) is None}
        settings = model.model_dump(mode=info.mode, exclude_none=bool(info.exclude_none), exclude=unsaid)
        return {"name": self.name, **settings, "blackout": blackouts if info.mode == "json" else tuple(blackouts)}

    def settings(self) -> ChannelModel:
        """The model that is named, with those settings that it uses.

        Raises:
            PluginError: there is no such model.
        """
        model = model_named(self.name)
        given = {key: getattr(self, key) for key in self.model_fields_set if key in model.model_fields}
        return model.model_validate_json(json.dumps(given, default=_plain), strict=True)

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """The loss model that is named, for a fleet.

        Raises:
            ConfigurationError: the file of a trace or network is gone, or another one than when the scenario was read.
        """
        with self._file_there():
            link = self.settings().link_model(deployment, seed)
        return link if self.name in CHANNELS else CheckedLink(self.name, link)

    @contextmanager
    def _file_there(self) -> Iterator[None]:
        """Tell a file that cannot be had by its key."""
        try:
            yield
        except LinkFileError as error:
            key = FILE_KEYS[self.name]
            fault = ConfigurationFault(f"channel.{key}", f'"{getattr(self, key)}"', str(error))
            raise ConfigurationError("channel", [fault]) from None

    def blackouts(self, nodes: Mapping[str, int]) -> tuple[Blackout, ...]:
        """Times without communication, for vehicles of these node numbers."""
        return tuple(
            Blackout(
                table.from_s,
                table.until_s,
                None if table.vehicle is None else nodes[table.vehicle],
                tuple(frozenset(nodes[name] for name in side) for side in table.between or ()),
            )
            for table in self.blackout
        )

    def mean_per(self, deployment: Deployment) -> float:
        """Packet error rate in the mean over time and all directed pairs of vehicles, within range and no blackout."""
        with self._file_there():
            return self.settings().mean_per(deployment)

    def assumed(self, deployment: Deployment | None = None, seed: int = 0) -> str:
        """What the model that is named assumes, of one run if a fleet is given; captions add it. Mostly nothing."""
        with self._file_there():
            return self.settings().assumed(deployment, seed)

    def sound_speed_mps(self, deployment: Deployment) -> float | None:
        """Speed of sound of the model that is named; None where that of the world holds."""
        return self.settings().sound_speed_mps(deployment)


def _plain(value: Any) -> Any:
    return value.model_dump(mode="json") if isinstance(value, BaseModel) else str(value)


@dataclass(frozen=True, slots=True)
class CheckedLink:
    """Links of a model from outside; an answer that is no probability ends the run with a clear message."""

    name: str
    link: LinkModel

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """The answer of the model, checked.

        Raises:
            ConfigurationError: the model raised, or answered with something else than a number from 0 to 1.
        """
        asked = f"p_loss({packet}, {receiver}, {range_m:g})"
        try:
            p_loss = self.link.p_loss(packet, receiver, range_m)
        except Exception as error:  # it is somebody else's class: anything may be wrong with it
            raise self._fault(f"{asked} raised {type(error).__name__}: {error}") from error
        if isinstance(p_loss, bool) or not isinstance(p_loss, int | float) or not 0.0 <= p_loss <= 1.0:
            raise self._fault(f"{asked} must be a number from 0 to 1, not {p_loss!r}")
        return p_loss

    def _fault(self, what: str) -> ConfigurationError:
        return ConfigurationError("channel", [ConfigurationFault("channel.name", f'"{self.name}"', what)])


def model_named(name: str) -> type[ChannelModel]:
    """A shipped model by name, or one from outside by ``package.module:Class``.

    Raises:
        PluginError: there is none of that name, it cannot be loaded, or it lacks a part of the seam.
    """
    if ":" not in name:
        if name not in CHANNELS:
            raise PluginError(f"allowed: {', '.join(CHANNELS)}{suggestion(name, CHANNELS)}")
        return CHANNELS[name]
    found = named_object(name)
    if not (isinstance(found, type) and issubclass(found, ChannelModel)):
        what = f"class {found.__name__}" if isinstance(found, type) else f"object of {type(found).__name__}"
        raise PluginError(f"a subclass of exchange.acoustics.models.ChannelModel is needed, not the {what}")
    lacking = [part for part in COMPULSORY if getattr(found, part) is getattr(ChannelModel, part)]
    if lacking or not found.title:
        raise PluginError(f"a channel model: lacks {', '.join([*lacking, *([] if found.title else ['title'])])}")
    if faults := list(faults_of(found, ChannelModel, COMPULSORY)):
        raise PluginError(f"a channel model: {'; '.join(faults)}")
    if taken := OF_EVERY_CHANNEL & found.model_fields.keys():
        raise PluginError(f"a channel model: rename its setting {', '.join(sorted(taken))}, a key of every channel")
    if unset := [key for key, info in found.model_fields.items() if info.is_required()]:
        raise PluginError(f"a channel model: {', '.join(unset)} without a default; a model can be named alone")
    return found


def _known_model(name: Any) -> type[ChannelModel] | None:
    """The model of that name; None if it is none, which is reported elsewhere."""
    try:
        return model_named(name) if isinstance(name, str) else None
    except PluginError:
        return None


def is_left_aside(key: str, channel: str) -> bool:
    """True for a setting of the shipped models, by its dotted key, in a study whose channel loses nothing."""
    model = _known_model(channel)
    table, _, below = key.partition(".")
    name = below.partition(".")[0]
    is_setting = any(name in shipped.model_fields for shipped in CHANNELS.values())
    return table == "channel" and is_setting and model is not None and not model.model_fields


def leave_aside(own: Raw, raw: Raw, overridden: Collection[str]) -> list[ConfigurationFault]:
    """Take out of the channel of ``raw`` what its model does not use; what was meant to be used is a fault.

    Args:
        own: channel as the scenario's file has it.
        raw: scenario with overrides applied; its channel is changed.
        overridden: dotted keys of the overrides.
    """
    channel, name, own_name = raw.get("channel"), table_of(raw, "channel").get("name"), own.get("name")
    model = _known_model(name)
    if not isinstance(channel, dict) or model is None:
        return []
    own_model = _known_model(own_name) if "channel" not in overridden else None
    replaced: Collection[str] = own_model.model_fields if own_model is not None else ()
    of_shipped = {key for shipped in CHANNELS.values() for key in shipped.model_fields}
    faults = []
    for key in [key for key in channel if key not in model.model_fields and (key in of_shipped or key in replaced)]:
        value = channel.pop(key)
        if f"channel.{key}" in overridden or (model.model_fields and key not in replaced):
            users = [user for user, shipped in CHANNELS.items() if key in shipped.model_fields] or [str(own_name)]
            uses = f"{name} uses {', '.join(model.model_fields) or 'no setting, it loses nothing'}"
            allowed = f"not used by the {name} channel, only by {' and '.join(users)}; {uses}"
            faults.append(ConfigurationFault(f"channel.{key}", "" if isinstance(value, list) else str(value), allowed))
    return faults


def channel_faults(raw: Raw) -> Iterator[ConfigurationFault]:
    """What has to hold within the channel, and between it and the vehicles."""
    channel, vehicles = table_of(raw, "channel"), names_of(raw, "vehicle")
    name = channel.get("name")
    if isinstance(name, str):
        try:
            model = model_named(name)
        except PluginError as error:
            yield ConfigurationFault("channel.name", f'"{name}"', str(error))
        else:
            yield from _setting_faults(name, model, channel, raw)
    for number, blackout in enumerate(entries(channel, "blackout"), 1):
        yield from one_of(f"channel.blackout.{number}.vehicle", blackout.get("vehicle"), vehicles)
        yield from _side_faults(f"channel.blackout.{number}.between", blackout, vehicles)
        from_s, until_s = blackout.get("from_s"), blackout.get("until_s")
        if isinstance(from_s, int | float) and isinstance(until_s, int | float) and from_s >= until_s:
            allowed = f"must be above from_s = {from_s}"
            yield ConfigurationFault(f"channel.blackout.{number}.until_s", str(until_s), allowed)


def _side_faults(key: str, blackout: Raw, vehicles: Sequence[str]) -> Iterator[ConfigurationFault]:
    """Sides of a blackout that name no vehicle of the scenario, or one twice, or beside a vehicle."""
    names = [name for side in list_of(blackout, "between") if isinstance(side, list) for name in side]
    for at, name in enumerate(names):
        yield from one_of(key, name, vehicles)
        if name in names[:at]:
            yield ConfigurationFault(key, _shown(name), "named twice: a vehicle is on one side")
    if "between" in blackout and "vehicle" in blackout:
        yield ConfigurationFault(key, _shown(blackout["between"]), "not together with vehicle: leave one of them out")


def _setting_faults(name: str, model: type[ChannelModel], channel: Raw, raw: Raw) -> Iterator[ConfigurationFault]:
    """What is wrong with the settings of the model: unknown keys, names of no vehicle, and what it says itself."""
    vehicles = names_of(raw, "vehicle")
    known = list(ChannelTable.model_fields) if name in CHANNELS else ["name", *model.model_fields, "blackout"]
    for key in channel:
        if key not in known:
            allowed = f"unknown key, allowed here: {', '.join(known)}{suggestion(key, known)}"
            yield ConfigurationFault(f"channel.{key}", _shown(channel[key]), allowed)
    yield from _vehicle_faults("channel", model, channel, vehicles)
    given = {key: value for key, value in channel.items() if key in model.model_fields}
    faults = [] if name in CHANNELS else list(_value_faults(model, given))
    yield from faults
    deployment = deployment_in(raw)
    if faults:
        return
    try:
        found = list(model.faults(given))
        if not found and deployment is not None and not any(_value_faults(model, given)):
            found += _settings(model, given).misfits(deployment)
        if wrong := [fault for fault in found if not isinstance(fault, SettingFault)]:
            raise TypeError(f"expected SettingFaults, not {wrong[0]!r}")
        yield from map(_as_configured, found)
        if name not in CHANNELS and deployment is not None:
            yield from _trial_faults(name, model, given, deployment)
    except Exception as error:  # it is somebody else's class: anything may be wrong with it
        allowed = f"its checks of settings raised {type(error).__name__}: {error}"
        yield ConfigurationFault("channel.name", f'"{name}"', allowed)


def _as_configured(fault: SettingFault) -> ConfigurationFault:
    """What a model found wrong with a setting, or with a key of a file of its own."""
    allowed = fault.allowed + suggestion(fault.given.strip('"'), fault.names)
    if not fault.file:
        return ConfigurationFault(f"channel.{fault.key}", fault.given, allowed)
    line = fault.line
    if line is None and fault.file.endswith(".toml"):
        with suppress(ConfigurationError):  # what is no TOML is said by its line already
            line = Document.of_text(text_of(Path(fault.file)), fault.file).line_of(fault.key)
    return ConfigurationFault(fault.key, fault.given, allowed, line, fault.file)


def deployment_in(raw: Raw) -> Deployment | None:
    """The fleet that transmits, by tables not checked yet; None where they are malformed, as others report."""
    communication, vehicles = table_of(raw, "communication"), entries(raw, "vehicle")
    modem = modem_in(raw)
    if not all(type(vehicle.get("slot")) is int for vehicle in vehicles):
        return None
    depths_m: dict[int, Any] = {vehicle["slot"]: vehicle.get("depth_m", 0.0) for vehicle in vehicles}
    numbers = [communication.get("range_m"), table_of(raw, "scenario").get("duration_s"), *depths_m.values()]
    nodes: dict[str, Any] = {str(vehicle.get("name")): vehicle.get("slot") for vehicle in vehicles}
    are_slots = sorted(depths_m) == list(range(len(vehicles)))
    if modem is None or not are_slots or len(nodes) < 2 or not all(map(is_number, numbers)):
        return None
    range_m, duration_s = numbers[:2]
    by_node = dict(sorted(nodes.items(), key=lambda item: int(item[1])))
    return Deployment(by_node, tuple(depths_m[slot] for slot in range(len(vehicles))), modem, range_m, duration_s)


def _settings(model: type[ChannelModel], given: Raw) -> ChannelModel:
    return model.model_validate_json(json.dumps(given, default=str), strict=True)


def _value_faults(model: type[ChannelModel], given: Raw) -> Iterator[ConfigurationFault]:
    """What a model from outside refuses of its settings, one by one."""
    try:
        _settings(model, given)
    except ValidationError as error:
        for detail in error.errors():
            key = ".".join(str(part + 1 if isinstance(part, int) else part) for part in detail["loc"])
            message = str(detail["msg"])
            yield ConfigurationFault(f"channel.{key}", _shown(detail["input"]), message[0].lower() + message[1:])


def _trial_faults(
    name: str, model: type[ChannelModel], given: Raw, deployment: Deployment
) -> Iterator[ConfigurationFault]:
    """What goes wrong when a model from outside is asked for the first time."""
    settings = _settings(model, given)
    try:
        per = settings.mean_per(deployment)
        if isinstance(per, bool) or not isinstance(per, int | float) or not 0.0 <= per <= 1.0:
            yield ConfigurationFault("channel.name", f'"{name}"', f"mean_per must be a number from 0 to 1, not {per!r}")
        speed_mps = settings.sound_speed_mps(deployment)
        if speed_mps is not None and not (is_number(speed_mps) and speed_mps > 0.0):
            allowed = f"sound_speed_mps must be None or a finite number above 0, not {speed_mps!r}"
            yield ConfigurationFault("channel.name", f'"{name}"', allowed)
        link = settings.link_model(deployment, 0)
        if not callable(getattr(link, "p_loss", None)):
            allowed = f"link_model must return an object with p_loss(packet, receiver, range_m), not {link!r}"
            yield ConfigurationFault("channel.name", f'"{name}"', allowed)
        else:
            CheckedLink(name, link).p_loss(Transmission(0, 0, 0.0, deployment.modem.payload_bits), 1, 1.0)
    except ConfigurationError as error:
        yield from error.faults
    except Exception as error:  # it is somebody else's class: anything may be wrong with it
        hooks = "link_model, mean_per and sound_speed_mps"
        allowed = f"{hooks} must take every scenario, but raised {type(error).__name__}: {error}"
        yield ConfigurationFault("channel.name", f'"{name}"', allowed)


def _vehicle_faults(
    above: str, model: type[BaseModel], given: Raw, vehicles: Sequence[str]
) -> Iterator[ConfigurationFault]:
    """Settings that should name a vehicle of the scenario and do not, in the table and in tables below it."""
    for key, info in model.model_fields.items():
        if any(isinstance(mark, OfVehicle) for mark in info.metadata):
            yield from one_of(f"{above}.{key}", given.get(key), vehicles)
        inner = [info.annotation, *getattr(info.annotation, "__args__", ())]
        below = next((kind for kind in inner if isinstance(kind, type) and issubclass(kind, BaseModel)), None)
        if below is not None:
            for number, entry in enumerate(entries(given, key), 1):
                yield from _vehicle_faults(f"{above}.{key}.{number}", below, entry, vehicles)


def _shown(value: Any) -> str:
    text = json.dumps(value, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


def with_link_file_found(raw: dict[str, Any], folder: Path, overridden: Collection[str]) -> dict[str, Any]:
    """Tables in which the file of a trace or a network has its whole path and its hash: results say which it was.

    Args:
        raw: tables of a scenario.
        folder: of the scenario's file, which a path in it starts from.
        overridden: dotted keys of the overrides; a path in one starts from the current folder.
    """
    channel: Mapping[str, Any] = table_of(raw, "channel")
    key = FILE_KEYS.get(str(channel.get("name")), "")
    given = channel.get(key)
    if not isinstance(given, str) or not given:
        return raw
    is_new = f"channel.{key}" in overridden
    sha256 = None if is_new and "channel.sha256" not in overridden else channel.get("sha256")
    found = {name: value for name, value in channel.items() if name != "sha256"}
    if key == "file" or file_in(given):
        path = str(((Path() if is_new or "channel" in overridden else folder) / given).resolve())
        found[key] = path
        with suppress(LinkFileGoneError):  # a check says that it is not there
            sha256 = sha256 or hash_of(path if key == "file" else file_in(path), "")
    return {**raw, "channel": {**found, **({"sha256": sha256} if sha256 else {})}}
