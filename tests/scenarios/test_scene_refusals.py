"""Whatever is wrong with a scene file is said in one line: file, place, what was expected."""

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from scenarios.errors import SceneError, SceneInvalid, SceneMalformed, SceneNotFound, SceneUnreadable
from scenarios.load import load_scenario

MUG = "mass: 0.3"
BOMB = "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\n"

BROKEN = [
    # what is replaced, with what, the place and the words expected in the message
    ("version: 1", "version: 2", "version, line 1", "version is 2, expected 1"),
    ("version: 1", "version: true", "version, line 1", "version is true, expected 1"),
    ("version: 1\n", "", "line 1", "missing key 'version'"),
    ("name: plain", "name: Plain Scene", "name, line 2", "expected a lower-case letter"),
    ("iiwa14_wsg50", "iiwa14", "robot.model, line 3", "did you mean 'iiwa14_wsg50'"),
    ("iiwa14_wsg50}", "iiwa14_wsg50, q0_deg: [0, 0]}", "robot.q0_deg, line 3", "expected 7 numbers, got 2"),
    ("iiwa14_wsg50}", "iiwa14_wsg50, q0_deg: [0, 0, 0, 130, 0, 0, 0]}", "robot.q0_deg", "joint 4 is at 130"),
    (MUG, "mass: -0.3", "objects.mug.mass, line 13", "expected a number above 0, got -0.3"),
    (MUG, "mass: 0", "objects.mug.mass, line 13", "above 0"),
    (MUG, "mass: .nan", "objects.mug.mass, line 13", "expected a finite number"),
    (MUG, "mass: .inf", "objects.mug.mass, line 13", "expected a finite number"),
    (MUG, "mass: 1e999", "objects.mug.mass, line 13", "expected a finite number"),
    (MUG, f"mass: {'9' * 5000}", "objects.mug.mass, line 13", "expected a finite number"),
    (MUG, "mass: 1000000000000000", "objects.mug.mass, line 13", "at most 100"),
    (MUG, "mass: true", "objects.mug.mass, line 13", "expected a number, got true"),
    (MUG, "mass: heavy", "objects.mug.mass, line 13", "expected a number, got 'heavy'"),
    (MUG, "mass:", "objects.mug.mass, line 13", "expected a number, got nothing"),
    (MUG, "mass: 0.3\n    wieght: 2", "objects.mug.wieght, line 14", "unknown key"),
    (MUG, "mass: 0.3\n    fricton: 2", "objects.mug.fricton, line 14", "did you mean 'friction'"),
    (MUG, "mass: 0.3\n    color: blue", "objects.mug.color, line 14", "expected text like #3355aa, got 'blue'"),
    (MUG, "mass: 0.3\n    mass: 0.4", "objects.mug, line 14", "given twice (first on line 13)"),
    (MUG, "mass: !!python/object/apply:os.system [ls]", "objects.mug.mass, line 13", "tag"),
    (MUG, "mass: !!float 0.3", "objects.mug.mass, line 13", "tag"),
    (MUG, "mass: &m 0.3", "objects.mug.mass, line 13", "anchors and aliases are not read"),
    (MUG, "<<: *other", "objects.mug.<<, line 13", "anchors and aliases are not read"),
    (MUG, "mass: [0.3", "line 14", "malformed YAML"),
    (MUG, "? [a, b]\n    : 1", "objects.mug, line 13", "a key is not plain text"),
    ("    mass: 0.3\n", "", "objects.mug, line 11", "missing key 'mass'"),
    ("radius: 0.04, ", "", "objects.mug.shape.cylinder, line 12", "missing key 'radius'"),
    ("radius: 0.04", "radius: 0", "objects.mug.shape.cylinder.radius", "at least 0.001"),
    ("{cylinder: {radius: 0.04, height: 0.1}}", "{}", "objects.mug.shape, line 12", "0 shapes are given"),
    ("{sphere: {radius: 0.01}}", "{sphere: {radius: 0.01}, box: [1, 1, 1]}", "objects.pea.shape", "2 shapes are given"),
    ("{sphere: {radius: 0.01}}", "{cone: {radius: 0.01}}", "objects.pea.shape.cone", "unknown key"),
    ("{sphere: {radius: 0.01}}", "{box: [0.1, 0.1]}", "objects.pea.shape.box", "expected 3 numbers, got 2"),
    ("{sphere: {radius: 0.01}}", "{box: 0.1}", "objects.pea.shape.box", "expected a list of numbers"),
    ("{box: [0.1, 0.06, 0.04]}", "{sphere: {radius: 0.02}}", "tools.sponge", "a sponge is a box"),
    ("kind: sponge", "kind: mop", "tools.sponge.kind", "expected 'sponge', got 'mop'"),
    ("kind: bin", "kind: bucket", "regions.crate.kind, line 6", "expected 'bin' or 'dustpan'"),
    ("kind: bin", "kind: bin, open_side: +x", "regions.crate.open_side", "a bin has four walls"),
    (", open_side: +y", "", "regions.tray", "a dustpan has an open side"),
    ("open_side: +y", "open_side: +z", "regions.tray.open_side", "expected '+x', '-x', '+y' or '-y'"),
    ("open_side: +y", "open_side: +y, ramp_deg: 2", "regions.tray.ramp_deg", "the ramp is 0.286 m long"),
    ("open_side: +y", "open_side: +y, ramp_deg: 8", "regions.tray.pose", "expected it flush with the table's top"),
    ("[0.7, -0.6, -0.06]", "[0.7, -0.6, 0.025]", "regions.tray.pose", "expected it below the table's top"),
    ("size: [0.4, 0.4, 0.13]", "size: [0.4, 0.02, 0.13]", "regions.crate.size", "no space inside walls"),
    ("[0.0, 0.75, -0.1]}", "[0.0, 0.75, -0.1], rpy_deg: [5, 0, 0]}", "regions.crate.pose.rpy_deg", "stands level"),
    ("  mug:", "  Mug:", "objects.Mug, line 11", "expected a lower-case letter"),
    ("  mug:", "  and:", "objects.and, line 11", "PDDL keyword"),
    ("  mug:", "  table:", "objects.table, line 11", "is taken"),
    ("  mug:", "  link_3:", "objects.link_3, line 11", "is taken"),
    ("  mug:", "  post:", "objects.post, line 11", "given in fixed already"),
    ("home: crate", "home: crater", "objects.mug.home", "did you mean 'crate'"),
    ("on: tray", "on: try", "tools.sponge.pose.on", "did you mean 'tray'"),
    ("xy: [0.7, 0.2]", "xy: [0.7, 0.6]", "objects.pea.pose.xy", "lies off 'table'"),
    ("xy: [0.7, -0.6]", "xy: [0.7, -0.8]", "tools.sponge.pose.xy", "lies off 'tray'"),
    ("xy: [0.7, 0.2]", "xy: [0.52, 0.02]", "objects.pea.pose", "'pea' overlaps 'mug'"),
    ("xy: [0.7, 0.2]", "xy: [1.0, 0.4]", "objects.pea.pose", "'pea' overlaps 'post'"),
    ("{on: table, xy: [0.7, 0.2]}", "{xyz: [0.7, 0.2, 0.02]}", "objects.pea.pose", "'pea' floats"),
    ("{on: table, xy: [0.7, 0.2]}", "{xyz: [0.7, 0.2, -0.02]}", "objects.pea.pose", "'pea' overlaps 'table'"),
    ("{on: table, xy: [0.7, 0.2]}", "{xyz: [9, 0.2, 0.01]}", "objects.pea.pose", "'pea' floats"),
    ("{on: table, xy: [0.7, 0.2]}", "{xyz: [11, 0.2, 0.01]}", "objects.pea.pose.xyz[0]", "at most 10"),
    ("{on: table, xy: [0.5, 0.0], yaw_deg: 30}", "{xyz: [1.21, 0, 0.05]}", "objects.mug.pose", "beyond the edge"),
    ("{on: table, xy: [0.7, 0.2]}", "[0.7, 0.2]", "objects.pea.pose", "expected a mapping, got a list"),
    ("[0.0, 0.75, -0.1]", "[0.5, 0.5, -0.1]", "regions.crate.pose", "'crate' overlaps 'table'"),
    ("[0.0, 0.75, -0.1]", "[0.6, -0.7, -0.13]", "regions.tray.pose", "'tray' overlaps 'crate'"),
    ("{on: table, xy: [1.0, 0.4]}", "{xyz: [1.0, 0.4, 0.05]}", "fixed.post.pose", "'post' overlaps 'table'"),
    ("clear-table", "tidy up", "goal, line 26", "expected one condition"),
    ("clear-table", "(in_bin mug crater)", "goal", "unknown place 'crater', did you mean 'crate'"),
    ("clear-table", "(in_bin mig crate)", "goal", "unknown object 'mig', did you mean 'mug'"),
    ("clear-table", "[in_bin]", "goal", "expected text, got a list"),
]


