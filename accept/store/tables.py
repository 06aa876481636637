"""Tables of the store, and the triggers against accidents: events are never updated or deleted."""

from sqlalchemy import (
    DDL,
    BigInteger,
    Column,
    Connection,
    Index,
    Integer,
    MetaData,
    Table,
    Text,
    event,
    func,
    insert,
    inspect,
    literal_column,
    text,
)

from accept.base.spelling import LOOKS, UNSEEN
from accept.store.chain import START
from accept.store.engine import has_index

SCHEMA = 2  # of the tables; a store of the one before is brought up to it when it is opened
EARLIER = 1  # without the index of parts, which a program that writes such a store does not fill

metadata = MetaData()

events = Table(
    "events",
    metadata,
    Column("seq", Integer, primary_key=True, autoincrement=False),
    Column("time", Text, nullable=False),
    Column("who", Text, nullable=False),
    Column("what", Text, nullable=False),
    Column("subject", Text, nullable=False),
    Column("spec", Text, nullable=False),
    Column("code", Text, nullable=False),
    Column("payload", Text, nullable=False),
    Column("prev", Text, nullable=False),
    Column("hash", Text, nullable=False),
)
Index("events_by_subject", events.c.subject, events.c.what, events.c.seq)
# By the kind of event. Earlier stores get it when they are opened.
BY_KIND = "events_by_kind"
_BY_KIND = Index(BY_KIND, events.c.what, events.c.seq)
# By the key that serials share that look alike. Earlier stores get it when they are opened.
BY_LOOK = "events_by_look"
LOOK = func.lower(events.c.subject)
for _letter, _like in [*LOOKS.items(), *((character, "") for character in UNSEEN)]:
    LOOK = func.replace(LOOK, literal_column(f"'{_letter}'"), literal_column(f"'{_like}'"))
_BY_LOOK = Index(BY_LOOK, LOOK, events.c.what, events.c.subject)

head = Table(
    "head",
    metadata,
    Column("id", Integer, primary_key=True, autoincrement=False),  # one row, id 1
    Column("store_schema", Integer, nullable=False),
    Column("seq", Integer, nullable=False),
    Column("hash", Text, nullable=False),
)


def _index(name: str) -> Table:
    """Return the table of an index: which of the events have a key (accept.store.indexes)."""
    return Table(
        name,
        metadata,
        Column("key", BigInteger, primary_key=True, autoincrement=False),
        Column("seq", Integer, primary_key=True, autoincrement=False),
        sqlite_with_rowid=False,
    )


INDEXES = samples, parts = _index("samples"), _index("parts")

LATER = {BY_KIND: _BY_KIND, BY_LOOK: _BY_LOOK}  # indexes that earlier stores lack
NAMES = {*metadata.tables, *LATER}

_REFUSAL = "events are never changed or removed"

for _verb in ("UPDATE", "DELETE"):
    event.listen(
        events,
        "after_create",
        DDL(  # type: ignore[no-untyped-call]  # sqlalchemy leaves it untyped
            f"CREATE TRIGGER events_no_{_verb.lower()} BEFORE {_verb} ON events "
            f"BEGIN SELECT RAISE(ABORT, '{_REFUSAL}'); END"
        ).execute_if(dialect="sqlite"),
    )
for _statement in (
    "CREATE OR REPLACE FUNCTION events_refuse() RETURNS trigger LANGUAGE plpgsql AS "
    f"$$ BEGIN RAISE EXCEPTION '{_REFUSAL}'; END $$",
    "CREATE TRIGGER events_append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON events "
    "FOR EACH STATEMENT EXECUTE FUNCTION events_refuse()",
):
    event.listen(events, "after_create", DDL(_statement).execute_if(dialect="postgresql"))  # type: ignore[no-untyped-call]


def make_tables(connection: Connection) -> None:
    """Make absent tables. The head's row is written only with a new store: a lost one must be noticed, not replaced."""
    new = not present(connection) & {events.name, head.name}
    metadata.create_all(connection)
    for name in LATER.keys() - present(connection):
        LATER[name].create(connection)
    if new:
        connection.execute(insert(head).values(id=1, store_schema=SCHEMA, seq=START.seq, hash=START.hash))


def present(connection: Connection) -> set[str]:
    """Return which of the `NAMES` exist."""
    found = {name for name in metadata.tables if inspect(connection).has_table(name)}
    return found | {name for name in LATER if has_index(connection, name)}


# What PostgreSQL answers by: plain tables without policies, rules, children and triggers (but that of 58: before each
# statement that updates, deletes or truncates), columns of the types above, and only built-in operators for built-in
# types: any other may compare differently.
_SERVER_COLUMNS = """
SELECT r.name || '.' || a.attname AS found FROM unnest(CAST(:names AS text[])) AS r (name)
JOIN pg_catalog.pg_class c ON c.oid = to_regclass(r.name) JOIN pg_catalog.pg_attribute a ON a.attrelid = c.oid
WHERE c.relkind = 'r' AND NOT (c.relrowsecurity OR c.relhasrules OR c.relhassubclass OR c.relispartition)
AND NOT EXISTS (SELECT FROM pg_catalog.pg_trigger t WHERE t.tgrelid = c.oid
AND NOT (t.tgname = 'events_append_only' AND t.tgtype = 58))
AND a.attnum > 0 AND NOT a.attisdropped AND a.attgenerated = ''
AND a.atttypid IN (20, 23, 25) AND a.attcollation IN (0, 100)
UNION ALL SELECT 'operator ' || o.oprname FROM pg_catalog.pg_operator o
JOIN pg_catalog.pg_type l ON l.oid = o.oprleft JOIN pg_catalog.pg_type r ON r.oid = o.oprright
WHERE 11 NOT IN (o.oprnamespace) AND 11 IN (l.typnamespace) AND 11 IN (r.typnamespace)
"""


def foreign_columns(connection: Connection) -> list[str]:
    """Return the columns that differ from those of this schema, as `table.column`. A view, which may show other rows to
    the next question, has none; nor has a virtual table, which may be one, or a table with policies or rules."""
    found, names = inspect(connection), {*metadata.tables}
    if connection.dialect.name == "sqlite":
        real = "SELECT name FROM sqlite_master WHERE sql LIKE 'CREATE TABLE %'"
        names &= {*connection.exec_driver_sql(real).scalars()}
        have = {f"{name}.{c['name']}" for name in names for c in found.get_columns(name)}
    elif connection.scalar(text("SELECT pg_catalog.current_schemas(true)"))[:1] != ["pg_catalog"]:
        return ["search_path"]  # operators of another schema would come first
    else:
        have = {*connection.scalars(text(_SERVER_COLUMNS), {"names": sorted(names)})}
    return sorted(have ^ {f"{t.name}.{c.name}" for t in metadata.sorted_tables for c in t.columns})
