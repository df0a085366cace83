"""Where a plan goes on when a step has brought about more than was planned of it."""

from planner.task.symbols import Fact, GroundAction, Step, TaskPlan, resume_at

CRUMBS = ("a", "b", "c")
ON = {name: Fact("in_bin", (name, "table")) for name in CRUMBS}
IN = {name: Fact("in_bin", (name, "pan")) for name in CRUMBS}
HOLDING = Fact("holding", ("sponge",))


def wipe(name: str) -> Step:
    action = GroundAction("wipe", (name, "table", "pan"))
    return Step(action, frozenset({ON[name], HOLDING}), frozenset({IN[name]}), frozenset({ON[name]}))


PLAN = TaskPlan(tuple(wipe(name) for name in CRUMBS), frozenset(IN.values()))


def test_a_step_whose_effect_is_there_already_is_passed_over():
    assert resume_at(PLAN, frozenset({HOLDING, ON["a"], IN["b"], ON["c"]})) == 0
    assert resume_at(PLAN, frozenset({HOLDING, IN["a"], IN["b"], ON["c"]})) == 2


def test_the_step_at_which_a_plan_goes_on_is_one_that_can_be_done():
    k = resume_at(PLAN, frozenset({HOLDING, IN["a"], ON["b"], IN["c"]}))
    assert k == 1


def test_a_step_that_can_neither_be_done_nor_is_done_ends_the_plan():
    assert resume_at(PLAN, frozenset({HOLDING, ON["a"], ON["c"]})) is None
    assert resume_at(PLAN, frozenset({ON["a"], IN["b"], IN["c"]})) is None
