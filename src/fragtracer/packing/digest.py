# SPDX-License-Identifier: MIT
"""What a packed scene is known by, for what is kept on disk of it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fragtracer.packing import PackedScene
from fragtracer.scene.content import content_digest
from fragtracer.shader_composer import shaders_digest


def program_digest(packed: PackedScene) -> str:
    """Of all that a program reads, and of the shaders."""
    parts: list[NDArray[Any] | str] = [part for table in packed.tables.values() for part in table]
    values = sorted({**packed.uniforms, **packed.flags}.items())
    movable = sorted(packed.movable.items())  # the environment's rotation among them
    texts = (repr([(k, np.asarray(v).tolist()) for k, v in values + movable]), repr(sorted(packed.features.items())))
    return content_digest(*parts, *texts, repr(packed.origin.tolist()), shaders_digest())
