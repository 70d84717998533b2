"""``python -m tank2sim``: the command line."""

from tank2sim.cli import main

if __name__ == "__main__":
    main()
