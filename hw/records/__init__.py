"""Record files: .mat (MATLAB 5 to 7.3), .csv, .uff and .tdms to records, and back."""

from hw.records.limits import DEFAULT_LIMITS, ReadLimits
from hw.records.reader import read, record_of
from hw.records.tables import list_channels, read_table, table_of
from hw.records.writers import csv_bytes, mat_bytes, own_record, write_csv, write_mat

__all__ = [
    "DEFAULT_LIMITS",
    "ReadLimits",
    "csv_bytes",
    "list_channels",
    "mat_bytes",
    "own_record",
    "read",
    "read_table",
    "record_of",
    "table_of",
    "write_csv",
    "write_mat",
]
