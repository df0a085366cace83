"""Spots: where a body is as seen, and where an action of the plan leaves it."""

from dataclasses import replace

import numpy as np
from pinocchio import SE3

from planner.task.situation import Situation, Spot
from planner.task.symbols import GroundAction
from sim.scene import Held

DRAG = GroundAction("drag", ("cup", "table"))
WIPE = GroundAction("wipe", ("crumb", "table", "dustpan"))


def shift(x):
    return SE3(np.eye(3), np.array([x, 0.0, 0.0]))


def test_an_action_moves_its_first_argument_however_little(tabletop):
    scene = tabletop("cup mug")
    situation = Situation.now(scene).after(DRAG, scene, frozenset())
    assert situation.spot("cup") == Spot("cup", DRAG)
    assert situation.spot("mug") == Spot("mug")
    assert situation.is_away(Spot("cup"))
    assert not situation.is_away(Spot("cup", DRAG))


def test_an_action_moves_whatever_lies_elsewhere_afterwards(tabletop):
    scene = tabletop("cup mug", "crumb")
    swept = scene.moved("mug", shift(0.05) * scene.poses["mug"])
    assert Situation.now(scene).after(WIPE, swept, frozenset()).spot("mug") == Spot("mug", WIPE)


def test_what_is_held_stays_where_its_pick_left_it_while_the_hand_moves(tabletop):
    scene = tabletop("cup", "crumb")
    pick = GroundAction("pick", ("sponge", "dustpan"))
    held = replace(scene, held=Held("sponge", SE3.Identity()))
    moved = held.moved("sponge", shift(0.3) * held.poses["sponge"])
    situation = Situation.now(scene).after(pick, held, frozenset()).after(WIPE, moved, frozenset())
    assert situation.held == Spot("sponge", pick)
