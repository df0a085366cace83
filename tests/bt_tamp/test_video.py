from dataclasses import replace
from types import MappingProxyType

import av
import numpy as np
import pytest
from PIL import Image

from bt_tamp.report.events import Event
from bt_tamp.report.film import Recording, Shot, net_forces, set_points
from bt_tamp.report.folder import EVENTS, SCENARIO, SIGNALS
from bt_tamp.report.overlay import Arrow, Path3, Words, draw
from bt_tamp.report.scenario_json import scenario_to_json
from bt_tamp.report.signals import Contact, Reference, Signals, SignalTable
from bt_tamp.report.timeline import Caption, Timeline
from bt_tamp.report.video import BUDGET_S, PACES, RATE, render_run, shots_of, show_scene, write_film
from scenarios.load import load_scenario
from sim.plant import Observation
from sim.render_camera import Camera
from sim.wrench import Wrench

EVENTS_OF_A_RUN = [
    Event("run_started", 0.0, {"scene": "desk", "seed": 0}),
    Event("learned", 0.1, {"action": "pick(book, table)", "sentence": "book cannot be grasped as it lies"}),
    Event("plan_installed", 0.1, {"actions": ["drag(book, table)", "pick(book, table)"], "rounds": 2}),
    Event("action_started", 0.2, {"action": "drag(book, table)"}),
    Event("phase", 0.3, {"action": "drag(book, table)", "phase": "descend"}),
    Event("action_started", 0.6, {"action": "pick(book, table)"}),
    Event("goal_reached", 0.9, {}),
]
ROBOT = frozenset({"finger_left", "finger_right"})


@pytest.fixture(scope="module")
def scenario():
    return load_scenario("fig2", 0)


def signals_of(scenario, path, seconds: float, contact_from: float = 0.3, contact_until: float = 0.6) -> Signals:
    table = SignalTable(list(scenario.bodies))
    for t in np.arange(0.0, seconds, 0.01):
        q = scenario.robot.q0
        poses = MappingProxyType({name: body.X_WO for name, body in scenario.bodies.items()})
        speeds = {name: np.zeros(6) for name in scenario.bodies}
        seen = Observation(float(t), q, 0 * q, 0 * q, 0.05, 0.0, 0.0, Wrench(np.zeros(3), np.zeros(3)), poses, speeds)
        touching = contact_from <= t < contact_until
        p_WG = np.array([0.5 + 0.5 * (t - contact_from), 0.0, 0.1]) if touching else None
        table.add(seen, Reference(q, p_WG, 10.0 if touching else 0.0), 10.0 if touching else 0.0)
        if touching:
            table.add_contacts(
                float(t), [Contact("finger_left", "table", np.array([0.5, 0, 0.1]), np.array([0, 0, 9.0]))]
            )
    table.save(path)
    return Signals.load(path)


@pytest.fixture
def folder(tmp_path, scenario):
    (tmp_path / SCENARIO).write_text(scenario_to_json(scenario))
    (tmp_path / EVENTS).write_text("\n".join(event.to_line() for event in EVENTS_OF_A_RUN[:5]) + "\n")
    signals_of(scenario, tmp_path / SIGNALS, 0.2)
    return tmp_path


def test_the_caption_tells_action_phase_and_how_far_the_plan_is():
    timeline = Timeline.of(EVENTS_OF_A_RUN)
    assert timeline.caption(0.05).action == "planning"
    assert timeline.caption(0.4) == Caption("drag(book, table)", "descend", 1, 2)
    assert timeline.caption(0.7) == Caption("pick(book, table)", "", 2, 2)
    assert timeline.caption(5.0).action == "done"


def test_the_film_tells_what_was_learned_when_it_was_learned():
    timeline = Timeline.of(EVENTS_OF_A_RUN)
    assert timeline.told_between(0.05, 0.15) == ("learned: book cannot be grasped as it lies",)
    assert timeline.told_between(0.15, 0.8) == ()


def test_a_flood_of_findings_is_cut_to_the_last_ones():
    events = [Event("learned", 0.1, {"action": "a", "sentence": f"finding {k}"}) for k in range(12)]
    told = Timeline.of(events).told_between(0.0, 1.0)
    assert told == ("(9 earlier findings)", "learned: finding 9", "learned: finding 10", "learned: finding 11")


def test_the_squeeze_of_two_fingers_cancels_and_the_weight_is_left():
    pairs = [("finger_left", "book"), ("book", "finger_right")]
    points = np.array([[0.0, 0.1, 0.0], [0.0, -0.1, 0.0]])
    forces = np.array([[0.0, 40.0, -2.0], [0.0, 40.0, 2.0]])
    (arrow,) = net_forces(pairs, points, forces, ROBOT)
    assert arrow.force == pytest.approx([0.0, 0.0, -4.0])
    assert arrow.point == pytest.approx([0.0, 0.0, 0.0])


def test_a_thing_in_the_hand_shows_what_the_table_does_to_it():
    pairs = [("finger_left", "sponge"), ("table", "sponge")]
    (arrow,) = net_forces(pairs, np.zeros((2, 3)), np.array([[0.0, 40.0, 9.0], [1.0, 0.0, -10.0]]), ROBOT)
    assert arrow.force == pytest.approx([-1.0, 0.0, 10.0])


def test_set_points_are_those_of_the_present_spell_of_contact_evenly_spaced(tmp_path, scenario):
    signals = signals_of(scenario, tmp_path / "s.npz", 1.0)
    assert set_points(signals, 10) is None
    path = set_points(signals, 45)
    assert path is not None
    assert path.points[0] == pytest.approx([0.5, 0.0, 0.1])
    assert np.diff(path.points[:, 0]) == pytest.approx(0.015)
    assert path.done == 6  # of 7.5 cm: at 0, 1.5, 3, 4.5, 6 and 7.5 cm


