"""The links of instances as they are seen, those that follow from them included: a graph that is walked when asked."""

from collections.abc import Iterable, Iterator

from worldmodel.ontology.axioms import CompiledAxioms

Slot = tuple[int, int]
"""(subject, attribute)."""


class Links:
    """Told links, from both ends; what follows from them is not kept.

    Attributes:
        steps: places that were looked at, for those who measure.
    """

    def __init__(self, rules: CompiledAxioms) -> None:
        """Hold no link; ``rules`` say what links say of one another."""
        self.steps = 0
        self._rules = rules
        self._targets: dict[Slot, tuple[int, ...]] = {}
        self._linking: dict[Slot, dict[int, None]] = {}  # (target, attribute) -> subjects
        self._leading = [
            [(leading, flipped) for leading, flipped in sources if leading in rules.transitive]
            for sources in rules.sources
        ]

    def told(self, slot: Slot) -> tuple[int, ...]:
        """Return the targets that were told last."""
        return self._targets.get(slot, ())

    def add(self, subject: int, attribute: int, target: int) -> None:
        """Add a told link."""
        self._targets[subject, attribute] = (*self.told((subject, attribute)), target)
        self._linking.setdefault((target, attribute), {})[subject] = None

    def take(self, subject: int, attribute: int, target: int) -> None:
        """Take a told link away."""
        slot = (subject, attribute)
        self._targets[slot] = tuple(linked for linked in self._targets[slot] if linked != target)
        del self._linking[target, attribute][subject]

    def reached(self, uid: int, attribute: int, backward: bool = False) -> Iterator[int]:
        """Yield what the links of an attribute lead to, or come from if ``backward``; some more than once."""
        yield from self._step(uid, attribute, backward)
        for leading, flipped in self._leading[attribute]:
            yield from self._walk(uid, leading, backward != flipped)

    def _walk(self, uid: int, attribute: int, backward: bool) -> Iterator[int]:
        """Yield all that an attribute that leads on reaches."""
        reached: set[int] = set()
        front = [uid]
        while front:
            for instance in self._step(front.pop(), attribute, backward):
                if instance not in reached:
                    reached.add(instance)
                    front.append(instance)
                    yield instance

    def _step(self, uid: int, attribute: int, backward: bool) -> Iterator[int]:
        for source, flipped in self._rules.sources[attribute]:
            self.steps += 1
            links = self._linking if backward != flipped else self._targets
            yield from tuple(links.get((uid, source), ()))

    def concerned(
        self, subject: int, attribute: int, target: int, conditional: Iterable[int]
    ) -> Iterator[tuple[int, int]]:
        """Yield the instances of whose links a told one is a part, each with the attribute of those; it is still there.

        Args:
            subject, attribute, target: the told link.
            conditional: the attributes that count.
        """
        entailed = self._rules.entailed[attribute]
        for asked in conditional:
            for flipped in (False, True):
                if (asked, flipped) in entailed:
                    yield target if flipped else subject, asked
            for leading, turned in self._leading[asked]:
                for flipped in (False, True):
                    if (leading, flipped) in entailed:
                        # the end of the link from which the condition is asked, and all from which one gets there
                        end = target if flipped != turned else subject
                        yield end, asked
                        for uid in self._walk(end, leading, not turned):
                            yield uid, asked
