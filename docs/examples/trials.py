"""The tutorial of trials: made-up records whose truth is known are examined, identified, and asked what is missing.

``python docs/examples/trials.py`` writes into the current folder.
"""

from pathlib import Path

import make_trials
from commands import tank2sim

import tank2sim as t2s


def main() -> None:
    """Go through the tutorial."""
    # A ship whose yaw damping Nr is -0.00174, on the card -0.00166.
    folder = Path("damping")
    make_trials.write(folder, "damping")
    tank2sim("audit", folder / "zigzag.csv", folder / "turn.csv")
    tank2sim("signals", folder / "zigzag.csv", "--columns", "r_degps")

    fitted = [folder / "zigzag.csv", folder / "turn.csv"]
    fit = t2s.identify("mariner", fitted, holdout=[folder / "held_out.csv"], hold=["Xuuu"], members=0)
    print(fit)
    print(fit.ship.derivatives.loc[["Nr"]])
    fit.card.save("found.toml")
    fit.to_html("identified.html")

    # The card is right, but a current of 0.5 m/s towards east acts. Two explanations are tried, to be quick.
    folder = Path("current")
    make_trials.write(folder, "current")
    gap = t2s.find_gap(
        "mariner",
        [folder / "zigzag.csv", folder / "turn.csv"],
        holdout=[folder / "held_out.csv"],
        effects=["current", "rudder_bias"],
        max_effects=1,
        workers=1,
    )
    print(gap.verdict)
    print(gap.effects)
    print(gap.misfit)
    gap.save("gap")  # gap.json, improved.toml, report.html


if __name__ == "__main__":  # processes that compute an ensemble read this file, too
    main()
