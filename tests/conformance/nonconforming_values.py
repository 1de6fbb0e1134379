"""Value rules that break their interface, each in one way."""

import math

from exchange.policy.candidates import Moment, QueuePlace, Waiting


class Nameless:
    name = ""

    def place(self, waiting: Waiting) -> QueuePlace:
        return QueuePlace(waiting.priority, -waiting.since_s)

    def value(self, waiting: Waiting, moment: Moment) -> float:
        return moment.now_s - waiting.since_s


class Endless(Nameless):
    name = "endless"

    def value(self, waiting: Waiting, moment: Moment) -> float:
        return math.inf


class Counting(Nameless):
    """It answers otherwise the second time."""

    name = "counting"

    def __init__(self) -> None:
        self.n = 0

    def value(self, waiting: Waiting, moment: Moment) -> float:
        self.n += 1
        return self.n


class Meddling(Nameless):
    name = "meddling"

    def value(self, waiting: Waiting, moment: Moment) -> float:
        waiting.priority = 2
        return 1.0


class Disordered(Nameless):
    """Ranks go by the time waited, values by the age."""

    name = "disordered"

    def value(self, waiting: Waiting, moment: Moment) -> float:
        return moment.now_s - waiting.observed_s


class Overtaking(Nameless):
    """One group for all priorities: faster growing values overtake."""

    name = "overtaking"

    def place(self, waiting: Waiting) -> QueuePlace:
        return QueuePlace("all", waiting.credit - waiting.since_slot)

    def value(self, waiting: Waiting, moment: Moment) -> float:
        return waiting.credit + (1 + waiting.n_sent) * (moment.n_slots - waiting.since_slot)
