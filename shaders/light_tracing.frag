// SPDX-License-Identifier: MIT
// Light tracing (Arvo 1986, Backward Ray Tracing; Veach 1997, section 8.2): one photon for each fragment, whose light one
// pixel sees. It is the light that the path tracer leaves out (integrator/light_traced.glsl): caustics, above all.
//
// A photon begins at the first surface that it meets, and not at the light, so that every kind of light serves as it is:
// a point of a target, which is a shape that may scatter narrowly, is drawn by area, and a light sample there is the photon
// that arrives. Of all vertices one is drawn by the light there, and of its views, at once or over a mirror, one by what it
// brings if nothing occludes it, so that one way decides (resampled importance sampling: Talbot et al. 2005, Importance
// Resampling for Global Illumination).
#include "core/constants.glsl"
#include "core/texels.glsl"
#include "sampler/sampler.glsl"
#include "film/pixel_filter.glsl"
#include "bsdf/bsdf.glsl"
#include "scene/storage.glsl"
#include "texture/texture.glsl"
#include "shape/intersect.glsl"
#include "material/material.glsl"
#include "light/light.glsl"
#include "integrator/direct.glsl"
#include "integrator/interior.glsl"
#include "integrator/light_traced.glsl"
#include "integrator/mirrored.glsl"
#include "integrator/target.glsl"
#include "integrator/vertex.glsl"

// rgb: the mean over photons is what the pixel has of this light; a: 1 where a pixel sees the photon, 0 where none does, -1
// where what is seen is not finite, -2 where the driver has ended a loop before its time.
OUTPUT(0) out_splat;
OUTPUT(1) out_place;  // rg: the pixel, counted from the left and from below; b: the number of the target

uniform int u_bounces;
uniform int u_photon_pass;  // whose photons are drawn
uniform int u_photon_width; // of a row of them

vec4 photon_random(uint number, int use, out float u) {
    return sampler_vec4(ivec2(u_photon_pass, 0), number, dimension_photon(use), u);
}

// A photon on its way: at a surface, which it has reached from `towards_light`.
struct Photon {
    Hit hit;
    Surface surface;
    Material material;
    vec3 towards_light;  // unit
    vec3 flux;           // W, over the density of all that was drawn
    ivec4 inside;        // the dielectrics that it has come through last
    int band;
    int events;          // that have scattered it
    uint seed;
};

// The vertex at which light goes on to or comes from `direction`, a unit vector away from the surface, which lies inside of
// some dielectrics.
Vertex photon_vertex(Photon photon, vec3 direction, ivec4 inside) {
    Vertex vertex = vertex_at(photon.surface, photon.material, -direction, photon.seed);
    interior_set_vertex(vertex, photon.material, dot(photon.surface.normal, direction) >= 0.0, inside, photon.band);
    return vertex;
}

// Flux scattered over flux received where f |cos_i| towards the light, for a path that comes from `vertex.wo`, is `value`.
vec3 photon_transfer(Photon photon, Vertex vertex, vec3 value, vec3 wi) {
    return value * vertex_shading_factor(vertex, wi) / max(abs(dot(photon.surface.normal, photon.towards_light)), 1e-6);
}

// How much a photon may bring to the picture, roughly, after it was scattered: 0 only where it brings nothing.
float photon_promise(Photon photon, Vertex vertex) {
    int model = vertex.bsdf.model;
    bool is_metal = (model == BSDF_CONDUCTOR || model == BSDF_COOK_TORRANCE) && max_component(vertex.bsdf.diffuse) <= 0.0;
    bool is_dielectric = model == BSDF_DIELECTRIC || model == BSDF_THIN_DIELECTRIC;
    bool is_narrow = (is_metal || is_dielectric) && vertex.bsdf.alpha <= NARROW_WIDEST;
    vec3 from_camera = photon.surface.position - u_inverse_view[3].xyz;
    bool is_behind = dot(from_camera, u_inverse_view[2].xyz) >= 0.0;
    bool is_seen = photon.events > 0 && !is_narrow && !(is_behind && u_mirror_count == 0 && u_lens_radius <= 0.0);
    return is_seen ? luminance(photon.flux) / max(dot(from_camera, from_camera), 1e-20) : 0.0;
}

const vec4 UNSEEN = vec4(0.0);
const vec4 NOT_FINITE = vec4(0.0, 0.0, 0.0, -1.0);
const vec4 CUT = vec4(0.0, 0.0, 0.0, -2.0);

