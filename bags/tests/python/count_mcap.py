"""Counts the messages, schemas and attachments of a bag's files with `mcap`; prints JSON facts."""

import json
import sys
from pathlib import Path

from mcap.reader import make_reader

facts = {"messages": 0, "attachments": 0}
for file in Path(sys.argv[1]).glob("*.mcap"):
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        facts["messages"] += sum(1 for _ in reader.iter_messages())
        facts["attachments"] += sum(1 for _ in reader.iter_attachments())
print(json.dumps(facts))
