"""The table ``[channel]``: loss model, its settings (see ``exchange.channel.models``), and blackouts."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field, SerializationInfo, ValidationError, model_serializer

from exchange.channel.acoustic import AcousticChannel
from exchange.channel.channel import Blackout
from exchange.channel.link import LinkModel, Transmission
from exchange.channel.models import (
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
from exchange.channel.network import NetworkChannel, file_in
from exchange.channel.shipped import CHANNELS
from exchange.channel.trace import TraceChannel
from missions.document import Document, fault_of
from missions.errors import ConfigurationError, ConfigurationFault, one_of
from missions.files import is_number
from missions.scenarios.communication import modem_in
from missions.scenarios.features import used_in
from remoras.errors import PluginError
from remoras.plugins import RAISED, answer, faults_of, known_or_named, named_error, refuse, refuse_other
from remoras.table import NotNegative, Section, Sparse
from worldmodel import suggestion

if TYPE_CHECKING:
    from missions.scenarios.scenario import Scenario

COMPULSORY = ("link_model", "mean_per")
SHARE = "a number from 0 to 1"
OF_EVERY_CHANNEL = {"name", "blackout"}

FILE_KEYS = {"trace": "file", "network": "network"}
"""Key of the file that a channel reads; results repeat it with a hash."""


Side = Annotated[tuple[str, ...], Field(min_length=1)]


class BlackoutTable(Sparse):
    """Interval without communication."""

    UNSAID: ClassVar[frozenset[str]] = frozenset({"between"})

    from_s: NotNegative = Field(description="packets that start at this time or later are lost")
    until_s: NotNegative = Field(description="packets that start at this time or later are received again")
    vehicle: str | None = Field(
        None, description="vehicle that neither sends nor receives; the whole channel if absent"
    )
    between: tuple[Side, ...] | None = Field(
        None,
        min_length=2,
        description='in place of vehicle: lists of vehicles without links between lists, as [["A", "B"], ["C"]]; '
        "vehicles in one list, and unlisted ones, keep their links",
    )

    def contradictions(self) -> Iterator[tuple[str, str]]:
        if self.from_s >= self.until_s:
            yield "until_s", f"must be above from_s = {self.from_s}"
        if self.between is not None and self.vehicle is not None:
            yield "between", "not together with vehicle: leave one of them out"


class NamedTable(Section):
    """Name of a channel."""

    name: str = Field(
        description="loss model, see `remoras list channels`, or package.module:Class. Keys that the model does "
        "not use are refused, except that perfect ignores settings of other models in the file, and a "
        "model from --channel, --set or a study ignores those for the scenario's own"
    )


class ChannelTable(TraceChannel, NetworkChannel, AcousticChannel, GilbertElliottChannel, MatrixChannel, NamedTable):
    """Channel of a scenario: settings of all shipped models, behaviour of the named one."""

    # Settings of a plug-in model are kept unchanged; its class checks them.
    model_config = ConfigDict(extra="allow")

    blackout: tuple[BlackoutTable, ...] = ()

    @model_serializer(mode="plain")
    def _what_is_used(self, info: SerializationInfo) -> dict[str, Any]:
        blackouts = [table.model_dump(mode=info.mode, exclude_none=bool(info.exclude_none)) for table in self.blackout]
        # Settings of other models are omitted, so that equal channels have equal text, hash and sweep key.
        model = self.settings()
        unsaid = {key for key in model.UNSAID if getattr(model, key) is None}
        settings = model.model_dump(mode=info.mode, exclude_none=bool(info.exclude_none), exclude=unsaid)
        return {"name": self.name, **settings, "blackout": blackouts if info.mode == "json" else tuple(blackouts)}

    def settings(self) -> ChannelModel:
        """Return the named model with the settings that it uses; raise PluginError if unknown."""
        model = model_named(self.name)
        settings = {key: getattr(self, key) for key in self.model_fields_set if key in model.model_fields}
        return model.model_validate_json(json.dumps(settings, default=_plain), strict=True)

    def link_model(self, deployment: Deployment, seed: int) -> LinkModel:
        """Return the named loss model; raise ConfigurationError for a missing or changed file."""
        with self._file_there():
            link = self.settings().link_model(deployment, seed)
        # Checks at each packet are for code that the tests of this project do not cover.
        return link if self.name in CHANNELS else CheckedLink(self.name, link)

    @contextmanager
    def _file_there(self) -> Iterator[None]:
        try:
            yield
        except LinkFileError as error:
            key = FILE_KEYS[self.name]
            value = f'"{getattr(self, key)}"'
            raise ConfigurationError.of("channel", f"channel.{key}", value, str(error)) from None

    def blackouts(self, nodes: Mapping[str, int]) -> tuple[Blackout, ...]:
        """Return the intervals without communication, with node numbers."""
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
        """Mean packet error rate over time and directed pairs, without range limit and blackouts."""
        with self._file_there():
            return self.settings().mean_per(deployment)

    def assumed(self, deployment: Deployment | None = None, seed: int = 0) -> str:
        """Return the model's assumptions for captions; ``deployment`` None for several runs."""
        with self._file_there():
            return self.settings().assumed(deployment, seed)

    def sound_speed_mps(self, deployment: Deployment) -> float | None:
        """Speed of sound of the model; None to use the world's."""
        return self.settings().sound_speed_mps(deployment)


