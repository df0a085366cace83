import json
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from bt_tamp.bench import control, force
from bt_tamp.bench.checks import Check, at_least, at_most, write_json
from bt_tamp.bench.control import PARTS, Cost
from bt_tamp.bench.plots import PLOTS
from bt_tamp.bench.scene import SPONGE, TABLE_TOP, Truth, believed, sponge_height, true_scene
from bt_tamp.bench.slide import Case, SlideResult, run_slide
from bt_tamp.bench.stopwatch import Stopwatch
from bt_tamp.bench.whole import whole_run
from bt_tamp.cli import main
from bt_tamp.commands.bench import BENCHES
from bt_tamp.options import RunOptions
from bt_tamp.report.recorder import RunRecorder
from scenarios.load import load_scenario

NAN = float("nan")


def slide(case="everything known", law="hybrid", target=10.0, **figures):
    fine = SlideResult(
        case, law, target, target, 0.001, target, 0.01, 0.0, 5e-4, 1e-4, 40.0, 0, 0, "done", [0.0], [target]
    )
    return replace(fine, **figures)


def verdicts(*slides):
    return {check.figure: check.reached for check in force.acceptance(slides)}


def test_good_slides_reach_every_figure():
    assert all(verdicts(slide(), slide("all together: a"), slide("all together: b", target=20.0)).values())


@pytest.mark.parametrize(
    ("bad", "figure"),
    [
        (slide(rms=0.2), "everything known, 5–20 N: RMS"),
        (slide(overshoot=0.2), "everything known, 5–20 N: overshoot"),
        (slide(path=2e-3), "everything known, 5–20 N: path error"),
        (slide("all together: a", mean=9.0), "all together, 10 and 20 N: mean off by"),
        (slide("all together: a", mean=NAN), "all together, 10 and 20 N: mean off by"),
        (slide("all together: a", rms=2.0), "all together, 10 and 20 N: RMS"),
        (slide("all together: a", airborne=0.002), "all together, 10 and 20 N: without contact"),
        (slide("all together: a", violations=1), "all together, 10 and 20 N: no limit passed"),
        (slide("all together: a", ended="contact lost"), "all together, 10 and 20 N: no limit passed"),
    ],
)
def test_each_figure_is_missed_by_one_bad_slide_alone(bad, figure):
    judged = verdicts(slide(), slide("all together: z"), bad)
    assert [name for name, reached in judged.items() if not reached] == [figure]


def test_other_laws_and_40_newtons_are_measured_but_not_judged():
    others = (slide(law="impedance, tuned", rms=5.0), slide(target=40.0, rms=20.0))
    assert all(verdicts(slide(), slide("all together: a"), *others).values())


def test_a_figure_nobody_measured_is_not_reached():
    assert not at_most("x", [], 1.0, "%").reached
    assert not at_most("x", [0.5, NAN], 1.0, "%").reached
    assert at_most("x", [0.5, 1.0], 1.0, "%").reached
    assert not at_least("x", [2.9, 4.0], 3.0, "times").reached


def test_every_disturbance_of_the_issue_is_there_alone_and_together():
    planned = list(force.cases((10.0,), False))
    assert len({case.name for case in planned}) == 1 + len(force.ALONE) + 8
    together = [case for case in planned if case.name.startswith(force.TOGETHER)]
    assert all(len(case.faults) == 4 for case in together)
    assert {case.truth.friction for case in together} == {0.7, 1.3}
    assert {case.truth.masses for case in together} == {0.8, 1.2}
    assert {case.truth.stiffness for case in together} == {0.2, 5.0}
    assert {case.truth.table_height for case in together} == {-0.005, 0.005}


def test_100_newtons_are_more_than_this_grip_bears():
    assert "can't be had" in force.about_100_newtons()


def test_the_true_table_is_higher_and_the_sponge_lies_on_it():
    scene = believed()
    true = true_scene(scene, Truth(table_height=0.005, friction=1.3, stiffness=5.0, masses=0.8))
    assert true.table.X_WT.translation[2] - scene.table.X_WT.translation[2] == pytest.approx(0.005)
    assert sponge_height(Truth(table_height=0.005)) == pytest.approx(0.005)
    body, known = true.bodies[SPONGE], scene.bodies[SPONGE]
    assert body.friction == pytest.approx(1.3 * known.friction)
    assert body.mass == pytest.approx(0.8 * known.mass)
    assert body.contact_stiffness == pytest.approx(5.0 * known.contact_stiffness)


