"""The description of an FMU next to the one its model would have: every unit, variable and dependency."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.fmu.export import description_text

_SECTIONS = ("UnitDefinitions", "DefaultExperiment", "ModelVariables", "ModelStructure")
"""What the model decides. Names, tokens, dates and capabilities are the FMU's own."""

_IDENTIFIERS = ("name", "valueReference", "index")

Elements = dict[str, dict[str, str]]
"""Place of each element, in words, to its attributes."""


def description_differences(path: Path, text: bytes, model: Model, fmi: int) -> list[str]:
    """Sentences on whatever a model description says of units, variables and dependencies and the model does not.

    Parameters
    ----------
    path : Path
        The FMU, for messages.
    text : bytes
        Its ``modelDescription.xml``.
    fmi : int
        2 or 3.

    Raises
    ------
    InputError
        The text is not XML.
    """
    try:
        found = _elements(ElementTree.fromstring(text))
    except ElementTree.ParseError as error:
        raise InputError(path, "modelDescription.xml", f"cannot be read ({error})", "export the FMU again") from None
    expected = _elements(ElementTree.fromstring(description_text(model, fmi=fmi)))
    differences = [f"{place} of the model is not in the FMU" for place in expected if place not in found]
    differences += [f"{place} of the FMU is not in the model" for place in found if place not in expected]
    for place in expected:
        differences += _attribute_differences(place, found.get(place, expected[place]), expected[place])
    if not differences and list(found) != list(expected):
        differences.append("the elements of the description are in another order than the model's")
    return differences


def _elements(root: ElementTree.Element) -> Elements:
    elements: Elements = {}
    for section in _SECTIONS:
        for top in root.findall(section):
            for place, attributes in _walk(top, section):
                again = sum(1 for other in elements if other == place or other.startswith(f"{place} (again"))
                elements[f"{place} (again {again})" if again else place] = attributes
    return elements


def _walk(element: ElementTree.Element, place: str) -> Iterator[tuple[str, dict[str, str]]]:
    yield place, dict(element.attrib)
    for child in element:
        identity = next((child.attrib[key] for key in _IDENTIFIERS if key in child.attrib), "")
        yield from _walk(child, f"{place}: {child.tag} {identity}".rstrip())


def _attribute_differences(place: str, found: dict[str, str], expected: dict[str, str]) -> list[str]:
    return [
        f"{place}: {name} is {found.get(name, 'missing')} in the FMU and {expected.get(name, 'missing')} in the model"
        for name in dict.fromkeys([*expected, *found])
        if not _same(found.get(name), expected.get(name))
    ]


def _same(found: str | None, expected: str | None) -> bool:
    if found is None or expected is None or found == expected:
        return found == expected
    try:
        return float(found) == float(expected)  # 1e2 says what 100.0 says
    except ValueError:
        return False
