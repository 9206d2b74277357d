// SPDX-License-Identifier: MIT
// Unidirectional path tracing with next-event estimation and multiple importance sampling (Veach
// 1997, chapters 9 and 10), one vertex at a time, so that a pixel whose path has ended can begin its
// next one at once (Novák et al. 2010, Path Regeneration for Interactive Path Tracing).
//
// bounces counts scattering events: 0 is emission seen directly, 1 adds direct light.
uniform int u_bounces;
uniform int u_light_samples;            // at each vertex
uniform int u_russian_roulette_vertex;  // the first vertex at which a path may be ended early
uniform vec2 u_inverse_image_size;
uniform vec3 u_ambient_radiance;
#if BACKGROUND == BACKGROUND_PREFILTERED
uniform float u_background_roughness;
#endif
#if HAS_BACKGROUND
uniform vec3 u_background_radiance;  // what a camera ray sees in place of the environment
#endif

struct Path {
    Ray ray;
    vec3 throughput;  // product of the BSDF weights so far
    vec3 radiance;    // what the path has gathered
    int vertex;       // scattering events so far
    float pdf;        // 1/sr, of the ray's direction by BSDF sampling
    bool unweighted;  // the ray could only have come this way: from the camera or a delta lobe
    float roulette;   // uniform number that decides whether the path survives its next vertex
#if HAS_ALPHA
    uint seed;        // what decides whether surfaces are there begins with; another for each path
#endif
};

// A point where a path scatters.
struct Vertex {
    bool scatters;  // false: the path ended here, and the rest is void
    vec3 origin;    // of the rays that leave
    Frame frame;    // on the side the path came from
    vec3 wo;        // local
    Bsdf bsdf;
#if HAS_SHADING_NORMALS
    vec3 geometric;  // unit normal of the surface itself, local
#endif
#if HAS_ALPHA
    uint seed;       // of the rays to lights
#endif
#if HAS_OCCLUSION_TEXTURE
    float occlusion;  // what is left of light from all around; a path finds out itself, and does not look
#endif
};

// Factor of what a vertex scatters to wi, for the sake of shading normals.
float path_shadowing(Vertex vertex, vec3 wi) {
#if HAS_SHADING_NORMALS
    return shading_normal_shadowing(vertex.geometric, wi);
#else
    return 1.0;
#endif
}

#if COUNT_WORK
vec3 path_work = vec3(0.0);  // of the sample so far: path rays, shadow rays, vertices
#define COUNT(field) path_work.field += 1.0
#else
#define COUNT(field)
#endif

Path path_begin(ivec2 pixel, vec4 u) {
    vec2 position = vec2(pixel) + 0.5 + pixel_filter_sample(u.xy);
    Ray ray = camera_ray(2.0 * position * u_inverse_image_size - 1.0, u.zw);
    return Path(ray, vec3(1.0), vec3(0.0), 0, 0.0, true, 0.0
#if HAS_ALPHA
        , hash_pcg4d(floatBitsToUint(u)).x
#endif
    );
}

