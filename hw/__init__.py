"""Sources of measurements: instruments, recorders and record files, each room entered by its own door.

    from hw.instruments import open_instrument  # a gauge, an LCR meter, an interferometer, a person who types
    from hw.recorders import open_recorder  # converters on one clock, which play and record
    from hw.records import load_bytes, record_of  # record files, of this program and of others
    from hw.simulated import SimulatedBench  # the same instruments on pseudo-terminals, with faults
    from hw.superelement import matrices_of  # mass and stiffness matrices of a finite-element program

`hw.errors` has what is raised in place of a reading. Everything else here is behind these doors."""
