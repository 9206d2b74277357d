// SPDX-License-Identifier: MIT
// From the light that really comes from the environment, step by step, to what the split-sum approximation says:
// each step makes one more of its errors, and integrates instead of looking up. A step is the integral of the
// radiance from wi times split_sum_kernel_pdf(wi).rgb, by one sample of the material and one of the environment.
#include "sampler/sampler.glsl"
#include "integrator/split_sum.glsl"

#if SPLIT_SUM_STEP < SPLIT_SUM_LOOKUPS

// As those of bsdf/bsdf.glsl; layers of coats are Cook-Torrance also where no material of the scene is.
vec4 split_sum_bsdf_eval_pdf(Bsdf b, vec3 wo, vec3 wi) {
#if HAS_EXACT_FRESNEL
    if (b.model == BSDF_COOK_TORRANCE) return cook_torrance_eval_pdf(b, wo, wi);
#endif
    return bsdf_eval_pdf(b, wo, wi);
}

BsdfSample split_sum_bsdf_sample(Bsdf b, vec3 wo, vec2 u) {
#if HAS_EXACT_FRESNEL
    if (b.model == BSDF_COOK_TORRANCE) return cook_torrance_sample(b, wo, u);
#endif
    return bsdf_sample(b, wo, u);
}

// The frame around the mirrored direction, local.
Frame split_sum_mirrored(Vertex vertex) { return frame_from_normal(vec3(-vertex.wo.xy, vertex.wo.z)); }

// Density over wi of the lobe: of half vectors drawn by D cos.
float split_sum_lobe_pdf(Vertex vertex, vec3 wi) {
    float alpha = vertex.bsdf.alpha;
#if SPLIT_SUM_STEP >= SPLIT_SUM_NORMAL_VIEW
    Frame mirrored = split_sum_mirrored(vertex);
    return 0.25 * ggx_d(alpha, frame_to_local(mirrored, normalize(mirrored.normal + wi)));
#else
    vec3 wh = normalize(vertex.wo + wi);
    return ggx_d(alpha, wh) * wh.z / (4.0 * dot(vertex.wo, wh));
#endif
}

// The factors of the lobe, whose integral over wi is 1, and of F0.
vec3 split_sum_lobe_color(Vertex vertex) {
    Bsdf b = vertex.bsdf;
    vec3 map = maps_brdf(vertex.wo.z, sqrt(b.alpha));
#if SPLIT_SUM_STEP >= SPLIT_SUM_FRESNEL
    return split_sum_fresnel(b, vertex.wo.z) * map.x + b.f90 * map.y;
#else
    return b.f0 * map.x + b.f90 * map.y;
#endif
}

float split_sum_specular_share(Vertex vertex) {
    float specular = luminance(split_sum_lobe_color(vertex));
    float total = specular + luminance(vertex.bsdf.diffuse);
    return total > 0.0 ? specular / total : 0.0;
}

// The kernel in rgb, without a delta lobe, and the density of split_sum_step_sample in a.
vec4 split_sum_kernel_pdf(Vertex vertex, vec3 wi) {
    Bsdf b = vertex.bsdf;
#if SPLIT_SUM_STEP < SPLIT_SUM_DIFFUSE
    return split_sum_bsdf_eval_pdf(b, vertex.wo, wi);
#else
    vec3 diffuse = (1.0 - split_sum_fresnel(b, vertex.wo.z)) * b.diffuse * square_to_cosine_hemisphere_pdf(wi);
#if SPLIT_SUM_STEP < SPLIT_SUM_FACTORS
    Bsdf specular = b;
    specular.diffuse = vec3(0.0);
    vec3 lobe = split_sum_bsdf_eval_pdf(specular, vertex.wo, wi).rgb;
    return vec4(diffuse + lobe, split_sum_bsdf_eval_pdf(b, vertex.wo, wi).a);
#else
    float share = split_sum_specular_share(vertex);
    float pdf = (1.0 - share) * square_to_cosine_hemisphere_pdf(wi);
    if (cook_torrance_is_mirror(b)) return vec4(diffuse, pdf);
    float lobe = split_sum_lobe_pdf(vertex, wi);
    float roughness = sqrt(b.alpha);
#if SPLIT_SUM_STEP >= SPLIT_SUM_NORMAL_VIEW
    float cos_theta = dot(vec3(-vertex.wo.xy, vertex.wo.z), wi) / maps_brdf(1.0, roughness).z;
#else
    float cos_theta = wi.z / maps_brdf(vertex.wo.z, roughness).z;
#endif
    return vec4(diffuse + split_sum_lobe_color(vertex) * (max(0.0, cos_theta) * lobe), pdf + share * lobe);
#endif
#endif
}

