// SPDX-License-Identifier: MIT
const float PI = 3.14159265358979;
const float INVERSE_PI = 0.318309886183791;
const float INFINITE_DISTANCE = 1e30;
