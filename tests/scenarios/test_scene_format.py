"""What the format means: poses, defaults, plain scalars, and the JSON Schema."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.document import parse_document
from scenarios.schema import SceneFile, json_schema, validate_document
from scenarios.shapes import Box, Cylinder, Sphere


def test_what_is_written_out_reads_back_the_same(plain):
    file = validate_document(parse_document(plain, "scene.yaml"))
    assert SceneFile.model_validate(file.model_dump()) == file
    assert SceneFile.model_validate_json(file.model_dump_json()) == file


def test_bodies_stand_on_the_table_and_on_a_region_s_floor(plain, build):
    bodies = build(plain).bodies
    np.testing.assert_allclose(bodies["mug"].X_WO.translation, [0.5, 0.0, 0.05])
    np.testing.assert_allclose(bodies["pea"].X_WO.translation, [0.7, 0.2, 0.01])
    np.testing.assert_allclose(bodies["sponge"].X_WO.translation, [0.7, -0.6, -0.075 + 0.02])
    c, s = np.cos(np.radians(30)), np.sin(np.radians(30))
    np.testing.assert_allclose(bodies["mug"].X_WO.rotation, [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-12)


def test_roll_pitch_and_yaw_turn_about_the_fixed_axes_in_this_order(plain, build):
    lying = plain.replace("{on: table, xy: [0.5, 0.0], yaw_deg: 30}", "{xyz: [0.5, 0.0, 0.04], rpy_deg: [90, 0, 90]}")
    X_WO = build(lying).bodies["mug"].X_WO
    np.testing.assert_allclose(X_WO.rotation @ [0, 0, 1], [1, 0, 0], atol=1e-12)


def test_shapes_colours_and_defaults_come_through(plain, build):
    scene = build(plain.replace("mass: 0.3", 'mass: 0.3\n    color: "#ff0080"'))
    mug, pea, sponge = (scene.bodies[name] for name in ("mug", "pea", "sponge"))
    assert (mug.shape, pea.shape, sponge.shape) == (Cylinder(0.04, 0.1), Sphere(0.01), Box((0.1, 0.06, 0.04)))
    assert mug.color == pytest.approx((1.0, 0.0, 128 / 255, 1.0))
    assert (mug.tool, sponge.tool) == (None, "sponge")
    assert (mug.contact_stiffness, sponge.contact_stiffness, sponge.contact_damping) == (None, 2000.0, 20.0)
    assert mug.friction == 0.5
    assert (mug.home, pea.home) == ("crate", None)
    assert scene.regions["tray"].open_side == "+y"
    assert scene.fixtures["post"].X_WO.translation[2] == pytest.approx(0.1)
    assert not scene.robot.q0.flags.writeable


def test_regions_tools_fixtures_base_and_start_may_be_left_out(build):
    scene = build(
        "version: 1\nname: bare\nrobot: {}\ntable: {size: [1, 1, 0.05], pose: {xyz: [0.7, 0, -0.025]}}\n"
        "objects: {mug: {shape: {box: [0.05, 0.05, 0.1]}, mass: 0.2, pose: {on: table, xy: [0.5, 0]}}}\n"
        "goal: (holding mug)\n"
    )
    assert (scene.regions, scene.fixtures, scene.goal) == ({}, {}, "(and (holding mug))")
    np.testing.assert_allclose(np.degrees(scene.robot.q0), [0, 20, 0, -80, 0, 80, 0])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("on", "on"),
        ("no", "no"),
        ("true", True),
        ("~", None),
        ("12", 12),
        ("-0.5", -0.5),
        (".5", 0.5),
        ("1e-3", 0.001),
        ("1:30", "1:30"),
        ("0o17", "0o17"),
        ("2024-01-01", "2024-01-01"),
        ("'12'", "12"),
        ('"true"', "true"),
    ],
)
def test_plain_scalars_are_read_as_in_yaml_1_2(text, value):
    data = parse_document(f"key: {text}\n", "scene.yaml").data
    assert data == {"key": value}
    assert type(data["key"]) is type(value)


@settings(derandomize=True, max_examples=60, deadline=None)
@given(number=st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(10**15) + 1, 10**15 - 1))
def test_every_number_reads_back_as_itself(number):
    assert parse_document(f"- {number!r}\n", "scene.yaml").data == [number]


def test_the_json_schema_describes_every_key():
    schema = json_schema()
    assert schema["required"] == ["version", "name", "robot", "table", "objects", "goal"]
    assert schema["additionalProperties"] is False
    assert all(part.get("description") for part in schema["$defs"].values())
    assert "product" in str(schema["$defs"]["Table"]["properties"]["friction"])
    assert "OUTER" in schema["$defs"]["Region"]["properties"]["size"]["description"]


def test_listing_scenes_and_printing_the_schema_loads_no_kinematics():
    code = (
        "import sys; from scenarios.library import list_scenarios; from scenarios.schema import json_schema;"
        "list_scenarios(); json_schema(); print([m for m in ('pinocchio', 'coal', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