@pytest.mark.parametrize(("old", "new", "place", "expected"), BROKEN, ids=[f"{b[2]}: {b[3]}"[:70] for b in BROKEN])
def test_a_broken_scene_is_refused_in_one_line(plain, build, old, new, place, expected):
    assert old in plain
    with pytest.raises(SceneError) as error:
        build(plain.replace(old, new, 1))
    message = str(error.value)
    assert message.startswith("scene.yaml, ")
    assert place in message
    assert expected in message
    assert "\n" not in message
    assert len(message) < 700


SCRIBBLES = [
    "0",
    "-1",
    "1e9",
    ".nan",
    "{",
    "}",
    "[",
    ": ",
    "- ",
    "'",
    "null",
    "!",
    "&a ",
    "*a",
    "? ",
    "|",
    "\n",
    "#",
    "(",
    "\t",
]


@settings(
    derandomize=True, max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(edits=st.lists(st.tuples(st.integers(0, 900), st.integers(0, 6), st.sampled_from(SCRIBBLES)), max_size=3))
def test_a_scribbled_scene_loads_or_is_refused_in_one_line(plain, build, edits):
    text = plain
    for at, length, scribble in edits:
        text = text[:at] + scribble + text[at + length :]
    message = ""
    try:
        build(text, 1)
    except SceneError as error:
        message = str(error)
    assert "\n" not in message


def test_of_several_problems_the_first_is_told_and_the_rest_counted(plain, build):
    broken = plain.replace("mass: 0.3", "mass: -1").replace("mass: 0.005", "mass: -2").replace("sphere", "spher")
    with pytest.raises(SceneInvalid, match=r"objects\.mug\.mass, line 13: .* \(and 2 more problems\)$"):
        build(broken)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "is empty"),
        (b"# nothing\n", "is empty"),
        (b"---\n", "expected a scene (a mapping), got nothing"),
        (b"- a\n- b\n", "expected a scene (a mapping), got a list"),
        (b"scene\n", "expected a scene (a mapping), got 'scene'"),
        (b"\x7fELF\x02\x01\x01\x00\x00", "is binary"),
        (b"version: 1\nname: caf\xe9\n", "byte 20 is not UTF-8"),
        (b"version: 1\nname: \x07\n", "malformed YAML"),
        (b"version: 1\n\tname: x\n", "malformed YAML"),
        (b"version: 1\n---\nversion: 1\n", "a second document begins"),
        (b"[" * 5000 + b"]" * 5000, "nested deeper than 16 levels"),
        (b"[" * 5000, "nested deeper than 16 levels"),
        (BOMB.encode(), "anchors and aliases are not read"),
        (b"version: 1\n" + b"#" * 1_000_000, "expected at most 1000000"),
    ],
)
def test_a_file_that_is_no_scene_is_refused_in_one_line(tmp_path, content, expected):
    path = tmp_path / "scene.yaml"
    path.write_bytes(content)
    with pytest.raises(SceneError) as error:
        load_scenario(path)
    message = str(error.value)
    assert message.startswith(str(path))
    assert expected in message
    assert "\n" not in message


