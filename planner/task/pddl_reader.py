"""Reads PDDL domains and problems, and refuses whatever Pyperplan would misunderstand without a word.

What it reads: typed STRIPS with conjunctions of positive conditions, and effects with `not`. Every
error is a `PddlError` that names file, line and column, what is wrong and what was expected.
"""

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import NoReturn

from planner.task.pddl import OBJECT, ActionSchema, Domain, Parameter, Problem
from planner.task.sexpr import Group, Node, PddlError, Position, Word, parse
from planner.task.symbols import Fact
from scenarios.names import known

MAX_INSTANCES = 200_000
"""Ground instances that one action may have: Pyperplan builds them all, without a bound of its own."""

REQUIREMENTS = frozenset({":strips", ":typing"})

_NAME = re.compile(r"[a-z][a-z0-9_-]*")
_VARIABLE = re.compile(r"\?[a-z][a-z0-9_-]*")
_UNSUPPORTED = frozenset("or imply forall exists when = increase decrease assign".split())
_RESERVED = frozenset({"and", "not", "either", "define"}) | _UNSUPPORTED
_ACTION_KEYS = (":parameters", ":precondition", ":effect")


def read_text(path: Path) -> str:
    """The text of a PDDL file. Raises PddlError if it can't be read or isn't UTF-8."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise PddlError(f"byte {error.start} is not UTF-8, expected a PDDL file", str(path)) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise PddlError(f"can't be read ({reason}), expected a PDDL file", str(path)) from None
    return text


def read_domain(text: str, file: str = "domain") -> Domain:
    """The domain that a text defines. Raises PddlError naming `file`."""
    return _DomainReader(file).read(text)


def read_problem(text: str, domain: Domain, file: str = "problem") -> Problem:
    """The problem that a text defines, held against its domain. Raises PddlError naming `file`."""
    return _ProblemReader(file, domain).read(text)


class _Reader:
    """What domains and problems have in common."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.places: dict[object, Position] = {}

    def refuse(self, message: str, at: Position) -> NoReturn:
        raise PddlError(message, self.file, at)

    def define(self, text: str, kind: str) -> tuple[Word, list[Group]]:
        """The name given by `(define (KIND NAME) …)` and the sections that follow."""
        root = parse(text, self.file)
        items = root.items
        if not items or not isinstance(items[0], Word) or items[0].text != "define":
            self.refuse(f"expected '(define ({kind} NAME) ...)'", root.at)
        head = items[1] if len(items) > 1 else None
        if not isinstance(head, Group) or len(head.items) != 2 or self.word(head.items[0]).text != kind:
            self.refuse(f"expected '({kind} NAME)' after 'define'", head.at if head else root.at)
        return self.name(head.items[1]), [self.group(item, "a section, (:KEYWORD ...)") for item in items[2:]]

    def sections(self, groups: Iterable[Group], expected: Collection[str]) -> Iterator[tuple[Word, Group]]:
        """Sections with their keywords; each keyword but ':action' may come once."""
        seen: set[str] = set()
        for group in groups:
            if not group.items:
                self.refuse(f"empty brackets, expected one of {', '.join(expected)}", group.at)
            key = self.word(group.items[0])
            if key.text not in expected:
                self.refuse(f"section {key.text!r} is not supported, expected one of {', '.join(expected)}", key.at)
            if key.text in seen and key.text != ":action":
                self.refuse(f"section {key.text!r} stands here a second time, expected once", key.at)
            seen.add(key.text)
            yield key, group

    def word(self, node: Node) -> Word:
        if isinstance(node, Group):
            self.refuse("'(' in the place of a name, expected a name", node.at)
        return node

    def group(self, node: Node, what: str) -> Group:
        if isinstance(node, Word):
            self.refuse(f"{node.text!r} stands alone, expected {what}", node.at)
        return node

    def name(self, node: Node) -> Word:
        word = self.word(node)
        if not _NAME.fullmatch(word.text) or word.text in _RESERVED:
            self.refuse(f"{word.text!r} is no name, expected a letter, then letters, digits, '_' or '-'", word.at)
        return word

    def typed(self, nodes: Iterable[Node], types: Collection[str], is_variable: bool = False) -> list[tuple[Word, str]]:
        """Names (or variables) with their types from `a b - t c`; what has no type is an object."""
        found: list[tuple[Word, str]] = []
        pending: list[Word] = []
        rest = iter(nodes)
        for node in rest:
            word = self.word(node)
            if word.text != "-":
                pending.append(self.variable(word) if is_variable else self.name(word))
                continue
            node = next(rest, None)
            if node is None or not pending:
                self.refuse("'-' without names before it and a type after it, expected 'NAME ... - TYPE'", word.at)
            if isinstance(node, Group):
                self.refuse("'(either ...)' is not supported, expected one type", node.at)
            self.known_type(node, types)
            found += [(name, node.text) for name in pending]
            pending = []
        found += [(name, OBJECT) for name in pending]
        self.once([name for name, _ in found])
        return found

    def once(self, names: Iterable[Word]) -> None:
        seen: set[str] = set()
        for name in names:
            if name.text in seen:
                self.refuse(f"{name.text!r} is declared twice, expected once", name.at)
            seen.add(name.text)

    def variable(self, word: Word) -> Word:
        if not _VARIABLE.fullmatch(word.text):
            self.refuse(f"{word.text!r} is no variable, expected '?' and a name", word.at)
        return word

    def known_type(self, word: Word, types: Collection[str]) -> None:
        if word.text not in types and word.text != OBJECT:
            self.refuse(f"unknown type {word.text!r}, {known(word.text, {*types, OBJECT})}", word.at)

    def literals(self, node: Node, domain: Domain, terms: Mapping[str, str]) -> list[tuple[Fact, bool, Position]]:
        """The conjuncts as (literal, is it positive, where); `terms` are the declared names with their types."""
        group = self.group(node, "a condition in brackets")
        if not group.items:
            return []
        head = self.word(group.items[0])
        if head.text == "and":
            parts = [self.group(item, "a literal in brackets") for item in group.items[1:]]
        else:
            parts = [group]
        return [self._literal(part, domain, terms) for part in parts]

    def positive(self, node: Node, domain: Domain, terms: Mapping[str, str], what: str) -> tuple[Fact, ...]:
        """Like `literals`, refusing negation."""
        found = self.literals(node, domain, terms)
        for fact, is_positive, at in found:
            if not is_positive:
                self.refuse(f"(not {fact.pddl}) in {what}, expected positive literals only", at)
        return tuple(dict.fromkeys(fact for fact, _, _ in found))

    def _literal(self, part: Group, domain: Domain, terms: Mapping[str, str]) -> tuple[Fact, bool, Position]:
        if not part.items:
            self.refuse("empty brackets, expected a literal", part.at)
        head = self.word(part.items[0])
        if head.text == "not":
            if len(part.items) != 2:
                self.refuse("'not' takes one literal, expected (not (PREDICATE ...))", head.at)
            inner = self.group(part.items[1], "a literal in brackets")
            fact, is_positive, at = self._literal(inner, domain, terms)
            if not is_positive:
                self.refuse("'not' inside 'not', expected a literal", at)
            return fact, False, part.at
        if head.text == "and":
            self.refuse("'and' inside a conjunction, expected a literal", head.at)
        if head.text in _UNSUPPORTED:
            self.refuse(f"{head.text!r} is not supported, expected a conjunction of literals", head.at)
        name = self.name(head).text
        if name not in domain.predicates:
            self.refuse(f"unknown predicate {name!r}, {known(name, domain.predicates)}", head.at)
        parameters = domain.predicates[name]
        args = [self.word(item) for item in part.items[1:]]
        if len(args) != len(parameters):
            self.refuse(f"predicate {name!r} has {len(args)} arguments, expected {len(parameters)}", head.at)
        for arg, parameter in zip(args, parameters, strict=True):
            if arg.text not in terms:
                kind = "variable" if arg.text.startswith("?") else "object"
                self.refuse(f"unknown {kind} {arg.text!r}, {known(arg.text, terms)}", arg.at)
            if not domain.is_kind(terms[arg.text], parameter.type):
                given, wanted = terms[arg.text], parameter.type
                self.refuse(f"{arg.text!r} in {name!r} has type {given!r}, expected {wanted!r}", arg.at)
        return Fact(name, tuple(arg.text for arg in args)), True, part.at


