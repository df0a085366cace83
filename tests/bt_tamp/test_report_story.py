import pytest

from bt_tamp.cli import main
from bt_tamp.report.events import Event, read_events
from bt_tamp.report.live import PlainLines, watcher
from bt_tamp.report.result import PressedMotion, RunResult, UnintendedContact
from bt_tamp.report.sentences import sentence
from bt_tamp.report.story import WIDTH, story

FIRST = ["pick(book, table)", "place(book, crate)"]
SECOND = ["drag(book, table)", *FIRST]

EVENTS = [
    Event("run_started", 0.0, {"scene": "desk", "seed": 4}),
    Event("round", 0.1, {"round": 1, "plan": FIRST, "expansions": 3}),
    Event(
        "refinement_failed",
        0.1,
        {"action": FIRST[0], "reason": "the hand would hit table", "culprits": ["vase"], "attempts": 2},
    ),
    Event("learned", 0.1, {"action": FIRST[0], "sentence": "book cannot be grasped as it lies: drag it first"}),
    Event("proof_sought", 0.1, {"round": 2, "plan": FIRST, "expansions": 3}),
    Event("widened", 0.1, {"tries": 40}),
    Event("round", 0.1, {"round": 2, "plan": SECOND, "expansions": 3}),
    Event("refined", 0.1, {"action": SECOND[0]}),
    Event("backtracked", 0.1, {"action": FIRST[0], "to": SECOND[0]}),
    Event("solved", 0.1, {"plan": SECOND, "rounds": 2}),
    Event("plan_installed", 0.4, {"actions": SECOND, "rounds": 2}),
    Event("action_started", 0.5, {"action": SECOND[0]}),
    Event("phase", 0.5, {"action": SECOND[0], "phase": "descend"}),
    Event("action_done", 3.0, {"action": SECOND[0]}),
    Event("action_started", 3.0, {"action": FIRST[0]}),
    Event("phase", 3.0, {"action": FIRST[0], "phase": "close"}),
    Event("action_failed", 4.0, {"action": FIRST[0], "failure": "GraspMissed", "reason": "the fingers closed on air"}),
    Event("replan", 4.0, {"reason": "the fingers closed on air"}),
    Event("round", 4.0, {"round": 3, "plan": None, "expansions": 1}),
    Event("run_ended", 4.1, {"outcome": "no_plan", "sentence": "no plan found"}),
]

RESULT = RunResult(
    "desk",
    4,
    "no_plan",
    "no plan found",
    {"in_bin(book, crate)": False},
    unintended_contacts=(UnintendedContact(1.0, "finger", "vase", 3.25, "drag(book, table)", "descend"),),
    pressed=(PressedMotion("drag(book, table)", 8.0, 8.1, 0.2, 9.5),),
)


def test_a_task_planner_that_failed_is_not_taken_for_one_that_found_the_goal_out_of_reach() -> None:
    failed = {"round": 1, "plan": None, "expansions": 0, "failure": "MemoryError: too much"}
    events = [EVENTS[0], Event("round", 0.1, failed), Event("proof_sought", 0.1, failed)]
    told = " ".join(story(events, None).split())
    assert "Round 1: the task planner failed (MemoryError: too much)." in told
    assert "By proofs alone: the task planner failed (MemoryError: too much)." in told
    assert "no sequence of actions" not in told
    assert sentence(events[1]) == "round 1: the task planner failed (MemoryError: too much)"


def test_the_story_of_a_run_that_goes_on_tells_its_options_what_was_skipped_and_what_was_done_again() -> None:
    events = [
        Event("run_started", 0.0, {"scene": "desk", "seed": 0, "choices": {"contact": "impedance"}, "resumed": True}),
        Event("skipped", 1.0, {"actions": FIRST}),
        Event("redone", 2.0, {"actions": FIRST[:1], "lacking": ["holding(book)"]}),
    ]
    interrupted = RunResult("desk", 0, "interrupted", "the run was interrupted, the arm brought to rest", {})
    told = " ".join(story(events, interrupted).split())
    for expected in (
        "desk, seed 0 (gone on from where another run ended; nothing that was to befall that one comes again)",
        "comes again), --contact impedance",
        "1.0 s Skipped, as it was done already: pick(book, table), place(book, crate).",
        "2.0 s To be done again, as holding(book) did not hold: pick(book, table).",
        "Before its end the run was interrupted, the arm brought to rest.",
    ):
        assert expected in told
    assert sentence(events[1]) == "skipped, as it is done already: pick(book, table), place(book, crate)"


