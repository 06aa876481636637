"""Units as their folders state them: `unit.toml`, read strictly, and the records that it names, read once.

    for folder in find(Path("units")):  # the unit folders at or below a path
        unit = read(folder)  # UnitError with every problem of `unit.toml`; no record is opened
        unit.serial, unit.kind, unit.header, unit.sections  # what was typed, and which records
        unit.input_hashes()  # what a verdict depends on, by file

        held = loaded(unit)  # reads each file once: the bytes that are hashed are judged and attached
        held.values("capacitance")  # numbers with their U, records, tables; RecordError if one is damaged

What writes to a folder is in `accept.units.attach` (records of the workflow) and `accept.units.toml_edit`."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from accept.units.folder_header import TYPED, by_check
    from accept.units.loaded_unit import RESPONSES, LoadedUnit, contents_of, loaded
    from accept.units.unit_entry import EXPERIMENTS, FileEntry, UnitSection
    from accept.units.unit_folder import (
        UNIT_FILE,
        UnitError,
        UnitFolder,
        anywhere,
        attempt_folder,
        attempt_number,
        find,
        inside,
        parsed,
        read,
    )
else:
    __getattr__ = door(__name__)
