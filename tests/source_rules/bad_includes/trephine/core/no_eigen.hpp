// SPDX-License-Identifier: MIT
#pragma once

using Length = Eigen::Matrix<double, 1, 1>;