def test_a_tilted_table_turns_about_the_middle_of_the_stroke_and_carries_the_sponge():
    tilt = np.radians(2.0)
    true = true_scene(believed(), Truth(tilt=tilt))
    normal = true.table.X_WT.rotation[:, 2]
    assert np.arccos(normal[2]) == pytest.approx(tilt)
    body = true.bodies[SPONGE]
    above = normal @ (body.X_WO.translation - [0.58, 0.0, TABLE_TOP])
    assert above == pytest.approx(body.shape.size[2] / 2)


@pytest.fixture(scope="module")
def by_hybrid():
    return run_slide(Case(force.KNOWN, "hybrid", 10.0))


def test_with_everything_known_a_slide_reaches_its_figures(by_hybrid):
    result = by_hybrid
    assert result.ended == "done"
    assert abs(result.mean - 10.0) < 0.1
    assert result.rms < 0.15
    assert result.overshoot < 0.15
    assert result.path < 1e-3
    assert result.airborne == 0.0
    assert result.fallbacks == result.violations == 0


def test_with_everything_disturbed_a_slide_reaches_its_figures():
    case = next(c for c in force.cases((20.0,), False) if c.name.startswith(force.TOGETHER))
    result = run_slide(case)
    assert result.ended == "done"
    assert abs(result.mean - 20.0) < 1.0
    assert result.rms < 2.0
    assert result.path < 5e-3
    assert result.airborne == 0.0
    assert result.violations == 0


def test_the_papers_laws_are_worse_where_the_paper_found_them_wanting(by_hybrid):
    open_loop = run_slide(Case(force.KNOWN, "open-loop PD hybrid", 10.0))
    soft = run_slide(Case(force.KNOWN, "impedance, paper's gains", 10.0))
    assert open_loop.rms > 3 * by_hybrid.rms
    assert open_loop.path > 3 * by_hybrid.path
    assert soft.path > 10 * by_hybrid.path


def test_a_stopwatch_tells_parts_apart():
    watch = Stopwatch()
    watch.start()
    sum(range(200000))
    watch.lap("long")
    watch.lap("short")
    assert watch.median("long") > watch.median("short") > 0.0
    assert watch.total("long") == pytest.approx(1e-6 * watch.median("long"))
    assert np.isnan(watch.median("never"))


def test_results_and_verdicts_are_written_as_json(tmp_path):
    write_json(tmp_path / "new" / "force.json", [Check("x", "≤ 1 %", "2 %", False)], slides=[{"a": 1}])
    content = json.loads((tmp_path / "new" / "force.json").read_text())
    assert content == {
        "slides": [{"a": 1}],
        "acceptance": [{"figure": "x", "wanted": "≤ 1 %", "measured": "2 %", "reached": False}],
    }


def test_force_plots_are_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    from bt_tamp.bench.plots import plot_forces

    made = plot_forces(tmp_path, [slide(), slide(law="impedance, tuned"), slide("all together: a")])
    assert [path.name for path in made] == ["force-10N.png"]
    assert made[0].stat().st_size > 5000


def test_a_benchmark_must_be_named_and_known(capsys):
    assert main(["bench"]) == 2
    assert main(["bench", "speed"]) == 2
    assert "speed" in capsys.readouterr().err


def test_costs_are_drawn_part_by_part(tmp_path):
    pytest.importorskip("matplotlib")
    costs = [Cost(regime, 3.0, dict.fromkeys(PARTS, 50.0), 40.0, 3.1, 126.0) for regime in ("free", "wiping")]
    made = PLOTS["control"](tmp_path, [costs])
    assert [path.name for path in made] == ["control.png"]
    assert made[0].stat().st_size > 5000


def test_every_benchmark_has_what_the_command_asks_of_it():
    for name in BENCHES:
        bench = import_module(f"bt_tamp.bench.{name}")
        parts = ("WHAT", "planned", "measure", "said", "print_results", "acceptance", "records")
        assert all(hasattr(bench, part) for part in parts)
        assert 0 < len(bench.planned(True)) < len(bench.planned(False))
    assert PLOTS.keys() == BENCHES.keys()


def test_of_three_runs_the_one_in_the_middle_is_told():
    runs = [[Cost("wiping", 3.0, dict.fromkeys(PARTS, 50.0), 40.0, factor, 126.0)] for factor in (3.5, 2.0, 3.1)]
    assert [cost.real_time for cost in control.middle(runs)] == [3.1]
    assert {check.figure: check.reached for check in control.acceptance(runs)}["wiping: real-time factor"]


class _Impatient(RunRecorder):
    def sample(self, *_):
        raise KeyboardInterrupt


def test_an_interruption_ends_the_benchmark_and_not_only_its_run():
    with pytest.raises(KeyboardInterrupt):
        whole_run(_Impatient(load_scenario("fig2", 0)), RunOptions())
