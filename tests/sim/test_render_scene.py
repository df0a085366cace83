import numpy as np
import pinocchio as pin
import pytest

from scenarios.load import load_scenario
from scenarios.shapes import extents
from sim.render import Backdrop, Renderer, overview
from sim.render_camera import Camera, distances
from sim.render_stage import LIGHT_FROM, Stage, add_room

WIDTH, HEIGHT = 320, 180
FOOT = 0.12


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("fig1", 0)


@pytest.fixture(scope="module")
def renderer(scenario):
    with Renderer(scenario, Backdrop.of(scenario, WIDTH, HEIGHT, FOOT), "tiny") as made:
        yield made


@pytest.fixture
def poses(scenario):
    return {name: pin.SE3ToXYZQUAT(body.X_WO) for name, body in scenario.bodies.items()}


def at(picture: np.ndarray, camera: Camera, point: np.ndarray) -> np.ndarray:
    x, y = camera.project(point)[0].astype(int)
    return picture[y, x].astype(int)


def top_of(scenario, poses, name):
    return poses[name][:3] + np.array([0, 0, extents(scenario.bodies[name].shape)[2] / 2])


def test_the_camera_has_every_corner_in_its_picture_and_keeps_the_foot_free(scenario):
    camera = overview(scenario, WIDTH, HEIGHT, FOOT)
    half = np.array(scenario.table.size) / 2
    corners = [scenario.table.X_WT.act(half * [x, y, z]) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    corners += [region.X_WR.act(np.array(region.size) / 2) for region in scenario.regions.values()]
    corners += [body.X_WO.translation for body in scenario.bodies.values()]
    x, y = camera.project(np.array(corners)).T
    assert x.min() > 0
    assert x.max() < WIDTH
    assert y.min() > 0
    assert y.max() < HEIGHT * (1 - FOOT)


def test_some_point_touches_the_free_rim_so_no_nearer_camera_would_do():
    points = np.random.default_rng(3).uniform(-1, 1, (50, 3))
    x, y = Camera.seeing(points, np.array([1.0, -0.7, 0.5]), 400, 300, foot=0.2).project(points).T
    touching = [x.min() - 12, 388 - x.max()], [y.min() - 9, 300 * 0.8 - 9 - y.max()]
    assert min(np.abs(pair).max() for pair in touching) < 1e-6
    assert min(np.min(pair) for pair in touching) > -1e-6


def test_a_point_behind_the_camera_is_nowhere():
    camera = Camera.seeing(np.array([[0.0, 0, 0], [0.1, 0, 0]]), np.array([1.0, 0, 0]), 64, 64)
    assert np.isnan(camera.project(camera.eye + np.array([1.0, 0, 0]))).all()


def test_rays_and_projection_are_each_others_inverse():
    camera = Camera.seeing(np.array([[-1.0, -1, 0], [1, 1, 1]]), np.array([1.0, -0.5, 0.8]), 40, 30)
    pixels = camera.project(camera.rays() * 2.5 + camera.eye)
    columns, rows = np.meshgrid(np.arange(40) + 0.5, np.arange(30) + 0.5)
    assert np.allclose(pixels, np.column_stack([columns.ravel(), rows.ravel()]), atol=1e-3)


def test_looking_up_a_point_finds_the_pixel_that_shows_it():
    camera = Camera.seeing(np.array([[-1.0, -1, 0], [1, 1, 1]]), np.array([1.0, -0.5, 0.8]), 40, 30)
    index, away = camera.look_up((camera.rays() * 2.5 + camera.eye).astype(np.float32))
    assert (index == np.arange(1200)).all()
    assert np.allclose(away, 2.5, atol=1e-4)


def test_depth_values_are_told_as_metres():
    assert distances(np.array([0.0, 1.0], dtype=np.float32)) == pytest.approx([0.1, 12.0], rel=1e-3)


def test_every_object_in_sight_is_seen_in_its_colour_where_it_lies(scenario, renderer, poses):
    picture = renderer.picture(scenario.robot.q0, 0.1, poses)
    for name in ("box", "book", "carrot", "sponge"):
        seen = at(picture, renderer.camera, top_of(scenario, poses, name))
        wanted = np.array(scenario.bodies[name].color[:3])
        assert seen @ wanted / np.linalg.norm(seen) / np.linalg.norm(wanted) > 0.97, name


def test_an_object_is_drawn_where_it_was_recorded_not_where_it_began(scenario, renderer, poses):
    before = renderer.picture(scenario.robot.q0, 0.1, poses)
    there = top_of(scenario, poses, "book")
    poses["book"] = poses["book"] + np.array([0, 0.0, 5.0, 0, 0, 0, 0])
    after = renderer.picture(scenario.robot.q0, 0.1, poses)
    assert before[..., 2].astype(int)[tuple(renderer.camera.project(there)[0].astype(int)[::-1])] > 100
    red, _, blue = at(after, renderer.camera, there)
    assert red > blue


def test_a_thing_in_the_air_darkens_the_table_below_it(scenario, renderer, poses):
    spot = scenario.table.X_WT.act(np.array([0.12, 0.05, scenario.table.size[2] / 2]))
    lit = at(renderer.picture(scenario.robot.q0, 0.1, poses), renderer.camera, spot)
    poses["book"] = np.concatenate([spot + 0.3 * LIGHT_FROM / np.linalg.norm(LIGHT_FROM), [0, 0, 0, 1]])
    shaded = at(renderer.picture(scenario.robot.q0, 0.1, poses), renderer.camera, spot)
    assert shaded.sum() < 0.85 * lit.sum()


def test_the_same_state_gives_the_same_pixels(scenario, renderer, poses):
    first = renderer.picture(scenario.robot.q0, 0.1, poses)
    renderer.picture(scenario.robot.q0 + 0.3, 0.0, poses)
    assert (renderer.picture(scenario.robot.q0, 0.1, poses) == first).all()


def test_the_fingers_are_drawn_as_far_apart_as_they_were(scenario, renderer, poses):
    closed = renderer.picture(scenario.robot.q0, 0.0, poses)
    assert (renderer.picture(scenario.robot.q0, 0.1, poses) != closed).any()


def test_a_window_shows_the_same_as_the_whole_picture_there(scenario):
    camera = overview(scenario, WIDTH, HEIGHT, FOOT)
    with Stage("tiny") as stage:
        add_room(stage, scenario)
        whole, far = stage.look(camera)
        part, near = stage.look(camera, (60, 30, 120, 80))
    differing = (np.abs(part.astype(int) - whole[30:110, 60:180]).max(axis=2) > 8).mean()
    assert differing < 0.02
    assert np.median(np.abs(near - far[30:110, 60:180])) < 1e-3


def test_nothing_of_the_arm_is_cut_off_by_the_window(scenario, renderer, poses):
    for q in np.random.default_rng(5).uniform(-1.6, 1.6, (12, 7)):
        left, top, width, height = renderer.window(q, 0.1, poses)
        whole = renderer.picture(q, 0.1, poses, (0, 0, WIDTH, HEIGHT)).astype(int)
        part = renderer.picture(q, 0.1, poses).astype(int)
        assert (np.abs(whole - part).max(axis=2) > 60).mean() < 0.01
        assert width * height <= WIDTH * HEIGHT
        assert 0 <= left < WIDTH
        assert 0 <= top < HEIGHT
