"""The instances that one store knows of: their uids, classes and names, and what has arrived about them."""

from collections.abc import Iterable, Sequence

from worldmodel.arrivals import Arrivals
from worldmodel.errors import FactError, unknown_name
from worldmodel.facts import Instance
from worldmodel.index import Index
from worldmodel.ontology.tbox import TBox, ValueKind
from worldmodel.tables import compiled_attributes


class Individuals:
    """The common instances have the uids 0, 1, ...; behind them each origin has a range for those that it creates."""

    def __init__(
        self,
        tbox: TBox,
        instances: Sequence[Instance],
        n_origins: int,
        run_time_instances_per_origin: int,
        waiting_s: float,
        waiting_blocks: int,
    ) -> None:
        """Know the common instances; see ``Store`` for the arguments."""
        _refuse_bad_instances(tbox, instances)
        if run_time_instances_per_origin < 0:
            raise FactError(f"run_time_instances_per_origin is {run_time_instances_per_origin}; allowed: 0 or more")
        if not waiting_s >= 0:
            raise FactError(f"waiting_s is {waiting_s}; allowed: 0 s or more")
        if waiting_blocks < 1:
            raise FactError(f"waiting_blocks is {waiting_blocks}; allowed: 1 or more")
        self.tbox = tbox
        self.n_origins = n_origins
        self.run_time_instances_per_origin = run_time_instances_per_origin
        self.common_instances = tuple(instances)
        self.n_uids = len(instances) + n_origins * run_time_instances_per_origin
        self.tables = compiled_attributes(tbox)
        """The attributes, compiled for the checks."""
        self.index = Index(tbox, instances)
        links = frozenset(a.uid for a in tbox.attributes if a.kind is ValueKind.LINK)
        self.arrivals = Arrivals(links, waiting_s, waiting_blocks)
        self._instance_named = {instance.name: instance for instance in instances}

    def instance(self, uid: int) -> Instance | None:
        """Return the instance if it is common or has been announced, even by a banned origin."""
        if 0 <= uid < len(self.common_instances):
            return self.common_instances[uid]
        created = self.arrivals.created_as(uid)
        if created is None or not self.class_mask(uid):
            return None
        return Instance(uid, created, f"{self.tbox.classes[created].name}-{uid}")

    def instance_uids(self) -> Iterable[int]:
        """Return the uids of all known instances, also of those that a banned origin announced."""
        return self.index.masks.keys()

    def instance_named(self, name: str) -> Instance:
        """Return a common instance by its name; raises UnknownNameError, which proposes a similar name."""
        try:
            return self._instance_named[name]
        except KeyError:
            raise unknown_name("common instance", name, self._instance_named) from None

    def class_mask(self, uid: int) -> int:
        """Return the classes an instance is known to belong to, bit c for class c; 0 when it is not known."""
        return self.index.masks.get(uid, 0)

    def created_as(self, uid: int) -> int | None:
        """Return the class an instance was created with, even while the block that creates it waits."""
        if 0 <= uid < len(self.common_instances):
            return self.common_instances[uid].class_uid
        return self.arrivals.created_as(uid)

    def owner_of(self, uid: int) -> int | None:
        """Return the origin whose range a uid is from; None for a common instance and outside all ranges."""
        if not len(self.common_instances) <= uid < self.n_uids:
            return None
        return (uid - len(self.common_instances)) // self.run_time_instances_per_origin

    def first_uid_of(self, origin: int) -> int:
        """Return the first uid of the range from which ``origin`` takes the uids of its instances."""
        return len(self.common_instances) + origin * self.run_time_instances_per_origin

    def base_mask(self, uid: int, has_creator: bool) -> int:
        """Return the classes that an instance has whatever others say of it, bit c for class c.

        Args:
            uid: the instance.
            has_creator: True if the block that created it is in, and its class of creation is not in question.
        """
        if 0 <= uid < len(self.common_instances):
            return self.tbox.ancestor_mask(self.common_instances[uid].class_uid)
        created = self.arrivals.created_as(uid)
        return self.tbox.ancestor_mask(created) if has_creator and created is not None else 0


def _refuse_bad_instances(tbox: TBox, instances: Sequence[Instance]) -> None:
    faults = []
    for expected, instance in enumerate(instances):
        if instance.uid != expected:
            faults.append(f"instance {instance.name!r} has uid {instance.uid}; allowed here: {expected}")
        if not 0 <= instance.class_uid < len(tbox.classes):
            faults.append(
                f"instance {instance.name!r} is of class {instance.class_uid}; allowed: 0..{len(tbox.classes) - 1}"
            )
    names = [instance.name for instance in instances]
    for name in sorted({name for name in names if names.count(name) > 1}):
        faults.append(f"{names.count(name)} instances are named {name!r}; allowed: one")
    if faults:
        raise FactError("\n".join(faults))
