// SPDX-License-Identifier: MIT
// The stack of the traversal of the BVH: groups of records that are left to do, and 1 below the last of them. The upper 16
// are in registers, which all move when a group is pushed or popped: a software renderer writes to an array lane by lane.
#include "scene/shape.glsl"

const int BVH_STACK = 64;  // MAX_DEPTH of fragtracer.bvh and 1, twice
const int STACK_REGISTERS = 16;

uvec4 stack_0, stack_1, stack_2, stack_3;  // from the top down
uint stack_rest[BVH_STACK];                // from the bottom up: a 1 for each register, and the groups below them
int stack_count;                           // groups on the stack

void stack_clear() {
    stack_0 = stack_1 = stack_2 = stack_3 = uvec4(1u);
    stack_count = 0;
}

void stack_push(uint group) {
    if (u_bvh_stack > STACK_REGISTERS) stack_rest[stack_count] = stack_3.w;
    if (u_bvh_stack > 12) stack_3 = uvec4(stack_2.w, stack_3.xyz);
    if (u_bvh_stack > 8) stack_2 = uvec4(stack_1.w, stack_2.xyz);
    if (u_bvh_stack > 4) stack_1 = uvec4(stack_0.w, stack_1.xyz);
    stack_0 = uvec4(group, stack_0.xyz);
    stack_count++;
}

// 1 if there is none.
uint stack_pop() {
    uint group = stack_0.x;
    stack_0 = uvec4(stack_0.yzw, stack_1.x);
    if (u_bvh_stack > 4) stack_1 = uvec4(stack_1.yzw, stack_2.x);
    if (u_bvh_stack > 8) stack_2 = uvec4(stack_2.yzw, stack_3.x);
    stack_count = max(stack_count - 1, 0);
    if (u_bvh_stack > 12) stack_3 = uvec4(stack_3.yzw, u_bvh_stack > STACK_REGISTERS ? stack_rest[stack_count] : 1u);
    return group;
}
