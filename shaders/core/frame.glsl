// SPDX-License-Identifier: MIT
// Orthonormal frames whose third axis is the shading normal.

struct Frame { vec3 tangent; vec3 bitangent; vec3 normal; };

// Duff et al. 2017, Building an Orthonormal Basis, Revisited, listing 3.
Frame frame_from_normal(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return Frame(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

// One whose first axis is that of `tangent`, which need be neither unit nor perpendicular to n; any where it is along n.
Frame frame_from_tangent(vec3 n, vec3 tangent) {
    vec3 across = tangent - n * dot(n, tangent);
    float size = length(across);
    if (size < 1e-6) return frame_from_normal(n);
    return Frame(across / size, cross(n, across / size), n);
}

vec3 frame_to_world(Frame f, vec3 v) { return f.tangent * v.x + f.bitangent * v.y + f.normal * v.z; }

vec3 frame_to_local(Frame f, vec3 v) { return vec3(dot(v, f.tangent), dot(v, f.bitangent), dot(v, f.normal)); }
