// SPDX-License-Identifier: MIT
#pragma once
#define GOOD 1
