"""Record files: .mat (MATLAB 5 to 7.3), .csv, .uff and .tdms to records and responses, and back.

    source = load_bytes(Path("noise.mat"))  # bytes within the limits, whose hash names the record
    source.sha256, source.is_text

    record = read(Path("noise.mat"))
    record.t, record["Va"]

    found = read_response_file(Path("analyser.uff"))  # responses of other programs
    found.f, found.H, found.channels, found.units
    found.to_bytes(".csv")  # or .mat, .uff

    Path("noise.csv").write_bytes(csv_bytes({"t": t, "Va": Va}))

Every statement of a file about itself (start, step, unit, scale, kind of function) is used, or the file is refused: the
`RecordError` states the value found and the value expected."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from hw.records.contents.variable import Remarked
    from hw.records.limits import DEFAULT_LIMITS, ReadLimits
    from hw.records.reader import declared_samples, read, record_by_input, record_of
    from hw.records.responses import Content, ResponseFile, read_response_file
    from hw.records.source import Source, load_bytes
    from hw.records.tables import list_channels, read_table, table_of
    from hw.records.text.file import read_text
    from hw.records.writers import csv_bytes, mat_bytes, own_record, ss_mat
else:
    __getattr__ = door(__name__)
