"""`accept store`."""

from accept.base.console import clear_errors, say, stdout
from accept.base.exit_codes import Exit
from accept.store import check_lines, open_store


@clear_errors
def check() -> Exit:
    """Walk the chain of events and say where it breaks."""
    with open_store() as store:
        unbroken, lines = check_lines(store)
    for line in lines:
        (stdout.print if unbroken else say)(line)
    return Exit.ACCEPTED if unbroken else Exit.REJECTED


@clear_errors
def log(serial: str | None) -> Exit:
    """Print the events, of one unit or of all."""
    found = False
    with open_store() as store:
        for event in store.events(subject=serial):
            found = True
            spec = event.spec.split("@")[0]
            code = f"code {event.code[:8]}"
            words = (str(event.seq), event.time[:19], event.who, event.what, event.subject, spec, code)
            print("  ".join(word for word in words if word))
    if not found:
        say("no event yet" if serial is None else f"no event of a unit '{serial}'")
    return Exit.ACCEPTED
