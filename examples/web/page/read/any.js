// SPDX-License-Identifier: MIT
import { headOf, refuse } from "./volume.js";

const word = (head, at, text) => [...text].every((c, i) => head[at + i] === c.charCodeAt(0));
const isNifti = (head) => word(head, 344, "n+1") || word(head, 4, "n+2");

/// Reads a volume of any kind, by its contents, because names lie. What is wrong with it is one sentence of a Refusal.
export async function readVolume(files, most, progress) {
  const file = files[0];
  const raw = await headOf(file, 1024, false);
  if (files.length === 1) {
    if (file.size === 0) refuse(`${file.name} is empty.`);
    if (word(raw, 0, "NRRD")) return (await import("./nrrd.js")).readNrrd(file, most);
    const packed = raw[0] === 0x1f && raw[1] === 0x8b;
    const head = packed ? await headOf(file, 1024, true) : raw;
    if (isNifti(head)) return (await import("./nifti.js")).readNifti(file, packed, most);
    if (word(head, 344, "ni1") || word(head, 4, "ni2"))
      refuse(`${file.name} keeps its voxels in another file, so please save it as one .nii file.`);
    if (!word(raw, 128, "DICM") && !/\.(dcm|dicom|ima)$/i.test(file.name))
      refuse(`${file.name} is no volume that this page reads: NIfTI, NRRD or DICOM.`);
  }
  return (await import("./dicom.js")).readDicom(files, progress, most);
}
