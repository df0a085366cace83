"""What a person did wrong, as one line."""

from collections.abc import Iterator
from contextlib import contextmanager


class UserError(Exception):
    """Wrong input. `str` is one line: what, which value, what was expected."""


def one_line_of(error: BaseException) -> str:
    """An error's message on one line."""
    return " ".join(str(error).split()) or type(error).__name__


@contextmanager
def refusing(*kinds: type[Exception], about: str = "") -> Iterator[None]:
    """Errors of these kinds inside the block are a person's: they become a UserError, told after `about`."""
    try:
        yield
    except kinds as error:
        lead = f"{about}: " if about else ""
        raise UserError(lead + one_line_of(error)) from error
