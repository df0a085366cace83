from collections.abc import Callable

import pytest

from scenarios.document import parse_document
from scenarios.load import build_scenario
from scenarios.scenario import Scenario

PLAIN = """\
version: 1
name: plain
robot: {model: iiwa14_wsg50}
table: {size: [1.0, 1.0, 0.05], pose: {xyz: [0.7, 0.0, -0.025]}, friction: 0.5}
regions:
  crate: {kind: bin, size: [0.4, 0.4, 0.13], pose: {xyz: [0.0, 0.75, -0.1]}}
  tray: {kind: dustpan, size: [0.3, 0.2, 0.05], pose: {xyz: [0.7, -0.6, -0.06]}, open_side: +y}
fixed:
  post: {shape: {cylinder: {radius: 0.03, height: 0.2}}, pose: {on: table, xy: [1.0, 0.4]}}
objects:
  mug:
    shape: {cylinder: {radius: 0.04, height: 0.1}}
    mass: 0.3
    pose: {on: table, xy: [0.5, 0.0], yaw_deg: 30}
    home: crate
  pea:
    shape: {sphere: {radius: 0.01}}
    mass: 0.005
    pose: {on: table, xy: [0.7, 0.2]}
tools:
  sponge:
    kind: sponge
    shape: {box: [0.1, 0.06, 0.04]}
    mass: 0.06
    pose: {on: tray, xy: [0.7, -0.6]}
goal: clear-table
"""


@pytest.fixture
def plain() -> str:
    """A small scene as text, to be broken by the tests."""
    return PLAIN


@pytest.fixture
def build() -> Callable[..., Scenario]:
    """Turns scene text into a scenario."""
    return lambda text, seed=0: build_scenario(parse_document(text, "scene.yaml"), seed)
