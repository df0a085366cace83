"""`bench motion`: its queries, and what it says of them."""

from dataclasses import replace
from io import StringIO
from itertools import pairwise

import numpy as np
import pytest
from rich.console import Console

from bt_tamp.bench.compiled_rrt import plan_compiled
from bt_tamp.bench.hopeless import lowered, walled
from bt_tamp.bench.motion import (
    INSTALL,
    Job,
    QueryResult,
    Refusal,
    SceneResult,
    acceptance,
    answer,
    planned,
    print_results,
    rows,
)
from bt_tamp.bench.motion_queries import table_query
from bt_tamp.bench.motion_trials import Arena, Move, Trial, best_length, by_pybullet, compiled, move, search, watched
from bt_tamp.bench.plots import plot_planners
from planner.failure import MotionFailure
from planner.motion.collision import FastChecker
from planner.motion.exact import ExactChecker
from planner.motion.motion_planner import MotionPlanner
from planner.motion.ompl_ import PathSettings, path_length, plan_path


@pytest.fixture(scope="module")
def query():
    return table_query(5)


@pytest.fixture(scope="module")
def arena(query) -> Arena:
    return Arena(query)


def _result(name: str = "a", **changes) -> QueryResult:
    one = Trial("RRT", 0.010, 0.001, 4.0, 3.0)
    both = Trial("RRTConnect", 0.001, 0.001, 5.0, 3.3)
    return replace(
        QueryResult(
            name,
            is_straight=False,
            trials=(one, both),
            compiled=(Trial("compiled", 0.0005, 0.0, 4.0, 3.1),),
            pybullet=(Trial("pybullet-planning", 1.0, 0.0, 3.5, 3.5),),
            moves=(Move(0.0015, 0.005, 3.2, True),),
            best=2.9,
        ),
        **changes,
    )


def _scene(*queries: QueryResult, refusals: tuple[Refusal, ...] = ()) -> list[SceneResult]:
    return [SceneResult("somewhere", queries, refusals)]


def _said(results: list[SceneResult]) -> str:
    console = Console(file=StringIO(), width=160)
    print_results(console, results)
    return console.file.getvalue()


def _reached(results: list[SceneResult]) -> dict[str, bool]:
    return {check.figure: check.reached for check in acceptance(results)}


def test_a_random_query_begins_and_ends_free_and_is_the_same_every_time(query, arena):
    assert arena.is_solvable()
    again = table_query(5)
    assert again is not None
    assert np.array_equal(again.goal, query.goal)
    assert np.array_equal(again.scene.q, query.scene.q)
    assert not np.allclose(query.goal, query.scene.q)


def test_the_full_run_has_thirty_tables_and_twenty_seeds_and_the_quick_one_fewer():
    full, quick = planned(False), planned(True)
    assert sum(job.table is not None for job in full) == 30
    assert {job.seeds for job in full} == {20}
    assert full[0] == Job(None, 20, 2, 30.0)
    assert len(quick) < len(full)
    assert max(job.seeds for job in quick) < 20


def test_a_search_tells_its_path_before_and_after_shortcutting(arena):
    trial = search(arena, "RRTConnect", 0)
    assert trial.is_found
    assert trial.short <= trial.length
    assert trial.length >= np.linalg.norm(arena.query.goal - arena.scene.q) - 1e-9
    assert replace(search(arena, "RRTConnect", 0), found_s=0, short_s=0) == replace(trial, found_s=0, short_s=0)


def test_the_compiled_planner_s_paths_are_free_and_lead_to_the_goal(arena):
    checker = arena.checker()
    for seed in range(5):
        path = plan_compiled(checker, arena.question(seed), 0.8)
        assert path is not None
        for polyline in (path.found, path.short):
            assert np.array_equal(polyline[0], arena.scene.q)
            assert np.array_equal(polyline[-1], arena.query.goal)
            assert all(checker.edge_is_free(a, b) for a, b in pairwise(polyline))
        assert path_length(path.short) <= path_length(path.found) + 1e-9
    assert compiled(arena, 0).is_found


def test_a_move_is_planned_timed_and_audited(arena):
    done = move(arena, 0)
    assert done.is_free
    assert done.length >= np.linalg.norm(arena.query.goal - arena.scene.q) - 1e-3
    assert done.way_s > 0.0
    assert done.move_s > 0.0


def test_longer_searching_finds_no_longer_path(arena):
    settings = PathSettings("AORRTC", restarts=1)
    paths = [plan_path(arena.question(0, checks), arena.checker(), settings) for checks in (2_000, 8_000, 32_000)]
    lengths = [path_length(path) for path in paths if path is not None]
    assert len(lengths) == 3
    assert lengths == sorted(lengths, reverse=True)
    assert lengths[-1] >= np.linalg.norm(arena.query.goal - arena.scene.q) - 1e-9


