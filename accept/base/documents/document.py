"""Base of all typed documents: they are dataclasses, and pydantic reads and writes their JSON."""

import json
from collections.abc import Callable
from dataclasses import fields
from functools import cache
from typing import Any, Self, get_args, get_type_hints

from pydantic import BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic_core import CoreConfig, PydanticSerializationError, SchemaValidator

from specs.errors import AcceptError
from specs.files import json_of
from specs.strict import problem_line

Number = int | float  # a whole number that was written as one is written so again


class DocumentError(AcceptError, ValueError):
    """A document that cannot be read or written; the text has a line for each wrong key."""


def only_if(given: Callable[[Any], bool] = lambda value: value is not None) -> Any:
    """Return a field that is written only if its value is `given`: an addition, absent from older documents."""
    return Field(exclude_if=lambda value: not given(value))


def unwritten(default: Any) -> tuple[Any, Any]:
    """Return what marks a field that is for this process alone: it is not written, and a document that has its key is
    read as one without it."""
    return Field(exclude=True), BeforeValidator(lambda _: default)


def written_hints(kind: type) -> dict[str, Any]:
    """Return the annotations of the fields of a model that are written, by name and in order."""
    hints = get_type_hints(kind, include_extras=True)
    own = {field.name: hints[field.name] for field in fields(kind)}
    return {n: h for n, h in own.items() if not any(getattr(m, "exclude", None) for m in get_args(h)[1:])}


class Document:
    """A JSON object with typed keys, for frozen dataclasses to derive from.

    Keys are written in the order of the fields. A key that is unknown here is ignored, since documents grow by
    addition; an absent one takes the field's default, or is an error if the field has none. Types are strict: no text
    is taken for a number, no NaN or infinity is read."""

    __pydantic_config__ = ConfigDict(strict=True, allow_inf_nan=False, extra="ignore")

    def to_json(self) -> dict[str, Any]:
        """Return the document as `json.dumps` takes it. Raises DocumentError if a field has another type."""
        kind: Any = type(self)
        try:
            written: dict[str, Any] = _adapter(kind).dump_python(self, mode="json", warnings="error")
        except (PydanticSerializationError, UnicodeError) as e:
            raise DocumentError(f"{type(self).__name__}: {e}") from e
        return written

    @classmethod
    def from_text(cls, content: str | bytes) -> Self:
        """Read the JSON of a document. Raises DocumentError naming every key that is wrong."""
        kind: Any = cls
        try:
            document: Self = _validator(kind).validate_json(content)
        except ValidationError as e:
            if (readable := _without_halves(content)) is not None:
                return cls.from_text(readable)
            raise DocumentError("\n".join(problem_line(problem) for problem in e.errors())) from e
        return document

    @classmethod
    def from_json(cls, entry: Any) -> Self:
        """Read a document from the return value of `json.loads`. Raises as `from_text`."""
        try:
            return cls.from_text(json.dumps(entry, allow_nan=False))
        except (TypeError, ValueError) as e:
            raise DocumentError(str(e)) from e


def _without_halves(content: str | bytes) -> bytes | None:
    """Return JSON with a question mark for each half surrogate pair (a byte of a file name that is not UTF-8 in
    Python); None if it has none or is not JSON."""
    try:
        text = json.dumps(json_of(content), ensure_ascii=False)
    except ValueError:
        return None
    readable = text.encode("utf-8", "replace")
    return readable if readable.decode() != text else None


@cache
def _validator(kind: Any) -> SchemaValidator:
    """Return the reader of a document. It keeps no text, so that memory stays flat over many events."""
    return SchemaValidator(_adapter(kind).core_schema, CoreConfig(cache_strings=False))


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)
