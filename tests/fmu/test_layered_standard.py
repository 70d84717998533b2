"""The reference run as FMI-LS-REF describes it: what the manifest names is there, and is what it says."""

from __future__ import annotations

import hashlib
import re
import zipfile
from pathlib import PurePosixPath
from posixpath import normpath
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.fmu.driving import ShipFmu

FOLDER = PurePosixPath("extra/org.fmi-standard.fmi-ls-ref")
NAMESPACE = "{http://fmi-standard.org/fmi-ls-manifest}"
ROLES = re.compile(r"experiment/smoke-test|result")


def at(source: str) -> str:
    """Path in the archive of a source that is relative to the manifest."""
    return normpath(str(FOLDER / source))


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_manifest_names_the_run_with_its_inputs_and_outputs(mariner_fmu: ShipFmu, fmi: int) -> None:
    with zipfile.ZipFile(mariner_fmu(fmi)) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    manifest = ElementTree.fromstring(files[str(FOLDER / "fmi-ls-manifest.xml")])
    assert manifest.tag == "fmiReferences"
    assert manifest.get(f"{NAMESPACE}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    assert manifest.get(f"{NAMESPACE}fmi-ls-version") and manifest.get(f"{NAMESPACE}fmi-ls-description")
    related = {str(one.get("role")): one for one in manifest}
    assert all(one.tag == "Related" for one in manifest) and all(ROLES.fullmatch(role) for role in related)
    for one in manifest:
        content = files[at(str(one.get("source")))]
        assert (one.get("checksumType"), one.get("checksum")) == ("SHA3-256", hashlib.sha3_256(content).hexdigest())
    experiments = ElementTree.fromstring(files[at(str(related["experiment/smoke-test"].get("source")))])
    assert experiments.tag == "Experiments" and experiments.get("name")
    (experiment,) = experiments
    stimuli, references = (files[at(str(one.get("source")))].decode() for one in experiment)
    assert [one.tag for one in experiment] == ["Stimuli", "References"]
    assert stimuli.startswith("time,rudder.command") and references.startswith("time,motion.x")
    times = np.array([float(row.split(",")[0]) for row in references.splitlines()[1:]])
    ends = [float(str(experiment.get(name))) for name in ("startTime", "stopTime")]
    assert ends == pytest.approx(times[[0, -1]], rel=1e-12)
    assert float(str(experiment.get("stepSize"))) == pytest.approx(np.median(np.diff(times)))
