from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from planner.motion.collision import FastChecker
from planner.motion.exact import ExactChecker
from planner.motion.ik import ClosedFormIK
from planner.motion.ompl_ import PLANNERS, PathSettings, Query, path_length, plan_path
from planner.motion.shortcut import CUTS, GOOD, shortened


@pytest.fixture(scope="module")
def limits(robot) -> np.ndarray:
    return np.stack([robot.q_min, robot.q_max])


@pytest.fixture
def checker(robot, scene) -> FastChecker:
    return FastChecker(robot, scene)


@pytest.fixture(scope="module")
def query(robot, scene, down, limits) -> Query:
    """From deep in one bin to deep in the other."""
    ik, checker = ClosedFormIK(robot), FastChecker(robot, scene)
    left, right = (next(q for q in ik.ik(down(0.05, y, -0.08)) if checker.is_free(q)) for y in (0.62, -0.62))
    return Query(left, [right], limits, seed=5, max_checks=12000)


def _is_free(path: np.ndarray, robot, scene) -> bool:
    exact = ExactChecker(robot, scene)
    return all(exact.edge_is_free(a, b) for a, b in pairwise(path))


def test_the_ways_between_the_bins_are_not_straight(checker, query):
    assert checker.is_free(query.start)
    assert checker.is_free(query.goals[0])
    assert not checker.edge_is_free(query.start, query.goals[0])


@pytest.mark.parametrize("name", PLANNERS)
def test_every_planner_finds_a_free_path_and_the_same_one_again(name, robot, scene, query):
    settings = PathSettings(name)
    first, again = (plan_path(query, FastChecker(robot, scene), settings) for _ in range(2))
    assert first is not None
    assert again is not None
    assert np.array_equal(first, again)
    assert np.array_equal(first[0], query.start)
    assert np.array_equal(first[-1], query.goals[0])
    assert _is_free(first, robot, scene)


@pytest.mark.parametrize("name", PLANNERS)
def test_every_planner_s_path_leads_from_the_start_even_if_the_straight_way_is_free(name, checker, query):
    goal = query.start + np.array([0.0, -0.3, 0.0, 0.0, 0.0, 0.0, 0.4])
    assert checker.edge_is_free(query.start, goal)
    path = plan_path(replace(query, goals=[goal]), checker, PathSettings(name))
    assert path is not None
    assert np.array_equal(path[0], query.start)
    assert np.array_equal(path[-1], goal)


def test_another_seed_takes_another_path(checker, query):
    other = replace(query, seed=6)
    first, second = (plan_path(q, checker, PathSettings()) for q in (query, other))
    assert first is not None
    assert second is not None
    assert first.shape != second.shape or not np.allclose(first, second)


def test_any_of_several_goals_will_do(checker, query):
    far = query.goals[0]
    near = query.start + np.array([0.0, -0.2, 0.0, 0.0, 0.0, 0.0, 0.1])
    path = plan_path(replace(query, goals=[far, near]), checker, PathSettings())
    assert path is not None
    assert any(np.array_equal(path[-1], goal) for goal in (far, near))


def test_the_best_of_n_is_no_longer_than_the_first(robot, scene, query):
    first = plan_path(query, FastChecker(robot, scene), PathSettings("RRT", restarts=1))
    five = replace(query, max_checks=5 * query.max_checks)
    best = plan_path(five, FastChecker(robot, scene), PathSettings("best-of-n-RRT", restarts=5))
    assert first is not None
    assert best is not None
    assert path_length(best) <= path_length(first)


@pytest.mark.parametrize("name", PLANNERS)
def test_a_search_ends_with_its_budget_of_checks(name, checker, query):
    plan_path(replace(query, max_checks=60), checker, PathSettings(name))
    # The last edge of each restart may run over.
    assert checker.checks < 60 + 3 * 250


@pytest.mark.parametrize("seed", range(5))
def test_shortcuts_keep_ends_and_freedom_and_make_the_path_shorter(robot, scene, checker, query, seed):
    path = plan_path(replace(query, seed=seed), checker, PathSettings("RRT"))
    assert path is not None
    short = shortened(path, checker)
    assert np.array_equal(short[0], path[0])
    assert np.array_equal(short[-1], path[-1])
    assert path_length(short) < path_length(path)
    assert _is_free(short, robot, scene)


def test_corners_are_cut_until_the_path_is_hardly_longer_than_the_straight_way(checker, query):
    straight = path_length(np.stack([query.start, query.goals[0]]))
    paths = [plan_path(replace(query, seed=seed), checker, PathSettings()) for seed in range(12)]
    short = [path_length(shortened(path, checker)) / straight for path in paths]
    assert sorted(short)[-3] <= GOOD
    spent = checker.checks
    shortened(paths[0], checker)
    few, spent = checker.checks - spent, checker.checks
    shortened(paths[0], checker, np.tile(CUTS, (4, 1)))
    assert checker.checks - spent == few


def test_the_exact_model_s_path_is_left_its_corners_but_no_detour(robot, scene):
    exact, start = ExactChecker(robot, scene), scene.q
    there = start + np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    short = shortened(np.stack([start, there, start, there]), exact)
    assert np.array_equal(short, np.stack([start, there]))


def test_a_hopeless_search_is_not_begun_again(checker, query):
    asked = []
    settings = PathSettings("RRT", restarts=3)

    def is_hopeless() -> bool:
        asked.append(checker.checks)
        return True

    assert plan_path(replace(query, max_checks=90), checker, settings, is_hopeless) is None
    assert len(asked) == 1
    assert checker.checks == asked[0]


def test_an_unknown_planner_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match="'RRTX', known: RRTConnect"):
        PathSettings("RRTX")


def test_no_restarts_at_all_are_refused():
    with pytest.raises(ValueError, match="at least 1"):
        PathSettings(restarts=0)
