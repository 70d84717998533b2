"""A script of a user with types, which mypy checks with ``--strict`` when it checks the package; it is not run."""

import tank2sim as t2s

ship: t2s.Ship = t2s.load("mariner", {"derivatives.Yv": -0.012})
run = ship.zigzag(20, 20, duration_s=300.0)
overshoot: float = run.figures["overshoot_1_deg"]
stable: bool = ship.stability().stable
t2s.check_fmu(ship.to_fmu("mariner.fmu", fmi=3).path).passed  # noqa: B018
t2s.reduce("campaign.toml").card.save("ship.toml")
fit = t2s.identify(ship, ["zz.csv"], holdout=["turn.csv"])
t2s.find_gap(fit.ship, ["zz.csv"], holdout=["turn.csv"]).improved.save("better.toml")