def test_a_missing_file_a_directory_and_a_device_are_refused(tmp_path):
    with pytest.raises(SceneNotFound, match="no such file"):
        load_scenario(tmp_path / "gone.yaml")
    with pytest.raises(SceneUnreadable, match="is a directory"):
        load_scenario(tmp_path)
    with pytest.raises(SceneUnreadable, match="no regular file"):
        load_scenario(os.devnull)
    with pytest.raises(SceneError):
        load_scenario("a\0b.yaml")
    with pytest.raises(SceneError):
        load_scenario("x" * 5000)


def test_a_mistyped_scene_name_is_answered_with_the_near_one_and_all_known_ones():
    with pytest.raises(SceneNotFound, match=r"'fig1'.*fig1, fig1_wipe, fig2, fig3") as error:
        load_scenario("fgi1")
    assert str(error.value).startswith("fgi1: unknown scene")


def test_a_tag_runs_no_code(tmp_path):
    trace = tmp_path / "trace"
    path = tmp_path / "scene.yaml"
    make = "!!python/object/apply:pathlib.Path"
    path.write_text(f"version: {make}.touch [{make} [{trace}]]\n")
    with pytest.raises(SceneMalformed):
        load_scenario(path)
    assert not trace.exists()


def test_a_negative_seed_is_an_error():
    with pytest.raises(ValueError, match="expected 0 or above"):
        load_scenario("fig2", -1)


def test_a_scene_file_in_the_working_directory_is_found_by_its_path(tmp_path, monkeypatch, plain):
    monkeypatch.chdir(tmp_path)
    Path("own.yaml").write_text(plain)
    assert load_scenario("own.yaml").name == "plain"
