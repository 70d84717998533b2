"""The tutorial of the glider and the yaw rig: glides, a programme, and added inertia from a simulated record.

``python docs/examples/glider_and_yaw_rig.py`` writes into the current folder.
"""

from pathlib import Path

from commands import tank2sim

import tank2sim as t2s


def main() -> None:
    """Go through the tutorial."""
    programme = Path(__file__).parents[2] / "models" / "kulikovsky-velikanov" / "programme.csv"
    tank2sim("glide", "--angles", "25,30", "--as-printed")
    tank2sim("glide", "--programme", programme, "--budget-kg", "50", "--depth-m", "200", "-o", "glide.html")
    print(t2s.load("kulikovsky-velikanov").to_fmu("glider.fmu"))

    # The truth of the simulated rig is an added inertia of 0.0302 kg m2.
    tank2sim("yaw", "rig.csv", "--simulate", "alyshev", "--noise", "0.003", "--inertia-kgm2", "0.01796")
    tank2sim("yaw", "similar.csv", "--simulate", "alyshev", "--similar-to", "38,8,100,120")
    tank2sim("yaw", "rig2.csv", "--simulate", "alyshev", "--noise", "0.003", "--card", "mariner", "-o", "ship.toml")
    print("added inertia on the card:", t2s.load("ship.toml").derivatives.loc["Nrdot", "value"])


if __name__ == "__main__":  # processes that compute an ensemble read this file, too
    main()
