"""The compiled heuristics: laws that hold whatever the task."""

import math
from types import SimpleNamespace

from hypothesis import given, settings
from hypothesis import strategies as st
from pyperplan.heuristics.relaxation import hMaxHeuristic
from pyperplan.task import Operator, Task

from planner.task.relaxed import RelaxedHeuristic

FACTS = 7
some = st.frozensets(st.integers(0, FACTS - 1), max_size=3)


@st.composite
def tasks(draw):
    """A task over a few facts; operators may need nothing or add nothing."""
    effects = draw(st.lists(st.tuples(some, some, some), max_size=8))
    operators = [Operator(f"op{i}", needs, adds, deletes - adds) for i, (needs, adds, deletes) in enumerate(effects)]
    return Task("t", frozenset(range(FACTS)), draw(some), draw(some), operators)


def value(heuristic, state):
    return heuristic(SimpleNamespace(state=state))


def distance(task, relaxed):
    """Length of the shortest plan, of all or with nothing ever deleted; infinite if there is none."""
    level, seen, length = {task.initial_state}, {task.initial_state}, 0
    while level:
        if any(task.goals <= state for state in level):
            return length
        after = {
            (state if relaxed else state - op.del_effects) | op.add_effects
            for state in level
            for op in task.operators
            if op.preconditions <= state
        }
        level = after - seen
        seen |= after
        length += 1
    return math.inf


@settings(max_examples=200, derandomize=True, deadline=None)
@given(tasks())
def test_h_max_is_what_pyperplan_says(task):
    assert value(RelaxedHeuristic(task, is_max=True), task.initial_state) == value(
        hMaxHeuristic(task), task.initial_state
    )


@settings(max_examples=200, derandomize=True, deadline=None)
@given(tasks())
def test_h_ff_is_the_length_of_a_relaxed_plan(task):
    estimate = value(RelaxedHeuristic(task, is_max=False), task.initial_state)
    shortest = distance(task, relaxed=True)
    assert math.isinf(estimate) == math.isinf(shortest)
    assert estimate >= shortest
    assert (estimate == 0) == (task.goals <= task.initial_state)
    if math.isfinite(estimate):
        assert estimate <= len(task.operators)


@settings(max_examples=100, derandomize=True, deadline=None)
@given(tasks())
def test_no_estimate_calls_a_solvable_state_hopeless(task):
    if math.isfinite(distance(task, relaxed=False)):
        for is_max in (True, False):
            assert math.isfinite(value(RelaxedHeuristic(task, is_max), task.initial_state))
