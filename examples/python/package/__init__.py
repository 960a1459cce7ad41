# SPDX-License-Identifier: MIT
"""Haptic bone drilling: forces and torques of a tool in the voxels of a CT, and the bone that it removes.

    import numpy, trephine
    voxels = numpy.full((48, 64, 64), -1000, numpy.int16)     # z, y, x: air above,
    voxels[:24] = 1200                                        # bone below
    bone = trephine.Bone(voxels, spacing=0.5e-3)
    scene = trephine.Scene(bone, 300, trephine.Burr(tip_radius=1.5e-3), cut=trephine.GeometricCut())
    poses = numpy.tile(numpy.eye(4), (1000, 1, 1))            # X_WT of each millisecond
    poses[:, :3, 3] = 16e-3, 16e-3, 14e-3
    poses[:, 2, 3] -= 4e-6 * numpy.arange(1000)
    ticks = scene.run(poses, spindle=numpy.arange(1000) > 800)
    print(ticks["force"][799], ticks["removed_mm3"].sum())

Units are SI: m, s, N, N m. Arrays of voxels are (z, y, x), x fastest. Frames: W is the world, G the bone (origin: the
centre of voxel [0, 0, 0]), T the tool (origin: the burr's centre; +z along the shaft to the handle). A pose X_WT maps
coordinates of T to W, as a matrix (4, 4), or as (7,): x y z qx qy qz qw. A wrench acts on the tool, about T's origin,
in W axes. Options are the structs of the C++ headers, with their defaults; a value out of range is a ValueError.

Bone: voxels. Scene: a tool in a bone, `tick` and `run`. Batch: many scenes on all cores. Structures: what must stay.
tool, Burr: tools. device_preset: options by a device's name. read_volume, read_labels, save_volume: files.
The modules trephine.env, environments for learning, and trephine.study, tables of many cases, are imported by name.
"""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy

from . import _trephine
from ._trephine import *  # noqa: F401,F403
from ._trephine import Bone, __version__


class VolumeError(OSError):
    """A file that is no usable volume or segmentation. The message has the file, the reason and a remedy."""


class Labels(NamedTuple):
    """A segmentation of a file: `Structures(labels.voxels, labels.spacing, X_GS=labels.X_GS(bone))` takes it."""

    voxels: numpy.ndarray  #: uint8 (z, y, x): 0 for none, s + 1 for structure s
    spacing: numpy.ndarray  #: (3,) along x, y, z [m]
    X_WS: numpy.ndarray  #: (4, 4) pose of the segmentation in the patient's space
    names: list[str]  #: of the structures

    def X_GS(self, bone: Bone) -> numpy.ndarray:
        """Pose of the segmentation in a bone that was read in the same patient's space, (4, 4)."""
        return numpy.linalg.inv(bone.X_WG) @ self.X_WS


def _with_itk() -> Any:
    try:
        from . import _files
    except ImportError as error:
        raise RuntimeError(f"trephine: this module cannot read or save volumes; it needs ITK ({error})") from error
    return _files


def _read(function: Any, *arguments: Any) -> Any:
    try:
        return function(*arguments)
    except RuntimeError as error:
        raise VolumeError(str(error)) from None


def read_volume(
    path: str | os.PathLike[str], isovalue: float | None = None, series: str = "", keep_original: bool = True
) -> Bone:
    """Reads a folder of DICOM slices, or an NRRD, NIfTI or MetaImage file, in the density type that suits it.

    Densities are Hounsfield units where the file has the rescaling. W is the patient's space: x to the left, y to the
    back, z to the head [m]. With an isovalue a file without a surface there is refused. `series` chooses one of several
    DICOM series. Raises VolumeError, and RuntimeError where the module was built without ITK.
    """
    voxels, spacing, X_WG, outside = _read(_with_itk().read_volume, os.fspath(path), isovalue, series)
    return Bone(voxels, spacing, X_WG=X_WG, outside=outside, keep_original=keep_original)


def save_volume(path: str | os.PathLike[str], bone: Bone) -> None:
    """Writes the present bone to an NRRD (.nrrd) or MetaImage (.mha) file, which `read_volume` reads back.

    Raises VolumeError, and RuntimeError where the module was built without ITK.
    """
    _read(_with_itk().save_volume, os.fspath(path), bone.voxels(), bone.spacing, bone.X_WG, bone.outside)


def read_labels(path: str | os.PathLike[str]) -> Labels:
    """Reads a segmentation: a .seg.nrrd file of 3D Slicer, or a label image in NRRD, NIfTI or MetaImage.

    Raises VolumeError, and RuntimeError where the module was built without ITK.
    """
    return Labels(*_read(_with_itk().read_labels, os.fspath(path)))


__all__ = sorted(name for name in vars(_trephine) if not name.startswith("_"))
__all__ += ["Labels", "VolumeError", "read_labels", "read_volume", "save_volume"]
