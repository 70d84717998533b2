"""The tutorial of the towing tank: five tows, and a made-up captive campaign, to cards whose truth is known.

``python docs/examples/towing_tank.py`` writes into the current folder.
"""

from pathlib import Path

import make_campaign
from commands import tank2sim

import tank2sim as t2s

MODELS = Path(__file__).parents[2] / "models"


def main() -> None:
    """Go through the tutorial."""
    # Mass and drag of an underwater vehicle: four parameters that these tows cannot separate, then two that they can.
    tows = MODELS / "wilinski-zellman" / "tows.csv"
    tank2sim("tow", tows, "--force-N", "11.63", "--mass-kg", "2243")
    tank2sim("tow", tows, "--terms", "B3", "-o", "vehicle.toml")
    print(t2s.load("vehicle.toml").to_fmu("vehicle.fmu"))

    # A captive campaign, made up from the bundled Mariner at 1:25.
    make_campaign.write(Path("campaign"))
    found = t2s.reduce("campaign/campaign.toml", fill="clarke1983")
    print(found.derivatives.loc[["Yv", "Yvvv", "Nr"]])
    found.card.save("model.toml")  # with its covariance next to it

    model = t2s.load("model.toml")
    print(model.turn(35, members=100))  # with the bands of 100 ships drawn from that covariance
    print("stable on a straight course:", model.stability(spirals=False).stable)

    # The ship at full scale, compared with the ship behind the campaign.
    tank2sim("reduce", "campaign/campaign.toml", "-o", "from_tank.toml", "--fill", "clarke1983", "--scale", "ship")
    tank2sim("compare", "mariner", "from_tank.toml", "--members", "10")


if __name__ == "__main__":  # processes that compute an ensemble read this file, too
    main()
