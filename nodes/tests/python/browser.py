"""Chromium for tests, and processes of a mission that are to be killed."""

import os
import shutil
import signal
import sys
from pathlib import Path

NAMES = ["chromium", "chromium-browser", "google-chrome"]
CHROMIUM = os.environ.get("SWATH_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)


def launch(playwright, *args):
    """The browser; says how to install it where there is none."""
    if CHROMIUM is None:
        sys.exit("no Chromium to look at the console with: apt-get install chromium, or set SWATH_CHROMIUM")
    return playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", *args])


def kill(name, domain):
    """Ends one of the processes of the mission in a domain as kill -9 does."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            command = (process / "cmdline").read_bytes().split(b"\0")[0].decode()
            environment = (process / "environ").read_bytes().split(b"\0")
        except (OSError, UnicodeDecodeError):
            continue
        if command.endswith(name) and f"ROS_DOMAIN_ID={domain}".encode() in environment:
            found.append(int(process.name))
    assert len(found) == 1, (name, found)
    os.kill(found[0], signal.SIGKILL)
