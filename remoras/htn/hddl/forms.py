"""Text of HDDL into nested forms, each with the line in which it begins; and the faults that are found in them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from remoras.errors import PlanningError

TOKEN = re.compile(r";[^\n]*|\n|[()]|[^\s();]+")


@dataclass(frozen=True, slots=True)
class Token:
    """A name, variable or keyword, in lower case, as HDDL does not tell cases apart."""

    text: str
    line: int


@dataclass(frozen=True, slots=True)
class Parenthesised:
    """What stands between two parentheses."""

    items: tuple[Parenthesised | Token, ...]
    line: int

    @property
    def head(self) -> str:
        """The first word, or nothing."""
        first = self.items[0] if self.items else None
        return first.text if isinstance(first, Token) else ""


class Faults:
    """Faults of one file, collected so that all are told at once."""

    def __init__(self, file: str) -> None:
        self.file = file
        self._found: list[str] = []

    def add(self, line: int, text: str) -> None:
        """Note a fault."""
        self._found.append(f"{self.file}:{line}: {text}")

    def fatal(self, line: int, text: str) -> PlanningError:
        """The error of a fault behind which nothing can be read."""
        self.add(line, text)
        return PlanningError("\n".join(self._found))

    def end(self) -> None:
        """Raise PlanningError if there are faults."""
        if self._found:
            raise PlanningError("\n".join(self._found))


def read_forms(text: str, faults: Faults) -> Parenthesised:
    """The one form that a file consists of.

    Raises:
        PlanningError: parentheses that do not match, or text outside them.
    """
    line = 1
    open_forms: list[tuple[list[Parenthesised | Token], int]] = []
    whole: Parenthesised | None = None
    for token in TOKEN.findall(text):
        if token == "\n":
            line += 1
        elif token.startswith(";"):
            continue
        elif whole is not None:
            raise faults.fatal(line, f"{token!r} stands behind the end of the definition")
        elif token == "(":
            open_forms.append(([], line))
        elif not open_forms:
            raise faults.fatal(line, f"a file begins with (define, not with {token!r}")
        elif token == ")":
            items, begun = open_forms.pop()
            form = Parenthesised(tuple(items), begun)
            if open_forms:
                open_forms[-1][0].append(form)
            else:
                whole = form
        else:
            open_forms[-1][0].append(Token(token.lower(), line))
    if whole is None:
        raise faults.fatal(open_forms[-1][1] if open_forms else line, "this parenthesis is never closed")
    return whole


def sections(whole: Parenthesised, kind: str, faults: Faults) -> Iterator[Parenthesised]:
    """The sections of ``(define (kind name) ...)`` behind its name."""
    if whole.head != "define" or len(whole.items) < 2 or not isinstance(whole.items[1], Parenthesised):
        raise faults.fatal(whole.line, f"a file begins with (define ({kind} NAME)")
    if whole.items[1].head != kind:
        raise faults.fatal(whole.items[1].line, f"this defines a {whole.items[1].head}, expected was a {kind}")
    for item in whole.items[2:]:
        if isinstance(item, Parenthesised) and item.head.startswith(":"):
            yield item
        else:
            faults.add(item.line, f"expected a section (:keyword ...), not {item_text(item)}")


def keywords(
    form: Parenthesised, skip: int, allowed: Sequence[str], faults: Faults
) -> dict[str, Parenthesised | Token]:
    """Values by keyword, as in ``:parameters (...) :task (...)``, behind the first ``skip`` items of ``form``."""
    found: dict[str, Parenthesised | Token] = {}
    items = form.items[skip:]
    for keyword, value in zip(items[::2], items[1::2], strict=False):
        if not isinstance(keyword, Token) or keyword.text not in allowed:
            faults.add(keyword.line, f"{item_text(keyword)} is not known here; allowed: {', '.join(allowed)}")
        elif keyword.text in found:
            faults.add(keyword.line, f"{keyword.text} stands here twice")
        else:
            found[keyword.text] = value
    if len(items) % 2:
        faults.add(items[-1].line, f"{item_text(items[-1])} has no value")
    return found


def item_text(item: Parenthesised | Token) -> str:
    """The item as it is written, cut after a few words."""
    if isinstance(item, Token):
        return item.text
    inner = " ".join(item_text(inner) if isinstance(inner, Token) else "(...)" for inner in item.items[:4])
    return f"({inner}{' ...' if len(item.items) > 4 else ''})"
