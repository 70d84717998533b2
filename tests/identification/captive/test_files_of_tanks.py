"""A campaign gives the same derivatives from the files of any tank."""

import pytest

from tank2sim.identification.captive.reduction import reduce_campaign
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import Campaign, write
from tests.records.tank_files import FORMATS, converted


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    written = write(Campaign(seed=5, size="linear", rate_hz=5.0), tmp_path_factory.mktemp("plain") / "made")
    return written, reduce_campaign(read_campaign(written.path)).derivatives


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_derivatives_are_those_of_the_plain_files_to_the_digits_of_the_format(plain, tmp_path, name):
    for library, ending in (("h5py", ("h5", "73.mat")), ("nptdms", "tdms")):
        if name.endswith(ending):
            pytest.importorskip(library)
    written, derivatives = plain
    again = reduce_campaign(read_campaign(converted(written.path, tmp_path / "again", name))).derivatives
    assert again.keys() == derivatives.keys()
    for key, derivative in derivatives.items():
        assert again[key].value == pytest.approx(derivative.value, abs=1e-6 * derivative.standard_error), key
        assert again[key].standard_error == pytest.approx(derivative.standard_error, rel=1e-4), (
            key
        )  # found by iteration
