"""YAML text as plain data, and the line on which each value stands.

Scenes need mappings, lists, text, numbers, true, false and null; tags, anchors, aliases, merge
keys, duplicate keys and further documents are refused. Plain scalars are read as YAML 1.2's core
schema does, so that the key `on` stays text.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

import yaml

from scenarios.errors import SceneMalformed, SceneNotFound, SceneUnreadable

MAX_BYTES = 1_000_000
MAX_DEPTH = 16

KeyPath = tuple[str | int, ...]

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_INTEGER = re.compile(r"[-+]?[0-9]{1,15}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITY = re.compile(r"([-+]?)\.(inf|Inf|INF)")
_CONSTANTS = {"": None, "~": None, "null": None, "true": True, "false": False, ".nan": float("nan")}


@dataclass(frozen=True)
class Document:
    """Plain data as read from `file`; `lines` counts from 1. `folder` holds what the file refers to (None: nothing)."""

    file: str
    data: Any
    lines: dict[KeyPath, int]
    folder: Path | None = None

    def line(self, path: KeyPath) -> int:
        """The line of a key path, or of its nearest parent."""
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path, 1)

    def place(self, path: KeyPath) -> str:
        """A place for people: the key path and its line."""
        line = f"line {self.line(path)}"
        return f"{dotted(path)}, {line}" if path else line


def dotted(path: KeyPath) -> str:
    """A key path as text, `objects.book.shape.box[1]`."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).removeprefix(".")


def read_document(path: Path, file: str) -> Document:
    """Read one YAML file. Raises SceneNotFound, SceneUnreadable or SceneMalformed, naming it `file`."""
    try:
        if path.is_dir():
            raise SceneUnreadable("is a directory, expected a scene file", file)
        if not path.exists():
            raise SceneNotFound("no such file, expected a scene file", file)
        if not path.is_file():
            raise SceneUnreadable("is no regular file, expected a scene file", file)
        if path.stat().st_size > MAX_BYTES:
            raise SceneUnreadable(f"is {path.stat().st_size} bytes, expected at most {MAX_BYTES}", file)
        raw = path.read_bytes()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise SceneUnreadable(f"can't be read ({reason}), expected a scene file", file) from None
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneUnreadable(f"byte {error.start} is not UTF-8, expected a text file", file) from None
    if "\0" in text:
        raise SceneUnreadable("is binary, expected a text file", file)
    return replace(parse_document(text, file), folder=path.parent)


def parse_document(text: str, file: str) -> Document:
    """Turn YAML text into plain data. Raises SceneUnreadable (empty) or SceneMalformed, naming it `file`."""
    try:
        return _Builder(file, yaml.parse(text, Loader=_LOADER)).document()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = " ".join(part for part in (error.context, error.problem) if part)
        place = f"line {mark.line + 1}" if mark else ""
        raise SceneMalformed(f"malformed YAML ({what}), expected a scene", file, place) from None
    except yaml.YAMLError as error:
        raise SceneMalformed(f"malformed YAML ({error}), expected a scene", file) from None


class _Builder:
    def __init__(self, file: str, events: Iterator[Any]) -> None:
        self.file = file
        self.events = events
        self.lines: dict[KeyPath, int] = {}

    def document(self) -> Document:
        next(self.events)
        if isinstance(next(self.events), yaml.StreamEndEvent):
            raise SceneUnreadable("is empty, expected a scene", self.file)
        data = self.value(next(self.events), ())
        next(self.events)
        event = next(self.events)
        if not isinstance(event, yaml.StreamEndEvent):
            self.refuse(event, (), "a second document begins, expected one")
        return Document(self.file, data, self.lines)

    def value(self, event: Any, path: KeyPath) -> Any:
        self.lines.setdefault(path, event.start_mark.line + 1)
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            self.refuse(event, path, "anchors and aliases are not read, expected the value written out")
        if event.tag is not None:
            self.refuse(event, path, f"tag {event.tag!r} is not read, expected plain data")
        if len(path) > MAX_DEPTH:
            self.refuse(event, path[:4], f"is nested deeper than {MAX_DEPTH} levels, expected a scene")
        if isinstance(event, yaml.ScalarEvent):
            return event.value if event.style else _plain(event.value)
        if isinstance(event, yaml.SequenceStartEvent):
            return self.sequence(path)
        return self.mapping(path)

    def sequence(self, path: KeyPath) -> list[Any]:
        items: list[Any] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            items.append(self.value(event, (*path, len(items))))
        return items

    def mapping(self, path: KeyPath) -> dict[str, Any]:
        items: dict[str, Any] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent) or event.tag is not None or event.anchor is not None:
                self.refuse(event, path, "a key is not plain text, expected a name")
            key = event.value
            if key in items:
                first = self.lines[(*path, key)]
                self.refuse(event, path, f"key {key!r} is given twice (first on line {first}), expected once")
            self.lines[(*path, key)] = event.start_mark.line + 1
            items[key] = self.value(next(self.events), (*path, key))
        return items

    def refuse(self, event: Any, path: KeyPath, message: str) -> NoReturn:
        line = f"line {event.start_mark.line + 1}"
        raise SceneMalformed(message, self.file, f"{dotted(path)}, {line}" if path else line)


def _plain(text: str) -> Any:
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if match := _INFINITY.fullmatch(text):
        return float(f"{match[1]}inf")
    return text
