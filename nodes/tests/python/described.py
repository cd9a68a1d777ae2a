"""Asks the console what its description allows, and what it does not: python described.py CONSOLE FOLDER CASES SEED.

The description goes through openapi-spec-validator, the console through all checks and phases of schemathesis, CASES an
operation and phase. Prints what came out as JSON; what schemathesis says goes to stderr where something is wrong.
"""

import json
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

from openapi_spec_validator import validate
from openapi_spec_validator.validation.exceptions import OpenAPIValidationError

BASE, FOLDER, CASES, SEED = sys.argv[1], Path(sys.argv[2]), sys.argv[3], sys.argv[4]
CONFIG = Path(__file__).with_name("schemathesis.toml")


def strips():
    with urllib.request.urlopen(f"{BASE}/features/collections/strips/items?limit=1") as answer:
        return json.load(answer)["numberMatched"]


def wait():
    """Until the mission tells of its strips: nobody can look at those that are not there yet."""
    until = time.monotonic() + 60
    while strips() == 0:
        assert time.monotonic() < until, "the mission has no strips"
        time.sleep(0.2)


def unsound(description):
    try:
        validate(description)
    except OpenAPIValidationError as error:
        return str(error)
    return ""


def main():
    wait()
    with urllib.request.urlopen(f"{BASE}/api/openapi.json") as answer:
        description = json.load(answer)
    saw = {"unsound": unsound(description)}
    (FOLDER / "openapi.json").write_text(json.dumps(description))
    report = FOLDER / "report.json"
    command = [sys.executable, "-m", "schemathesis.cli", "--config-file", CONFIG, "run", FOLDER / "openapi.json"]
    command += ["--url", BASE, "--checks", "all", "--max-examples", CASES, "--seed", SEED, "--no-color"]
    command += ["--report", "json", "--report-json-path", report]
    done = subprocess.run(command, capture_output=True, text=True, cwd=FOLDER)
    if done.returncode:
        print(done.stdout[-20_000:], done.stderr[-5_000:], file=sys.stderr)
    told = json.loads(report.read_text())
    operations, cases = told["operations"], told["test_cases"]
    saw |= {"operations": operations["total"], "tested": operations["tested"], "cases": cases["generated"]}
    saw |= {key: [it["title"] for it in told[key]] for key in ("failures", "errors")}
    print(json.dumps(saw))


main()