def test_the_story_numbers_the_plans_that_had_something_to_do_and_tells_of_waiting_only_while_it_lasted() -> None:
    def installed(t: float, *actions: str) -> list[Event]:
        proposed = {"round": 1, "plan": list(actions), "failure": ""}
        return [Event("round", t, proposed), Event("plan_installed", t, {"actions": list(actions)})]

    gone = [Event("missing", 3.0, {"bodies": ["can"]}), Event("missing", 4.0, {"bodies": ["can"]})]
    again = Event("replan", 5.0, {"reason": "can is wanted now, too"})
    events = [*installed(0.0, *FIRST), *installed(2.0), *gone]
    end = RunResult("desk", 0, "no_plan", "can is nowhere to be seen", {})
    assert "The arm had waited in vain since 3.0 s." in story(events, end)
    told = story([*events, again, *installed(5.0, *FIRST)], end)
    assert "waited in vain" not in told
    assert "Plan 2, in force from 5.0 s" in told
    assert told.count("Planning before anything is done") == 1


def test_an_event_that_lacks_something_is_named_in_one_line(tmp_path, capsys) -> None:
    (tmp_path / "scenario.json").write_text("{}")
    for line, said in (
        ('{"t": 0, "kind": "run_started"}', "event 'run_started' at 0 s: lacks 'seed'"),
        ('{"t": null, "kind": "run_started"}\n{"t": 0, "kind": "x"}', "events.jsonl, line 1: expected an event"),
    ):
        (tmp_path / "events.jsonl").write_text(line + "\n")
        assert main(["explain", str(tmp_path)]) == 2
        assert said in capsys.readouterr().err


def test_the_story_tells_plans_failures_lessons_deeds_and_end_in_their_order() -> None:
    told = " ".join(story(EVENTS, RESULT).split())
    expected = [
        "desk, seed 4",
        "Round 1: the task planner proposed pick(book, table), place(book, crate).",
        "pick(book, table) could not be worked out: the hand would hit table; in the way: vase.",
        "Learned: book cannot be grasped as it lies: drag it first.",
        "widened to 40 samples",
        "Round 2: a plan of 3 actions, now with drag(book, table).",
        "another choice was made for drag(book, table)",
        "Plan 1, in force from 0.4 s",
        "drag(book, table): descend.",
        "pick(book, table) failed in its phase 'close': the fingers closed on air.",
        "A new one was sought",
        "Round 3: with what had been learned, no sequence of actions led to the goal.",
        "There was no plan: no plan found.",
        "in_bin(book, crate) did not hold",
        "drag(book, table) pressed with 8.10 N, 8 N wanted: off by 2.5% (RMS), peak 9.5 N",
        "finger and vase at 1.0 s, 3.2 N (drag(book, table) descend)",
    ]
    places = [told.find(text) for text in expected]
    assert -1 not in places, expected[places.index(-1)]
    assert places == sorted(places)


def test_the_story_keeps_to_its_width() -> None:
    assert max(map(len, story(EVENTS, RESULT).splitlines())) <= WIDTH


@pytest.mark.parametrize("length", range(len(EVENTS) + 1))
def test_the_story_of_a_run_that_was_cut_off_anywhere_says_so(length: int) -> None:
    assert "it left no result" in story(EVENTS[:length], None)


def test_an_action_under_way_at_the_end_is_told() -> None:
    assert "pick(book, table) was under way, in its phase 'close'" in story(EVENTS[:16], None)


def test_in_a_pipe_each_event_is_a_line_with_its_time(tmp_path) -> None:
    with (tmp_path / "out").open("w") as stream:
        looking_on = watcher(stream)
        for event in EVENTS:
            looking_on.event(event)
        looking_on.progress(4.1, 0.0)
        looking_on.close()
    lines = (tmp_path / "out").read_text().splitlines()
    assert isinstance(looking_on, PlainLines)
    assert "    0.50 s  drag(book, table): descend" in lines
    assert "    4.00 s  planning again: the fingers closed on air" in lines
    assert all(line[11:] and " s  " in line for line in lines)


def test_events_come_back_as_they_were_stored_and_a_torn_last_line_is_left_out(tmp_path) -> None:
    path = tmp_path / "events.jsonl"
    path.write_text("\n".join(event.to_line() for event in EVENTS) + '\n{"t": 4.2, "ki')
    assert [(e.kind, e.t, dict(e.data)) for e in read_events(path)] == [(e.kind, e.t, dict(e.data)) for e in EVENTS]


def test_a_broken_line_before_the_end_is_named(tmp_path) -> None:
    path = tmp_path / "events.jsonl"
    path.write_text(f"{EVENTS[0].to_line()}\nnonsense\n{EVENTS[1].to_line()}\n")
    with pytest.raises(ValueError, match=r"events\.jsonl, line 2"):
        list(read_events(path))


def test_what_was_measured_in_real_time_is_not_stored() -> None:
    assert "cpu_s" not in Event("plan_installed", 1.0, {"actions": [], "cpu_s": 0.3}).to_line()


def test_a_result_comes_back_from_its_json() -> None:
    assert RunResult.from_json(RESULT.to_json()) == RESULT
