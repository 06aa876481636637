"""The strut without encoder: the encoder sits on the hexapod's plates ([STB] 5.1.1)."""

from specs.products.product import Product
from specs.products.strut import PRODUCT as STRUT

NO_ENCODER = "no encoder on this strut: it sits on the plates"

PRODUCT = Product(
    name="strut-plates",
    title="Strut without encoder",
    plural="struts without encoder",
    spec="strut-plates",
    model="strut-plates",
    parts={name: label for name, label in STRUT.parts.items() if name != "encoder"},
    matched_by=("axial_resonance_Hz", "ga_N_per_V"),
    variant_of="strut",
    absent={"de": NO_ENCODER, "misalignment": NO_ENCODER},
)
