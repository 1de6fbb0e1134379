"""Refusals: what only shows once a fleet has founded its groups, told before the mission begins."""

from __future__ import annotations

from missions.errors import ConfigurationError, ConfigurationFault
from missions.scenarios.scenario import Scenario
from remoras.authority import CONSULTING
from remoras.database import AUVDatabase
from remoras.social.agreement import Agreement
from remoras.strategy import Strategy
from remoras.wellformed import Defect, specification_faults


def refuse_malformed(scenario: Scenario, agreement: Agreement) -> None:
    """Refuse an organisation that is not well formed from the start: a group without a head would wait for ever.

    Raises:
        ConfigurationError: with all that does not hold.
    """
    founding = agreement.organisation
    faults = [
        ConfigurationFault(f"group.{group}.role.{of_group.head_role}", "", "nobody came to play it before the mission")
        for group, of_group in founding.groups.items()
        if not founding.heads(group)
    ]
    headless = {fault.key for fault in faults}
    faults += [
        ConfigurationFault(defect.key, defect.given, f"no founding gives it what it demands: {defect.allowed}")
        for defect in specification_faults(founding)
        if defect.key.rpartition(".")[0] not in headless and defect.defect is not Defect.SUBGROUPS  # some come at sea
    ]
    if faults:
        raise ConfigurationError(scenario.scenario.name, faults)


def refuse_undivided(scenario: Scenario, strategy: Strategy, agreement: Agreement, database: AUVDatabase) -> None:
    """Where vehicles divide jobs among themselves, those without the social layer would leave theirs undone.

    Args:
        scenario: the whole input.
        strategy: that divides jobs.
        agreement: of the fleet; database: of its vehicles.

    Raises:
        ConfigurationError: with the jobs that nobody would do.
    """
    if strategy.declaration.authorities.isdisjoint(CONSULTING):
        return
    remedy = "set social_layer = true for one of them, or name a strategy whose heads give out jobs, such as central"
    faults = []
    for name, group in agreement.organisation.groups.items():
        for role in group.roles:
            able = database.able_to_play(name, role.name) if role.job is not None else ()
            if able and not any(data.social_layer for data in able):
                names = ", ".join(data.name for data in able)
                why = f"under {strategy.name} vehicles with the social layer divide jobs, {names} has none: {remedy}"
                faults.append(ConfigurationFault(f"group.{name}.role.{role.name}.job", f'"{role.job}"', why))
    if faults:
        raise ConfigurationError(scenario.scenario.name, faults)
