# SPDX-License-Identifier: MIT
"""What a worker unpickles: tasks of this package, and what they are of.

Dask runs whatever a client sends. A worker that is started with ``--no-nanny --preload fragtracer.apps.cluster.guard``
runs nothing else than these tasks.
"""

import io
import pickle
from collections.abc import Iterable
from dataclasses import is_dataclass
from types import SimpleNamespace
from typing import Any

_ALLOWED = {
    ("builtins", "bytes"),
    ("builtins", "bytearray"),
    ("dask._task_spec", "Alias"),
    ("dask._task_spec", "Task"),
    ("distributed.shuffle._worker_plugin", "ShuffleWorkerPlugin"),  # which each scheduler sends
    ("fragtracer.apps.cluster.worker", "render_part"),
    ("fragtracer.apps.cluster.worker", "versions"),
    ("fragtracer.scene.environment", "Panorama"),
    ("fragtracer.scene.medium", "Density"),
    ("fragtracer.scene.mesh", "Geometry"),
    ("fragtracer.scene.texture", "Image"),
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.numeric", "_frombuffer"),
}
_PARTS = ("fragtracer.scene", "fragtracer.sampling", "fragtracer.apps.cluster")  # whose dataclasses travel
# Of Dask's workers, those that run or write what is sent.
_BLOCKED = ["run", "run_coroutine", "upload_file", "plugin-add", "actor_execute", "actor_attribute", "benchmark_disk"]
_BLOCKED += ["shuffle_receive", "shuffle_inputs_done"]


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in _ALLOWED:
            return super().find_class(module, name)
        if any(module == part or module.startswith(f"{part}.") for part in _PARTS):
            found = super().find_class(module, name)
            if is_dataclass(found):
                return found
        raise pickle.UnpicklingError(f"this worker renders for fragtracer, and does nothing with {module}.{name}")


def loads(content: Any, *, buffers: Iterable[Any] = ()) -> Any:
    """As :func:`pickle.loads`, for what renders.

    Raises
    ------
    pickle.UnpicklingError
        If there is anything else.
    """
    return _Unpickler(io.BytesIO(content), buffers=buffers).load()


def dask_setup(worker: Any) -> None:
    """What Dask calls where this module is a ``--preload`` of a worker."""
    from distributed.protocol import pickle as of_dask

    of_dask.pickle = SimpleNamespace(loads=loads, dumps=pickle.dumps)
    worker.blocked_handlers = worker.blocked_handlers + _BLOCKED
