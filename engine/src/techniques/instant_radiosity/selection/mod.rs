//! Which virtual lights a point sends its shadow rays to: those that might bring the most, on the host and in double precision.
//!
//! A point takes its lights in the order of what they would bring if nothing stood between, until those taken carry a share of the sum of all. Shadow rays are
//! most of the work, and half of the lights carry nine tenths of the sum. Here are the parts by themselves: [`potential_contribution`], orders and where they
//! stop ([`lights_for_share`]), orders that are kept from point to point ([`KeptOrder`]), and walks that leave lights ([`LightWalks`]). On the device
//! technique `vpl` has a share of the potential as its setting `selection`, by a threshold from a histogram in place of a sort.
//!
//! Sources: G. Ward, "Adaptive Shadow Testing for Ray Tracing", EGWR 1991, who sorts light sources so and stops where what is left cannot matter; of virtual
//! lights the chapter on virtual light sources of a doctoral thesis on metals and reflections on graphics hardware, §6.2 and §6.3. Errata that are kept to: its
//! pseudocode swaps the light and the point; power and bound, which its listing lacks, belong to the potential; (r + g + b)/3 is no luminance, which is the key
//! here; what it calls a compensation is a rescaling, and biased.

mod bins;
mod order;
mod potential;
#[cfg(test)]
mod tests;
mod walks;

pub use bins::{potential_bin, potential_bin_least};
pub use order::{
    Gathered, KeptOrder, Resorting, above_threshold, bubble_pass, gather_in_order, lights_for_share, misplaced_lights,
    order_by_potential,
};
pub use potential::{LitPoint, SurfaceLight, potential_contribution};
pub use walks::{LightWalks, Survival, WalkHit};

use crate::catalogue::{Bias, Role, Row, sources};

/// Why a share of the potential is not the whole.
pub(super) const LEFT_OUT: &str = "lights left out count as seen as often as those taken";

