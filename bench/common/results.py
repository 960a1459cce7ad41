# SPDX-License-Identifier: MIT
"""Files of results, opened before the work that fills them."""

import os


def opened(parser, folder, name):
    """The file in the folder, which is made if missing. Where it cannot be written the program ends with one line and 2."""
    try:
        os.makedirs(folder, exist_ok=True)
        return open(os.path.join(folder, name), "w", newline="", encoding="utf-8")
    except OSError as error:
        parser.exit(2, f"{parser.prog}: --out {folder}: cannot be written ({error.strerror})\n")
