// SPDX-License-Identifier: MIT
// Sampling by the lobes of a cell and by the BSDF together: one of the two is chosen, and the density is that of the
// mixture (the one-sample model: Veach 1997, section 9.2.4; Vorba et al. 2014, On-line Learning of Parametric Mixture
// Models for Light Transport Simulation, section 4.2).
#include "bsdf/bsdf.glsl"
#include "guiding/lobes.glsl"

#if GUIDING

const float GUIDING_MOST = 0.5;   // probability of a lobe: what the BSDF alone finds needs samples as well

// How a point is guided.
struct Guide {
    Lobe lobes[GUIDING_LOBES];
    float probability[GUIDING_LOBES];  // of each
    float sum;                         // of them; what is left is the probability of the BSDF
};

// The lobes count by the light that arrives by them, on the sides of the surface where it is scattered, and as far as the
// surface is matte: a narrow lobe of its own is sampled better by the BSDF. Where not `is_guided`, none does.
Guide guide_at(vec3 position, Frame frame, Bsdf bsdf, bool is_guided) {
    Guide guide;
    int first = guiding_cell(position);
    float matte = luminance(bsdf.diffuse + bsdf.sheen_color + bsdf.transmitted);
    matte = is_guided && matte > 0.0 ? matte / (matte + luminance(iridescence_f0(bsdf))) : 0.0;
    float sum = 0.0;
    for (int i = 0; i < GUIDING_LOBES; i++) {
        guide.lobes[i] = lobe_load(first, i, position);
        bool is_met = bsdf_transmits(bsdf) || dot(frame.normal, guide.lobes[i].direction) > -guide.lobes[i].alpha;
        guide.probability[i] = is_met ? guide.lobes[i].ratio * matte : 0.0;
        sum += guide.probability[i];
    }
    guide.sum = min(GUIDING_MOST, sum / (sum + 1.0));
    for (int i = 0; i < GUIDING_LOBES; i++) guide.probability[i] *= guide.sum / max(sum, 1e-20);
    return guide;
}

// Density of the lobes, each times its probability.
float guide_pdf(Guide guide, vec3 wi) {
    float pdf = 0.0;
    for (int i = 0; i < GUIDING_LOBES; i++) pdf += guide.probability[i] * lobe_pdf(guide.lobes[i], wi);
    return pdf;
}

// A direction by one of the lobes, u.x < guide.sum chooses which.
vec3 guide_sample(Guide guide, vec2 u) {
    Lobe lobe = guide.lobes[0];
    float begin = 0.0, end = 0.0, probability = 1.0;
    for (int i = 0; i < GUIDING_LOBES; i++) {
        bool is_chosen = guide.probability[i] > 0.0 && u.x >= end;
        if (is_chosen) lobe = guide.lobes[i];
        begin = is_chosen ? end : begin;
        probability = is_chosen ? guide.probability[i] : probability;
        end += guide.probability[i];
    }
    u.x = clamp((u.x - begin) / probability, 0.0, ONE_MINUS_EPSILON);
    return lobe_sample(lobe, u);
}

// As bsdf_sample(), with the weight of the mixture. The density is that by which direct light is weighed: of the BSDF
// alone, times the probability of choosing it; the weights of two techniques are a partition of unity whatever draws the
// directions of the second.
BsdfSample guide_scatter(Guide guide, Frame frame, Bsdf bsdf, vec3 wo, vec2 u) {
    bool is_guided = u.x < guide.sum;
    vec3 direction = guide_sample(guide, u);
    if (!is_guided) u.x = min((u.x - guide.sum) / (1.0 - guide.sum), ONE_MINUS_EPSILON);
    BsdfSample s = bsdf_sample(bsdf, wo, u);
    bool is_delta = !is_guided && bsdf_is_delta(s);
    s.wi = is_guided ? frame_to_local(frame, direction) : s.wi;
    vec4 eval_pdf = bsdf_eval_pdf(bsdf, wo, s.wi);
#if HAS_EXACT_FRESNEL  // of the others, those that draw no direction evaluate to 0
    if (!is_guided && s.pdf <= 0.0) eval_pdf = vec4(0.0);
#endif
    float pdf = (1.0 - guide.sum) * eval_pdf.a;
    float mixture = pdf + guide_pdf(guide, frame_to_world(frame, s.wi));
    s.weight = is_delta ? s.weight / (1.0 - guide.sum) : eval_pdf.rgb / max(mixture, 1e-30);
    s.pdf = is_delta ? s.pdf : pdf;
    s.event = is_guided ? (s.wi.z < 0.0 ? EVENT_TRANSMISSION : EVENT_REFLECTION) : s.event;
    s.eta = is_guided ? 1.0 : s.eta;
    return s;
}

#endif