def _plain(value: Any) -> Any:
    return value.model_dump(mode="json") if isinstance(value, BaseModel) else str(value)


@dataclass(frozen=True, slots=True)
class CheckedLink:
    """Links of a plug-in model that checks each loss probability."""

    name: str
    link: LinkModel

    def p_loss(self, packet: Transmission, receiver: int, range_m: float) -> float:
        """Return the model's loss probability; raise PluginError for a wrong answer."""
        asked = f"p_loss({packet}, {receiver}, {range_m:g})"
        return answer(
            f"channel {self.name}", asked, SHARE, _is_share, lambda: self.link.p_loss(packet, receiver, range_m)
        )


def _is_share(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0.0 <= value <= 1.0


def model_named(name: str) -> type[ChannelModel]:
    """Return a shipped or plug-in (``package.module:Class``) model, or raise PluginError."""
    model: type[ChannelModel] = known_or_named("channel", name, CHANNELS)
    if name in CHANNELS:
        return model
    refuse_other(model, ChannelModel, "exchange.channel.models.ChannelModel")
    lacking = [part for part in COMPULSORY if getattr(model, part) is getattr(ChannelModel, part)]
    if lacking or not model.title:
        raise PluginError(f"a channel model: lacks {', '.join([*lacking, *([] if model.title else ['title'])])}")
    refuse("a channel model", faults_of(model, ChannelModel, COMPULSORY))
    if taken := OF_EVERY_CHANNEL & model.model_fields.keys():
        raise PluginError(f"a channel model: rename its setting {', '.join(sorted(taken))}, a key of every channel")
    if unset := [key for key, info in model.model_fields.items() if info.is_required()]:
        raise PluginError(f"a channel model: {', '.join(unset)} without a default; allowed: a default each")
    return model


def _known_model(name: Any) -> type[ChannelModel] | None:
    try:
        return model_named(name) if isinstance(name, str) else None
    except PluginError:
        return None


def is_left_aside(key: str, channel: str) -> bool:
    """True for a setting of a shipped model in a study whose channel loses nothing."""
    model = _known_model(channel)
    table, _, below = key.partition(".")
    name = below.partition(".")[0]
    is_setting = any(name in shipped.model_fields for shipped in CHANNELS.values())
    return table == "channel" and is_setting and model is not None and not model.model_fields


def leave_aside(own_name: Any, channel: Any, overridden: Collection[str]) -> list[ConfigurationFault]:
    """Remove settings that the channel's model does not use; return faults for intended ones.

    ``own_name`` is the model in the scenario file, before overrides.
    """
    name = channel.get("name") if isinstance(channel, dict) else None
    model = _known_model(name)
    if model is None:
        return []
    # An override of the whole table leaves nothing of the scenario's own channel.
    own_model = _known_model(own_name) if "channel" not in overridden else None
    replaced: Collection[str] = own_model.model_fields if own_model is not None else ()
    of_shipped = {key for shipped in CHANNELS.values() for key in shipped.model_fields}
    faults = []
    for key in [key for key in channel if key not in model.model_fields and (key in of_shipped or key in replaced)]:
        value = channel.pop(key)
        # A key left over from a replaced model is no mistake; a key given for this model is one.
        if f"channel.{key}" in overridden or (model.model_fields and key not in replaced):
            users = [user for user, shipped in CHANNELS.items() if key in shipped.model_fields] or [str(own_name)]
            uses = f"{name} uses {', '.join(model.model_fields) or 'no setting, it loses nothing'}"
            allowed = f"not used by the {name} channel, only by {' and '.join(users)}; {uses}"
            faults.append(ConfigurationFault(f"channel.{key}", "" if isinstance(value, list) else str(value), allowed))
    return faults


def channel_faults(scenario: Scenario) -> Iterator[ConfigurationFault]:
    """Yield faults within the channel, and between it and the vehicles."""
    channel, vehicles = scenario.channel, scenario.vehicle_names
    try:
        model = model_named(channel.name)
    except PluginError as error:
        yield ConfigurationFault("channel.name", "", str(error))
    else:
        yield from _setting_faults(model, scenario)
    for number, blackout in enumerate(channel.blackout, 1):
        key = f"channel.blackout.{number}"
        yield from one_of(f"{key}.vehicle", blackout.vehicle, vehicles)
        for name in (name for side in blackout.between or () for name in side):
            yield from one_of(f"{key}.between", name, vehicles)


def _setting_faults(model: type[ChannelModel], scenario: Scenario) -> Iterator[ConfigurationFault]:
    channel, name = scenario.channel, scenario.channel.name
    table = {key: getattr(channel, key) for key in channel.model_fields_set}
    known = list(ChannelTable.model_fields) if name in CHANNELS else ["name", *model.model_fields, "blackout"]
    for key in table.keys() - set(known):
        allowed = f"unknown key, allowed here: {', '.join(known)}{suggestion(key, known)}"
        yield ConfigurationFault(f"channel.{key}", "", allowed)
    try:
        settings = channel.settings()
    except ValidationError as error:  # of a plug-in model
        for fault in (fault_of(detail, model, table) for detail in error.errors()):
            yield ConfigurationFault(f"channel.{fault.key}", fault.given, fault.allowed)
        return
    yield from _vehicle_faults("channel", settings, scenario.vehicle_names)
    if (deployment := deployment_in(scenario)) is None:
        return
    try:
        faults = list(settings.misfits(deployment))
        if wrong := [fault for fault in faults if not isinstance(fault, SettingFault)]:
            raise TypeError(f"expected SettingFaults, not {wrong[0]!r}")
        yield from map(_as_configured, faults)
        if name not in CHANNELS:
            yield from _trial_faults(name, settings, deployment)
    except RAISED as error:
        allowed = f"its checks of settings raised {named_error(error)}"
        yield ConfigurationFault("channel.name", "", allowed)


def _as_configured(fault: SettingFault) -> ConfigurationFault:
    allowed = fault.allowed + suggestion(fault.given.strip('"'), fault.names)
    if not fault.file:
        return ConfigurationFault(f"channel.{fault.key}", fault.given, allowed)
    line = fault.line
    if line is None and fault.file.endswith(".toml"):
        with suppress(ConfigurationError):  # invalid TOML is reported already
            line = Document.at(Path(fault.file)).line_of(fault.key)
    return ConfigurationFault(fault.key, fault.given, allowed, line, fault.file)


def deployment_in(scenario: Scenario) -> Deployment | None:
    """Return the transmitting fleet; None if modem or slots are wrong, as other checks report."""
    slots = sorted(vehicle.slot for vehicle in scenario.vehicle)
    # A model may assume numbers from 0 without gaps; a wrong fleet gets its own faults.
    is_whole = modem_in(scenario) is not None and slots == list(range(max(2, len(slots))))
    return scenario.deployment if is_whole else None


def _trial_faults(name: str, settings: ChannelModel, deployment: Deployment) -> Iterator[ConfigurationFault]:
    speed, linking = "None or a finite number above 0", "an object with p_loss(packet, receiver, range_m)"
    try:
        answer("it", "mean_per", SHARE, _is_share, lambda: settings.mean_per(deployment))
        answer("it", "sound_speed_mps", speed, _is_speed, lambda: settings.sound_speed_mps(deployment))
        link = answer("it", "link_model", linking, _is_link, lambda: settings.link_model(deployment, 0))
        # One full packet at 1 m: enough to find a wrong signature or kind of answer before the run.
        CheckedLink(name, link).p_loss(Transmission(0, 0, 0.0, deployment.modem.payload_bits), 1, 1.0)
    except PluginError as error:
        yield ConfigurationFault("channel.name", f'"{name}"', str(error).removeprefix("it: "))


def _is_speed(value: Any) -> bool:
    return value is None or (is_number(value) and value > 0.0)


def _is_link(value: Any) -> bool:
    return callable(getattr(value, "p_loss", None))


def _vehicle_faults(above: str, table: BaseModel, vehicles: Sequence[str]) -> Iterator[ConfigurationFault]:
    for key, info in type(table).model_fields.items():
        value = getattr(table, key) if key in table.model_fields_set else None
        if any(isinstance(mark, OfVehicle) for mark in info.metadata):
            yield from one_of(f"{above}.{key}", value, vehicles)
        for number, entry in enumerate(value if isinstance(value, tuple) else (), 1):
            if isinstance(entry, BaseModel):
                yield from _vehicle_faults(f"{above}.{key}.{number}", entry, vehicles)


def with_link_file_found(channel: ChannelTable, folder: Path, is_other: bool) -> ChannelTable:
    """Return the channel with absolute path and hash of its file; ``is_other``: the scenario's hash is of another."""
    key = FILE_KEYS.get(channel.name, "")
    value = getattr(channel, key, None)
    if not value:
        return channel
    changes = {"sha256": "" if is_other else channel.sha256}
    if key == "file" or file_in(value):
        path = changes[key] = str((folder / value).resolve())
        with suppress(LinkFileGoneError):  # a check reports a missing file
            # A hash in the scenario stays: it says which file results were made with.
            changes["sha256"] = changes["sha256"] or hash_of(path if key == "file" else file_in(path), "")
    return channel.model_copy(update=changes)


def most_apart_s(scenario: Scenario) -> float:
    """Greatest difference (s) between two clocks that guard and tolerances cover."""
    return max([feature.apart_s(scenario) for feature in used_in(scenario)], default=0.0)


def guard_s(scenario: Scenario) -> float:
    """Slot guard (s): travel time over the whole range plus clock difference."""
    return scenario.communication.range_m / scenario.sound_speed_mps + most_apart_s(scenario)
