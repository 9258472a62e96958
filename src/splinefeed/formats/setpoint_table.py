"""The formats of setpoints, which the command line and `formats/setpoints.py` read. It needs no NumPy."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SetpointFormat:
    """A kind of file for setpoints.

    Parameters
    ----------
    suffixes : tuple of str
        Of its files.
    module : str
        Of this room, with `write_NAME`, and where it can be loaded `read_NAME(file)`, which returns columns by name and
        the description; HDF5, which holds other records too, is `hdf5`.
    rotary : str, optional
        Unit of rotary axes in the file: "deg" or "rad". Setpoints come to the writer in it.
    at_once : bool, optional
        Whether all setpoints are written at once, by ``write_NAME(points, file)``. Else ``write_NAME(file)`` is a
        generator that gets chunk after chunk of Setpoints from `yield`, and None behind the last.
    """

    suffixes: tuple[str, ...]
    module: str
    rotary: str = "rad"
    at_once: bool = False


#: Every format of setpoints by the name that `--format` takes; the first suffix is the one that files get.
FORMATS = {
    "hdf5": SetpointFormat((".h5", ".hdf5"), "hdf5"),
    "csv": SetpointFormat((".csv",), "setpoints_text", "deg"),
    "mat": SetpointFormat((".mat",), "setpoints_arrays", "deg", at_once=True),
    "npz": SetpointFormat((".npz",), "setpoints_arrays", at_once=True),
    "parquet": SetpointFormat((".parquet",), "setpoints_arrays"),
    "halstreamer": SetpointFormat((".halstream",), "setpoints_text", "deg"),
    "pvt": SetpointFormat((".pvt",), "setpoints_text", "deg", at_once=True),
}
