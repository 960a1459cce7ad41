// SPDX-License-Identifier: MIT
#pragma once
using namespace std;
