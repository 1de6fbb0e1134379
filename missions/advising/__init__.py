"""Advising: which strategy a scenario asks for, by the runs of all on instances that were drawn.

Scenarios are drawn from numbers (``instances``), run (``running``), and told apart by what follows from their text
(``traits``). What came of it is a file (``experience``), from which advice for any scenario is learned (``model``,
``advice``) and judged on instances held out (``judging``). Nothing else imports it, but the command.
"""

__all__: list[str] = []
