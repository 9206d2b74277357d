// SPDX-License-Identifier: MIT
const float PI = 3.14159265358979;
const float INVERSE_PI = 0.318309886183791;
const float ONE_MINUS_EPSILON = 0.99999994;  // the largest float32 below 1
const float INFINITE_DISTANCE = 1e30;
