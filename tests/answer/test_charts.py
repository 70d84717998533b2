import io

import altair as alt
import numpy as np
import pytest
from PIL import Image

from tank2sim.answer.charts.motion import TrackData, track_chart
from tank2sim.answer.charts.parts import series_look
from tank2sim.answer.charts.picture import VEGALITE_VERSION, altair_chart, chart_png, chart_specification
from tank2sim.answer.charts.theme import DARK_TONE, LIGHT_PALETTE, LIGHT_TONE, Tone, vega_config
from tests.answer.example import every_chart


def picture(chart, **how):
    with Image.open(io.BytesIO(chart_png(chart, **how))) as image:
        assert image.format == "PNG"
        return np.asarray(image.convert("RGB")).astype(int)


def near(pixels, colour):
    wanted = [int(colour[place : place + 2], 16) for place in (1, 3, 5)]
    return np.argwhere(np.abs(pixels - wanted).sum(axis=2) < 30)


@pytest.mark.parametrize("name", ["track", "history", "tow", "bode", "pole_zero", "error", "spiral"])
def test_every_chart_is_a_picture_with_its_series_in_it(charts, name):
    pixels = picture(charts[name], scale=1.0)
    assert len(near(pixels, LIGHT_PALETTE[0])) > 5
    assert pixels[0, 0].tolist() == [255, 255, 255]


def test_a_picture_has_the_size_of_its_chart_times_the_scale(charts):
    specification = chart_specification(charts["track"])
    single, double = picture(charts["track"], scale=1.0), picture(charts["track"], scale=2.0)
    assert specification["width"] < single.shape[1] < specification["width"] + 120
    assert specification["height"] < single.shape[0] < specification["height"] + 160
    assert double.shape[:2] == pytest.approx(np.multiply(single.shape[:2], 2), abs=2)


def test_a_run_to_the_north_east_goes_up_and_to_the_right_in_the_picture():
    pixels = picture(track_chart([TrackData("run", x_m=[0, 1000], y_m=[0, 400])]), scale=1.0)
    line = near(pixels, LIGHT_PALETTE[0])
    top, bottom = line[line[:, 0].argmin()], line[line[:, 0].argmax()]
    assert top[1] > bottom[1]
    # One scale on both axes: the line climbs 1000 for 400 to the right, in pixels as in metres.
    assert (bottom[0] - top[0]) / (top[1] - bottom[1]) == pytest.approx(2.5, rel=0.03)


def test_the_specification_says_nothing_of_looks(charts):
    assert all("config" not in chart_specification(chart) for chart in charts.values())


def test_the_same_data_give_the_same_specification(charts):
    again = every_chart()
    assert all(chart_specification(charts[name]) == chart_specification(again[name]) for name in charts)


def test_charts_are_drawn_in_the_version_of_vega_lite_they_are_written_in(charts):
    assert f"/v{VEGALITE_VERSION}" in chart_specification(charts["track"])["$schema"]
    assert alt.SCHEMA_VERSION.startswith(f"v{VEGALITE_VERSION}.")


def test_a_chart_as_an_object_of_altair_is_the_same_and_can_be_changed(charts):
    for chart in charts.values():
        assert chart_specification(altair_chart(chart)) == chart_specification(chart)
    assert chart_specification(altair_chart(charts["track"]).properties(width=99))["width"] == 99


def test_measured_and_simulated_look_the_same_whatever_is_on_the_chart_with_them():
    def looks(*labels):
        look = series_look(labels, as_points=["measured"])
        names, dashes = look.colour["scale"]["domain"], look.dash["scale"]["range"]
        return {label: (names.index(label), dashes[names.index(label)]) for label in labels}

    both, more = looks("measured", "simulated"), looks("other", "simulated", "measured", "card before")
    assert {label: more[label] for label in both} == both
    assert len({place for place, _ in more.values()}) == 4
    assert series_look(["measured", "simulated"]).colour["legend"]["values"] == ["measured", "simulated"]


@pytest.mark.parametrize("tone", [LIGHT_TONE, DARK_TONE], ids=["light", "dark"])
def test_words_and_limits_stand_out_from_the_paper(tone):
    # WCAG 2.2: relative luminance, and 4.5 : 1 for text.
    def luminance(colour):
        parts = [int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return float(np.dot(linear, [0.2126, 0.7152, 0.0722]))

    for colour in (tone.ink, tone.muted, tone.limit):
        lighter, darker = sorted((luminance(colour), luminance(tone.paper)), reverse=True)
        assert (lighter + 0.05) / (darker + 0.05) >= 4.5


@pytest.mark.parametrize("tone", [LIGHT_TONE, DARK_TONE], ids=["light", "dark"])
def test_an_interval_without_a_series_has_the_ink_of_its_paper(tone: Tone) -> None:
    assert vega_config(tone)["rule"]["color"] == tone.ink != tone.paper
