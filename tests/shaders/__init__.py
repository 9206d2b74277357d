# SPDX-License-Identifier: MIT
"""The proof of the shader library: its functions, run over tables and held against float64."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating]