/// Rows of the catalogue.
pub(super) const ROWS: &[Row] = &[
    Row {
        id: "CL-HOST-WALKS",
        name: "walks from a lamp on the host that leave lights, by roulette or by number",
        role: Role::Yardstick,
        limits: "Host, Lambert's law alone, one lamp; on the device MET-V1 stands for it.",
        sources: &[sources::KELLER_1997.whole()],
        tests: &[
            "engine/src/techniques/instant_radiosity/selection/tests.rs::fractional_walks_end_by_number",
            "engine/src/techniques/instant_radiosity/selection/tests.rs::bounds_of_distance_remove_spikes",
        ],
        api: &["clerestory::techniques::instant_radiosity::selection::LightWalks"],
        ..Row::of("engine/src/techniques/instant_radiosity/selection/walks.rs")
    },
    Row {
        id: "MET-V3",
        name: "potential contributions of virtual lights, and shadow rays for those above a threshold",
        role: Role::Yardstick,
        limits: "Host, Lambert's law at both ends; a threshold leaves out light, how much depends on the scene's units.",
        sources: &[sources::WARD_SHADOW_1991.whole()],
        bias: Some(Bias::Biased("lights below the threshold are left out")),
        tests: &[
            "engine/src/techniques/instant_radiosity/selection/tests.rs::points_in_one_place_bring_nothing_to_each_other",
            "engine/src/techniques/instant_radiosity/selection/tests.rs::orders_tell_what_is_misplaced",
        ],
        api: &["clerestory::techniques::instant_radiosity::selection::potential_contribution"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-V4",
        name: "the strongest virtual lights of a place that carry a share of their potential, and rescaling: setting `selection` potential of `vpl`",
        role: Role::PartOf("SVO-G0"),
        limits: "What rescaling assumes, that lights left out are seen as often as those taken, makes pictures a few hundredths too bright; the potential of all lights is found for each place, of 32,768 at most.",
        sources: &[sources::WARD_SHADOW_1991.whole()],
        shaders: &[
            "shaders/techniques/instant_radiosity/vpl_gather.comp",
            "shaders/techniques/instant_radiosity/potential_bins.glsl",
        ],
        bias: Some(Bias::Biased(LEFT_OUT)),
        tests: &[
            "engine/src/techniques/instant_radiosity/selection/tests.rs::a_share_of_the_potential_needs_the_published_share_of_lights_and_rays",
            "engine/src/techniques/instant_radiosity/selection/tests.rs::shares_of_lights_hardly_depend_on_the_bound",
            "engine/src/techniques/instant_radiosity/selection/tests.rs::rescaling_is_exact_where_nothing_is_hidden",
            "engine/src/techniques/instant_radiosity/selection/bins.rs::bins_are_quarters_of_octaves",
            "tests/tests/instant_radiosity/selection.rs::a_share_of_the_potential_is_exact_where_nothing_is_hidden",
            "tests/tests/instant_radiosity/selection.rs::a_share_of_the_potential_saves_rays_for_little_error",
        ],
        api: &["clerestory::techniques::instant_radiosity::selection::gather_in_order"],
        settings: &["selection", "potential_share", "rescales"],
        ..Row::of("engine/src/techniques/instant_radiosity/selection/order.rs")
    },
    Row {
        id: "MET-V5",
        name: "an order of lights that is made at every n-th point and kept between",
        role: Role::Yardstick,
        limits: "Host, points in rows; where surfaces change, orders are stale up to the next sort and take more rays.",
        sources: &[sources::WARD_SHADOW_1991.whole()],
        bias: Some(Bias::Biased(LEFT_OUT)),
        tests: &[
            "engine/src/techniques/instant_radiosity/selection/tests.rs::orders_that_are_kept_cost_the_published_rays",
        ],
        api: &["clerestory::techniques::instant_radiosity::selection::KeptOrder"],
        ..Row::of("engine/src/techniques/instant_radiosity/selection/order.rs")
    },
    Row {
        id: "MET-V6",
        name: "an order of lights that a bubble pass mends at each point, and a sort where too many are misplaced",
        role: Role::Yardstick,
        limits: "Host, points in rows; each point pays for a pass over all lights.",
        sources: &[sources::WARD_SHADOW_1991.whole()],
        bias: Some(Bias::Biased(LEFT_OUT)),
        tests: &[
            "engine/src/techniques/instant_radiosity/selection/tests.rs::orders_tell_what_is_misplaced",
            "engine/src/techniques/instant_radiosity/selection/tests.rs::orders_that_are_kept_cost_the_published_rays",
        ],
        api: &["clerestory::techniques::instant_radiosity::selection::misplaced_lights"],
        ..Row::of("engine/src/techniques/instant_radiosity/selection/order.rs")
    },
    Row {
        id: "MET-V7",
        name: "potential contributions of all pairs of a place and a virtual light on the device, by bins in place of a sort",
        role: Role::PartOf("SVO-G0"),
        limits: "Potentials are found and used in one dispatch, never stored; lights of the weakest bin that is needed are all taken, a few more than sorted.",
        sources: &[sources::WARD_SHADOW_1991.whole()],
        shaders: &[
            "shaders/techniques/instant_radiosity/vpl_gather.comp",
            "shaders/techniques/instant_radiosity/potential_bins.glsl",
        ],
        bias: Some(Bias::Biased(LEFT_OUT)),
        tests: &[
            "engine/src/techniques/instant_radiosity/selection/bins.rs::bins_are_quarters_of_octaves",
            "tests/tests/twins/light_tree.rs::unions_agree_with_their_twins",
            "tests/tests/instant_radiosity/selection.rs::potentials_are_their_twins",
            "tests/tests/instant_radiosity/selection.rs::selections_out_of_range_are_refused_by_name",
        ],
        api: &["clerestory::techniques::instant_radiosity::selection::potential_bin"],
        settings: &["selection", "potential_share"],
        ..Row::of("engine/src/techniques/instant_radiosity/selection/bins.rs")
    },
    Row {
        id: "MET-V8",
        name: "a point that is saturated takes no more lights",
        role: Role::Yardstick,
        limits: "Host, and for pictures of low dynamic range alone: what is beyond the limit is lost.",
        sources: &[sources::WARD_SHADOW_1991.whole()],
        bias: Some(Bias::Biased("radiance beyond the limit is cut off")),
        tests: &["engine/src/techniques/instant_radiosity/selection/tests.rs::a_saturated_point_stops"],
        api: &["clerestory::techniques::instant_radiosity::selection::gather_in_order"],
        ..Row::of("engine/src/techniques/instant_radiosity/selection/order.rs")
    },
];