// The next surface along the ray.
Hit path_intersect(Path path) {
#if HAS_ALPHA
    return alpha_intersect(path.ray, INFINITE_DISTANCE, NO_PRIMITIVE, hash_uint(path.seed + uint(path.vertex)));
#else
    return scene_intersect(path.ray, INFINITE_DISTANCE, NO_PRIMITIVE, false);
#endif
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

// What a camera ray sees that meets nothing, in place of the environment.
vec3 path_background(vec3 direction) {
#if BACKGROUND == BACKGROUND_PREFILTERED
    return maps_prefiltered(direction, u_background_roughness);
#elif BACKGROUND == BACKGROUND_IRRADIANCE
    return maps_irradiance(direction);
#else
    return vec3(0.0);
#endif
}

// Adds what comes from infinitely far away.
void path_add_distant(inout Path path) {
#if HAS_AMBIENT
    path.radiance += path.throughput * u_ambient_radiance * path_emission_weight(path, 0.0);
#endif
#if BACKGROUND != BACKGROUND_ENVIRONMENT
    if (path.vertex == 0) {
        path.radiance += path_background(path.ray.direction);
        return;
    }
#elif HAS_BACKGROUND
    if (path.vertex == 0) {
        path.radiance += path.throughput * u_background_radiance;
        return;
    }
#endif
#if HAS_ENVIRONMENT
    vec4 environment = environment_radiance_pdf(path.ray.direction);
    float pdf = environment.a * light_load(ENVIRONMENT_LIGHT).probability;
    path.radiance += path.throughput * environment.rgb * path_emission_weight(path, pdf);
#endif
#if HAS_SUN
    Light sun = light_load(SUN_LIGHT);
    float sun_pdf = sun_light_pdf(sun.position, sun.radius, path.ray.direction) * sun.probability;
    if (sun_pdf > 0.0) path.radiance += path.throughput * sun.radiance * path_emission_weight(path, sun_pdf);
#endif
}

// Follows the ray to its next vertex and adds the emission found there.
Vertex path_extend(inout Path path) {
    Vertex vertex;
    vertex.scatters = false;
    COUNT(x);
    Hit hit = path_intersect(path);
    if (hit.primitive == NO_PRIMITIVE) {
        path_add_distant(path);
        return vertex;
    }
    Surface surface = surface_at(path.ray, hit);
    Material material = material_at(surface);
    float cos_theta = -dot(surface.normal, path.ray.direction);

#if LIGHT_COUNT
    // Surfaces emit from their front only.
    if (surface.light >= 0 && cos_theta > 0.0) {
        float pdf = light_pdf(surface.light, path.ray.origin, hit.distance, cos_theta, surface_light_density(surface));
        path.radiance += path.throughput * material.emission * path_emission_weight(path, pdf);
    }
#endif
#if HAS_UNLIT
    // What is unlit shines by its albedo, for every ray that meets it; no light is sampled there.
    if (material.unlit != 0) {
        path.radiance += path.throughput * material.emission;
        return vertex;
    }
#endif
    if (path.vertex >= u_bounces) return vertex;

    // Russian roulette by the throughput (Arvo and Kirk 1990, Particle Transport and Image Synthesis).
    float survival = path.vertex < u_russian_roulette_vertex ? 1.0 : min(0.95, max_component(path.throughput));
    if (path.roulette >= survival) return vertex;
    path.throughput /= survival;

    vec3 normal = cos_theta < 0.0 ? -surface.normal : surface.normal;
    COUNT(z);
    vertex.scatters = true;
    // Back along the ray as well: where walls meet, the normal of one runs along the other, and a point
    // rounded to beyond that one would stay there.
    vertex.origin = ray_offset_origin(surface.position, normal - path.ray.direction, surface.extent);
#if HAS_SHADING_NORMALS
    vec3 shading_normal = material_shading_normal(surface);
    if (cos_theta < 0.0) shading_normal = -shading_normal;
    vertex.frame = frame_from_normal(shading_normal_bend(shading_normal, -path.ray.direction));
    vertex.geometric = frame_to_local(vertex.frame, normal);
#else
    vertex.frame = frame_from_normal(normal);
#endif
    vertex.wo = frame_to_local(vertex.frame, -path.ray.direction);
    vertex.bsdf = Bsdf(material.diffuse, material.alpha, material.f0, material.f90);
#if HAS_ALPHA
    vertex.seed = hash_uint(~path.seed + uint(path.vertex));
#endif
#if HAS_OCCLUSION_TEXTURE
    vertex.occlusion = material_occlusion(surface);
#endif
    return vertex;
}

// Whether anything is between a vertex and a light in the direction wi, which `u` has chosen.
bool path_is_occluded(Vertex vertex, vec3 wi, float distance, int light_primitive, vec2 u) {
    COUNT(y);
    Ray ray = Ray(vertex.origin, wi);
#if HAS_ALPHA
    uint seed = hash_uint(vertex.seed ^ hash_uint(floatBitsToUint(u.x) ^ hash_uint(floatBitsToUint(u.y))));
    return alpha_intersect(ray, distance, light_primitive, seed).primitive != NO_PRIMITIVE;
#else
    return scene_intersect(ray, distance, light_primitive, true).primitive != NO_PRIMITIVE;
#endif
}

#if LIGHT_COUNT
// Radiance scattered towards wo from one sample of the lights, of u_light_samples, if nothing occludes it.
vec3 path_light_unoccluded(Vertex vertex, LightSample light) {
    vec3 wi = frame_to_local(vertex.frame, light.wi);
    vec4 eval_pdf = bsdf_eval_pdf(vertex.bsdf, vertex.wo, wi);
    eval_pdf.rgb *= path_shadowing(vertex, wi);
    if (light.pdf <= 0.0 || max_component(eval_pdf.rgb) <= 0.0) return vec3(0.0);
#if ESTIMATOR == ESTIMATOR_MIS
    float weight = light.delta ? 1.0 : power_heuristic(float(u_light_samples) * light.pdf, eval_pdf.a);
#elif ESTIMATOR == ESTIMATOR_NEE
    float weight = 1.0;
#else
    float weight = float(light.delta);
#endif
    return eval_pdf.rgb * light.radiance * (weight / light.pdf);
}

vec3 path_light_sample(Vertex vertex, vec2 u) {
    LightSample light = light_sample(vertex.origin, u);
    vec3 radiance = path_light_unoccluded(vertex, light);
    if (max_component(radiance) <= 0.0) return vec3(0.0);
    return path_is_occluded(vertex, light.wi, light.distance, light.primitive, u) ? vec3(0.0) : radiance;
}
#endif

#if HAS_AMBIENT && ESTIMATOR == ESTIMATOR_NEE
// The ambient light by sampling it alone. The other estimators leave it to BSDF sampling, which is
// proportional to the integrand where nothing occludes; its light pdf is therefore 0 there.
vec3 path_ambient_sample(Vertex vertex, vec2 u) {
    vec3 wi = square_to_cosine_hemisphere(u);
    bool occluded = path_is_occluded(vertex, frame_to_world(vertex.frame, wi), INFINITE_DISTANCE, NO_PRIMITIVE, u);
    if (occluded || wi.z <= 0.0) return vec3(0.0);
    float shadowing = path_shadowing(vertex, wi);
    return bsdf_eval(vertex.bsdf, vertex.wo, wi) * u_ambient_radiance * shadowing / square_to_cosine_hemisphere_pdf(wi);
}
#endif

// Adds the direct light at a vertex by next-event estimation; u serves if one sample is all.
void path_gather_direct(inout Path path, Vertex vertex, ivec2 pixel, uint index, vec2 u) {
    vec3 direct = vec3(0.0);
    float spare;
#if LIGHT_COUNT
#if SINGLE_LIGHT_EVALUATION
    vec3 unoccluded;
#endif
    int i = 0;
    do {
        if (u_light_samples > 1) {
            uint light_index = index * uint(u_light_samples) + uint(i);
            u = sampler_vec4(pixel, light_index, dimension_light(path.vertex), spare).xy;
        }
#if SINGLE_LIGHT_EVALUATION
        // The BSDF once, for the first sample, times the fraction of all samples that are not occluded: biased,
        // since light that is occluded and light that is not are scattered alike. `bench --what ablations` measures it.
        LightSample light = light_sample(vertex.origin, u);
        if (i == 0) unoccluded = path_light_unoccluded(vertex, light);
        bool occluded = light.pdf <= 0.0 || path_is_occluded(vertex, light.wi, light.distance, light.primitive, u);
        if (!occluded) direct += unoccluded;
#else
        direct += path_light_sample(vertex, u);
#endif
        i++;
    } while (i < u_light_samples);
    direct /= float(u_light_samples);
#endif
#if HAS_AMBIENT && ESTIMATOR == ESTIMATOR_NEE
    direct += path_ambient_sample(vertex, sampler_vec4(pixel, index, dimension_ambient(path.vertex), spare).xy);
#endif
    path.radiance += path.throughput * direct;
}

// Goes on in a direction drawn from the BSDF. Where there is none, the throughput becomes zero.
// `roulette` is a uniform number for the next vertex.
void path_scatter(inout Path path, Vertex vertex, vec2 u, float roulette) {
    BsdfSample scattered = bsdf_sample(vertex.bsdf, vertex.wo, u);
    path.throughput *= scattered.weight * path_shadowing(vertex, scattered.wi);
    path.vertex = scattered.pdf > 0.0 ? path.vertex + 1 : u_bounces;
    path.pdf = scattered.pdf;
    path.unweighted = scattered.delta;
    path.roulette = roulette;
    path.ray = Ray(vertex.origin, frame_to_world(vertex.frame, scattered.wi));
}
