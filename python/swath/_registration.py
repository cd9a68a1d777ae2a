"""Registers the environment with Gymnasium: now if it is imported, else when it is.

Importing Gymnasium takes longer than importing everything of this package, and it has no entry points by which it would
find environments itself.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType

_ENVIRONMENTS = "gymnasium.envs"


def register_with_gymnasium() -> None:
    """Registers the environment with Gymnasium, at the latest when Gymnasium is imported."""
    if _ENVIRONMENTS in sys.modules:
        _register()
    else:
        sys.meta_path.insert(0, _AfterImport())


def _register() -> None:
    from gymnasium.envs.registration import register, registry

    name = "Swath/StripImaging-v0"
    if name not in registry:
        register(
            id=name,
            entry_point="swath.environment:StripImagingEnv",
            vector_entry_point="swath.vector:StripImagingVectorEnv",
        )


class _AfterImport(MetaPathFinder):
    """Finds Gymnasium's own environments as ever, and adds ours once they are there."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != _ENVIRONMENTS:
            return None
        sys.meta_path.remove(self)
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is None or spec.loader is None:
            return spec
        execute = spec.loader.exec_module

        def exec_module(module: ModuleType) -> None:
            execute(module)
            _register()

        spec.loader.exec_module = exec_module  # type: ignore[method-assign]
        return spec
