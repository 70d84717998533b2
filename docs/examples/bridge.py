"""The tutorial of the bridge: poster, pilot card, the page of a result, a validation, and two cards compared.

``python docs/examples/bridge.py`` writes into the current folder.
"""

from commands import tank2sim

import tank2sim as t2s


def main() -> None:
    """Go through the tutorial."""
    tank2sim("poster", "mariner", "-o", "poster.html")
    tank2sim("pilotcard", "mariner", "-o", "pilot.html")
    tank2sim("steer", "mariner", "-o", "steer.html")

    ship = t2s.load("mariner")
    zigzag = ship.zigzag(20, 20, members=100)
    zigzag.to_json("zigzag.json")
    zigzag.to_html("zigzag.html")

    # A trial whose truth is known: 60 s straight ahead, then hard over, of a ship with 5 % more yaw damping.
    other = ship.replace({"derivatives.Nr": -174e-5})
    other.steer({"t_s": [0.0, 60.0], "delta_order_deg": [0.0, 35.0]}, duration_s=400.0).to_csv("turn.csv")
    tank2sim("validate", "mariner", "turn.csv", "--members", "10", "-o", "report.html")

    other.save("trial.toml")
    tank2sim("compare", "mariner", "trial.toml", "--members", "10", "-o", "compare.html")


if __name__ == "__main__":  # processes that compute an ensemble read this file, too
    main()
