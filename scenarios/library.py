"""The scenes that ship with the package, and how a name or path on the command line finds its file."""

from importlib.resources import files
from pathlib import Path

from scenarios.errors import SceneNotFound
from scenarios.names import known


def list_scenarios() -> list[str]:
    """Names of the scenes that ship with the package, sorted."""
    return sorted(Path(entry.name).stem for entry in files("scenarios").iterdir() if entry.name.endswith(".yaml"))


def scenario_path(name_or_path: str | Path) -> Path:
    """The file of a scene: a shipped one's by its bare name, anything else is a path.

    Raises SceneNotFound for a bare name that is neither, listing the known ones.
    """
    text = str(name_or_path)
    if text in list_scenarios():
        return Path(str(files("scenarios"))) / f"{text}.yaml"
    path = Path(name_or_path)
    is_bare = path.name == text and path.suffix not in (".yaml", ".yml")
    if is_bare and not _exists(path):
        raise SceneNotFound(f"unknown scene, {known(text, list_scenarios())}, or a path to a file", text)
    return path


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):
        return False
