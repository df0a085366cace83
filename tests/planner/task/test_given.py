"""Hand-written PDDL: what fits the primitives and the scene, and what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest
from pinocchio import SE3

import skills
from planner.task.given import read_given
from planner.task.learned import Learned
from planner.task.pddl_reader import read_domain, read_text
from planner.task.primitives import arities, ground
from planner.task.sexpr import PddlError
from planner.task.symbols import Fact, GroundAction

CATALOGUE = Path(skills.__file__).parent / "domain.pddl"
PRIMITIVES = arities(read_domain(read_text(CATALOGUE)))

DOMAIN = """(define (domain own)
  (:types thing spot - object)
  (:predicates (in_bin ?x - thing ?y - spot) (hand_empty) (holding ?x - thing) (graspable ?x - thing) (mine ?x - thing))
  (:action pick--mine
    :parameters (?x - thing ?y - spot ?owner - thing)
    :precondition (and (in_bin ?x ?y) (mine ?owner) (hand_empty) (graspable ?x))
    :effect (and (holding ?x) (not (in_bin ?x ?y)) (not (hand_empty)))))
"""
PROBLEM = """(define (problem own)
  (:domain own)
  (:objects cup mug - thing table - spot)
  (:init (in_bin cup table) (hand_empty) (graspable mug) (mine mug))
  (:goal (holding cup)))
"""


def test_the_catalogue_defines_how_many_arguments_a_primitive_has():
    assert PRIMITIVES == {"pick": 2, "place": 2, "wipe": 3, "drag": 2, "drag_aside": 2}


@pytest.fixture
def files(tmp_path):
    def write(domain=DOMAIN, problem=PROBLEM):
        paths = tmp_path / "d.pddl", tmp_path / "p.pddl"
        for path, text in zip(paths, (domain, problem), strict=True):
            path.write_text(text)
        return paths

    return write


def test_further_parameters_of_a_hand_written_action_are_not_shown(files, tabletop):
    domain, _ = read_given(*files(), PRIMITIVES, tabletop("cup mug"))
    step = ground(domain.actions[0], ("cup", "table", "mug"))
    assert step.action == GroundAction("pick", ("cup", "table"))
    assert Fact("mine", ("mug",)) in step.preconditions
    assert Fact("away", ("cup",)) in step.adds


def test_the_scene_decides_what_it_can_and_the_file_the_rest(files, tabletop):
    scene = tabletop("cup mug jug")
    domain, given = read_given(*files(), PRIMITIVES, scene)
    learned = Learned(domain)
    now = given.facts(domain, scene, learned)
    assert Fact("in_bin", ("mug", "table")) in now
    assert Fact("mine", ("mug",)) in now
    assert not any("jug" in fact.args for fact in now)


def test_what_the_file_does_not_call_graspable_is_so_once_it_lies_elsewhere(files, tabletop):
    scene = tabletop("cup mug")
    domain, given = read_given(*files(), PRIMITIVES, scene)
    graspable = Fact("graspable", ("cup",))
    assert graspable not in given.facts(domain, scene, Learned(domain))
    dragged = scene.moved("cup", SE3(np.eye(3), np.array([0.2, 0.2, 0.03])))
    assert graspable in given.facts(domain, dragged, Learned(domain))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("pick--mine", "grab", "d.pddl:4:12: action 'grab' is no primitive, expected one of drag, drag_aside, pick"),
        ("pick--mine", "wipe-dry", "action 'wipe-dry' is no primitive, did you mean 'wipe'? expected one of drag"),
        ("(mine ?x - thing)", "(mine ?x - thing) (a--b)", "predicate 'a--b': '--' is kept for learned ones, expected"),
        ("(mine ?x - thing)", "(mine ?x - thing) (away)", "predicate 'away' has 0 parameters, expected 1"),
    ],
)
def test_a_domain_that_does_not_fit_the_primitives_is_refused(files, tabletop, old, new, message):
    with pytest.raises(PddlError, match=re.escape(message)):
        read_given(*files(domain=DOMAIN.replace(old, new)), PRIMITIVES, tabletop("cup mug"))


def test_an_action_with_fewer_parameters_than_its_primitive_is_refused(files, tabletop):
    domain = DOMAIN[: DOMAIN.index("(:action")] + "(:action wipe :parameters (?x - thing ?y - spot) :effect ()))"
    with pytest.raises(PddlError, match=r"d.pddl:4:12: action 'wipe' has 2 parameters, expected at least 3"):
        read_given(*files(domain=domain), PRIMITIVES, tabletop("cup mug"))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mug - thing", "mug pot - thing", "p.pddl:3:21: object 'pot' isn't in the scene, expected one of crumb, cup"),
        ("(in_bin cup table)", "(holding cup)", "p.pddl:4:10: (holding cup) doesn't hold in the scene, expected it"),
        (
            "(in_bin cup table)",
            "(in_bin mug left_bin)",
            "p.pddl:4:10: (in_bin mug left_bin) doesn't hold in the scene, expected (in_bin mug table)",
        ),
    ],
)
def test_a_problem_that_contradicts_the_scene_is_refused(files, tabletop, old, new, message):
    problem = PROBLEM.replace(old, new).replace("table - spot", "table left_bin - spot")
    with pytest.raises(PddlError, match=re.escape(message)):
        read_given(*files(problem=problem), PRIMITIVES, tabletop("cup mug", "crumb"))


def test_a_missing_file_is_refused(files, tabletop, tmp_path):
    domain, _ = files()
    with pytest.raises(PddlError, match="can't be read"):
        read_given(domain, tmp_path / "none.pddl", PRIMITIVES, tabletop("cup mug"))
