"""What a class draws can be dealt with, as it declares."""

import numpy as np
import pytest

from bt_tamp.disturb.deed import Occasion
from bt_tamp.disturb.world import crumbs_beside_pan, moved
from bt_tamp.executive.build import build
from bt_tamp.options import RunOptions
from planner.motion.motion_planner import MotionPlanner
from scenarios.document import parse_document
from scenarios.generate import generate
from scenarios.load import build_scenario, load_scenario
from skills.gathering import Place, strokes_for
from skills.strokes import Crumbs, Tool, opening_of

SPONGE = Tool(width=0.09, depth=0.06, span=0.11)


def _scenes():
    yield load_scenario("fig1")
    yield load_scenario("fig1_wipe")
    for seed, objects in ((27, 4), (31, 8)):
        yield build_scenario(parse_document(generate(seed, objects), "generated"))


@pytest.mark.parametrize("draw", [crumbs_beside_pan, moved])
def test_a_crumb_is_put_where_a_stroke_can_take_it(draw):
    found = 0
    for scenario in _scenes():
        machine = build(scenario, RunOptions(), lambda kind, **data: None, lambda why: None)
        rng = np.random.default_rng(0)
        pans = [region for region in scenario.regions.values() if region.kind == "dustpan"]
        for _ in range(20):
            now = Occasion(0.0, machine.plant.observe(), machine, MotionPlanner(machine.robot), rng)
            deed = draw(now)
            if deed is None or not now.is_crumb(deed.names[0]):
                continue
            (fault,), (name,) = deed.faults, deed.names
            crumbs = Crumbs((name,), fault.X_WO.translation[None, :2], np.array([0.016]))
            places = [Place(scenario.table, SPONGE, opening_of(pan, scenario.table), crumbs) for pan in pans]
            assert any(True for place in places for _ in strokes_for(place, name)), fault.X_WO.translation
            found += 1
        machine.plant.close()
    assert found >= 10
