"""Evaluation of measurements: pure functions of arrays, in rooms that are entered by their doors.

    from checks.acceptance import CHECKS  # the acceptance checks, as declared with `checks.declare`
    from checks.consistency import check_consistency  # measurements that contradict each other
    from checks.signals import RecordResponse  # responses, resonances, excitations
    from checks.model import build_model  # the simulated unit on its bench
    from checks.fitting import ModelFit  # parameters from responses
    from checks.misalignment import estimate_misalignment
    from checks.gap import run  # what the model lacks
    from checks.population import Population  # what the units of a batch have in common

Small modules beside the rooms are doors of their own: `declare`, `verdict`, `cause`, `quantity`, `record`, `picture`,
`rounding`, `errors`, `arrays`. A room loads what it shows when it is first used (PEP 562)."""
