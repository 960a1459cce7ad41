// SPDX-License-Identifier: MIT
#pragma once
#include <itkImage.h>
