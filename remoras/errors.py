"""Errors of the vehicle and fleet package."""


class RemorasError(Exception):
    """Base of the errors that ``remoras`` raises."""


class OrganisationError(RemorasError):
    """The organisation was asked something that makes no sense, such as a role with an empty name."""


class PlanningError(RemorasError):
    """An HTN domain is malformed: a task without methods, a method that is no sequence of tasks."""


class StrategyError(RemorasError):
    """A parameter that a strategy does not have, or a value that it does not allow.

    Attributes:
        key: name of the parameter; allowed: what is allowed.
    """

    def __init__(self, key: str, allowed: str) -> None:
        super().__init__(key, allowed)  # what it is made of, so that it goes from process to process
        self.key = key
        self.allowed = allowed

    def __str__(self) -> str:
        return f"{self.key}: {self.allowed}"


class PluginError(RemorasError):
    """An object named ``package.module:object`` cannot be loaded, lacks a part, or does not keep to its seam."""
