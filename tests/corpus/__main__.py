"""``python -m tests.corpus COMMAND NUMBER DIR``: the files of one job, and the command line that reads them."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.corpus.crew import Crew
from tests.corpus.jobs import job

if __name__ == "__main__":
    crew = Crew()
    each = job(sys.argv[1], int(sys.argv[2]), crew.made)
    crew.close()
    for name, content in each.files.items():
        path = Path(sys.argv[3]) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    print("tank2sim", each.command, *each.arguments, f"  # {each}")