BsdfSample split_sum_step_sample(Vertex vertex, vec2 u) {
    Bsdf b = vertex.bsdf;
    BsdfSample s;
#if SPLIT_SUM_STEP < SPLIT_SUM_FACTORS
    s = split_sum_bsdf_sample(b, vertex.wo, u);
    if (bsdf_is_delta(s)) return s;
#else
    float share = split_sum_specular_share(vertex);
    bool specular = choose_first(share, u.x);
    vec3 mirrored = vec3(-vertex.wo.xy, vertex.wo.z);
    if (specular && cook_torrance_is_mirror(b)) {
        return BsdfSample(mirrored, split_sum_lobe_color(vertex) / share, share, 1.0, EVENT_REFLECTION | EVENT_DELTA);
    }
    vec3 z = vec3(0.0, 0.0, 1.0);
    vec3 wh = ggx_sample_vndf(b.alpha, z, u);
#if SPLIT_SUM_STEP >= SPLIT_SUM_NORMAL_VIEW
    vec3 wi = frame_to_world(split_sum_mirrored(vertex), reflect(-z, wh));
#else
    vec3 wi = reflect(-vertex.wo, wh);
#endif
    s = bsdf_no_sample();
    s.wi = specular ? wi : square_to_cosine_hemisphere(u);
#endif
    vec4 kernel_pdf = split_sum_kernel_pdf(vertex, s.wi);
    s.pdf = kernel_pdf.a;
    s.weight = kernel_pdf.a > 0.0 ? kernel_pdf.rgb / kernel_pdf.a : vec3(0.0);
    return s;
}

float split_sum_visibility(Vertex vertex, vec3 wi) {
#if SPLIT_SUM_STEP < SPLIT_SUM_UNOCCLUDED
    if (direct_is_occluded(vertex, Ray(vertex.origin, wi), INFINITE_DISTANCE, NO_PRIMITIVE, wi.xy)) return 0.0;
    return vertex_shading_factor(vertex, frame_to_local(vertex.frame, wi));
#else
    return 1.0;
#endif
}

vec3 split_sum_step(Vertex vertex, ivec2 pixel, uint index) {
    float unused;
    vec4 u = sampler_vec4(pixel, index, dimension_vertex(0), unused);
    vec3 sum = vec3(0.0);
    BsdfSample s = split_sum_step_sample(vertex, u.xy);
    vec3 wi = frame_to_world(vertex.frame, s.wi);
    if (s.pdf > 0.0 && max_component(s.weight) > 0.0) {
        vec3 radiance = u_ambient_radiance;
#if HAS_ENVIRONMENT
        vec4 found = environment_radiance_pdf(wi);
        radiance += found.rgb * (bsdf_is_delta(s) ? 1.0 : power_heuristic(s.pdf, found.a));
#endif
        sum += s.weight * radiance * split_sum_visibility(vertex, wi);
    }
#if HAS_ENVIRONMENT
    LightSample e = environment_light_sample(u.zw);
    vec4 kernel_pdf = split_sum_kernel_pdf(vertex, frame_to_local(vertex.frame, e.wi));
    if (e.pdf > 0.0 && max_component(kernel_pdf.rgb) > 0.0) {
        float weight = power_heuristic(e.pdf, kernel_pdf.a) / e.pdf;
        sum += kernel_pdf.rgb * e.radiance * (weight * split_sum_visibility(vertex, e.wi));
    }
#endif
    return sum;
}
#endif
