"""Parameters fitted to measured responses: data with their noise, a fit with its covariance, and what it leaves.

    data = Dataset.from_records(low, high, merge_Hz=350.0, tolerance=model.tolerance)  # records of noise or sweeps
    data.f, data.H, data.cov  # (F,) [Hz], (F, C) per volt of Va, (F, C, C)

    fitted = ModelFit.of(model, first, second, starts=1, say=print)  # two realisations, or None
    fitted.fit.at, fitted.fit.sds  # by flat name
    fitted.doubt  # why the values must not be used, or None
    fitted.held_out["Vs"].G  # 1 or less: the fitted model agrees with responses that were not fitted
    LikelihoodProfile.of(fitted.fit, "apa.ke_N_per_um").ci95

G is the root mean square of the residuals, each over its noise and the model's tolerance."""

from typing import TYPE_CHECKING

from specs import door

if TYPE_CHECKING:
    from checks.fitting.calibrate import Calibration
    from checks.fitting.dataset import CHANNELS, F_HI, F_LO, Dataset
    from checks.fitting.fit import Fit
    from checks.fitting.goodness import gaps
    from checks.fitting.identifiability import Identifiability, LikelihoodProfile
    from checks.fitting.model_fit import ModelFit, fit_panels, frf_panels
else:
    __getattr__ = door(__name__)
