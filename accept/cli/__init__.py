"""Command lines: typer only, each imports what it runs."""