def test_an_arrow_is_green_where_the_force_acts_and_points_along_it():
    camera = Camera.seeing(np.array([[-1.0, -1, 0], [1, 1, 1]]), np.array([1.0, -0.5, 0.5]), 320, 180)
    white = np.full((180, 320, 3), 255, np.uint8)
    image = draw(white, camera, [Arrow(np.zeros(3), np.array([0, 0, 25.0]))], None, None).astype(int)
    green = (image[..., 1] - image[..., 0] > 60) & (image[..., 1] - image[..., 2] > 60)
    rows, columns = np.nonzero(green)
    x, y = camera.project(np.zeros(3))[0]
    assert np.median(columns) == pytest.approx(x, abs=2)
    assert rows.max() == pytest.approx(y, abs=4)
    assert rows.min() < y - 10


def test_a_point_outside_the_picture_disturbs_nothing():
    camera = Camera.seeing(np.array([[-1.0, -1, 0], [1, 1, 1]]), np.array([1.0, -0.5, 0.5]), 320, 180)
    white = np.full((180, 320, 3), 255, np.uint8)
    far = Arrow(np.array([40.0, 40, 0]), np.array([0, 0, 5.0]))
    behind = Path3(np.array([camera.eye + np.array([2.0, -1, 1])]), 1)
    assert (draw(white, camera, [far], behind, None) == white).all()


def test_a_sentence_too_long_for_one_line_is_broken_within_the_picture():
    camera = Camera.seeing(np.array([[-1.0, -1, 0], [1, 1, 1]]), np.array([1.0, -0.5, 0.5]), 1280, 720)
    white = np.full((720, 1280, 3), 255, np.uint8)
    words = Words(Caption("pick(a, b)", "close", 1, 2), 1.0, 3.0, 4.0, ("word " * 60,))
    changed = (draw(white, camera, [], None, words)[:600] != 255).any(axis=(0, 2))
    assert np.flatnonzero(changed).max() < 640


@pytest.mark.parametrize(("cost", "pace"), [(1e-6, PACES[0]), (0.1, PACES[4]), (1e6, PACES[-1])])
def test_the_time_a_picture_takes_decides_how_many_there_are(scenario, tmp_path, cost, pace):
    signals = replace(signals_of(scenario, tmp_path / "s.npz", 0.5), t=np.linspace(0.0, 40.0, 50))
    shots = shots_of(Recording(scenario, signals, Timeline.of([])), cost)
    speed, hold = pace
    assert shots[0][0].speed == speed
    assert len(shots) == int(np.ceil(40.0 / speed / hold * RATE)) + 1
    assert sum(repeats for _, repeats in shots) / RATE == pytest.approx(40.0 / speed, abs=2.0)
    assert pace == PACES[-1] or len(shots) * cost <= BUDGET_S * 1.01


def test_the_film_stands_still_while_something_is_told(scenario, tmp_path):
    signals = replace(signals_of(scenario, tmp_path / "s.npz", 0.5), t=np.linspace(0.0, 1.0, 50))
    shots = shots_of(Recording(scenario, signals, Timeline.of(EVENTS_OF_A_RUN)), 1e-6)
    held = [shot for shot, repeats in shots[:-1] if repeats > RATE]
    assert [shot.told[0] for shot in held] == ["learned: book cannot be grasped as it lies", "goal reached"]


def test_what_is_told_after_the_last_sample_still_ends_the_film(scenario, tmp_path):
    recording = Recording(scenario, signals_of(scenario, tmp_path / "s.npz", 0.5), Timeline.of(EVENTS_OF_A_RUN))
    assert shots_of(recording, 1e-6)[-1][0].told == ("goal reached",)


def test_a_film_is_h264_with_every_picture_as_often_as_its_shot_says(tmp_path):
    pictures = [np.full((36, 64, 3), 60 * k, np.uint8) for k in range(3)]
    shots = [(Shot(float(k), 1.0), repeats) for k, repeats in enumerate((3, 1, 30))]
    done = []
    write_film(tmp_path / "film.mp4", shots, pictures, lambda n, total: done.append((n, total)), (64, 36))
    with av.open(str(tmp_path / "film.mp4")) as film:
        stream = film.streams.video[0]
        shown = [frame.to_ndarray(format="rgb24").mean() for frame in film.decode(stream)]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
    assert np.array(shown) == pytest.approx(np.repeat([0, 60, 120], [3, 1, 30]), abs=6)
    assert done == [(1, 3), (2, 3), (3, 3)]


def test_a_run_becomes_a_film_of_720_lines_in_its_folder(folder):
    video = render_run(folder)
    assert video == folder / "video.mp4"
    with av.open(str(video)) as film:
        stream = film.streams.video[0]
        assert (stream.width, stream.height) == (1280, 720)
        assert stream.frames > RATE


def test_a_folder_without_samples_gives_no_film_and_no_half_of_one(folder, scenario):
    SignalTable(list(scenario.bodies)).save(folder / SIGNALS)
    with pytest.raises(ValueError, match="holds no sample"):
        render_run(folder)
    assert not list(folder.glob("*.mp4"))


def test_a_scene_is_shown_as_a_picture(tmp_path, scenario):
    picture = Image.open(show_scene(scenario, tmp_path / "scene.png"))
    assert picture.size == (1280, 720)
    assert len(picture.convert("RGB").getcolors(1 << 20) or []) > 100
