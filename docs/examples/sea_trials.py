"""The tutorial of the trial office: from six records to the report that is filed.

``python docs/examples/sea_trials.py`` writes into the current folder.
"""

from pathlib import Path

from make_sea_trial import main as make_trial

import tank2sim as t2s


def main() -> None:
    """Go through the tutorial."""
    make_trial(Path("trial"))
    found = t2s.trial_office("trial", ship="mariner", notes="trial/notes.toml", members=10)
    print(found)
    Path("report").mkdir(exist_ok=True)
    for path, content in found.files(Path("report")).items():
        path.write_bytes(content.encode() if isinstance(content, str) else content)


if __name__ == "__main__":
    main()
