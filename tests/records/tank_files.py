"""The runs of a made-up campaign written again as towing tanks write them; nothing of tank2sim is used."""

from __future__ import annotations

from pathlib import Path

import numpy as np

GERMAN = ["Zeit", "Querweg", "Kurswinkel", "vq", "Drehgeschw.", "Fahrt", "Ruder", "Längskraft", "Querkraft", "Moment"]
UNITS = ["ms", "mm", "°", "m/s", "°/s", "m/s", "°", "N", "kN", "Nm"]
FACTORS = np.array([1e-3, 1e-3, np.pi / 180, 1, np.pi / 180, 1, np.pi / 180, 1, 1e3, 1])
NAMES = ["t", "y", "psi", "v", "r", "speed", "delta", "X", "Y", "N"]
SI = ["s", "m", "rad", "m/s", "rad/s", "m/s", "rad", "N", "N", "N m"]
MAP = "[columns]\n" + "".join(f'"{name}" = "{quantity}"\n' for name, quantity in zip(GERMAN, NAMES, strict=True))


def german(path: Path, table: np.ndarray) -> str:
    """Semicolons, decimal commas, a row of units, a preamble, latin-1, CRLF; the sway force has the other sign."""
    shown = table / FACTORS
    shown[:, 8] *= -1
    rows = [";".join(f"{value:.12g}".replace(".", ",") for value in row) + ";" for row in shown]
    head = ["Schleppkanal Musterstadt", "Größe: Modell 12; 3,5 m", "", "Bemerkung;Prüfling ähnlich;;;;;;;;;"]
    text = "\r\n".join([*head, ";".join(GERMAN) + ";", ";".join(UNITS) + ";", *rows]) + "\r\n"
    path.write_bytes(text.encode("latin-1"))
    return MAP.replace('"Querkraft" = "Y"', '"Querkraft" = { quantity = "Y", sign = -1 }')


def tabs(path: Path, table: np.ndarray) -> str:
    """Tabs, units in brackets of the names, UTF-16 as a spreadsheet exports."""
    shown = table / FACTORS
    heads = [f"{name} [{unit}]" for name, unit in zip(GERMAN, UNITS, strict=True)]
    rows = ["\t".join(f"{value:.12g}" for value in row) for row in shown]
    path.write_text("\n".join(["\t".join(heads), *rows]), encoding="utf-16")
    return MAP


def blanks(path: Path, table: np.ndarray) -> str:
    """Columns of fixed width with units under the names, a preamble of 30 lines."""
    head = [f"line {place} of the log of the carriage" for place in range(30)]
    names = "".join(f"{name:>20}" for name in NAMES)
    units = "".join(f"{'[' + unit.replace(' ', '') + ']':>20}" for unit in SI)
    rows = ["".join(f"{value:20.12e}" for value in row) for row in table]
    path.write_text("\n".join([*head, names, units, *rows]) + "\n")
    return ""


def touching(path: Path, table: np.ndarray) -> str:
    """Columns of fixed width that touch, without names."""
    path.write_text("\n".join("".join(f"{value:20.13e}" for value in row) for row in table) + "\n")
    names = ", ".join(f'"{name} [{unit}]"' for name, unit in zip(NAMES, SI, strict=True))
    return f"[files]\nwidths = {[20] * 10}\nnames = [{names}]\n"


def matlab(path: Path, table: np.ndarray) -> str:
    """A structure of vectors, next to parameters."""
    from scipy.io import savemat

    fields = {f"k{place}": values[:, None] for place, values in enumerate(table.T)}
    savemat(path, {"run": {"data": fields, "speed": 1.2}, "comment": "made up"})
    units = {"t": "s", "y": "m", "psi": "rad", "v": "m/s", "r": "rad/s", "speed": "m/s", "delta": "rad", "N": "N m"}
    return "[columns]\n" + "".join(
        f'k{place} = {{ quantity = "{name}", unit = "{units.get(name, "N")}" }}\n' for place, name in enumerate(NAMES)
    )


def matlab_73(path: Path, table: np.ndarray) -> str:
    """A matrix in a MATLAB 7.3 file: HDF5 behind 512 bytes, by columns."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        data = file.create_dataset("data", data=table.T)
        data.attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: made up".ljust(128))
    text = "[columns]\n"
    for place, (name, unit) in enumerate(zip(NAMES, SI, strict=True), start=1):
        text += f'"data {place}" = {{ quantity = "{name}", unit = "{unit}" }}\n'
    return text


def hdf5(path: Path, table: np.ndarray) -> str:
    """A dataset a channel with its unit as an attribute."""
    import h5py

    with h5py.File(path, "w") as file:
        for name, unit, values in zip(GERMAN, UNITS, (table / FACTORS).T, strict=True):
            file.create_dataset(f"Messung/{name}", data=values).attrs["unit"] = unit
        file["Messung/Kanalzahl"] = 10
    return MAP


def tdms(path: Path, table: np.ndarray) -> str:
    """Channels with unit_string, and the time by the increment of the waveform."""
    from nptdms import ChannelObject, TdmsWriter

    step = float(table[1, 0] - table[0, 0])
    channels = [
        ChannelObject("Messung", name, values, {"unit_string": unit, "wf_increment": step, "wf_start_offset": 0.0})
        for name, unit, values in zip(GERMAN[1:], UNITS[1:], (table / FACTORS).T[1:], strict=True)
    ]
    with TdmsWriter(str(path)) as writer:
        writer.write_segment(channels)
    return MAP.replace('"Zeit" = "t"\n', "")


FORMATS = {
    "german.csv": german,
    "tabs.txt": tabs,
    "blanks.dat": blanks,
    "touching.asc": touching,
    "matlab.mat": matlab,
    "matlab_73.mat": matlab_73,
    "hdf5.h5": hdf5,
    "tdms.tdms": tdms,
}
"""Name of a format, ending with that of its files, to its writer: (path, table) to sections of ``campaign.toml``."""


def converted(campaign: Path, folder: Path, name: str) -> Path:
    """The campaign with all its runs in another format, in a new folder; the path of its ``campaign.toml``."""
    folder.mkdir()
    ending = "." + name.partition(".")[2]
    sections = ""
    text = campaign.read_text()
    for file in sorted(campaign.parent.glob("*.csv")):
        table = np.loadtxt(file, delimiter=",", skiprows=1)
        sections = FORMATS[name](folder / (file.stem + ending), table)
        text = text.replace(f'file = "{file.name}"', f'file = "{file.stem}{ending}"')
    path = folder / "campaign.toml"
    first = text.index("[[runs]]")
    path.write_text(text[:first] + sections + "\n" + text[first:], encoding="utf-8")
    return path
