"""The amplified piezo actuator alone."""

from specs.products.product import Product

PRODUCT = Product(
    name="apa",
    title="Amplified piezo actuator",
    plural="APAs",
    spec="apa",
    model="apa-frame",
    matched_by=("k_closed_N_per_um", "stroke_um"),
)