// out_splat of a photon, and out_place.
vec4 photon_trace(uint number, out vec3 place) {
    float rr_sample;
    vec4 u = photon_random(number, 0, rr_sample);
    vec4 v = photon_random(number, 1, rr_sample);
    float chosen;
    vec4 w = photon_random(number, 2, chosen);

    int number_of_target = target_choose(u.x, w.x);
    place = vec3(0.0, 0.0, float(number_of_target));
    Target target = target_load(number_of_target);
    Photon photon;
    Ray there;
    photon.hit = target_point(target, u.yz, there);
    photon.surface = surface_at(there, photon.hit);
    photon.seed = hash_uint(floatBitsToUint(rr_sample) ^ hash_uint(number));
    float opacity = 1.0;
#if HAS_ALPHA
    opacity = material_opacity(photon.surface);
#endif
    material_choose(photon.surface, photon.seed);
    photon.material = material_at(photon.surface);
    photon.inside = ivec4(0);
    photon.band = BAND_NONE;
    photon.events = 0;

    float wanted = 1.0;  // of the choice among lights, in which the environment is the last
#if HAS_ENVIRONMENT
    wanted -= u_environment_probability;
#endif
    LightSample light = light_sample(photon.surface.position, vec2(wanted * v.x, v.y));
    photon.towards_light = light.wi;
    float cosine = dot(photon.surface.normal, light.wi);
    bool is_met = light_traced_is_wanted(light) && light.pdf > 0.0 && !material_is_unlit(photon.material);
    is_met = is_met && (cosine > 0.0 || (cosine < 0.0 && !target.is_culled));
    // What has an inside is lit from outside: no light is within (light_tracing/decision.py).
    is_met = is_met && (cosine > 0.0 || photon.material.bsdf != BSDF_DIELECTRIC);
    is_met = is_met && (light.primitive != photon.hit.primitive || light.primitive < 0);  // as in direct_sample()
    vec3 away = light.wi + (cosine < 0.0 ? -photon.surface.normal : photon.surface.normal);
    vec3 origin = ray_offset_origin(photon.surface.position, away, photon.surface.extent);
    is_met = is_met && !is_occluded(Ray(origin, light.wi), light.distance, light.primitive, hash_uint(~photon.seed));
    if (!is_met) return UNSEEN;
    photon.flux = light.radiance * (opacity * wanted * abs(cosine) / (light.pdf * target.density));

    // The vertex that is seen, if any is, what lies behind it, what it promises, and the sum of what all of them do.
    Photon seen = photon;
    ivec4 seen_beyond = ivec4(0);
    float promised = 0.0, all_promised = 0.0;
    vec3 throughput = vec3(1.0);
    int turn = 0;
    bool goes_on;
    do {
        u = photon_random(number, 3 + turn, rr_sample);
        photon.seed = hash_uint(photon.seed);
        int band = interior_band(photon.material, photon.band, hash_to_unit(hash_uint(photon.seed ^ 0x68bc21ebu)));
        photon.flux *= interior_band_color(photon.band, band);
        photon.band = band;
        Vertex vertex = photon_vertex(photon, photon.towards_light, photon.inside);

        float promise = photon_promise(photon, vertex);
        all_promised += promise;
        if (promise > 0.0 && chosen * all_promised < promise) {
            seen = photon;
            seen_beyond = vertex.beyond;
            promised = promise;
            chosen = chosen * all_promised / promise;
        } else if (promise > 0.0) {
            chosen = (chosen * all_promised - promise) / (all_promised - promise);
        }

        // On in a direction that is sampled as if the light was the viewer, with the value of a path that comes from there.
        BsdfSample s = bsdf_sample(vertex.bsdf, vertex.wo, u.xy);
        vec3 direction = frame_to_world(vertex.frame, s.wi);
        ivec4 beyond = interior_behind_vertex(vertex, s.wi);
        Vertex from = photon_vertex(photon, direction, beyond);
        vec3 wi = frame_to_local(from.frame, photon.towards_light);
        vec3 value;
        vec3 narrow = vec3(1.0);
        if (bsdf_is_delta(s)) {
            value = s.weight * (square(s.eta) * vertex.wo.z / max(abs(s.wi.z), 1e-6));
        } else {
            value = vertex_eval_pdf(from, wi).rgb;
            narrow = vertex_narrow_share(from, wi, value);
            value /= s.pdf;
        }
        vec3 factor = photon_transfer(photon, from, value, wi) * abs(dot(photon.surface.normal, direction));
        if (photon.events == 0 && !light_traced_from(photon.hit)) factor = vec3(0.0);
        if (photon.events == 0 && !bsdf_is_null(s)) factor *= narrow;
        photon.events += bsdf_is_null(s) ? 0 : 1;

        // Russian roulette by the share of the light that is left.
        throughput *= factor;
        float survival = turn > 0 ? min(1.0, sqrt(max_component(throughput))) : 1.0;
        bool scatters = s.pdf > 0.0 && max_component(factor) > 0.0 && !from.is_bent;
        goes_on = scatters && photon.events < u_bounces && rr_sample < survival;
        throughput /= survival;
        photon.flux *= factor / survival;

        Ray ray = Ray(vertex_origin(vertex, s.wi), direction);
        photon.inside = beyond;
        photon.hit = closest_hit(ray, photon.seed);
        goes_on = goes_on && photon.hit.primitive != NO_PRIMITIVE;
        photon.flux *= interior_transmittance(beyond, photon.hit.distance);
        photon.surface = surface_at(ray, photon.hit);
        material_choose(photon.surface, photon.seed);
        photon.material = material_at(photon.surface);
        photon.towards_light = -direction;
        goes_on = goes_on && !material_is_unlit(photon.material);
        turn++;
    } while (goes_on);

    if (promised <= 0.0) return UNSEEN;

    // Its views by the camera, which is inside of nothing.
    MirroredView view;
    vec3 end;  // where the way to it ends
    vec3 radiance = vec3(0.0);
    float brought = 0.0;
    vec3 pixel;
    vec2 size = floor(1.0 / u_inverse_image_size + 0.5);
    int mirror = -1;
    u = photon_random(number, 3 + turn, rr_sample);
    do {
        MirroredView here = mirrored_view(seen.surface.position, mirror, v.zw, u.xy, seen.seed);
        float cos_camera = dot(seen.surface.normal, here.leaves);
        bool is_behind = (cos_camera > 0.0) != (dot(seen.surface.normal, seen.towards_light) > 0.0);
        ivec4 inside = is_behind ? seen_beyond : seen.inside;
        Vertex receiver = photon_vertex(seen, here.leaves, inside);
        vec3 wi = frame_to_local(receiver.frame, seen.towards_light);
        vec3 value = vertex_eval_pdf(receiver, wi).rgb;
        value *= 1.0 - vertex_narrow_share(receiver, wi, value);
        vec3 brings = seen.flux * photon_transfer(seen, receiver, value, wi) * here.reflectance;
        brings *= abs(cos_camera) * here.camera.weight;
        vec3 there = pixel_filter_pixel(here.camera.position, w.yz);
        bool sees = all(greaterThanEqual(there.xy, vec2(0.0))) && all(lessThan(there.xy, size)) && here.camera.weight > 0.0;
        sees = sees && here.mirror != seen.hit.primitive && interior_of(inside) == 0;
        sees = sees && seen.events + int(mirror >= 0) < u_bounces;
        float worth = sees ? luminance(brings) : 0.0;
        brought += worth;
        if (worth > 0.0 && chosen * brought < worth) {
            radiance = brings / worth;
            view = here;
            pixel = there;
            end = receiver.origin;
            chosen = chosen * brought / worth;
        } else if (worth > 0.0) {
            chosen = (chosen * brought - worth) / (brought - worth);
        }
        mirror++;
    } while (mirror < u_mirror_count);
    if (brought <= 0.0) return UNSEEN;
    radiance *= brought * all_promised / promised;
    if (!is_finite(radiance)) return NOT_FINITE;
    bool is_hidden = false;
    vec3 begin = view.camera.origin;
    vec3 next = view.mirror < 0 ? end : view.origin;
    int leg = 0;
    do {
        vec3 way = next - begin;
        is_hidden = is_occluded(Ray(begin, normalize(way)), length(way), view.mirror, hash_uint(~seen.seed + uint(leg)));
        begin = view.origin;
        next = end;
        leg++;
    } while (view.mirror >= 0 && leg < 2 && !is_hidden);
    place.xy = pixel.xy;
    return is_hidden ? UNSEEN : vec4(radiance * pixel.z, 1.0);
}

void main() {
    uvec2 texel = uvec2(gl_FragCoord.xy);
    vec3 place;
    vec4 splat = photon_trace(texel.y * uint(u_photon_width) + texel.x, place);
    output_write(out_splat, traversal_was_cut ? CUT : splat);
    output_write(out_place, vec4(place, 0.0));
}
