"""Reading PDDL: what is refused, where and how; and that writing and reading are inverse."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import skills
from planner.task.pddl import OBJECT, ActionSchema, Domain, Parameter, Problem, write_domain, write_problem
from planner.task.pddl_reader import read_domain, read_problem, read_text
from planner.task.sexpr import PddlError
from planner.task.symbols import Fact

DOMAIN = """(define (domain d)
  (:requirements :strips :typing)
  (:types block place - object small - block)
  (:constants shelf - place)
  (:predicates (on ?b - block ?p - place) (free))
  (:action move
    :parameters (?b - small ?p - place)
    :precondition (and (free) (on ?b shelf))
    :effect (and (on ?b ?p) (not (on ?b shelf)))))
"""
PROBLEM = """(define (problem p)
  (:domain d)
  (:objects a b - small c - block)
  (:init (free) (on a shelf))
  (:goal (and (on a shelf))))
"""


def test_a_domain_is_read():
    domain = read_domain(DOMAIN)
    assert domain.types == {"block": "object", "place": "object", "small": "block"}
    assert domain.constants == {"shelf": "place"}
    assert domain.predicates["on"] == (Parameter("?b", "block"), Parameter("?p", "place"))
    (move,) = domain.actions
    assert move.preconditions == (Fact("free"), Fact("on", ("?b", "shelf")))
    assert (move.adds, move.deletes) == ((Fact("on", ("?b", "?p")),), (Fact("on", ("?b", "shelf")),))
    assert domain.is_kind("small", "block")
    assert domain.is_kind("small", OBJECT)
    assert not domain.is_kind("block", "small")


def test_a_problem_is_read():
    problem = read_problem(PROBLEM, read_domain(DOMAIN))
    assert problem.objects == {"a": "small", "b": "small", "c": "block"}
    assert problem.init == {Fact("free"), Fact("on", ("a", "shelf"))}
    assert problem.goal == {Fact("on", ("a", "shelf"))}


NO_NAME = "is no name, expected a letter, then letters, digits, '_' or '-'"


def points_at(error, text):
    """What stands in the text where the error says."""
    return text.splitlines()[error.line - 1][error.column - 1 :]


@pytest.mark.parametrize(
    ("old", "new", "where", "message"),
    [
        ("(domain d)", "(domain 3d)", "3d)", f"'3d' {NO_NAME}"),
        ("(domain d)", "(domain dä)", "dä)", f"'dä' {NO_NAME}"),
        ("(domain d)", "(problem d)", "(problem", "expected '(domain NAME)' after 'define'"),
        (":typing", ":equality", ":equality", "requirement ':equality' is not supported, expected :strips or :typing"),
        (":typing", ":adl", ":adl", "requirement ':adl' is not supported, expected :strips or :typing"),
        (
            "small - block",
            "small - brick",
            "brick",
            "unknown type 'brick', did you mean 'block'? expected one of block",
        ),
        ("small - block", "small - small", "small - small", "type 'small' is above itself, expected a tree of types"),
        ("small - block", "s - (either block place)", "(either", "'(either ...)' is not supported, expected one type"),
        ("small - block", "small block", "block)", "'block' is declared twice, expected once"),
        ("small - block", "- block", "- block)", "'-' without names before it and a type after it, expected 'NAME"),
        ("shelf - place", "shelf - plaice", "plaice", "unknown type 'plaice', did you mean 'place'? expected one of"),
        ("(free))\n", "(free) (free))\n", "free))", "'free' is declared twice, expected once"),
        ("?b - block ?p", "?b - block p", "p - place", "'p' is no variable, expected '?' and a name"),
        ("(and (free)", "(and (fre)", "fre)", "unknown predicate 'fre', did you mean 'free'? expected one of free, on"),
        ("(and (free)", "(and (free ?b)", "free ?b", "predicate 'free' has 1 arguments, expected 0"),
        ("(and (free)", "(and (not (free))", "(not", "(not (free)) in the precondition of 'move', expected positive"),
        ("(and (free)", "(and (= ?b ?p)", "= ?b", "'=' is not supported, expected a conjunction of literals"),
        ("(and (free)", "(or (free)", "or (", "'or' is not supported, expected a conjunction of literals"),
        ("(and (free)", "(and (and (free))", "and (free)", "'and' inside a conjunction, expected a literal"),
        ("(and (free)", "(and free", "free", "'free' stands alone, expected a literal in brackets"),
        ("(and (free)", "(and ()", "()", "empty brackets, expected a literal"),
        ("(on ?b shelf))\n", "(on ?c shelf))\n", "?c", "unknown variable '?c', expected one of ?b, ?p, shelf"),
        ("(on ?b shelf))\n", "(on ?b desk))\n", "desk", "unknown object 'desk', expected one of ?b, ?p, shelf"),
        ("(on ?b shelf))\n", "(on ?p shelf))\n", "?p", "'?p' in 'on' has type 'place', expected 'block'"),
        ("(on ?b ?p)", "(when (free) (on ?b ?p))", "when", "'when' is not supported, expected a conjunction of"),
        ("(on ?b ?p)", "(not (not (on ?b ?p)))", "(not (on", "'not' inside 'not', expected a literal"),
        (":precondition", ":condition", ":cond", "':condition' in an action, expected each of :parameters, :precond"),
        (":parameters (?b - small ?p - place)", "", "move", "action 'move' has no ':parameters', expected one"),
        ("?b - small ?p - place", "?b - small ?b - place", "?b - place", "'?b' is declared twice, expected once"),
        ("(:action move", "(:derived move", ":derived", "section ':derived' is not supported, expected one of :requ"),
        ("(:constants", "(:types", ":types shelf", "section ':types' stands here a second time, expected once"),
    ],
)
def test_a_domain_with_a_fault_is_refused_with_its_place(old, new, where, message):
    assert DOMAIN.count(old) == 1
    text = DOMAIN.replace(old, new)
    with pytest.raises(PddlError) as error:
        read_domain(text, "d.pddl")
    assert error.value.message.startswith(message)
    assert points_at(error.value, text).startswith(where)
    assert str(error.value) == f"d.pddl:{error.value.line}:{error.value.column}: {error.value.message}"


def test_an_action_may_be_declared_once_only():
    action = DOMAIN[DOMAIN.index("(:action") : -2]
    with pytest.raises(PddlError, match=r"^d:10:10: action 'move' is declared twice, expected once$"):
        read_domain(DOMAIN[:-2] + "\n" + action + ")", "d")


def test_a_domain_without_predicates_is_refused():
    with pytest.raises(PddlError, match=r"d:1:17: no predicates, expected a section \(:predicates \.\.\.\)"):
        read_domain("(define (domain d))", "d")


@pytest.mark.parametrize(
    ("old", "new", "where", "message"),
    [
        ("(:domain d)", "(:domain e)", "e)", "problem for domain 'e', expected 'd'"),
        ("c - block", "shelf - block", "shelf", "'shelf' is a constant of the domain already, expected another name"),
        ("c - block", "a - block", "a - block", "'a' is declared twice, expected once"),
        (
            "c - block",
            "c - brick",
            "brick",
            "unknown type 'brick', did you mean 'block'? expected one of block, object",
        ),
        ("(:init (free)", "(:init (fee)", "fee", "unknown predicate 'fee', did you mean 'free'? expected one of free"),
        ("(:init (free)", "(:init (on a)", "on a)", "predicate 'on' has 1 arguments, expected 2"),
        ("(:init (free)", "(:init (not (free))", "(not", "(not (free)) in ':init', expected only what holds"),
        ("(:init (free)", "(:init (= a b)", "= a", "'=' is not supported, expected a conjunction of literals"),
        ("(on a shelf))))\n", "(on d shelf))))\n", "d shelf", "unknown object 'd', expected one of a, b, c, shelf"),
        ("(and (on a shelf))", "(not (free))", "(not", "(not (free)) in the goal, expected positive literals only"),
        ("(and (on a shelf))", "(on shelf a)", "shelf a", "'shelf' in 'on' has type 'place', expected 'block'"),
        ("(:goal (and (on a shelf)))", "(:metric minimize)", ":metric", "section ':metric' is not supported, expected"),
        ("(:goal (and (on a shelf)))", "", "p)", "no section ':goal', expected one"),
    ],
)
def test_a_problem_with_a_fault_is_refused_with_its_place(old, new, where, message):
    assert PROBLEM.count(old) == 1
    text = PROBLEM.replace(old, new)
    with pytest.raises(PddlError) as error:
        read_problem(text, read_domain(DOMAIN), "p.pddl")
    assert error.value.message.startswith(message)
    assert points_at(error.value, text).startswith(where)


def test_a_problem_too_large_to_ground_is_refused():
    names = " ".join(f"n{i}" for i in range(60))
    text = DOMAIN.replace("(?b - small ?p - place)", "(?b ?c ?d ?e - small ?p - place)")
    problem = PROBLEM.replace("a b - small", f"a b {names} - small")
    with pytest.raises(PddlError, match="'move' has 14776336 instances with these objects, expected at most 200000"):
        read_problem(problem, read_domain(text))


@pytest.mark.parametrize(
    ("content", "message"), [(b"\xff\x00\x80", "byte 0 is not UTF-8"), (None, "can't be read (No such file")]
)
def test_a_file_that_is_no_text_is_refused(tmp_path, content, message):
    path = tmp_path / "x.pddl"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(PddlError) as error:
        read_text(path)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_the_catalogue_survives_writing_and_reading():
    domain = read_domain(read_text(Path(skills.__file__).parent / "domain.pddl"))
    assert read_domain(write_domain(domain)) == domain


NAMES = st.from_regex(r"[a-z][a-z0-9_-]{0,6}", fullmatch=True).filter(
    lambda name: name not in {"and", "or", "not", "when", "either", "define", "imply", "exists", "forall", "object"}
)


@st.composite
def domains(draw):
    types: dict[str, str] = {}
    for name in draw(st.lists(NAMES, unique=True, max_size=4)):
        types[name] = draw(st.sampled_from([OBJECT, *types]))
    kinds = [OBJECT, *types]

    def parameters(count):
        return tuple(Parameter(f"?x{i}", draw(st.sampled_from(kinds))) for i in range(count))

    names = draw(st.lists(NAMES, unique=True, min_size=1, max_size=4))
    predicates = {name: parameters(draw(st.integers(0, 3))) for name in names}
    constants = {name: draw(st.sampled_from(kinds)) for name in draw(st.lists(NAMES, unique=True, max_size=3))}
    frame = Domain("d", types, constants, predicates, ())
    actions = []
    for name in draw(st.lists(NAMES, unique=True, max_size=3)):
        own = parameters(draw(st.integers(0, 3)))
        terms = {**constants, **{p.name: p.type for p in own}}
        literals = [
            draw(st.lists(st.sampled_from(pool), unique=True, max_size=3)) if pool else []
            for pool in [statable(frame, terms)] * 3
        ]
        actions.append(ActionSchema(name, own, *(tuple(part) for part in literals)))
    return Domain("d", types, constants, predicates, tuple(actions))


def statable(domain, terms):
    """Some literals that fit the types of the terms."""
    found = []
    for name, parameters in domain.predicates.items():
        args = [next((t for t in terms if domain.is_kind(terms[t], p.type)), None) for p in parameters]
        if None not in args:
            found.append(Fact(name, tuple(args)))
    return found


@settings(max_examples=40, derandomize=True, deadline=None)
@given(domains(), st.data())
def test_writing_and_reading_are_inverse(domain, data):
    assert read_domain(write_domain(domain)) == domain
    kinds = [OBJECT, *domain.types]
    names = [name for name in data.draw(st.lists(NAMES, unique=True, max_size=5)) if name not in domain.constants]
    objects = {name: data.draw(st.sampled_from(kinds)) for name in names}
    literals = statable(domain, {**domain.constants, **objects})
    chosen = [frozenset(data.draw(st.lists(st.sampled_from(literals))) if literals else []) for _ in range(2)]
    problem = Problem("p", "d", objects, *chosen)
    assert read_problem(write_problem(problem), domain) == problem
