"""Conformance checks of organisational strategies, raising ``AssertionError``."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, get_args, get_type_hints

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from missions.runs.run import Run, run
from missions.scenarios import load
from missions.scenarios.parts import strategy_named
from remoras.authority import CONSULTING, Act, Authority, Request, Rules, may_assign
from remoras.decision_timeout import InTime
from remoras.errors import StrategyError
from remoras.organisation import Outcome
from remoras.plugins import named_object
from remoras.strategies import configured, parameters
from remoras.strategy import (
    INFLUENCE_SIGNAL,
    JOB_DONE,
    OBJECTIVE,
    Situation,
    Strategy,
    ask,
    division_of,
    faults_of_strategy,
)
from remoras.testing.behaviours import passed
from remoras.testing.missions import check_free_of_hashes
from remoras.testing.sample_worlds import (
    GROUPS,
    NAMES,
    ROLES,
    TBOX,
    WORLDS,
    Watched,
    fleets,
    hearsay,
    organisations,
    role_facts,
    small_patches,
    works_of,
)
from remoras.work import Job

OCCASIONAL_BLOCKS = 10
"""Allowed blocks per job and run beyond ``blocks_per_round``, for assignments and releases."""
N_ROUNDS = 6
CUT_OFF, CUT_OFF_S = ("AUV00", "AUV02"), (60.0, 700.0)
"""Vehicles isolated in turn, the head and a member, and when: longer than any time-out of shipped strategies."""
NEARLY_ALL = 0.9
"""Mapped share of an area that suffices: an early turn leaves out a corner."""
OFTEN = 3
"""Allowed number of releases of one role by a vehicle."""
UNLAWFUL = (Outcome.OUTSIDE.value, Outcome.NO_SOCIAL_LAYER.value, Outcome.NO_AUTHORITY.value)
REMEDY = f"unless it leads, the declaration has to name an authority ({', '.join(map(str, Authority))}) that allows it"
EXAMPLES = settings(
    max_examples=20,
    deadline=None,
    derandomize=True,
    phases=[Phase.generate],  # the message names the fault: no shrinking
    suppress_health_check=list(HealthCheck),
)

# Declaration


def check_parts(strategy: Strategy) -> None:
    """Check members and signatures of the protocol."""
    faults = "; ".join(faults_of_strategy(strategy))
    assert not faults, faults


def check_declaration(strategy: Strategy) -> None:
    """Check source, messages in the vocabulary, and limits."""
    declaration = strategy.declaration
    assert strategy.name, "has no name"
    assert declaration.source.strip(), "declares no source"
    words = {attribute.name for attribute in TBOX.attributes} | {INFLUENCE_SIGNAL, JOB_DONE, OBJECTIVE}
    for message, meaning in declaration.messages.items():
        assert message in words, f"message {message!r} is neither an attribute of the ontology nor an influence signal"
        assert meaning.strip(), f"message {message!r} is not explained"
    assert declaration.influences == (INFLUENCE_SIGNAL in declaration.messages), "influences and messages disagree"
    assert declaration.tells or not declaration.messages, "declares messages but tells nobody"
    assert declaration.blocks_per_round >= 0, "blocks_per_round is negative"


def check_parameters(strategy: Strategy) -> None:
    """Check descriptions, bounds and defaults of all parameters."""
    for parameter in parameters(strategy):
        name, value = parameter.name, parameter.default
        assert parameter.description.strip(), f"parameter {name} is not described"
        try:
            configured(strategy, {name: value})
        except StrategyError as error:
            raise AssertionError(f"parameter {name}: its default is refused: {error}") from None
        if not isinstance(value, bool | str):
            assert len(_bounds(strategy, name)) == 2, f"parameter {name} has no lower and upper bound"


def _bounds(strategy: Strategy, name: str) -> dict[str, float]:
    fields = get_args(get_type_hints(type(strategy), include_extras=True)[name])[1:]
    constraints = [constraint for field in fields for constraint in field.metadata]
    kinds = ("ge", "gt", "le", "lt")
    return {kind: getattr(limit, kind) for limit in constraints for kind in kinds if hasattr(limit, kind)}


# Decisions


def check_allocates_within_the_group(strategy: Strategy) -> None:
    """Check ``form`` and ``adapt``: able members, each open job once, deterministic."""
    strategy = InTime(strategy)

    @settings(EXAMPLES, max_examples=60)  # of 20 draws, none may have an able vehicle for a job that is not due
    @given(st.sampled_from(list(WORLDS.values())), st.data())
    def holds(jobs: Mapping[str, Job], data: st.DataObject) -> None:
        database = data.draw(fleets())
        formed = strategy.form(database, GROUPS)
        assert strategy.form(database, GROUPS) == formed, "forms another organisation when asked again"
        for assignment in formed.assignments:
            assert database[assignment.vehicle].can_play(assignment.group, assignment.role), (
                f"{assignment} founds what it cannot play"
            )
        for group in GROUPS:
            work = data.draw(works_of(group, formed, database, jobs))
            allocated = strategy.adapt(work)
            assert strategy.adapt(work) == allocated, "allocates otherwise when asked again"
            held: Counter[str] = Counter()
            for entry in allocated:
                role = group.role(entry.role)
                assert entry.group == group.name, f"{entry} is in another group than {group.name}"
                assert role is not None, f"{entry} is of a role that the group does not have"
                assert formed.is_member(entry.vehicle, group.name), f"{entry} is given to no member of {group.name}"
                assert database[entry.vehicle].can_play(entry.group, entry.role), (
                    f"{entry} is given to a vehicle that cannot play it"
                )
                assert not formed.plays(entry.vehicle, entry.group, entry.role), f"{entry} is held already"
                if role.job is not None:
                    held[role.job] += 1
                    assert role.job not in work.done, f"{entry}: its job is done"
                    assert role in work.open, f"{entry}: its job needs others that are not done"
                    assert work.able(database[entry.vehicle], role), f"{entry} is given to a vehicle that is not able"
            assert all(n == 1 for n in held.values()), f"a job is given to several vehicles: {dict(held)}"

    holds()


def check_states_within_the_group(strategy: Strategy) -> None:
    """Check that negotiators state only roles of their group, for able members, on any input."""
    _check_states(strategy)
    if least := _least(strategy):  # with the minima of all integer parameters time-outs expire within the few rounds
        _check_states(configured(strategy, least))


def _least(strategy: Strategy) -> dict[str, int]:
    whole = [p.name for p in parameters(strategy) if isinstance(p.default, int) and not isinstance(p.default, bool)]
    bounds = {name: _bounds(strategy, name) for name in whole}
    return {name: int(limits["ge"] if "ge" in limits else limits["gt"] + 1) for name, limits in bounds.items()}


def _check_states(strategy: Strategy) -> None:
    strategy = InTime(strategy)

    @EXAMPLES
    @given(st.sampled_from(list(WORLDS.values())), st.data())
    def holds(jobs: Mapping[str, Job], data: st.DataObject) -> None:
        database = data.draw(fleets())
        formed = strategy.form(database, GROUPS)
        group = GROUPS[1]
        members = formed.members(group.name)
        if not members:
            return
        me = data.draw(st.sampled_from(members))
        authorities, communicates = strategy.declaration.authorities, strategy.declaration.communicates
        if authorities & CONSULTING and not database[me].social_layer:
            return  # without the social layer it does not negotiate
        rules = Rules(database, authorities, jobs)
        negotiator = strategy.negotiator(me, group)
        if negotiator is None:
            return
        organisation, done = data.draw(organisations(formed, database)), frozenset[str]()
        mentioned: list[Any] = []
        for number in range(1, 1 + N_ROUNDS):
            work = data.draw(works_of(group, organisation, database, jobs))
            done |= work.done if number == N_ROUNDS else frozenset()
            situation = Situation(
                7.0 * number,
                number,
                replace(work, done=done),
                data.draw(st.sampled_from([None, (0.0, 0.0)])),
                data.draw(hearsay(strategy, database, jobs, mentioned)),
                data.draw(st.dictionaries(st.sampled_from(NAMES), st.floats(0.0, 7.0 * number))),
            )
            statements = ask(strategy.name, negotiator, situation).statements
            _assert_within(situation, group.name, statements)
            _assert_lawful(situation, me, rules, statements)
            for stated in statements if communicates and not strategy.declaration.private_jobs else ():
                kept = [fact for fact in stated.facts if fact[1] in ROLES and not stated.told]
                assert not kept, f"{me} keeps {kept} to itself, but its declaration has not private_jobs"
            mentioned = [subject for statement in statements for subject, _, _ in statement.facts]
            for role, vehicle in division_of(strategy.name, negotiator).items():
                assert group.role(role) is not None, f"division names {role}, which is no role of {group.name}"
                assert vehicle in database.names, f"division names {vehicle}, which is no vehicle"

    holds()


def _assert_within(situation: Situation, group: str, statements: Any) -> None:
    organisation, database = situation.work.organisation, situation.work.database
    for vehicle, _, of_group, role in role_facts(statements):
        claim = f"states that {vehicle} plays or left {of_group}.{role}"
        assert of_group == group, f"{claim}, but negotiates for {group}"
        assert organisation.groups[group].role(role) is not None, f"{claim}, which is no role"
        assert organisation.is_member(vehicle, group), f"{claim}, but it is no member"
        assert database[vehicle].can_play(group, role), f"{claim}, but it cannot play it"


def _assert_lawful(situation: Situation, me: str, rules: Rules, statements: Any) -> None:
    organisation = situation.work.organisation
    for subject, attribute, of_group, role in role_facts(statements):
        act = Act.ASSIGN if attribute == "playsRole" else Act.RELEASE
        ruling = may_assign(Request(me, act, of_group, role, subject), organisation, rules).value
        assert ruling not in UNLAWFUL, f"{me} states: {subject} {attribute} {of_group}.{role}: {ruling}; {REMEDY}"
        change = organisation.assign if act is Act.ASSIGN else organisation.leave_role
        organisation, _ = change(subject, of_group, role)


# Runs


def check_runs(strategy: Strategy) -> None:
    """Check a small mission without loss and at PER 0.6: completed, without false beliefs."""
    for per in (0.0, 0.6):
        finished, watched = _watched_run(strategy, f"channel.per={per}")
        _assert_as_declared(finished, watched)  # first: excess traffic may end a mission
        assert finished.completed, f"PER {per}: {finished.reason}"
        assert finished.n_false_beliefs == 0, f"PER {per}: {finished.n_false_beliefs} false beliefs"


def check_does_jobs_in_order(strategy: Strategy) -> None:
    """Check that surveys and a dependent recovery complete without loss."""
    finished = run(load("trident-intervention", [("--set", "channel.per=0")]), strategy=InTime(strategy))
    assert finished.completed, f"of jobs that need each other: {finished.reason}"


def check_survives_silence(strategy: Strategy) -> None:
    """Check a run without any reception: it ends, and all initially assigned jobs are done."""
    finished, watched = _watched_run(strategy, "channel.blackout=[{from_s=0.0, until_s=1e6}]")
    assert finished.completed or finished.reason, "a run in silence has no reason"
    assert finished.n_false_beliefs == 0
    _assert_as_declared(finished, watched)
    role_of = {(g.name, r.name): r.job for g in finished.scenario.group for r in g.role if r.job is not None}
    roles = finished.recorder.roles
    begun = {(group, role) for time_s, _, group, role, event in roles if time_s == 0.0 and event == "assigned"}
    begun &= set(role_of)
    if strategy.declaration.planned_before:
        mapped = _mapped_fractions(finished)
        lacking = [role_of[key] for key in sorted(begun) if mapped[role_of[key]] < 1.0]
        assert not lacking, f"given out before the mission, but not mapped in silence: {', '.join(lacking)}"
        assert max(mapped.values()) == 1.0, "without communication no vehicle maps an area"


def check_survives_the_silence_of_one(strategy: Strategy) -> None:
    """Check a temporarily isolated vehicle: mission completed, no oscillating roles."""
    for vehicle in CUT_OFF:
        blackout = f'channel.blackout=[{{vehicle="{vehicle}", from_s={CUT_OFF_S[0]}, until_s={CUT_OFF_S[1]}}}]'
        finished, watched = _watched_run(strategy, blackout)
        left = Counter((name, role) for _, name, _, role, event in finished.recorder.roles if event == "left")
        dithered = [f"{name} leaves {role} {n} times" for (name, role), n in left.items() if n > OFTEN]
        assert not dithered, f"{vehicle} cut off for a time: {'; '.join(dithered)}"
        assert finished.completed, f"{vehicle} cut off for a time: {finished.reason}"
        lacking = [area for area, mapped in _mapped_fractions(finished).items() if mapped < NEARLY_ALL]
        assert not lacking, f"{vehicle} cut off for a time: not mapped: {', '.join(lacking)}"
        _assert_as_declared(finished, watched)


def _watched_run(strategy: Strategy, setting: str) -> tuple[Run, Watched]:
    watched = Watched(strategy)
    return run(small_patches("remoras", setting), strategy=watched), watched


def _mapped_fractions(finished: Run) -> dict[str, float]:
    cells = finished.mission.world(finished.seed).cells
    mapped = {(x, y) for _, _, x, y in finished.recorder.rows("coverage")}
    totals = Counter(area for area, _ in cells.values())
    done = Counter(area for cell, (area, _) in cells.items() if cell in mapped)
    return {area: done[area] / total for area, total in totals.items()}


def _assert_as_declared(finished: Run, watched: Watched) -> None:
    declaration = watched.declaration
    assert declaration.communicates or not finished.recorder.packets, "sends packets without declaring that it does"
    assert declaration.influences or not finished.recorder.satisfaction, "sends signals without declaring that it does"
    blocks: Counter[tuple[str, str]] = Counter()
    rounds: Counter[tuple[str, str]] = Counter()
    jobs: dict[str, int] = {}
    for vehicle, group, situation, move in watched.moves:
        _assert_within(situation, group, move.statements)
        sent = {attribute for statement in move.statements if statement.told for _, attribute, _ in statement.facts}
        assert sent <= set(declaration.messages), f"sends undeclared facts: {sent - set(declaration.messages)}"
        rounds[vehicle, group] += 1
        blocks[vehicle, group] += len(move.statements)
        jobs[group] = len(situation.work.roles)
    for (vehicle, group), stated in blocks.items():
        allowed = jobs[group] * (declaration.blocks_per_round * rounds[vehicle, group] + OCCASIONAL_BLOCKS)
        assert stated <= allowed, f"{vehicle} states {stated} blocks, its declaration allows {allowed}"
    for _, me, name, of_group, role, _, issuer, act, *_, outcome in finished.recorder.organisation:
        is_lawful = me != issuer or outcome not in UNLAWFUL  # others may not know a new leader
        what = " ".join(filter(None, (act, name, ".".join(filter(None, (of_group, role))))))
        assert is_lawful, f"{me} requests to {what}: {outcome}; {REMEDY}"


def check_deterministic(reference: str) -> None:
    """Check that processes with different hash seeds record equal rows of a short run."""
    check_free_of_hashes(small_patches(reference, "channel.per=0.4", "scenario.duration_s=400"))


# All checks

CHECKS: tuple[Callable[[Strategy], None], ...] = (
    check_parts,
    check_declaration,
    check_parameters,
    check_allocates_within_the_group,
    check_states_within_the_group,
    check_runs,
    check_does_jobs_in_order,
    check_survives_silence,
    check_survives_the_silence_of_one,
)


def conforms(reference: str) -> Iterator[str]:
    """Run all checks of a named strategy and yield their names."""
    strategy: Strategy = named_object(reference) if ":" in reference else strategy_named(reference)
    yield from passed(CHECKS, strategy)
    yield from passed([check_deterministic], reference)
