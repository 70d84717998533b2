from __future__ import annotations

import re

from tank2sim.analysis.influence.card_influence import influence
from tank2sim.analysis.influence.figures import parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.tuning.result import Means
from tank2sim.analysis.tuning.targets import parse_target
from tank2sim.analysis.tuning.tune import tune
from tank2sim.answer.page import render_page
from tank2sim.cards import read_card
from tank2sim.files import plain_json
from tank2sim.report.influence.charts import InfluenceData, influence_charts, most_influential
from tank2sim.report.influence.page import influence_page

TEXTS = ("criterion_C", "steady_radius_m@20", "steady_rate_degpmin@20", "K_per_s", "T_prime")


def test_the_page_has_every_parameter_both_coefficients_and_the_tuning() -> None:
    target = parse_target("steady_radius_m@20=640")
    study = Study(read_card("mariner"), [parse_figure(text) for text in TEXTS])
    result = influence(study, {"Yv": 1.0, "Nr": 2.0})
    tuned = tune(study, [target], Means())
    after = dict(zip(TEXTS, study.figures_at(tuned.values).tolist(), strict=True))
    page = influence_page(plain_json(result.as_json() | {"tuned": tuned.as_json(after)}))
    html = render_page(page)
    assert html == render_page(page)
    text = re.sub(r"<script.*?</script>", "", html, flags=re.DOTALL)
    assert all(one.short in text for one in study.parameters)
    assert "Agreed variation" in text and "640" in text and "passed" in text
    errors = next(section for section in page.sections if section.heading.startswith("What is known"))
    assert errors.text.startswith("By the delta method") and errors.text not in TEXTS
    assert [(one.label, one.unit) for one in page.figures][2:4] == [("steady rate, 20 deg", "deg/min"), ("K", "1/s")]
    tables = [table for section in page.sections for table in section.tables if "K by the" in table.caption]
    assert [len(table.columns) for table in tables] == [5, 2]  # all that is as wide as the page
    reported = InfluenceData.of(result.as_json())
    charts = influence_charts(reported)
    assert len(charts) == len(TEXTS)
    # Nr and Yv have the largest K on the criterion, Nd on the radius: they stand at the top, and are named first.
    assert {reported.names[place] for place in most_influential(reported, 0)[:2]} == {"Nr", "Yv"}
    assert reported.names[most_influential(reported, 1)[0]] == "Nd" and "20 deg by Nd" not in page.verdict
