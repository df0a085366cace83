import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from bt_tamp.cli import COMMANDS, main
from bt_tamp.display import has_display
from bt_tamp.disturb.names import CLASSES
from planner.search_then_sample import SearchThenSample

TABLE = """\
version: 1
name: table
robot: {model: iiwa14_wsg50}
table: {size: [2.0, 1.0, 0.05], pose: {xyz: [1.4, 0.0, -0.025]}, friction: 0.5}
regions:
  crate: {kind: bin, size: [0.3, 0.3, 0.13], pose: {xyz: [0.0, 0.75, -0.1]}}
  tray: {kind: dustpan, size: [0.3, 0.2, 0.05], pose: {xyz: [0.7, -0.6, -0.06]}, open_side: +y}
objects:
"""

WALLED_IN = f"""{TABLE}
  buoy: {{shape: {{box: [0.05, 0.05, 0.08]}}, mass: 0.2, pose: {{on: table, xy: [0.6, 0.0]}}}}
fixed:
  east: {{shape: {{box: [0.02, 0.1, 0.3]}}, pose: {{on: table, xy: [0.64, 0.0]}}}}
  west: {{shape: {{box: [0.02, 0.1, 0.3]}}, pose: {{on: table, xy: [0.56, 0.0]}}}}
  north: {{shape: {{box: [0.056, 0.02, 0.3]}}, pose: {{on: table, xy: [0.6, 0.04]}}}}
  south: {{shape: {{box: [0.056, 0.02, 0.3]}}, pose: {{on: table, xy: [0.6, -0.04]}}}}
goal: "(and (in_bin buoy crate))"
"""

WITHOUT_SPONGE = f"""{TABLE}
  pea: {{shape: {{sphere: {{radius: 0.01}}}}, mass: 0.01, pose: {{on: table, xy: [0.6, 0.0]}}}}
goal: "(and (in_bin pea tray))"
"""

ROOT = Path(__file__).parents[2]

KEYS = (
    "scenario seed outcome goal plan executed learned rounds replans planning_cpu_s planning_wall_s robot_s wall_s "
    "peak_contact_force_n torque_limit_violations unintended_contacts pressed peak_rss_mb energy_j reproducible"
).split()


@pytest.fixture(autouse=True)
def _alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "walled.yaml").write_text(WALLED_IN)
    (tmp_path / "spongeless.yaml").write_text(WITHOUT_SPONGE)


@pytest.fixture(scope="module")
def cut_short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that gave up in its first action."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    assert main(["run", "fig2", "--seed", "2", "--max-sim-time", "0.8", "--out", str(folder)]) == 12
    return folder


def test_help_names_every_command_and_needs_no_engine() -> None:
    code = "import sys; from bt_tamp.cli import main; main(['--help']); sys.exit('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert all(f"  {name}" in done.stdout for name in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--help"]) == 0
    assert f"bt-tamp {command}" in capsys.readouterr().out


