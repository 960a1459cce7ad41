// SPDX-License-Identifier: MIT
#pragma once

/// Processes, where there is POSIX: sources of a folder are compiled as one, their includes before all else.
#if defined(__unix__) || defined(__APPLE__)

#include <sys/mman.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#endif
