"""Statistics of many units: control charts, capability, gauge studies, matching."""
