//! Ray-bundles as a technique.

use std::collections::BTreeMap;

use super::lists::Lists;
use super::{RayBundleSettings, RayBundles};
use crate::Result;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::Caps;
use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::kernels::reduce_words;
use crate::gpu::shaders::techniques::ray_bundles::{bundle_eye, bundle_shade};
use crate::gpu::shaders::types::BundleVertex;
use crate::kernels::Scan;
use crate::scene::SceneProfile;
use crate::settings::{Settings, SettingsDecl};
use crate::techniques::foresight::frame_fits;
use crate::techniques::skipped::skipped;
use crate::techniques::{Bias, Card, Foresight, Law, Skipped, Technique, Variant, reasons};
use crate::transport::{PathSet, SURFACE_FEATURES};

/// The causes, as the module's documentation has them.
const BIAS: Bias = Bias::Consistent(
    "lines go through the middles of texels, off by up to a half of one from where paths are: by edges between surfaces light leaks or is missing, on a strip as wide as a texel, and so it does within bodies that are not much wider than some texels; the error falls with the width of texels",
);

const NEEDS: &[&str] = &["VK_QUEUE_GRAPHICS_BIT", "fragmentStoresAndAtomics"];

/// What a picture may take with default settings, of whatever scene, beside those of lists.
const KERNELS: [&ShaderInfo; 3] = [&bundle_eye::INFO, &bundle_shade::INFO, &reduce_words::INFO];

/// The catalogue's entry.
pub(in crate::techniques) const CARD: Card = Card {
    id: "ray-bundles",
    summary: "eye paths that go on along parallel lines, of which one rasterization of the scene finds all at once, with direct light where they arrive",
    rows: &[ROWS],
    bias: BIAS,
    needs: NEEDS,
    kernels: &[&KERNELS, &Lists::KERNELS, &Scan::KERNELS],
    path_set: PathSet::UP_TO_FOUR_DIFFUSE,
    refusals,
    settings: SettingsDecl::of::<RayBundleSettings>(),
    variants: &[Variant::DEFAULTS],
    foresight: Foresight {
        fits,
        law,
        ..Foresight::PLAIN
    },
    create: |gpu, scene, view, settings| {
        let mut settings: RayBundleSettings = settings.read()?;
        settings.seed = view.seed;
        let technique = RayBundles::new(gpu, scene, view.camera, view.size, settings)?;
        Ok(Box::new(technique))
    },
};

/// Refuses pictures whose paths are more than a storage buffer holds.
fn fits(caps: &Caps, size: [u32; 2]) -> Result<()> {
    frame_fits(caps, size)?;
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    caps.check_storage("bundle vertices", pixels * size_of::<BundleVertex>() as u64)
}

/// Frames are independent, and all pixels have the directions of one.
fn law(_: &Settings) -> Result<Law> {
    Ok(Law {
        shares_noise: true,
        ..Law::INDEPENDENT
    })
}

/// Why a scene cannot be modelled.
pub(super) fn refusals(profile: &SceneProfile) -> Vec<String> {
    reasons(&[
        (
            profile.media.any(),
            "the scene has participating media, and paths go from surface to surface",
        ),
        (
            !profile.is_opaque(),
            "surfaces let light through: paths go on above the surface alone, and lists hold what is there in part as if it were whole",
        ),
        (
            profile.has_unlit,
            "unlit surfaces send light that no sample of the lights finds",
        ),
        (
            profile.keeps_instances,
            "it draws triangle by triangle, and the scene keeps its instances; with another ray index, such as `wide`, they are flattened",
        ),
    ])
}

impl Technique for RayBundles {
    forward_to_methods!(RayBundles);

    fn path_set(&self) -> PathSet {
        RayBundles::path_set(self)
    }

    fn counters(&self) -> BTreeMap<&'static str, u64> {
        let c = self.counts();
        BTreeMap::from([
            ("frames", c.frames),
            ("bundles", c.bundles),
            ("entries", c.entries),
            ("longest_list", c.longest),
            ("rooms_enlarged", c.enlarged),
            ("passes", c.passes),
            ("bytes_between_passes", self.bytes()),
        ])
    }

    fn skipped(&self) -> Vec<Skipped> {
        let pipelines = RayBundles::pipelines(self);
        let mut all = skipped(&pipelines, bundle_shade::INFO.name, &SURFACE_FEATURES);
        let further = [
            (
                !self.has_surface_light(),
                "light of surfaces",
                "nothing is lit, or the picture has none of it",
            ),
            (
                !self.has_bundles(),
                "bundles",
                "nothing is lit, or the picture has no light that is scattered twice",
            ),
            (true, "albedo, normal and depth", "frames hold only radiance"),
        ];
        let missing = further.into_iter().filter(|(is_missing, ..)| *is_missing);
        all.extend(missing.map(|(_, what, why)| Skipped { what, why }));
        all
    }
}

/// [`PathSet::UP_TO_FOUR_DIFFUSE`] as path sets are written.
const DISPLAYED: &str = "bounces=0..4,lobes=diffuse+reflection+transmission";

/// Rows of the catalogue.
const ROWS: &[Row] = &[Row {
    id: "SVO-G6",
    name: "technique `ray-bundles`: eye paths along global ray-bundles, which one rasterization finds for all pixels at once",
    role: Role::Technique,
    limits: "Diffuse scattering alone, up to four times; media, surfaces that let light through, unlit surfaces and kept instances are refused; light leaks at edges by the width of a texel, through sheets that are nearer than one, and within small bodies; all pixels of a frame share its directions.",
    sources: &[
        sources::HERMES_2010.whole(),
        sources::TOKUYOSHI_OGAKI_2012.whole(),
        sources::SZIRMAY_KALOS_PURGATHOFER_1998.whole(),
        sources::SUN_2015.at("§2.2.6"),
    ],
    shaders: &["shaders/techniques/ray_bundles/", "shaders/raster/vertex_main.glsl"],
    path_set: Some(DISPLAYED),
    bias: Some(BIAS),
    needs: NEEDS,
    tests: &[
        "tests/tests/bidirectional/ray_bundles.rs::lists_are_what_rays_meet_in_order",
        "tests/tests/bidirectional/ray_bundles.rs::furnaces_are_uniform_but_for_a_strip_by_their_edges",
        "tests/tests/bidirectional/ray_bundles.rs::pictures_are_the_path_tracers_but_for_the_width_of_texels",
        "tests/tests/bidirectional/ray_bundles.rs::errors_fall_with_the_square_root_of_the_directions",
        "tests/tests/bidirectional/ray_bundles.rs::threads_and_widths_of_the_driver_never_show",
        "tests/tests/bidirectional/ray_bundles.rs::how_work_is_shared_out_never_shows",
        "tests/tests/bidirectional/ray_bundles.rs::what_cannot_be_is_refused_by_name",
        "engine/src/raster/view.rs::shifted_beams_hold_their_bounds_and_are_moved_by_parts_of_a_pixel",
        "engine/src/techniques/ray_bundles/settings.rs::path_sets_are_ranges_of_up_to_four_diffuse_bounces",
    ],
    api: &["clerestory::techniques::ray_bundles::RayBundles"],
    settings: &[
        "clerestory::techniques::ray_bundles::RayBundleSettings",
        "clerestory render --technique ray-bundles",
    ],
    ..Row::of("engine/src/techniques/ray_bundles/mod.rs")
}];
