// SPDX-License-Identifier: MIT
// Names that Qt defines as macros, unless QT_NO_KEYWORDS keeps them from it.
#pragma once

#define slots
#define signals public
#define emit
#define foreach(variable, container) for (variable : container)
#define forever for (;;)