class _DomainReader(_Reader):
    SECTIONS = (":requirements", ":types", ":constants", ":predicates", ":action")

    def read(self, text: str) -> Domain:
        name, groups = self.define(text, "domain")
        found: dict[str, Group] = {}
        actions: list[Group] = []
        for key, group in self.sections(groups, self.SECTIONS):
            if key.text == ":action":
                actions.append(group)
            else:
                found[key.text] = group
        if ":predicates" not in found:
            self.refuse("no predicates, expected a section (:predicates ...)", name.at)
        for node in self._content(found, ":requirements"):
            word = self.word(node)
            if word.text not in REQUIREMENTS:
                self.refuse(f"requirement {word.text!r} is not supported, expected :strips or :typing", word.at)
        types = self._types(self._content(found, ":types"))
        constants: dict[str, str] = {}
        for word, type_ in self.typed(self._content(found, ":constants"), types):
            constants[word.text] = type_
            self.places[word.text] = word.at
        predicates = self._predicates(self._content(found, ":predicates"), types)
        frame = Domain(name.text, types, constants, predicates, (), self.places)
        schemas = tuple(self._action(group, frame) for group in actions)
        return Domain(name.text, types, constants, predicates, schemas, self.places)

    def _content(self, found: Mapping[str, Group], key: str) -> tuple[Node, ...]:
        return found[key].items[1:] if key in found else ()

    def _types(self, nodes: tuple[Node, ...]) -> dict[str, str]:
        words = [node.text if isinstance(node, Word) else "" for node in nodes]
        declared = {word for before, word in zip(["", *words], words, strict=False) if "-" not in (before, word)}
        pairs = [(word, parent) for word, parent in self.typed(nodes, declared) if word.text != OBJECT]
        types = {word.text: parent for word, parent in pairs}
        for word, parent in pairs:
            above = parent
            for _ in range(len(types)):
                above = types.get(above, OBJECT)
            if above != OBJECT:
                self.refuse(f"type {word.text!r} is above itself, expected a tree of types", word.at)
        return types

    def _predicates(self, nodes: Iterable[Node], types: Mapping[str, str]) -> dict[str, tuple[Parameter, ...]]:
        groups = [self.group(node, "a predicate in brackets") for node in nodes]
        for group in groups:
            if not group.items:
                self.refuse("empty brackets, expected (PREDICATE ?PARAMETER ...)", group.at)
        self.once([self.name(group.items[0]) for group in groups])
        return {self.name(group.items[0]).text: self._parameters(group.items[1:], types) for group in groups}

    def _parameters(self, nodes: Iterable[Node], types: Mapping[str, str]) -> tuple[Parameter, ...]:
        return tuple(Parameter(word.text, type_) for word, type_ in self.typed(nodes, types, is_variable=True))

    def _action(self, group: Group, domain: Domain) -> ActionSchema:
        if len(group.items) < 2:
            self.refuse("an action without a name, expected (:action NAME ...)", group.at)
        name = self.name(group.items[1])
        if ("action", name.text) in self.places:
            self.refuse(f"action {name.text!r} is declared twice, expected once", name.at)
        self.places["action", name.text] = name.at
        parts: dict[str, Node] = {}
        keys = group.items[2::2]
        for key, value in zip(map(self.word, keys), group.items[3::2], strict=False):
            if key.text not in _ACTION_KEYS or key.text in parts:
                self.refuse(f"{key.text!r} in an action, expected each of {', '.join(_ACTION_KEYS)} once", key.at)
            parts[key.text] = value
        if len(keys) != len(parts):
            self.refuse(f"nothing follows in action {name.text!r}, expected a condition", keys[-1].at)
        for key in (":parameters", ":effect"):
            if key not in parts:
                self.refuse(f"action {name.text!r} has no {key!r}, expected one", name.at)
        parameters = self._parameters(self.group(parts[":parameters"], "parameters in brackets").items, domain.types)
        terms = {**domain.constants, **{parameter.name: parameter.type for parameter in parameters}}
        what = f"the precondition of {name.text!r}"
        preconditions = self.positive(parts.get(":precondition", Group((), name.at)), domain, terms, what)
        effects = self.literals(parts[":effect"], domain, terms)
        adds = dict.fromkeys(fact for fact, is_positive, _ in effects if is_positive)
        deletes = dict.fromkeys(fact for fact, is_positive, _ in effects if not is_positive)
        return ActionSchema(name.text, parameters, preconditions, tuple(adds), tuple(deletes))


