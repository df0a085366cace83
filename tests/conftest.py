"""Every task plan that Pyperplan finds in a test is judged by a validator that isn't ours: unified-planning's. What
crashes in a test and is taken for a failure fails it."""

import itertools
import warnings
from collections import OrderedDict
from collections.abc import Iterable, Iterator
from typing import Any

import pytest

from planner import crash
from planner.task.pddl import OBJECT, Domain, Parameter, Problem
from planner.task.pddl_reader import read_domain, read_problem
from planner.task.primitives import ground, own_parameters, primitive
from planner.task.pyperplan_ import PyperplanPlanner
from planner.task.symbols import Fact, Step, TaskPlan


@pytest.fixture(autouse=True)
def _plans_are_valid(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever plan comes from Pyperplan in this test has to be valid."""
    solve = PyperplanPlanner.solve

    def validated(self: PyperplanPlanner, domain_text: str, problem_text: str, max_expansions: int) -> Any:
        found = solve(self, domain_text, problem_text, max_expansions)
        if isinstance(found, TaskPlan):
            assert_valid(domain_text, problem_text, found)
        return found

    monkeypatch.setattr(PyperplanPlanner, "solve", validated)


@pytest.fixture(autouse=True)
def _nothing_crashes_unseen(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """An error that planning takes for a failure is still an error, unless the test is about such."""
    crashes: list[Exception] = []
    place_of = crash.place_of

    def noticed(error: Exception) -> str:
        crashes.append(error)
        return place_of(error)

    monkeypatch.setattr(crash, "place_of", noticed)
    yield
    if crashes and request.node.get_closest_marker("crashes") is None:
        raise crashes[0]


def assert_valid(domain_text: str, problem_text: str, plan: TaskPlan) -> None:
    """Fails unless the plan is one for the problem that the texts state.

    Plans with a step that adds what it deletes are left out: PDDL lets the step add it, unified-planning refuses that.
    """
    from unified_planning.engines import SequentialPlanValidator, ValidationResultStatus
    from unified_planning.plans import ActionInstance, SequentialPlan

    if any(step.adds & step.deletes for step in plan.steps):
        return
    domain = read_domain(domain_text)
    problem = read_problem(problem_text, domain)
    task = restated(domain, problem)
    calls = []
    for step in plan.steps:
        name, args = _call(step, domain, [*domain.constants, *problem.objects])
        promoted = task.environment.expression_manager.auto_promote([task.object(arg) for arg in args])
        calls.append(ActionInstance(task.action(name), tuple(promoted)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        judged = SequentialPlanValidator().validate(task, SequentialPlan(calls))
    assert judged.status == ValidationResultStatus.VALID, f"{judged}: {', '.join(map(str, plan.actions))}"


def restated(domain: Domain, problem: Problem) -> Any:
    """The task in unified-planning's terms."""
    from unified_planning.shortcuts import And, Fluent, InstantaneousAction, Object, UserType, get_environment
    from unified_planning.shortcuts import Problem as Task

    get_environment().credits_stream = None
    get_environment().error_used_name = False  # A type and an object may have the same name.

    def kind(name: str) -> Any:
        return UserType(name, None if name == OBJECT else kind(domain.types[name]))

    def typed(parameters: Iterable[Parameter]) -> OrderedDict[str, Any]:
        return OrderedDict((parameter.name[1:], kind(parameter.type)) for parameter in parameters)

    def literal(fact: Fact, action: Any = None) -> Any:
        args = (action.parameter(arg[1:]) if arg[0] == "?" else task.object(arg) for arg in fact.args)
        return task.fluent(fact.predicate)(*args)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        task = Task(problem.name)
        for name, parameters in domain.predicates.items():
            task.add_fluent(Fluent(name, _signature=typed(parameters)), default_initial_value=False)
        task.add_objects(Object(name, kind(type_)) for name, type_ in {**domain.constants, **problem.objects}.items())
        for schema in domain.actions:
            action = InstantaneousAction(schema.name, typed(schema.parameters))
            action.add_precondition(And([literal(fact, action) for fact in schema.preconditions]))
            effects = {
                **dict.fromkeys(schema.adds, True),
                **dict.fromkeys([f for f in schema.deletes if f not in schema.adds], False),
            }
            for fact, is_added in effects.items():
                action.add_effect(literal(fact, action), is_added)
            task.add_action(action)
        for fact in problem.init:
            task.set_initial_value(literal(fact), True)
        task.add_goal(And([literal(fact) for fact in problem.goal]))
    return task


def _call(step: Step, domain: Domain, objects: list[str]) -> tuple[str, tuple[str, ...]]:
    """The schema and all its arguments, those included that the task planner binds alone."""
    for schema in domain.actions:
        if primitive(schema.name) == step.action.name:
            more = len(schema.parameters) - len(own_parameters(schema))
            for rest in itertools.product(objects, repeat=more):
                args = (*step.action.args, *rest)
                if len(args) == len(schema.parameters) and ground(schema, args) == step:
                    return schema.name, args
    raise AssertionError(f"no schema gives {step.action}")
