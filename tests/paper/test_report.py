"""Tables, the page, fits and claims."""

import numpy as np
import pytest

from gough.paper import published
from gough.paper.markdown import number, page, percent, table
from gough.paper.results import linear_fit


def test_a_table_with_an_empty_cell_is_refused():
    assert table(("a", "b"), [("x", 1)]).splitlines()[-1] == "| x | 1 |"
    with pytest.raises(ValueError, match="filled cells"):
        table(("a", "b"), [("x", "")])
    with pytest.raises(ValueError, match="2 filled cells"):
        table(("a", "b"), [("x",)])


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0014912, "0.00149"), (48.06, "48.1"), (117.4, "117"), (1234.5, "1,234"), (0, "0"),
     (None, "n/a"), (2e-13, "2.00e-13"), (100.0, "100")],
)  # fmt: skip
def test_numbers_are_short(value, text):
    assert number(value) == text


def test_percent():
    assert percent(0.99966, 3) == "99.966"


def test_the_page_holds_its_figures(tmp_path):
    for name in ("one", "two"):
        (tmp_path / f"{name}.svg").write_text(
            '<?xml version="1.0"?>\n<svg width="1"><defs><path id="p"/></defs>'
            '<use href="#p"/><g clip-path="url(#p)"/></svg>'
        )
    made = page('# T\n\n![a "b"](one.svg)\n\n![c](two.svg)\n', "T", tmp_path)
    assert made.count("<svg") == 2
    assert 'id="one-p"' in made
    assert 'href="#two-p"' in made
    assert "url(#one-p)" in made
    assert "<img" not in made
    assert 'aria-label="a &quot;b&quot;"' in made


def test_the_fit_and_its_band_are_those_of_a_known_line():
    x = list(range(10, 210, 10))
    noise = np.random.default_rng(0).normal(0, 0.5, len(x))
    fit = linear_fit(x, list(2 + 0.25 * np.array(x) + noise))
    slope, intercept = np.polyfit(x, 2 + 0.25 * np.array(x) + noise, 1)
    assert fit["slope"] == pytest.approx(slope)
    assert fit["intercept"] == pytest.approx(intercept)
    assert fit["quantile"] == pytest.approx(2.1009, abs=1e-4)  # Student's t, 18, 97.5 %


def test_a_band_of_95_per_cent_holds_the_line_95_times_in_100():
    x = list(range(10, 110, 10))
    rng = np.random.default_rng(1)
    truth = 1 + 0.1 * np.array(x)
    held = 0
    for _ in range(1000):
        fit = linear_fit(x, list(truth + rng.normal(0, 0.3, len(x))))
        at = 80.0
        half = fit["quantile"] * fit["deviation"] * np.sqrt(
            1 / fit["count"] + (at - fit["mean"]) ** 2 / fit["sxx"]
        )  # fmt: skip
        held += abs(fit["slope"] * at + fit["intercept"] - (1 + 0.1 * at)) < half
    assert 930 <= held <= 970


def test_the_papers_tables_agree_with_each_other():
    """What the report says of them: the supplement's rows repeat table I's, at half the norm."""
    for name, row in published.SETS["full"].items():
        main = published.TABLE[name]
        assert row[5] == main.rot
        assert 0.49 < row[1] / main.trans < 0.56
