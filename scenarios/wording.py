"""What pydantic finds wrong with a scene, told in our words."""

from typing import Any

from pydantic_core import ErrorDetails

from scenarios.document import KeyPath

LISTS_OF_ENTRIES = ("disturbances", "compound")
"""Keys whose lists hold mappings, not numbers."""


def path_of(error: ErrorDetails) -> KeyPath:
    """The key path of a problem in the file."""
    path = tuple(key for key in error["loc"] if not (isinstance(key, str) and key.startswith("<")))
    if error["type"] == "missing":
        return path[:-1]
    key = error.get("ctx", {}).get("key", "")
    return (*path, key) if key else path


def message_of(error: ErrorDetails) -> str:
    """What is wrong there, and what was expected."""
    kind, context = error["type"], error.get("ctx", {})
    got = f"got {shown(error['input'])}"
    match kind:
        case "scene":
            return str(context["message"])
        case "missing":
            return f"missing key {error['loc'][-1]!r}, expected it here"
        case "float_type":
            return f"expected a number, {got}"
        case "int_type" | "int_from_float":
            return f"expected a whole number, {got}"
        case "finite_number":
            return f"expected a finite number, {got}"
        case "greater_than_equal" | "greater_than" | "less_than_equal" | "less_than":
            words = {"greater_than_equal": "of at least", "greater_than": "above", "less_than": "below"}
            bound = context.get("ge", context.get("gt", context.get("le", context.get("lt"))))
            return f"expected a number {words.get(kind, 'of at most')} {bound:g}, {got}"
        case "too_short" | "too_long" if _holds_more_than_numbers(error["input"]):
            bound = "at least" if kind == "too_short" else "at most"
            count = context.get("min_length", context.get("max_length"))
            return f"expected {bound} {count} entries, got {len(error['input'])}"
        case "too_short" | "too_long" if isinstance(error["input"], list):
            count = context.get("min_length", context.get("max_length"))
            return f"expected {count} numbers, got {len(error['input'])}"
        case "too_long":
            return f"expected at most {context['max_length']} entries, got {len(error['input'])}"
        case "literal_error":
            return f"expected {context['expected']}, {got}"
        case "list_type" if error["loc"][-1] in LISTS_OF_ENTRIES:
            return f"expected a list of entries, {got}"
        case "list_type":
            return f"expected a list of numbers, {got}"
        case "model_type" | "dict_type" | "model_attributes_type":
            return f"expected a mapping, {got}"
        case "string_type":
            return f"expected text, {got}"
        case "string_pattern_mismatch":
            return f"expected text like #3355aa, {got}"
    return f"{error['msg']}, {got}"


def _holds_more_than_numbers(value: Any) -> bool:
    return isinstance(value, list) and any(isinstance(entry, list | dict) for entry in value)


def shown(value: Any) -> str:
    """A value as it is told to people."""
    match value:
        case None:
            return "nothing"
        case dict():
            return "a mapping"
        case list():
            return "a list"
        case bool():
            return str(value).lower()
        case str():
            return repr(value if len(value) <= 40 else f"{value[:39]}…")
    return f"{value:g}" if isinstance(value, float) else str(value)