class _ProblemReader(_Reader):
    SECTIONS = (":domain", ":requirements", ":objects", ":init", ":goal")

    def __init__(self, file: str, domain: Domain) -> None:
        super().__init__(file)
        self.domain = domain

    def read(self, text: str) -> Problem:
        name, groups = self.define(text, "problem")
        found = {key.text: group for key, group in self.sections(groups, self.SECTIONS)}
        for key in (":domain", ":init", ":goal"):
            if key not in found:
                self.refuse(f"no section {key!r}, expected one", name.at)
        self._same_domain(found[":domain"])
        objects: dict[str, str] = {}
        for word, type_ in self.typed(found[":objects"].items[1:] if ":objects" in found else (), self.domain.types):
            if word.text in self.domain.constants:
                self.refuse(f"{word.text!r} is a constant of the domain already, expected another name", word.at)
            objects[word.text] = type_
            self.places[word.text] = word.at
        terms = {**self.domain.constants, **objects}
        init = self._init(found[":init"], terms)
        goal = self._goal(found[":goal"], terms)
        self._check_size(terms, name.at)
        return Problem(name.text, self.domain.name, objects, init, goal, self.places)

    def _same_domain(self, group: Group) -> None:
        if len(group.items) != 2:
            self.refuse("expected (:domain NAME)", group.at)
        given = self.name(group.items[1])
        if given.text != self.domain.name:
            self.refuse(f"problem for domain {given.text!r}, expected {self.domain.name!r}", given.at)

    def _init(self, group: Group, terms: Mapping[str, str]) -> frozenset[Fact]:
        facts: set[Fact] = set()
        for item in group.items[1:]:
            part = self.group(item, "a fact in brackets")
            fact, is_positive, at = self._literal(part, self.domain, terms)
            if not is_positive:
                self.refuse(f"(not {fact.pddl}) in ':init', expected only what holds", at)
            facts.add(fact)
            self.places[fact] = at
        return frozenset(facts)

    def _goal(self, group: Group, terms: Mapping[str, str]) -> frozenset[Fact]:
        if len(group.items) != 2:
            self.refuse("expected (:goal CONDITION)", group.at)
        return frozenset(self.positive(group.items[1], self.domain, terms, "the goal"))

    def _check_size(self, terms: Mapping[str, str], at: Position) -> None:
        for action in self.domain.actions:
            counts = [sum(self.domain.is_kind(t, p.type) for t in terms.values()) for p in action.parameters]
            if math.prod(counts) > MAX_INSTANCES:
                many = f"action {action.name!r} has {math.prod(counts)} instances with these objects"
                self.refuse(f"{many}, expected at most {MAX_INSTANCES}", at)
