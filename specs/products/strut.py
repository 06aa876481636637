"""The strut: an amplified piezo actuator between two flexible joints, with an encoder."""

from specs.products.product import Product

PRODUCT = Product(
    name="strut",
    title="Strut",
    plural="struts",
    spec="strut",
    model="strut-as-built",  # its modes are as uncertain as they are from unit to unit
    parts={
        "apa": "Serial number of the APA",
        "joint_bottom": "Bottom joint",
        "joint_top": "Top joint",
        "encoder": "Encoder",
    },
    matched_by=("axial_resonance_Hz", "ga_N_per_V", "dx_um", "dy_um"),
)
