"""Meshes and compounds in scene files: what they mean, and how wrong ones are refused."""

from collections.abc import Callable

import numpy as np
import pytest

from scenarios.errors import SceneInvalid
from scenarios.load import load_scenario
from scenarios.scenario import Scenario
from scenarios.shapes import Compound, Hull, bounds, extents

MUG = "{cylinder: {radius: 0.04, height: 0.1}}"
WEDGE = "{mesh: {vertices: [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1], [0.02, 0.02, 0.02]]}}"
TEE = """{compound: [{shape: {box: [0.1, 0.02, 0.02]}, pose: {xyz: [0, 0, 0.05]}},
             {shape: {cylinder: {radius: 0.01, height: 0.1}}, pose: {xyz: [0, 0, 0]}}]}"""
CUBE_OBJ = "# a cube\n" + "".join(f"v {x} {y} {z}\n" for x in (0, 0.1) for y in (0, 0.1) for z in (0, 0.1))


CORNERS = [(0, 0), (0.06, 0), (0.06, 0.02), (0.02, 0.02), (0.02, 0.06), (0, 0.06)]
ANGLE_OBJ = "".join(f"v {x} {y} {z}\n" for x, y in CORNERS for z in (0, 0.05)) + "".join(
    f"f {2 * k + 1} {2 * k + 2} {(2 * k + 3) % 12 + 1} {(2 * k + 2) % 12 + 1}\n" for k in range(6)
)
"""An angle iron: all its corners lie on its hull."""


def test_a_mesh_stands_on_the_table_about_its_centre_of_volume(plain, build):
    mug = build(plain.replace(MUG, WEDGE)).bodies["mug"]
    assert isinstance(mug.shape, Hull)
    assert len(mug.shape.vertices) == 4
    np.testing.assert_allclose(bounds(mug.shape)[0], -0.025, atol=1e-9)
    np.testing.assert_allclose(mug.X_WO.translation, [0.5, 0.0, 0.025], atol=1e-9)


def test_a_compound_stands_on_its_lowest_part(plain, build):
    mug = build(plain.replace(MUG, TEE)).bodies["mug"]
    assert isinstance(mug.shape, Compound)
    np.testing.assert_allclose(extents(mug.shape), [0.1, 0.02, 0.11])
    assert mug.X_WO.translation[2] == pytest.approx(-bounds(mug.shape)[0][2])


def test_a_compounds_parts_are_what_overlaps_not_its_box(plain, build):
    # The pea lies under the bar of the T, beside its stem.
    scene = plain.replace(MUG, TEE).replace("xy: [0.7, 0.2]", "xy: [0.535, 0.02]")
    assert build(scene).bodies["pea"].X_WO.translation[2] == pytest.approx(0.01)
    with pytest.raises(SceneInvalid, match="overlaps 'mug'"):
        build(scene.replace("xy: [0.535, 0.02]", "xy: [0.515, 0.0]"))


@pytest.mark.parametrize(
    ("form", "place", "words"),
    [
        ("{mesh: {}}", "objects.mug.shape.mesh", "expected either vertices or a file"),
        ("{mesh: {vertices: [[0, 0, 0]]}}", "objects.mug.shape.mesh.vertices", "at least 4 entries, got 1"),
        ("{mesh: {vertices: [[0, 0, 0], [1, 0], [0, 1, 0], [0, 0, 1]]}}", "vertices[1]", "expected 3 numbers, got 2"),
        (
            "{mesh: {vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]}}",
            "objects.mug.shape.mesh.vertices, line 12",
            "within 0 mm of a plane",
        ),
        ("{mesh: {file: cup.obj}}", "objects.mug.shape.mesh.file", "this scene has no folder"),
        ("{compound: []}", "objects.mug.shape.compound", "got 0"),
        ("{compound: [{shape: {compound: []}}]}", "compound[0].shape.compound", "unknown key"),
    ],
)
def test_a_shape_that_is_none_is_refused_in_one_line(plain, build, form, place, words):
    with pytest.raises(SceneInvalid) as caught:
        build(plain.replace(MUG, form))
    message = str(caught.value)
    assert place in message
    assert words in message
    assert "\n" not in message


@pytest.fixture
def load(plain, tmp_path) -> Callable[..., Scenario]:
    """Loads the plain scene with a mug of the mesh file `name`, after writing `text` to cup.obj."""

    def loaded(text: str, name: str = "cup.obj") -> Scenario:
        folder = tmp_path / "scenes"
        folder.mkdir()
        (folder / "cup.obj").write_text(text)
        (tmp_path / "outside.obj").write_text(CUBE_OBJ)
        (folder / "scene.yaml").write_text(plain.replace(MUG, f"{{mesh: {{file: {name}}}}}"))
        return load_scenario(folder / "scene.yaml")

    return loaded


def test_a_mesh_file_beside_the_scene_is_read(load):
    np.testing.assert_allclose(extents(load(CUBE_OBJ).bodies["mug"].shape), 0.1)


@pytest.mark.parametrize(
    ("text", "name", "words"),
    [
        (CUBE_OBJ, "cap.obj", "no such file"),
        (CUBE_OBJ, "../outside.obj", "outside the scene file's folder"),
        (CUBE_OBJ, "/etc/hostname", "outside the scene file's folder"),
        (CUBE_OBJ, "scene.yaml", "expected a Wavefront .obj file"),
        ("nothing\n", "cup.obj", "holds no vertex"),
        ("v 0 0\n", "cup.obj", "line 1 is no vertex"),
        ("v 0 0 nan\n", "cup.obj", "beyond 10 m"),
        (ANGLE_OBJ, "cup.obj", "is not convex (its surface lies up to 20 mm inside"),
        (ANGLE_OBJ + "f 1/2 3/x -1//4\nf 1 2 13\n", "cup.obj", "line 20 is no face"),
        (CUBE_OBJ + "v 0.05 0.05 0.02\n", "cup.obj", "is not convex (its surface lies up to 20 mm inside"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n", "cup.obj", "cup.obj: the points lie within 0 mm of a plane"),
    ],
)
def test_a_mesh_file_that_is_of_no_use_is_refused_in_one_line(load, text, name, words):
    with pytest.raises(SceneInvalid) as caught:
        load(text, name)
    assert words in str(caught.value)
    assert "objects.mug.shape.mesh.file, line 12" in str(caught.value)
