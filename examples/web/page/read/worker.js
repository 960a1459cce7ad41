// SPDX-License-Identifier: MIT
// Reads files beside the page, so that the picture goes on and a wrong file harms nothing.
import { readVolume } from "./any.js";
import { Refusal } from "./volume.js";

onmessage = async ({ data: { files, most } }) => {
  try {
    const volume = await readVolume(files, most, (text) => postMessage({ progress: text }));
    postMessage({ volume }, [volume.voxels.buffer]);
  } catch (error) {
    const memory = error instanceof RangeError;
    postMessage({
      refused: error instanceof Refusal ? error.message
        : memory ? "This device has too little memory for that volume."
        : `${files[0].name} cannot be read: it is damaged, or of a kind that this page does not know.`,
    });
  }
};
