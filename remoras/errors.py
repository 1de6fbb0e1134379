"""Errors of the ``remoras`` package."""


class RemorasError(Exception):
    """Base class of the errors of ``remoras``.

    >>> try:
    ...     raise StrategyError("parameters.patience", "more than 0")
    ... except RemorasError as error:
    ...     print(error)
    parameters.patience: more than 0
    """


class OrganisationError(RemorasError):
    """An invalid operation on the organisation, such as a role with an empty name."""


class PlanningError(RemorasError):
    """A malformed HTN domain, or a mission without a plan."""


class StrategyError(RemorasError):
    """An unknown strategy parameter, or a value that is not ``allowed``; ``key`` names it."""

    def __init__(self, key: str, allowed: str) -> None:
        super().__init__(key, allowed)  # constructor arguments, for pickling
        self.key = key
        self.allowed = allowed

    def __str__(self) -> str:
        return f"{self.key}: {self.allowed}"


class PluginError(RemorasError):
    """A ``package.module:object`` that cannot be loaded or violates its interface."""
