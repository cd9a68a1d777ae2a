"""Unpack from the wheels in folder argv[1] what a CPU build of libtorch needs into folder argv[2]."""

import pathlib
import shutil
import sys
import zipfile

LIBRARIES = {
    "torch/lib/libtorch_cpu.so",
    "torch/lib/libc10.so",
    "torch/lib/libgomp.so.1",
    "nvidia/cu13/lib/libcudart.so.13",
    "nvidia/cu13/lib/libcupti.so.13",
}


def place(name):
    """Where a member of a wheel goes in the view, or None."""
    if name in LIBRARIES:
        return pathlib.PurePosixPath("lib", name.rsplit("/", 1)[1])
    if name.startswith("torch/include/") and not name.endswith("/"):
        return pathlib.PurePosixPath(name.removeprefix("torch/"))
    return None


def main(wheels, view):
    found = set()
    for wheel in sorted(wheels.glob("*.whl")):
        with zipfile.ZipFile(wheel) as archive:
            for name in archive.namelist():
                target = place(name)
                if target is None:
                    continue
                path = view / target
                path.parent.mkdir(parents=True, exist_ok=True)
                with archive.open(name) as source, open(path, "wb") as out:
                    shutil.copyfileobj(source, out, 1 << 20)
                found.add(name)
    missing = sorted(LIBRARIES - found)
    if missing:
        sys.exit(f"the wheels in {wheels} lack {', '.join(missing)}")
    link = view / "lib" / "libtorch.so"
    link.unlink(missing_ok=True)
    link.symlink_to("libtorch_cpu.so")
    (view / "build-version").write_text("2.11.0\n")


main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
