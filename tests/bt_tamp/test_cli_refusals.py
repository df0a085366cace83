from pathlib import Path

import pytest

from bt_tamp.cli import main

SCENE = """\
version: 1
name: small
robot: {model: iiwa14_wsg50}
table: {size: [0.6, 0.8, 0.05], pose: {xyz: [0.6, 0.0, -0.025]}, friction: 0.5}
regions:
  crate: {kind: bin, size: [0.3, 0.3, 0.13], pose: {xyz: [0.0, 0.65, -0.1]}}
objects:
  mug: {shape: {box: [0.05, 0.05, 0.08]}, mass: 0.2, pose: {on: table, xy: [0.5, 0.0]}, home: crate}
goal: "(and (in_bin mug crate))"
"""

DOMAIN = Path(__file__).parents[2] / "skills" / "domain.pddl"


@pytest.fixture(autouse=True)
def _alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(SCENE)
    (tmp_path / "a-file").write_text("here already")
    (tmp_path / "binary.yaml").write_bytes(bytes(range(256)))
    (tmp_path / "empty.yaml").write_text("")
    (tmp_path / "bomb.yaml").write_text("a: &a [1, 1]\nb: &b [*a, *a]\nc: [*b, *b]\n")
    (tmp_path / "tagged.yaml").write_text("!!python/object/apply:os.system ['true']\n")
    (tmp_path / "misspelt.yaml").write_text(SCENE.replace("mass", "mas"))
    (tmp_path / "weightless.yaml").write_text(SCENE.replace("mass: 0.2", "mass: -0.2"))
    (tmp_path / "goal.yaml").write_text(SCENE.replace("in_bin mug", "in_bin mgu"))
    (tmp_path / "sunk.yaml").write_text(SCENE.replace("50}", "50, base: {xyz: [0.4, 0.0, -0.04]}}"))
    (tmp_path / "low.yaml").write_text(SCENE.replace("50}", "50, q0_deg: [0, 95, 0, -20, 0, 60, 0]}"))
    (tmp_path / "off.yaml").write_text(SCENE.replace("xy: [0.5, 0.0]", "xy: [0.5, 2.0]"))
    take = SCENE + "disturbances: [{action: pick, phase: pregrasp, take: {object: mug}}]\n"
    (tmp_path / "waits.yaml").write_text(take)
    (tmp_path / "unheard.yaml").write_text(take.replace("pick", "pik"))
    (tmp_path / "broken.pddl").write_text("(define (problem p)")
    (tmp_path / "other.pddl").write_text(
        "(define (problem p) (:domain table) (:objects ghost - movable) (:init) (:goal ()))"
    )
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "result.json").write_text("{}")


REFUSED = [
    ([], "name a command"),
    (["dance"], "dance"),
    (["run"], "SCENE"),
    (["run", "small.yml"], "small.yml"),
    (["run", "fig0"], "unknown scene"),
    (["run", "binary.yaml"], "binary.yaml"),
    (["run", "empty.yaml"], "empty.yaml"),
    (["run", "bomb.yaml"], "bomb.yaml"),
    (["run", "tagged.yaml"], "tagged.yaml"),
    (["run", "misspelt.yaml"], "misspelt.yaml, objects.mug"),
    (["run", "weightless.yaml"], "objects.mug.mass"),
    (["run", "goal.yaml"], "mgu"),
    (["run", "off.yaml"], "objects.mug"),
    (["run", "."], "."),
    (["validate", "goal.yaml"], "goal.yaml, goal"),
    (["validate", "sunk.yaml"], "sunk.yaml, robot.base: the robot's base stands in 'table'"),
    (["run", "waits.yaml"], "waits.yaml, disturbances[0].phase: unknown phase 'pregrasp' of pick, did you mean 'pre-"),
    (["validate", "unheard.yaml"], "unheard.yaml, disturbances[0].action: unknown action 'pik', did you mean 'pick'"),
    (["plan", "low.yaml"], "low.yaml, robot.q0_deg: the arm starts in collision ("),
    (["run", "small.yaml", "--seed", "-1"], "-1"),
    (["run", "small.yaml", "--seed", "one"], "one"),
    (["run", "small.yaml", "--tries", "0"], "--tries 0"),
    (["run", "small.yaml", "--max-sim-time", "nan"], "--max-sim-time nan"),
    (["run", "small.yaml", "--contact", "gentle"], "gentle"),
    (["run", "small.yaml", "--search", "guessing"], "guessing"),
    (["run", "small.yaml", "--motion-planner", "teleport"], "teleport"),
    (["run", "small.yaml", "--domain", "broken.pddl"], "--problem"),
    (["run", "small.yaml", "--out", "a-file"], "a-file"),
    (["run", "small.yaml", "--out", "a-file/below"], "a-file"),
    (["run", "small.yaml", "--out", "old"], "--force"),
    (["run", "small.yaml", "--domain", str(DOMAIN), "--problem", "broken.pddl"], "broken.pddl"),
    (["plan", "small.yaml", "--domain", str(DOMAIN), "--problem", "missing.pddl"], "missing.pddl"),
    (["plan", "small.yaml", "--domain", str(DOMAIN), "--problem", "other.pddl"], "other.pddl"),
    (["tree", "small.yaml", "--format", "pdf"], "pdf"),
    (["tree", "old"], "old"),
    (["explain", "nowhere"], "nowhere"),
    (["explain", "old"], "events.jsonl"),
    (["sweep", "fig0", "--store", "s.db"], "unknown scene"),
    (["sweep", "low.yaml", "--store", "s.db"], "low.yaml, robot.q0_deg: the arm starts in collision ("),
    (["sweep", "small.yaml", "--seeds", "3:1", "--store", "s.db"], "3:1"),
    (["sweep", "small.yaml", "--seeds", "a:b", "--store", "s.db"], "a:b"),
    (["sweep", "small.yaml", "--jobs", "0", "--store", "s.db"], "--jobs"),
    (["sweep", "small.yaml", "--store", "binary.yaml"], "binary.yaml"),
    (["sweep", "small.yaml", "--store", "no/such/place.db"], "place.db"),
]


@pytest.mark.parametrize(("argv", "named"), REFUSED, ids=[" ".join(argv)[-60:] or "nothing" for argv, _ in REFUSED])
def test_wrong_input_is_one_line_and_leaves_nothing_behind(
    argv: list[str], named: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}

    code = main(argv)

    said = capfd.readouterr()
    lines = said.err.splitlines()
    assert code == 2
    assert len(lines) == 1
    assert lines[0].startswith("bt-tamp: ")
    assert named in lines[0]
    assert said.out == ""
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder that not even root can write")
def test_a_folder_that_cannot_be_written_is_refused(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "small.yaml", "--out", "/proc/self/run"]) == 2
    assert len(capfd.readouterr().err.splitlines()) == 1
