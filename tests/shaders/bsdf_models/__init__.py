# SPDX-License-Identifier: MIT
"""The table of all models of shaders/bsdf/: what each is tried with, and what it must be by its formulas.

Whatever is asked of every BSDF is asked of each entry of :data:`MODELS` by test_bsdf_values.py and test_bsdf_sample.py:
values and densities, reciprocity, chi² of its samples, weights, albedos, white furnaces, events, and arguments at the
ends of their ranges. A new model needs an entry, and a module with its formulas in float64, and no test of its own for
these.
"""

from .brushed import brushed
from .coated import COATED
from .conductor import CONDUCTOR
from .cook_torrance import cook_torrance
from .dielectric import DIELECTRIC
from .diffuse import DIFFUSE
from .eon import EON
from .half_vector import HALF_VECTOR
from .iridescence import IRIDESCENT
from .model import Model
from .plastic import PLASTIC
from .rough_plastic import ROUGH_PLASTIC
from .sheen import SHEEN
from .thin_dielectric import THIN_DIELECTRIC
from .translucent import TRANSLUCENT

DEGREES = [0, 45, 80, 89]
TERMS = ["SMITH", "SMITH_HEIGHT_CORRELATED", "SCHLICK_BECKMANN", "KARIS"]
MODELS: dict[str, Model] = {
    "eon": EON,
    "rough-plastic": ROUGH_PLASTIC,
    "half-vector": HALF_VECTOR,
    "coated": COATED,
    "sheen": SHEEN,
    "iridescent": IRIDESCENT,
    "translucent": TRANSLUCENT,
    **{f"brushed {term}": brushed(term) for term in TERMS[:2]},
    "plastic": PLASTIC,
    "conductor": CONDUCTOR,
    "dielectric": DIELECTRIC,
    "thin-dielectric": THIN_DIELECTRIC,
    "diffuse": DIFFUSE,
    **{f"cook-torrance {term}": cook_torrance(term) for term in TERMS},
}
CASES = [(name, material) for name, model in MODELS.items() for material in model.materials]
