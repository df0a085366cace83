"""A recorded scenario keeps meshes and compounds exactly."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
from pinocchio import SE3

from bt_tamp.report.scenario_json import scenario_from_json, scenario_to_json
from scenarios.load import load_scenario
from scenarios.shapes import Box, Compound, Cylinder, Hull


def test_a_recorded_scenario_keeps_its_meshes_and_compounds():
    hull = Hull.of(np.random.default_rng(0).normal(size=(12, 3)))[0]
    tilted = SE3(pin.exp3(np.array([0.3, -0.2, 0.9])), np.array([0.1, 0.0, 0.02]))
    mug = Compound.of([(hull, SE3.Identity()), (Box((0.1, 0.2, 0.3)), tilted), (Cylinder(0.1, 0.2), tilted)])[0]
    scenario = load_scenario("fig1")
    bodies = {name: replace(scenario.bodies[name], shape=shape) for name, shape in (("book", hull), ("box", mug))}
    recorded = replace(scenario, bodies={**scenario.bodies, **bodies})
    again = scenario_from_json(scenario_to_json(recorded))
    assert {name: body.shape for name, body in again.bodies.items()} == {
        name: body.shape for name, body in recorded.bodies.items()
    }
