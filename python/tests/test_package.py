"""The package as a package: types, import, registration, the README."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import swath

PYTHON = Path(__file__).parents[1]


def run(*args: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *args], cwd=PYTHON / "tests", capture_output=True, text=True, check=False)


def test_types_are_right() -> None:
    config = str(PYTHON / "pyproject.toml")
    checked = run("-m", "mypy", "--config-file", config, *(str(PYTHON / part) for part in ("swath", "tests", "examples")))
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_stubs_say_what_the_native_module_has() -> None:
    checked = run("-m", "mypy.stubtest", "swath._swath", "--mypy-config-file", "stubtest.ini")
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_importing_it_imports_neither_gymnasium_nor_numpy() -> None:
    code = "import swath, sys; print('gymnasium' in sys.modules, 'numpy' in sys.modules)"
    assert run("-c", code).stdout.split() == ["False", "False"]


def test_it_is_registered_whichever_comes_first() -> None:
    for first, second in [("gymnasium", "swath"), ("swath", "gymnasium")]:
        code = f"import {first}\nimport {second}\nprint(gymnasium.spec('Swath/StripImaging-v0').id)"
        done = run("-c", code)
        assert done.stdout.strip() == "Swath/StripImaging-v0", done.stderr


def test_everything_that_is_named_is_there() -> None:
    assert all(getattr(swath, name) is not None for name in swath.__all__)
    assert dir(swath) == swath.__all__


def test_the_examples_of_the_readmes_run() -> None:
    for readme in [PYTHON / "README.md", PYTHON.parent / "README.md"]:
        blocks = re.findall(r"```python\n(.*?)```", readme.read_text(), re.DOTALL)
        assert blocks, readme
        for block in blocks:
            done = run("-c", block)
            assert done.returncode == 0, done.stderr


def test_the_wheel_installs_into_a_clean_environment(tmp_path: Path) -> None:
    wheel = os.environ.get("SWATH_WHEEL")
    if wheel is None:
        pytest.skip("SWATH_WHEEL names no wheel: cargo xtask test does")
    python = tmp_path / "clean/bin/python"
    quick = ["--quiet", "--disable-pip-version-check", "--no-compile"]
    for command in [
        ["-m", "venv", "--without-pip", str(tmp_path / "clean")],
        ["-m", "pip", "--python", str(python), "install", *quick, wheel],
    ]:
        done = run(*command)
        assert done.returncode == 0, done.stderr
    code = "import swath; print(swath.fly('random', episode={'orbits': 0.1}).score['seed'])"
    flown = subprocess.run([python, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert flown.stdout.strip() == "0", flown.stderr