def test_where_the_straight_edge_is_free_nothing_is_shorter(query):
    near = Arena(replace(query, goal=query.scene.q + 0.01))
    assert near.is_straight()
    assert best_length(near, 0.0) == pytest.approx(0.01 * np.sqrt(7))


def test_a_lowered_goal_collides_and_a_walled_one_is_free_but_out_of_reach(arena):
    motion, query = MotionPlanner(arena.robot), table_query(0)
    assert query is not None
    low, behind = lowered(motion, query), walled(motion, query)
    assert low is not None
    assert behind is not None
    assert not motion.free(low.query.scene, low.query.goal)
    assert motion.free(behind.query.scene, behind.query.goal)
    failures = [motion.move(hopeless.query.scene, [hopeless.query.goal]) for hopeless in (low, behind)]
    assert all(isinstance(failure, MotionFailure) for failure in failures)
    assert "the goal is in collision" in failures[0].reason
    assert "the goal is walled in by" in failures[1].reason
    assert "wall_0" in failures[1].reason
    assert not failures[1].culprits


def test_pybullet_planning_looks_at_the_same_pairs_and_finds_a_way(arena):
    pytest.importorskip("pybullet_planning")
    from sim.pybullet_planning_ import PybulletPlanning

    engine = PybulletPlanning(arena.scene, arena.robot, watched(arena), 0.05)
    rng = np.random.default_rng(0)
    near = arena.scene.q + rng.normal(size=(300, 7)) * 0.25
    near = near[np.all((near > arena.robot.q_min) & (near < arena.robot.q_max), axis=1)]
    exact = ExactChecker(arena.robot, arena.scene, arena.margins)
    try:
        verdicts = [(engine.collides(q), not exact.is_free(q)) for q in near]
    finally:
        engine.close()
    assert 0.1 < np.mean([ours for _, ours in verdicts]) < 0.9
    assert np.mean([theirs == ours for theirs, ours in verdicts]) > 0.97
    (trial,) = by_pybullet(arena, range(1))
    assert trial.is_found


def test_the_paper_s_question_is_answered_with_ratios_of_bidirectional_to_one_way():
    text = answer([_result(), _result("b", is_straight=True)])
    assert "yes: 1.25 times as long as found, 1.10 times after shortcutting, in 0.10 times the CPU time" in text
    assert "1 queries" in text
    assert "no query" in answer([_result(is_straight=True)])


def test_lengths_are_told_by_the_shortest_path_known():
    by_name = {row.planner: row for row in rows([_result()])}
    assert by_name["RRT"].length == pytest.approx(4.0 / 2.9)
    assert by_name["pybullet-planning"].median_ms == pytest.approx(1000.0)
    missed = replace(_result().trials[0], length=float("nan"), short=float("nan"))
    assert {row.planner: row for row in rows([_result(trials=(missed,))])}["RRT"].solved == 0.0


def test_every_figure_is_reached_by_good_results_and_missed_by_bad_ones():
    refused = Refusal("a", "walled in", 0.03, "no path", True)
    assert all(_reached(_scene(_result(), refusals=(refused,))).values())
    for changes, figure in (
        ({"moves": (Move(0.003, 0.005, 3.2, True),)}, "feasibility query, median"),
        ({"moves": (Move(0.0015, 0.005, 3.4, True),)}, "executed path beside the best of AORRTC's"),
        ({"moves": (Move(0.0015, 0.005, 3.2, False),)}, "executed motions that pass the exact audit"),
        ({"pybullet": (Trial("pybullet-planning", 0.3, 0.0, 3.5, 3.5),)}, "faster than pybullet-planning, median"),
    ):
        assert not _reached(_scene(_result(**changes)))[figure], figure
    late = _reached(_scene(_result(), refusals=(replace(refused, seconds=0.06),)))
    assert not late["hopeless queries, until refused"]
    solved = _reached(_scene(_result(), refusals=(replace(refused, is_refused=False),)))
    assert not solved["hopeless queries refused"]


def test_without_the_package_the_bench_says_so_in_a_line_and_goes_on():
    results = _scene(_result(pybullet=None))
    assert INSTALL in _said(results)
    assert INSTALL not in _said(_scene(_result()))
    assert not _reached(results)["faster than pybullet-planning, median"]


def test_planners_are_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    (made,) = plot_planners(tmp_path, _scene(_result()))
    assert made.name == "motion.png"
    assert made.stat().st_size > 5000


def test_the_fast_model_stands_for_all_planners(arena):
    assert isinstance(arena.checker(), FastChecker)
    assert arena.checker().is_free(arena.query.goal)
