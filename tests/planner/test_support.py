"""What stands on what."""

from dataclasses import replace

import numpy as np
from pinocchio import SE3

from planner.support import borne, burden, supports
from sim.scene import Held


def at(x, y, z):
    return SE3(np.eye(3), np.array([x, y, z]))


def stacked(tabletop):
    """A mug on a cup, a jug on the mug, a pot beside them."""
    scene = tabletop("cup mug jug pot")
    x, y, z = scene.poses["cup"].translation
    scene = scene.moved("mug", at(x, y, z + 0.06)).moved("jug", at(x + 0.01, y, z + 0.12))
    return scene.moved("pot", at(x + 0.061, y, z))


def test_what_stands_on_something_and_what_stands_on_that_is_its_burden(tabletop):
    scene = stacked(tabletop)
    assert burden(scene, "cup") == {"mug", "jug"}
    assert burden(scene, "mug") == {"jug"}
    assert burden(scene, "jug") == frozenset()


def test_what_stands_beside_it_or_hangs_in_the_hand_is_none(tabletop):
    scene = stacked(tabletop)
    assert "pot" not in burden(scene, "cup")
    assert supports(scene, "pot") == frozenset()
    assert burden(replace(scene, held=Held("mug", at(0.0, 0.0, 0.0))), "cup") == frozenset()


def test_what_stands_on_what_the_hand_holds_is_borne_with_it(tabletop):
    scene = stacked(tabletop)
    assert borne(scene) == frozenset()
    held = replace(scene, held=Held("cup", at(0.0, 0.0, 0.0)))
    assert borne(held) == {"mug", "jug"}
    assert borne(replace(scene, held=Held("jug", at(0.0, 0.0, 0.0)))) == frozenset()
