"""`bt-tamp generate`: writes a scene that `validate` accepts, and refuses what it can't do in one line."""

import pytest

from bt_tamp.cli import main
from bt_tamp.commands.generate import KINDS
from scenarios import spoilers


def test_a_generated_file_is_a_valid_scene(tmp_path, capsys):
    file = tmp_path / "tables" / "three.yaml"
    assert main(["generate", "--seed", "3", "--objects", "5", "--out", str(file)]) == 0
    assert main(["validate", str(file)]) == 0
    told = capsys.readouterr().out
    assert "Solvable by construction" in told
    assert file.read_text().startswith("# bt-tamp generate --seed 3 --objects 5\n")


def test_the_command_line_offers_every_kind_there_is():
    assert KINDS == spoilers.KINDS


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--objects", "99"], "99 objects, expected 1 to"),
        (["--seed", "-2"], "seed -2, expected 0 or above"),
        (["--unsolvable", "odd"], "invalid choice: 'odd'"),
    ],
)
def test_what_can_not_be_generated_is_told_in_one_line(tmp_path, capsys, arguments, words):
    assert main(["generate", "--out", str(tmp_path / "x.yaml"), *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


def test_a_place_where_nothing_can_be_written_is_told_in_one_line(tmp_path, capsys):
    assert main(["generate", "--objects", "2", "--out", str(tmp_path)]) == 2
    assert "can't be written" in capsys.readouterr().err
