"""Noise on start poses: within bounds, reproducible, each object's own, never into something."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pinocchio import SE3

from scenarios.errors import SceneInvalid
from scenarios.noise import PoseNoise, perturbed, stream
from scenarios.solids import body_solid, overlap


def _noisy(plain: str, xy: float = 0.02) -> str:
    mug = plain.replace("yaw_deg: 30}\n", f"yaw_deg: 30}}\n    noise: {{xy: {xy}, yaw_deg: 10}}\n")
    return mug.replace("xy: [0.7, 0.2]}\n", f"xy: [0.7, 0.2]}}\n    noise: {{xy: {xy}, yaw_deg: 10}}\n")


def _poses(scene):
    return {name: body.X_WO for name, body in scene.bodies.items()}


def test_seed_zero_is_the_scene_as_written(plain, build):
    for name, X_WO in _poses(build(_noisy(plain))).items():
        assert X_WO.isApprox(_poses(build(plain))[name])


def test_the_same_seed_draws_the_same_and_another_seed_another(plain, build):
    text = _noisy(plain)
    first, again, other = (_poses(build(text, seed))["mug"] for seed in (7, 7, 8))
    assert first == again
    assert not first.isApprox(other)


def test_a_body_without_noise_stays(plain, build):
    assert _poses(build(_noisy(plain), 3))["sponge"].isApprox(_poses(build(plain))["sponge"])


@settings(derandomize=True, max_examples=50, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    name=st.text("ab7_-", max_size=6).map(lambda rest: f"x{rest}"),
    xy=st.floats(0, 0.5),
    yaw=st.floats(0, 3),
)
def test_a_draw_stays_within_its_bounds_and_at_its_height(seed, name, xy, yaw):
    X_WO = SE3(np.eye(3), np.array([0.3, -0.2, 0.1]))
    drawn = perturbed(X_WO, PoseNoise(xy, yaw), stream(seed, name))
    shift = drawn.translation - X_WO.translation
    assert np.all(np.abs(shift[:2]) <= xy)
    assert shift[2] == 0.0
    np.testing.assert_allclose(drawn.rotation[:, 2], [0, 0, 1], atol=1e-12)
    assert np.arccos(np.clip(drawn.rotation[0, 0], -1, 1)) <= yaw + 1e-7


def test_draws_are_uniform_over_their_range():
    X_WO, noise = SE3.Identity(), PoseNoise(0.01, 0.1)
    x = np.array([perturbed(X_WO, noise, stream(seed, "mug")).translation[0] for seed in range(400)])
    assert abs(x.mean()) < 0.001
    assert x.std() == pytest.approx(0.01 / np.sqrt(3), rel=0.1)


def test_streams_of_different_names_are_uncorrelated():
    draws = np.array([[stream(seed, name).uniform(-1, 1) for name in ("carrot", "tomato")] for seed in range(400)])
    assert abs(np.corrcoef(draws.T)[0, 1]) < 0.15


def test_a_new_object_changes_no_other_draw(plain, build):
    text = _noisy(plain)
    bean = (
        "  bean: {shape: {sphere: {radius: 0.01}}, mass: 0.01, pose: {on: table, xy: [0.3, -0.3]}, noise: {xy: 0.02}}\n"
    )
    more = text.replace("objects:\n", f"objects:\n{bean}")
    for seed in range(1, 6):
        before, after = _poses(build(text, seed)), _poses(build(more, seed))
        assert all(after[name] == X_WO for name, X_WO in before.items())


def test_the_order_in_the_file_does_not_matter(plain, build):
    text = _noisy(plain, xy=0.2)
    head, rest = text.split("objects:\n")
    mug, rest = rest.split("  pea:\n")
    pea, rest = rest.split("tools:\n")
    swapped = f"{head}objects:\n  pea:\n{pea}{mug}tools:\n{rest}"
    for seed in range(1, 6):
        assert _poses(build(swapped, seed)) == _poses(build(text, seed))


def test_noise_into_something_is_drawn_again(plain, build):
    near = _noisy(plain, xy=0.1).replace("xy: [0.7, 0.2]", "xy: [0.56, 0.0]")
    first_draws_hit = 0
    for seed in range(1, 31):
        scene = build(near, seed)
        mug, pea = scene.bodies["mug"], scene.bodies["pea"]
        assert not overlap(body_solid(mug), body_solid(pea))
        nominal = build(near).bodies["mug"].X_WO
        first = perturbed(nominal, PoseNoise(0.1, np.radians(10)), stream(seed, "mug"))
        first_draws_hit += not mug.X_WO.isApprox(first)
    assert first_draws_hit > 0


def test_noise_never_pushes_a_body_off_the_table(plain, build):
    at_edge = _noisy(plain, xy=0.1).replace("xy: [0.7, 0.2]", "xy: [1.19, 0.0]")
    for seed in range(1, 21):
        assert build(at_edge, seed).bodies["pea"].X_WO.translation[0] <= 1.2 + 1e-4


def test_noise_that_leaves_no_free_place_is_refused(plain, build):
    wedged = plain.replace("[0.1, 0.06, 0.04]", "[0.279, 0.06, 0.04]").replace(
        "xy: [0.7, -0.6]}", "xy: [0.7, -0.6]}\n    noise: {xy: 0.1, yaw_deg: 90}"
    )
    assert build(wedged).bodies["sponge"]
    with pytest.raises(SceneInvalid, match=r"tools\.sponge\.pose, line 25: seed 1: 200 draws found no free place"):
        build(wedged, 1)


def test_what_stands_on_a_moved_body_stays_on_it_or_is_refused(plain, build):
    pea_on_mug = _noisy(plain, xy=0.01).replace("{on: table, xy: [0.7, 0.2]}", "{xyz: [0.5, 0.0, 0.11]}")
    scene = build(pea_on_mug, 4)
    offset = scene.bodies["pea"].X_WO.translation - scene.bodies["mug"].X_WO.translation
    assert np.hypot(*offset[:2]) < 0.04
