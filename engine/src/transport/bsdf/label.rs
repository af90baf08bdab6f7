//! Which lobe a sampled direction counts as, where what follows depends on it. Twin of `transport/bsdf_label.glsl`.
//!
//! Strategies overlap: a direction found by the cosine may be the microfacets' light as well. A label is drawn in proportion to what the
//! lobes scatter that way, and the weight is that lobe's share over the label's probability: unbiased for each label, and the sum over
//! labels has the weight that it had (a discrete choice inside one-sample estimation; Veach 1997, 2.5 and 9.2.4).

use glam::DVec3;

use super::{Bsdf, BsdfContext, BsdfSample, LOBE_DIFFUSE, LOBE_GLOSSY, LOBE_REFLECTION, bsdf_eval, lobe_allowed};
use crate::gpu::shaders::constants;
use crate::transport::choice::choose_first;

/// Keeps a quotient of zeros zero.
const LABEL_LEAST: f64 = constants::LABEL_LEAST as f64;

/// A sample with its label, one of the lobes of the mask that it was drawn with.
///
/// `alike`: the base and the microfacets' reflection need not be told apart. `u` in [0, 1) is used and, for further use, made uniform
/// again.
pub fn bsdf_label(
    context: &BsdfContext,
    b: &Bsdf,
    wo: DVec3,
    mut s: BsdfSample,
    mask: u32,
    alike: bool,
    u: &mut f64,
) -> BsdfSample {
    let (base, microfacets) = (LOBE_DIFFUSE & LOBE_REFLECTION, LOBE_GLOSSY & LOBE_REFLECTION);
    if s.pdf <= 0.0 || s.flags & (base | microfacets) == 0 {
        return s;
    }
    if !lobe_allowed(mask, s.flags) {
        // The metal's compensation is sampled as the base is.
        s.flags ^= base | microfacets;
    }
    if alike || !lobe_allowed(mask, base) || !lobe_allowed(mask, microfacets) {
        return s;
    }
    let whole = s.weight * s.pdf;
    let diffuse = bsdf_eval(context, b, wo, s.wi, base).min(whole);
    let glossy = whole - diffuse;
    let (d, g) = (diffuse.max_element(), glossy.max_element());
    let p = d / (d + g).max(LABEL_LEAST);
    let chosen = choose_first(u, p);
    let share = if chosen { p } else { 1.0 - p };
    s.flags = if chosen { base } else { microfacets };
    s.weight = if chosen { diffuse } else { glossy } / (s.pdf * share);
    s
}
