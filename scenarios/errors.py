"""What can be wrong with a scene file.

SceneError
├── SceneNotFound    no such scene, no such file
├── SceneUnreadable  something is there, but no text of a sensible size
├── SceneMalformed   text, but not the part of YAML in which scenes are written
└── SceneInvalid     YAML, but no scene of this version, or one that can't stand as written
"""

MAX_LENGTH = 600


class SceneError(Exception):
    """A scene can't be used. `str` is one line: file, place, what is wrong and what was expected.

    `file` is the file's or scene's name as given, `place` a key path and line ("objects.book.mass,
    line 12"); both may be empty.
    """

    def __init__(self, message: str, file: str = "", place: str = "") -> None:
        self.message = one_line(message)
        self.file = one_line(file)
        self.place = one_line(place)
        where = ", ".join(part for part in (self.file, self.place) if part)
        super().__init__(f"{where}: {self.message}" if where else self.message)


class SceneNotFound(SceneError):
    """No scene of that name is known, or no file of that name exists."""


class SceneUnreadable(SceneError):
    """A directory, a device, a file that can't be opened, isn't UTF-8 text, is empty or too big."""


class SceneMalformed(SceneError):
    """Not YAML, or YAML with tags, anchors, duplicate keys or several documents."""


class SceneInvalid(SceneError):
    """Not a scene of this version, or one in which things overlap, float or hang over, or a goal without sense."""


def one_line(text: str) -> str:
    """The text with runs of blanks and line breaks as one blank, unprintable characters escaped, cut when very long."""
    joined = " ".join(text[: 2 * MAX_LENGTH].split())
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in joined)
    return line if len(line) <= MAX_LENGTH else f"{line[: MAX_LENGTH - 1]}…"
