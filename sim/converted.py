"""What an engine said of things by name, as our own types."""

from collections.abc import Callable, Iterator, Mapping
from typing import Generic, TypeVar

import numpy as np
import pinocchio as pin
from pinocchio import SE3

T = TypeVar("T")


class Converted(Mapping[str, T], Generic[T]):
    """What the engine said of each body, converted when it is asked for. What has not changed since `before` stays the
    same object, which those who look at it know again."""

    def __init__(
        self,
        raw: dict[str, tuple[float, ...]],
        convert: Callable[[tuple[float, ...]], T],
        before: "Converted[T] | None",
    ) -> None:
        self._raw, self._convert = raw, convert
        self._known: dict[str, T] = {}
        if before is not None:
            self._known = {name: known for name, known in before._known.items() if before._raw[name] == raw.get(name)}

    def __getitem__(self, name: str) -> T:
        if name not in self._known:
            self._known[name] = self._convert(self._raw[name])
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._raw)

    def __len__(self) -> int:
        return len(self._raw)


def pose_of(xyzquat: tuple[float, ...]) -> SE3:
    """The pose with position xyz in metres and quaternion xyzw."""
    return pin.XYZQUATToSE3(np.array(xyzquat))
