"""The table of effects on the page of contracts, from their declarations: `python -m accept.analysis.effects_table`."""

from pathlib import Path

from accept.base.atomic_files import write_atomic
from checks.gap import EFFECTS
from specs import plugins

PAGE = Path("docs/decisions/contracts.md")  # in the working folder, which is the repository's
HEAD = "| effect | parameters | what it does |\n|---|---|---|\n"


def table() -> str:
    """Return a row for each effect of the program: name, parameters, and its influence on the model."""
    brought = {plugin.name for plugin in plugins.USED}
    rows = [
        f"| `{e.name}` | {', '.join(f'`{p.name}`' for p in e.parameters)} | {e.does or e.title} |\n"
        for e in sorted(EFFECTS.values(), key=lambda e: e.name)
        if e.name not in brought
    ]
    return HEAD + "".join(rows)


def update_table(page: str) -> str:
    """Return the page with its table renewed."""
    before, _, rest = page.partition(HEAD)
    lines = rest.splitlines(keepends=True)
    rows = next((n for n, line in enumerate(lines) if not line.startswith("|")), len(lines))
    return before + table() + "".join(lines[rows:])


if __name__ == "__main__":
    write_atomic(PAGE, update_table(PAGE.read_text(encoding="utf-8")).encode())
