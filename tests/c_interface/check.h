/* SPDX-License-Identifier: MIT */
#ifndef TREPHINE_TESTS_CHECK_H
#define TREPHINE_TESTS_CHECK_H

#include "trephine_c.h"

#include <stdio.h>
#include <string.h>

/* Of each file by itself. */
static int failures = 0;

#define CHECK(condition)                                     \
  do {                                                       \
    if (!(condition)) {                                      \
      printf("%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      printf("  last error: %s\n", trephine_last_error());   \
      ++failures;                                            \
    }                                                        \
  } while (0)

/* The code, and a word of its message. */
#define CHECK_REFUSED(call, code, word)                 \
  do {                                                  \
    CHECK((call) == (code));                            \
    CHECK(strstr(trephine_last_error(), word) != NULL); \
  } while (0)

/* Checks meshes, the ramp and mirrored axes; returns how many checks failed. */
int for_engines(void);

#endif
