"""What is kept of a disturbance: whether it mattered, and how soon the run answered to it."""

from bt_tamp.executive.befallen import Ledger


def disturbed(ledger, t, **more):
    ledger.hear("disturbed", t, {"name": "moved", "sentence": "it was moved", "phase": "approach", **more})


def test_a_reaction_ends_when_the_arm_stands_still_after_the_answer():
    ledger = Ledger()
    disturbed(ledger, 1.0, is_urgent=True)
    ledger.look(1.01, is_still=True)
    ledger.hear("refined_again", 1.04, {})
    ledger.look(1.06, is_still=False)
    ledger.look(1.12, is_still=True)
    (one,) = ledger.found
    assert (one.answer, round(one.answered_after_s, 6), round(one.reacted_after_s, 6)) == ("refined_again", 0.04, 0.12)


def test_setting_out_anew_is_a_reaction_too():
    ledger = Ledger()
    disturbed(ledger, 1.0, is_urgent=True)
    ledger.hear("refined_again", 1.04, {})
    ledger.hear("phase", 1.1, {})
    assert round(ledger.found[0].reacted_after_s, 6) == 0.1


def test_rising_out_of_contact_is_a_reaction_too():
    ledger = Ledger()
    disturbed(ledger, 1.0, is_urgent=True)
    ledger.hear("action_failed", 1.04, {})
    ledger.hear("lifting_off", 1.08, {})
    ledger.look(1.9, is_still=True)
    assert round(ledger.found[0].reacted_after_s, 6) == 0.08


def test_a_reaction_counts_from_when_the_sensors_could_show_it():
    for hidden, counted in ((0.0, 0.4), (0.3, 0.1), (0.5, 0.0), (None, 0.4)):
        ledger = Ledger()
        disturbed(ledger, 1.0, is_urgent=True, hidden_s=hidden)
        ledger.hear("refined_again", 1.35, {})
        ledger.look(1.4, is_still=True)
        (one,) = ledger.found
        assert (round(one.reacted_after_s, 6), round(one.reacted_s, 6)) == (0.4, counted)


def test_what_comes_after_the_actions_end_answers_to_something_else():
    ledger = Ledger()
    disturbed(ledger, 1.0, is_urgent=True)
    ledger.hear("action_done", 2.0, {})
    ledger.hear("action_started", 2.0, {})
    ledger.hear("refined_again", 9.0, {})
    ledger.look(9.1, is_still=True)
    assert not ledger.found[0].is_urgent
    assert ledger.found[0].reacted_after_s is None


def test_a_deed_matters_once_its_consequence_was_seen():
    ledger = Ledger()
    disturbed(ledger, 1.0, mattered=False)
    disturbed(ledger, 2.0, mattered=False)
    ledger.hear("mattered", 2.3, {"number": 1})
    assert [one.mattered for one in ledger.found] == [False, True]


def test_what_made_the_action_fail_that_it_befell_mattered():
    ledger = Ledger()
    disturbed(ledger, 1.0, mattered=False, is_urgent=True)
    disturbed(ledger, 1.0, mattered=False)
    ledger.hear("action_failed", 1.1, {})
    assert [one.mattered for one in ledger.found] == [True, False]


def test_actions_that_came_to_their_end_tell_how_long_they_took():
    ledger = Ledger()
    for kind, t in (("action_started", 1.0), ("action_failed", 2.0), ("action_started", 3.0), ("action_done", 7.0)):
        ledger.hear(kind, t, {})
    assert ledger.durations == (4.0,)
