"""The page of formats, from the typed models: `python -m accept.store.formats > docs/reference/formats.md`."""

import types
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from typing import Annotated, Any, Union, get_args, get_origin

from accept.base.documents import listings
from accept.base.documents.analyses import GapDocument, MisalignmentDocument
from accept.base.documents.document import Document, written_hints
from accept.base.documents.manifest import Manifest
from accept.base.documents.results import ResultsDocument
from accept.store.payloads import KINDS, Payload
from checks.cause import Reason

HEAD = """# Formats

Written by `python -m accept.store.formats` from the models that write and read these documents. A format changes by
addition only: keys may be added, none changes its name or meaning. A key marked *later* is absent from documents of
earlier versions, or wherever it has nothing to say. Numbers that are unknown are `null`; there is no NaN.
"""
EVENTS = """## Events of the store

Each event has a number, a time, who, what (the kind), a subject (the serial, or nothing), the spec, the hash of the
program, its payload and two hashes (`accept store log --full` shows them). The payload is one of these. Any has
`typed` = true if no key was opened for the name of who acted; events of versions before 0.2.0 have no such mark.
"""
DOCUMENTS: Mapping[str, type[Document]] = {
    "results.json": ResultsDocument,
    "gap.json": GapDocument,
    "manifest.json of a certificate": Manifest,
    "`accept misalign --json`": MisalignmentDocument,
    "`accept verify --json`": listings.VerificationDocument,
    "`accept spec list --json`": listings.SpecList,
    "`accept spec show --json`": listings.SpecShown,
    "`accept spec diff --json`": listings.SpecsCompared,
    "`accept product list --json`": listings.ProductList,
    "`accept model list --json`": listings.ModelList,
    "`accept model show --json`": listings.ModelShown,
    "`accept model effects --json`": listings.EffectList,
    "`accept lookup info --json`": listings.TableList,
    "`accept simulate faults --json`": listings.FaultList,
    "`accept hw list --json`": listings.BenchListing,
    "`accept hw test --json`": listings.InstrumentsAsked,
    "`accept hw scan --json`": listings.PlacesSeen,
    "`accept keys list --json`": listings.KeyList,
    "evidence.json of `accept evidence`": listings.EvidenceFolder,
    "`accept store log --json`": listings.EventList,
    "`accept store check --json`": listings.StoreChecked,
    "`accept recall --json`": listings.Recall,
    "`accept golden list --json`": listings.GoldenList,
    "`accept golden check --json`": listings.GoldensCompared,
}
_OPAQUE = {Reason: "object: `code` of the cause, and its parameters"}
_WORDS = {str: "text", int: "number", float: "number", bool: "true or false", type(None): "null", Any: "any"}


def page() -> str:
    """Return the page in Markdown."""
    lines, parts = [HEAD], dict[str, Any]()
    for name, kind in DOCUMENTS.items():
        lines += [f"## {name}\n", *_section(kind, parts)]
    lines.append(EVENTS)
    for name, kind in sorted(KINDS.items()):
        lines += [f"### {name}\n", *_section(kind, parts)]
    lines.append("## Parts of these\n")
    done: set[str] = set()
    while rest := {name: part for name, part in parts.items() if name not in done}:
        for name, part in rest.items():
            lines += [f"### {name}\n", *_section(part, parts)]
            done.add(name)
    return "\n".join(lines).rstrip()


def _section(kind: Any, parts: dict[str, Any]) -> Iterator[str]:
    """Yield the description of a model and the table of its keys. Models inside it are added to `parts`."""
    yield " ".join((kind.__doc__ or "").partition("\n\n")[0].split()) + "\n"
    yield "| key | type | meaning |\n|---|---|---|"
    hints = written_hints(kind)
    for field in (field for field in fields(kind) if field.name in hints and field not in fields(Payload)):
        hint = hints[field.name]
        words = [m for m in getattr(hint, "__metadata__", ()) if isinstance(m, str)]
        later = "" if field.default is MISSING and field.default_factory is MISSING else "*later*"
        shown = "; ".join(w for w in (*words, later) if w).replace("|", "\\|")
        yield f"| `{field.name}` | {_type(hint, parts)} | {shown} |"
    yield ""


def _type(hint: Any, parts: dict[str, Any]) -> str:
    arguments = get_args(hint)
    match get_origin(hint):
        case None if hint in _OPAQUE:
            return _OPAQUE[hint]
        case None if isinstance(hint, type) and is_dataclass(hint):
            parts[hint.__name__] = hint
            return f"[{hint.__name__}](#{hint.__name__.lower()})"
        case None if isinstance(hint, type) and issubclass(hint, Enum):
            return "one of " + ", ".join(f"`{member.value}`" for member in hint)
        case None:
            return _WORDS.get(hint, "object")
        case origin if origin is Annotated:
            return _type(arguments[0], parts)
        case origin if origin in (Union, types.UnionType):
            return " or ".join(dict.fromkeys(_type(a, parts) for a in arguments))
        case origin if origin is tuple and arguments[-1] is Ellipsis:
            return f"list of {_type(arguments[0], parts)}"
        case origin if origin is tuple:
            return f"list [{', '.join(_type(a, parts) for a in arguments)}]"
    return f"object of {_type(arguments[1], parts)} by name"


if __name__ == "__main__":
    print(page())