def test_every_shipped_scene_is_listed_and_valid(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    names = capsys.readouterr().out.split()
    assert {"fig1", "fig1_wipe", "fig2", "fig3"} <= set(names)
    assert main(["validate", *names]) == 0


def test_every_class_of_disturbances_is_listed_with_what_it_does(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "--disturbances"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(CLASSES)
    assert "taken away for good (the goal is out of reach then)" in next(x for x in lines if x.startswith("taken-for"))


def test_every_file_is_validated_also_after_one_that_is_not_fine(tmp_path, capfd):
    (tmp_path / "bad.yaml").write_text("version: 1\n")
    assert main(["validate", str(tmp_path / "bad.yaml"), str(tmp_path / "none.yaml"), "fig1"]) == 2
    said = capfd.readouterr()
    first, second = said.err.splitlines()
    assert "bad.yaml" in first
    assert "none.yaml" in second
    assert said.out.startswith("fig1: scene 'fig1' is fine")


def test_the_schema_is_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert "objects" in json.loads(capsys.readouterr().out)["properties"]


def test_a_run_that_gives_up_leaves_a_whole_folder(cut_short: Path) -> None:
    result = json.loads((cut_short / "result.json").read_text())
    assert set(KEYS) <= set(result)
    assert (result["scenario"], result["seed"], result["outcome"]) == ("fig2", 2, "gave_up")
    assert result["goal"]
    assert not any(result["goal"].values())
    assert result["plan"]
    files = {str(path.relative_to(cut_short)) for path in cut_short.rglob("*") if path.is_file()}
    assert {"events.jsonl", "scenario.json", "signals.npz", "plans/round-01.txt"} <= files
    assert {"pddl/round-01-domain.pddl", "pddl/round-01-problem.pddl"} <= files
    assert {"trees/000-planned.svg", "trees/000-planned.txt", "trees/001-end.svg", "trees/001-end.txt"} <= files
    assert not [name for name in files if name.rpartition("/")[2].startswith(".")]


def test_a_display_that_is_not_there_gives_no_window(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":4711")
    assert not has_display()


def test_the_story_of_a_run_can_be_told(cut_short: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", str(cut_short)]) == 0
    told = capsys.readouterr().out
    assert "Plan 1" in told
    assert "The run gave up: 0.8 s of simulated time have passed." in told


@pytest.mark.parametrize("form", ["ascii", "unicode", "dot", "svg", "html"])
def test_the_last_tree_of_a_run_is_shown(form: str, cut_short: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tree", str(cut_short), "--format", form]) == 0
    shown = capsys.readouterr().out
    assert "pick(sponge, dustpan)" in shown
    assert form != "ascii" or shown.isascii()


def test_a_folder_with_a_result_is_replaced_only_by_force(cut_short: Path, capsys: pytest.CaptureFixture[str]) -> None:
    again = ["run", "fig2", "--max-sim-time", "0.1", "--out", str(cut_short)]
    before = (cut_short / "result.json").read_text()
    assert main(again) == 2
    assert (cut_short / "result.json").read_text() == before
    copy = cut_short.parent / "copy"
    again[-1] = str(copy)
    assert [main(again), main(again), main([*again, "--force"])] == [12, 2, 12]
    assert capsys.readouterr().out.rstrip().endswith(str(copy))


def test_without_out_runs_are_numbered(tmp_path: Path) -> None:
    for _ in range(2):
        assert main(["run", "fig2", "--max-sim-time", "0.05"]) == 12
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == ["fig2-0", "fig2-0-2"]


@pytest.mark.parametrize("command", ["plan", "run", "tree"])
@pytest.mark.parametrize(("scene", "code", "named"), [("spongeless", 10, "pea"), ("walled", 11, "buoy")])
def test_without_a_plan_the_exit_code_tells_proof_from_budget(
    command: str, scene: str, code: int, named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, f"{scene}.yaml"]) == code
    said = capsys.readouterr()
    assert named in said.out + said.err


def test_a_plan_is_printed_with_its_phases(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "fig2"]) == 0
    said = capsys.readouterr().out
    assert "1. pick(sponge, dustpan)" in said
    assert "stroke" in said


def test_a_scene_is_shown_as_a_picture_and_as_facts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", "fig2", "--out", "fig2.png"]) == 0
    said = capsys.readouterr().out
    assert "in_bin(sponge, dustpan)" in said
    assert (tmp_path / "fig2.png").read_bytes().startswith(b"\x89PNG")


def test_the_tree_that_would_run_is_written(tmp_path: Path) -> None:
    assert main(["tree", "fig2", "--format", "svg", "--out", "tree.svg"]) == 0
    assert "wipe(cube, table, dustpan)" in (tmp_path / "tree.svg").read_text()


def test_a_run_outlives_the_reader_of_its_lines(tmp_path: Path) -> None:
    run = [sys.executable, "-m", "bt_tamp", "run", "fig2", "--max-sim-time", "0.3", "--out", str(tmp_path / "run")]
    process = subprocess.Popen(run, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    assert process.wait(timeout=60) == 12
    assert process.stderr.read() == ""
    assert (tmp_path / "run" / "result.json").exists()


def test_an_interrupted_run_says_so_in_a_whole_folder(tmp_path: Path) -> None:
    run = [sys.executable, "-m", "bt_tamp", "run", "fig2", "--out", str(tmp_path / "run")]
    process = subprocess.Popen(run, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    for line in process.stdout:
        if "pick(sponge" in line and ": pre-grasp" in line:
            time.sleep(0.2)
            process.send_signal(signal.SIGINT)
            break
    said, complaints = process.communicate(timeout=60)
    assert process.returncode == 130
    assert complaints == ""
    assert str(tmp_path / "run") in said
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["outcome"] == "interrupted"
    assert "brought to rest" in result["reason"]
    with np.load(tmp_path / "run" / "signals.npz") as signals:
        assert np.abs(signals["v"][-1]).max() < 0.05
    assert (tmp_path / "run" / "state.json").exists()
    assert (tmp_path / "run" / "signals.npz").exists()


def test_an_error_in_our_own_code_ends_a_run_with_a_whole_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(self: SearchThenSample, *_: object) -> None:
        raise RuntimeError("broken on purpose")

    monkeypatch.setattr(SearchThenSample, "plan", broken)

    assert main(["run", "fig2", "--out", str(tmp_path / "run")]) == 1
    assert "broken on purpose" in capsys.readouterr().out
    assert "RuntimeError" in (tmp_path / "run" / "crash.txt").read_text()
    assert json.loads((tmp_path / "run" / "result.json").read_text())["outcome"] == "crashed"


@pytest.mark.parametrize(
    ("objects", "goal", "reason"),
    [
        (
            "  brick: {shape: {box: [0.09, 0.09, 0.12]}, mass: 0.3, pose: {on: table, xy: [0.6, 0.1]}}",
            "(in_bin brick cup)",
            "brick is 9.0 cm thick, which is more than the 6.0 cm inside cup",
        ),
        (
            "  can: {shape: {box: [0.06, 0.06, 0.1]}, mass: 0.3, pose: {on: table, xy: [2.2, 0.1]}}",
            "(in_bin can crate)",
            "from the shoulder, the arm reaches",
        ),
        (
            "  pea: {shape: {box: [0.02, 0.02, 0.02]}, mass: 0.01, pose: {on: table, xy: [0.6, 0.1]}}",
            "(in_bin pea tray)",
            "wipe needs is_sponge(some tool), which holds of nothing here",
        ),
    ],
)
def test_what_geometry_rules_out_is_proven_and_said(
    objects: str, goal: str, reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cup = "  cup: {kind: bin, size: [0.08, 0.08, 0.08], pose: {xyz: [0.0, -0.75, -0.1]}}\n"
    (tmp_path / "scene.yaml").write_text(f"{TABLE.replace('objects:', cup + 'objects:')}{objects}\ngoal: {goal!r}\n")

    assert main(["plan", str(tmp_path / "scene.yaml")]) == 10
    assert reason in " ".join(capsys.readouterr().out.split())
