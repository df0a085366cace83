"""The tables of `bench tamp`, and what is made of their results."""

import json
from collections import Counter
from dataclasses import replace

import pytest

from bt_tamp.bench import tamp
from bt_tamp.bench.plots import plot_tables
from bt_tamp.bench.tables import CULPRITS, Case, cases
from bt_tamp.bench.tamp import TampResult, acceptance, groups, plan_table, shortcomings
from bt_tamp.cli import main
from bt_tamp.executive.preview import preview
from bt_tamp.options import RunOptions
from planner.search_then_sample import Solution
from scenarios.generate import table_kind
from scenarios.spoilers import KINDS

HEAVY = Case("unsolvable", 1, 3, "too-heavy")


def result(part="table", outcome="planned", cpu_s=2.0, steps=10, shortest=10, culprits=(), kind=None):
    return TampResult(Case(part, 0, 5, kind), outcome, cpu_s, 2, steps, shortest, culprits, "because")


def told(**changes):
    fine = result("unsolvable", "proven", 0.1, 0, 0, ("block_1",), "too-heavy")
    return replace(fine, **changes)


def fine():
    return [result("fig1", cpu_s=0.5), result(), result("run", "goal_reached", steps=0, shortest=0), told()]


def reached(results):
    return [check.reached for check in acceptance(results)]


def test_the_tables_are_those_that_were_asked_for():
    made = list(cases(quick=False))
    assert Counter(case.part for case in made) == {"fig1": 20, "table": 100, "larger": 20, "unsolvable": 50, "run": 10}
    assert {case.objects for case in made if case.part == "table"} == set(range(4, 13))
    assert [case.seed for case in made if case.part == "table"] == list(range(100))
    assert Counter(case.kind for case in made if case.kind) == dict.fromkeys(KINDS, 10)
    assert set(CULPRITS) == set(KINDS)
    assert {case.part for case in cases(quick=True)} == {case.part for case in made}


def test_good_tables_reach_every_figure():
    assert all(reached(fine()))


@pytest.mark.parametrize(
    ("bad", "missed"),
    [
        (result("fig1", cpu_s=9.0), 0),
        (result(cpu_s=21.0), 1),
        (result(outcome="budget"), 1),
        (result("run", "gave_up"), 2),
        (told(outcome="planned"), 3),
        (told(culprits=("block_1", "mug_2")), 4),
        (told(culprits=()), 4),
        (result(steps=12), 5),
    ],
)
def test_each_figure_is_missed_by_bad_tables(bad, missed):
    judged = reached([*fine(), bad, bad])
    assert not judged[missed]
    assert all(judged[k] for k in range(6) if k != missed and not (missed == 3 and k == 4))
    assert len(shortcomings([bad])) == (0 if bad.case.part == "fig1" else 1)


def test_a_figure_nobody_measured_is_not_reached():
    assert not any(reached([]))


def test_every_table_is_told_of_in_some_group():
    assert sum(len(group.results) for group in groups(fine()) if not group.title.startswith(" ")) == 4


def test_an_unsolvable_table_is_told_to_be_so_and_why():
    found = plan_table(HEAVY)
    assert found.outcome == "proven"
    assert found.is_told
    assert found.cpu_s > 0.0


def test_what_was_measured_before_an_interruption_is_printed_and_written(tmp_path, monkeypatch, capsys):
    def interrupted(tables):
        yield plan_table(HEAVY)
        raise KeyboardInterrupt

    monkeypatch.setattr(tamp, "measure", interrupted)
    assert main(["bench", "tamp", "--quick", "--out", str(tmp_path)]) == 130
    assert "unsolvable: too-heavy" in capsys.readouterr().out
    content = json.loads((tmp_path / "tamp.json").read_text())
    assert [entry["table"] for entry in content["tables"]] == [str(HEAVY)]


@pytest.mark.parametrize("seed", range(3, 10))
def test_a_generated_table_needs_what_its_kind_says(seed):
    sentences = []

    def listen(kind, **data):
        if kind == "learned":
            sentences.append(data["sentence"])

    found = preview(Case("table", seed, 4).scenario(), RunOptions(), listen).outcome
    assert isinstance(found, Solution)
    kind = table_kind(seed)
    assert found.rounds > 1
    assert sentences
    if "chain" in kind:
        assert any(" and " in sentence for sentence in sentences), "A before B before C"
    if "aside" in kind:
        assert any(action.name == "place" and action.args[1] == "table" for action in found.plan.actions)


def test_tables_are_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    made = plot_tables(tmp_path, fine())
    assert [path.name for path in made] == ["tamp.png"]
    assert made[0].stat().st_size > 5000
