// SPDX-License-Identifier: MIT
// Unidirectional path tracing with next-event estimation and multiple importance sampling (Veach
// 1997, chapters 9 and 10), one vertex a call, so that a pixel whose path has ended can begin its
// next one at once.
//
// bounces counts scattering events: 0 is emission seen directly, 1 adds direct light.
uniform int u_bounces;
uniform int u_light_samples;            // at each vertex
uniform int u_russian_roulette_vertex;  // the first vertex at which a path may be ended early
uniform vec2 u_inverse_image_size;
uniform vec3 u_ambient_radiance;

struct Path {
    Ray ray;
    vec3 throughput;  // product of the BSDF weights so far
    vec3 radiance;    // what the path has gathered
    int vertex;       // scattering events so far
    float pdf;        // 1/sr, of the ray's direction by BSDF sampling
    bool unweighted;  // the ray could only have come this way: from the camera or a delta lobe
    ivec2 pixel;
    uint index;       // of this sample within the pixel
};

Path path_begin(ivec2 pixel, uint index) {
    vec4 u = sampler_vec4(pixel, index, dimension_camera());
    vec2 position = vec2(pixel) + 0.5 + pixel_filter_sample(u.xy);
    Ray ray = camera_ray(2.0 * position * u_inverse_image_size - 1.0, u.zw);
    return Path(ray, vec3(1.0), vec3(0.0), 0, 0.0, true, pixel, index);
}

bool is_occluded(vec3 origin, vec3 wi, float distance, int light_primitive) {
    return scene_intersect(Ray(origin, wi), distance, light_primitive).primitive != NO_PRIMITIVE;
}

// MIS weight of emission met by BSDF sampling, against light sampling of density light_pdf.
float path_emission_weight(Path path, float light_pdf) {
#if ESTIMATOR == ESTIMATOR_MIS
    return path.unweighted ? 1.0 : power_heuristic(path.pdf, float(u_light_samples) * light_pdf);
#elif ESTIMATOR == ESTIMATOR_NEE
    return path.unweighted ? 1.0 : 0.0;
#else
    return 1.0;
#endif
}

#if LIGHT_COUNT
// Radiance towards wo by sampling the lights, averaged over u_light_samples.
vec3 path_direct_light(Path path, Bsdf bsdf, Frame frame, vec3 origin, vec3 wo) {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < u_light_samples; i++) {
        uint index = path.index * uint(u_light_samples) + uint(i);
        vec4 u = sampler_vec4(path.pixel, index, dimension_light(path.vertex));
        LightSample light = light_sample(origin, u.xyz);
        vec4 eval_pdf = bsdf_eval_pdf(bsdf, wo, frame_to_local(frame, light.wi));
        if (light.pdf > 0.0 && max_component(eval_pdf.rgb) > 0.0 &&
            !is_occluded(origin, light.wi, light.distance, light.primitive)) {
#if ESTIMATOR == ESTIMATOR_MIS
            float weight = light.delta ? 1.0 : power_heuristic(float(u_light_samples) * light.pdf, eval_pdf.a);
#elif ESTIMATOR == ESTIMATOR_NEE
            float weight = 1.0;
#else
            float weight = float(light.delta);
#endif
            sum += eval_pdf.rgb * light.radiance * (weight / light.pdf);
        }
    }
    return sum / float(u_light_samples);
}
#endif

#if HAS_AMBIENT && ESTIMATOR == ESTIMATOR_NEE
// The ambient light by sampling it alone. The other estimators leave it to BSDF sampling, which is
// proportional to the integrand where it matters; its light pdf is therefore 0 there.
vec3 path_direct_ambient(Path path, Bsdf bsdf, Frame frame, vec3 origin, vec3 wo) {
    vec3 wi = square_to_cosine_hemisphere(sampler_vec4(path.pixel, path.index, dimension_ambient(path.vertex)).xy);
    bool occluded = is_occluded(origin, frame_to_world(frame, wi), INFINITE_DISTANCE, NO_PRIMITIVE);
    if (occluded || wi.z <= 0.0) return vec3(0.0);
    return bsdf_eval(bsdf, wo, wi) * u_ambient_radiance / square_to_cosine_hemisphere_pdf(wi);
}
#endif

// Follows the ray to its next vertex, gathers the light there and scatters. False: the path ended.
bool path_extend(inout Path path) {
    Hit hit = scene_intersect(path.ray, INFINITE_DISTANCE, NO_PRIMITIVE);
    if (hit.primitive == NO_PRIMITIVE) {
#if HAS_AMBIENT
        path.radiance += path.throughput * u_ambient_radiance * path_emission_weight(path, 0.0);
#endif
        return false;
    }
    Surface surface = surface_at(path.ray, hit);
    Material material = material_load(surface.material);
    float cos_theta = -dot(surface.normal, path.ray.direction);

    // Emission, from the front only.
#if LIGHT_COUNT
    if (surface.light >= 0 && cos_theta > 0.0) {
        float pdf = light_pdf(surface.light, path.ray.origin, hit.distance, cos_theta);
        path.radiance += path.throughput * material.emission * path_emission_weight(path, pdf);
    }
#endif
    if (path.vertex >= u_bounces) return false;

    // The shading frame, on the side the ray came from.
    vec3 normal = cos_theta < 0.0 ? -surface.normal : surface.normal;
    Frame frame = frame_from_normal(normal);
    vec3 wo = frame_to_local(frame, -path.ray.direction);
    vec3 origin = ray_offset_origin(surface.position, normal, surface.extent);
    Bsdf bsdf = Bsdf(material.diffuse, material.alpha, material.f0, material.f90);

    // Direct light by next-event estimation.
#if LIGHT_COUNT
    path.radiance += path.throughput * path_direct_light(path, bsdf, frame, origin, wo);
#endif
#if HAS_AMBIENT && ESTIMATOR == ESTIMATOR_NEE
    path.radiance += path.throughput * path_direct_ambient(path, bsdf, frame, origin, wo);
#endif

    // The next direction.
    vec4 u = sampler_vec4(path.pixel, path.index, dimension_bsdf(path.vertex));
    BsdfSample scattered = bsdf_sample(bsdf, wo, u.xyz);
    if (scattered.pdf <= 0.0) return false;
    path.throughput *= scattered.weight;
    path.vertex++;
    path.pdf = scattered.pdf;
    path.unweighted = scattered.delta;
    path.ray = Ray(origin, frame_to_world(frame, scattered.wi));

    // Russian roulette by the throughput (Arvo and Kirk 1990, Particle Transport and Image Synthesis).
    float survival = path.vertex < u_russian_roulette_vertex ? 1.0 : min(0.95, max_component(path.throughput));
    if (u.w >= survival) return false;
    path.throughput /= survival;
    return true;
}
