"""What stands on what."""

from dataclasses import replace

import numpy as np
import pytest
from pinocchio import SE3

from planner.support import borne, burden, supports
from scenarios.shapes import Box
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


@pytest.mark.parametrize("height", [0.012, 0.018, 0.03])
@pytest.mark.parametrize("gap", [0.0, -0.0003])
def test_flat_things_that_touch_side_by_side_do_not_stand_on_each_other(tabletop, height, gap):
    scene = tabletop("cup mug")
    bodies = {n: replace(body, shape=Box((0.1, 0.1, height))) for n, body in scene.scenario.bodies.items()}
    scene = replace(scene, scenario=replace(scene.scenario, bodies=bodies))
    top = scene.scenario.table.X_WT.translation[2] + scene.scenario.table.size[2] / 2
    scene = scene.moved("cup", at(0.6, 0.0, top + height / 2)).moved("mug", at(0.6, 0.1 + gap, top + height / 2))
    assert supports(scene, "cup") == supports(scene, "mug") == frozenset()
    upon = scene.moved("mug", at(0.6, 0.05, top + 1.5 * height - 0.0003))
    assert supports(upon, "mug") == {"cup"}
