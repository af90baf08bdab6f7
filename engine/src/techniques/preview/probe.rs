//! Light probes: all light that arrives at a point, kept as what reflections of every width see of it.
//!
//! Sources: J. Blinn and M. Newell, "Texture and Reflection in Computer Generated Images", CACM 1976 (reflection mapping); G. Miller and
//! R. Hoffman, "Illumination and Reflection Maps", SIGGRAPH course notes, 1984 (diffuse irradiance in a map); J. Kautz et al., "A Unified Approach to Prefiltered
//! Environment Maps", EGWR 2000; B. Karis, "Real Shading in Unreal Engine 4", SIGGRAPH course notes, 2013 (the integral split into filtered
//! light and albedo).
//!
//! A probe is a square octahedron map in the world's axes, or a cube ([`ProbeMap`]). Its look-ups are in levels: the first is the map itself, for mirrors; the last, of 32²
//! texels or of six times 16², is filtered by the GGX lobe of width α = 1, which with n = v = r is the cosine, so that it is irradiance over π; those between are of
//! smaller α, each level half as wide. Finer levels than the finest filtered one, the map itself among them, are plain means by solid angle, and count as the lobe of
//! their texels' solid angle.
//! A width between two levels' is the mixture of both whose lobe is nearest to its own ([`probe_part`]).
//!
//! Bias: that of [`prefilter`](crate::maps::prefilter) (round lobes), of mixtures of two lobes for those between (by the measure of [`probe_part`] at most 0.06 of
//! the lobe between filtered levels; between mirrors and the finest of these they show the mirror through a haze), of bilinear look-ups in 32² texels
//! (irradiance), and of light that is taken to come from infinity. A mean over all directions is kept to the rounding of f32. Deterministic.

use glam::{DMat3, UVec2};

use super::method::PreviewSettings;
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants::PROBE_LEVELS_MAX;
use crate::gpu::{
    Access, BufferBarrier, Gpu, Pass, PipelineInfo, Recorder, compute_to_transfer, rw_compute_to_compute,
    transfer_to_compute,
};
use crate::maps::directional_map::DirectionalMap;
use crate::maps::prefilter::{PrefilterGgx, ggx_solid_angle};
use crate::maps::resample::{Reconstruction, ResampleSettings, resample};
use crate::maps::{MapImage, Parametrization};
use crate::scene::Environment;
use crate::{Error, Result};

/// Texels along a side of an octahedron over those of a cube's face that stands in for it.
const OCTAHEDRON_OVER_FACE: u32 = 2;

/// What maps of probes are; both are in the world's axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ProbeMap {
    /// One square, drawn as eight octants in one pass.
    #[default]
    Octahedron,
    /// Six faces, each drawn in a pass of its own. With half as many texels along a side it has one and a half times as many as an octahedron.
    Cube,
}

impl ProbeMap {
    /// The map's parametrization.
    pub fn parametrization(self) -> Parametrization {
        match self {
            Self::Octahedron => Parametrization::OctahedronQuadratic,
            Self::Cube => Parametrization::Cube,
        }
    }

    /// Texels along a side of the last level, whose lobe has α = 1.
    pub const fn last_side(self) -> u32 {
        match self {
            Self::Octahedron => 32,
            Self::Cube => 32 / OCTAHEDRON_OVER_FACE,
        }
    }

    /// Greatest texels along a side of a level that is filtered.
    const fn finest_max(self) -> u32 {
        match self {
            Self::Octahedron => 256,
            Self::Cube => 256 / OCTAHEDRON_OVER_FACE,
        }
    }

    /// A black map in levels; the cube has no borders.
    pub(super) fn allocate(self, gpu: &Gpu, side: u32, levels: u32) -> Result<DirectionalMap> {
        let border = match self {
            Self::Octahedron => 1,
            Self::Cube => 0,
        };
        DirectionalMap::new(gpu, self.parametrization(), UVec2::splat(side), levels, border)
    }
}

/// What a [`LightProbe`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LightProbeDesc {
    /// Which map.
    pub map: ProbeMap,
    /// Texels along a side: a power of two from 64 to 4096, of a cube's faces from 32 to 2048. With the least there is no level between mirrors and irradiance.
    pub side: u32,
    /// Texels along a side of the finest level that is filtered by a lobe: a power of two from 32 to 256, of a cube's faces from 16 to 128. The work grows with its fourth
    /// power.
    pub finest: u32,
}

impl Default for LightProbeDesc {
    fn default() -> Self {
        PreviewSettings::default().probe()
    }
}

impl LightProbeDesc {
    fn check(self) -> Result<()> {
        let is_one_of = |value: u32, low: u32, high: u32| value.is_power_of_two() && (low..=high).contains(&value);
        let (last, finest) = (self.map.last_side(), self.map.finest_max());
        let most = last << (PROBE_LEVELS_MAX - 1);
        if !is_one_of(self.side, 2 * last, most) {
            let cause = format!("is not a power of two from {} to {most}", 2 * last);
            return Err(Error::setting("probe side", self.side, cause));
        }
        if !is_one_of(self.finest, last, finest) {
            let cause = format!("is not a power of two from {last} to {finest}");
            return Err(Error::setting("finest filtered level", self.finest, cause));
        }
        Ok(())
    }

    /// Number of levels.
    pub fn levels(self) -> u32 {
        (self.side / self.map.last_side()).ilog2() + 1
    }

    fn is_filtered(self, level: u32) -> bool {
        level > 0 && self.side >> level <= self.finest
    }

    /// The lobe's width α of each level.
    pub fn alphas(self) -> Vec<f32> {
        let alpha = |level: u32| {
            let side = f64::from(self.side >> level);
            if self.is_filtered(level) {
                // 1, 0.35, 0.125, 0.044: lobes stay wider than the texels of half as fine a level.
                (f64::from(self.map.last_side()) / side).powf(1.5)
            } else {
                let texels = f64::from(self.map.parametrization().layers()) * side * side;
                alpha_of_solid_angle(4.0 * std::f64::consts::PI / texels)
            }
        };
        (0..self.levels()).map(|level| alpha(level) as f32).collect()
    }
}

/// The width whose lobe holds a solid angle, sr; [`ggx_solid_angle`] grows with it.
fn alpha_of_solid_angle(solid_angle: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..f32::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        if ggx_solid_angle(middle) < solid_angle {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Between two levels of lobe widths 0 < a < b: the share of the second in the mixture whose lobe is nearest to that of width `alpha`; 0 up to a, 1 from
/// b on.
///
/// Nearest by least squares in the mean over surroundings whose power falls with the square of the frequency, as that of natural pictures does (D. Field,
/// "Relations between the Statistics of Natural Images and the Response Properties of Cortical Cells", JOSA A 1987), with Gaussian lobes of variances a²,
/// b² and α² in place of those of GGX: lobes of variances x and y have, but for a constant, the overlap −½ ln(x + y). A mixture of the lobe's variance
/// would keep too much of the narrow lobe, and peak up to 2.2 times as high as the lobe of α between 0.125 and 0.35.
pub fn probe_part(alpha: f64, a: f64, b: f64) -> f64 {
    if alpha <= a {
        return 0.0;
    }
    let (x, a, b) = (alpha * alpha, a * a, b * b);
    let part = ((x + a) * (a + b) / (2.0 * a * (x + b))).ln() / ((a + b) * (a + b) / (4.0 * a * b)).ln();
    part.min(1.0)
}

/// The level of detail of a look-up for a lobe of width `alpha`, between the levels' own widths, which grow from above 0.
pub fn probe_level(alphas: &[f32], alpha: f64) -> f64 {
    let last = alphas.len().saturating_sub(1);
    if last == 0 {
        return 0.0;
    }
    let below = alphas[1..last].iter().take_while(|a| alpha >= f64::from(**a)).count();
    let [a, b] = [alphas[below], alphas[below + 1]].map(f64::from);
    below as f64 + probe_part(alpha, a, b)
}

/// Light at a point, on the device.
#[derive(Debug)]
pub struct LightProbe {
    desc: LightProbeDesc,
    alphas: Vec<f32>,
    /// The map and its means.
    map: DirectionalMap,
    /// What is looked up.
    filtered: DirectionalMap,
    filter: PrefilterGgx,
}

impl LightProbe {
    /// A probe without light.
    ///
    /// # Errors
    /// [`Error::Setting`] for sizes out of range; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, desc: LightProbeDesc) -> Result<Self> {
        desc.check()?;
        let map = || desc.map.allocate(gpu, desc.side, desc.levels());
        let map_of_light = map()?;
        Ok(Self {
            desc,
            alphas: desc.alphas(),
            filter: PrefilterGgx::new(gpu, &map_of_light)?,
            map: map_of_light,
            filtered: map()?,
        })
    }

    /// A probe of a distant environment.
    ///
    /// # Errors
    /// As [`LightProbe::new`]; [`Error::DeviceLost`].
    pub fn of_environment(gpu: &Gpu, desc: LightProbeDesc, environment: &Environment) -> Result<Self> {
        let probe = Self::new(gpu, desc)?;
        let size = UVec2::new(environment.width, environment.height);
        let texels = environment.radiance.iter().map(|texel| *texel * environment.strength);
        let source = MapImage::new(Parametrization::LatLong, size, texels.collect())?;
        let from_world = DMat3::from_quat(environment.rotation.as_dquat().inverse());
        let image = resample(
            &source,
            desc.map.parametrization(),
            UVec2::splat(desc.side),
            Parametrization::LatLong.world_axes() * from_world,
            &ResampleSettings {
                reconstruction: Reconstruction::Bilinear,
                ..ResampleSettings::default()
            },
        )?;
        probe.map.upload(0, &image)?;
        probe.fill(gpu)?;
        Ok(probe)
    }

    /// What it is.
    pub fn desc(&self) -> LightProbeDesc {
        self.desc
    }

    /// The map and its means by solid angle. What is put into level 0 counts after [`LightProbe::record`] or [`LightProbe::fill`].
    pub fn map(&self) -> &DirectionalMap {
        &self.map
    }

    /// The levels that are looked up, filtered by the lobes of [`LightProbe::alphas`].
    pub fn filtered(&self) -> &DirectionalMap {
        &self.filtered
    }

    /// The lobe's width of each level.
    pub fn alphas(&self) -> &[f32] {
        &self.alphas
    }

    /// The kernels that fill it, with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.map.pipelines();
        all.push(self.filter.info());
        all
    }

    /// Bytes of both maps.
    pub fn bytes(&self) -> u64 {
        self.map.texels().bytes() + self.filtered.texels().bytes()
    }

    /// Records three passes: levels and borders of the map, the copy of those that are looked up as they are, and the filtering of the others.
    ///
    /// Barriers: texels of the map's level 0 must have been made visible to [`Access::COMPUTE`], and earlier uses must have ended. After it what
    /// is looked up is visible to compute shaders.
    ///
    /// # Errors
    /// As [`Pass::dispatch`].
    pub fn record(&self, recorder: &mut Recorder) -> Result<()> {
        recorder.pass("probe: levels and borders", |pass| self.map.record_levels(pass))?;
        recorder.pass("probe: copy", |pass| self.record_copy(pass))?;
        // Least texels along a side of the level that lobes are summed over.
        let least_source = self.desc.map.last_side();
        recorder.pass("probe: filter", |pass| {
            for level in (0..self.desc.levels()).filter(|level| self.desc.is_filtered(*level)) {
                let source = (self.desc.side / (self.desc.side >> (level + 1)).max(least_source)).ilog2();
                let alpha = self.alphas[level as usize];
                self.filter
                    .record(pass, (&self.map, source), (&self.filtered, level), alpha)?;
                pass.barrier(&[rw_compute_to_compute(self.filtered.texels())]);
                self.filtered.record_border(pass, level)?;
            }
            Ok(())
        })
    }

    /// Both maps have the same levels in the same places.
    fn record_copy(&self, pass: &mut Pass<'_>) -> Result<()> {
        let first_filtered = (0..self.desc.levels()).find(|level| self.desc.is_filtered(*level));
        let texels = match first_filtered {
            Some(level) => u64::from(self.map.level(level)?.first),
            None => self.map.texels().bytes() / size_of::<[f32; 3]>() as u64,
        };
        let bytes = texels * size_of::<[f32; 3]>() as u64;
        let (from, to) = (self.map.texels(), self.filtered.texels());
        pass.barrier(&[compute_to_transfer(from), compute_to_transfer(to)]);
        pass.copy(from.slice(0, bytes), to.slice(0, bytes))?;
        pass.barrier(&[
            transfer_to_compute(to),
            BufferBarrier {
                buffer: from,
                from: Access::TRANSFER_READ,
                to: Access::COMPUTE,
            },
        ]);
        Ok(())
    }

    /// As [`LightProbe::record`], after what was uploaded to the map, and waits.
    ///
    /// # Errors
    /// As [`LightProbe::record`]; [`Error::DeviceLost`].
    pub fn fill(&self, gpu: &Gpu) -> Result<()> {
        let mut recorder = gpu.recorder("probe")?;
        self.record(&mut recorder)?;
        recorder.submit()?.wait()?;
        Ok(())
    }
}

/// Rows of the catalogue.
pub(super) const ROWS: &[Row] = &[Row {
    id: "MET-E1",
    name: "classical environment map: what lies in the ray's own direction",
    role: Role::PartOf("CL-PREVIEW"),
    limits: "The same from everywhere: right at the map's place and for what is infinitely far.",
    sources: &[sources::BLINN_NEWELL_1976.whole(), sources::MILLER_HOFFMAN_1984.whole()],
    shaders: &["shaders/techniques/preview/probe.glsl"],
    bias: Some(Bias::Biased("light is taken to come from infinity")),
    tests: &[
        "tests/tests/preview/light.rs::a_mirror_sphere_shows_the_environment",
        "tests/tests/preview/cubes.rs::cubes_light_surfaces_as_their_skies_do",
        "tests/tests/preview/cubes.rs::rough_reflections_by_cubes_are_those_by_octahedra",
        "tests/tests/preview/cubes.rs::maps_that_do_not_fit_are_refused",
        "engine/src/maps/impostor/tests/edges.rs::the_classical_look_up_is_the_same_everywhere",
        "engine/src/maps/impostor/tests/searches.rs::convex_rooms_give_the_published_errors",
    ],
    api: &[
        "clerestory::techniques::preview::LightProbe",
        "clerestory::techniques::preview::ProbeMap",
    ],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::prefilter::ggx_lobe;
    use glam::DVec3;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn lobes_grow_from_level_to_level() {
        let both = |side: u32, finest: u32| {
            let cube = LightProbeDesc {
                map: ProbeMap::Cube,
                side: side / OCTAHEDRON_OVER_FACE,
                finest: finest / OCTAHEDRON_OVER_FACE,
            };
            let map = ProbeMap::Octahedron;
            [LightProbeDesc { map, side, finest }, cube]
        };
        for (side, finest) in [(64, 32), (128, 64), (256, 64), (512, 128), (4096, 256)] {
            for desc in both(side, finest) {
                let alphas = desc.alphas();
                assert!(desc.check().is_ok(), "{desc:?}");
                assert_eq!(alphas.len() as u32, desc.levels());
                assert!(alphas.windows(2).all(|pair| pair[0] < pair[1]), "{desc:?}: {alphas:?}");
                assert!(
                    alphas[0] > 0.0 && alphas[0] < 1.0 / side as f32,
                    "{desc:?}: {}",
                    alphas[0]
                );
                assert_eq!(alphas.last(), Some(&1.0));
            }
            // Halves of the sides give the same filtered lobes.
            let [octahedron, cube] = both(side, finest);
            let levels = 0..octahedron.levels();
            for level in levels.filter(|level| octahedron.is_filtered(*level)) {
                let [a, b] = [octahedron, cube].map(|desc| desc.alphas()[level as usize]);
                assert!(cube.is_filtered(level) && a == b, "{side}, {finest}: {a} {b}");
            }
        }
        for (side, finest) in [(32, 32), (100, 64), (8192, 64), (128, 16), (128, 512)] {
            for desc in both(side, finest) {
                assert!(desc.check().is_err(), "{desc:?}");
            }
        }
    }

    #[test]
    fn levels_of_lobes_are_those_of_their_widths() {
        let alphas = LightProbeDesc {
            map: ProbeMap::Octahedron,
            side: 512,
            finest: 128,
        }
        .alphas();
        for (level, alpha) in alphas.iter().enumerate() {
            assert!((probe_level(&alphas, f64::from(*alpha)) - level as f64).abs() < 1e-12);
        }
        assert!(probe_level(&alphas, 0.0) == 0.0);
        let mut last = -1.0;
        for i in 0..=100 {
            let level = probe_level(&alphas, f64::from(alphas[0]) + f64::from(i) * 0.0098);
            assert!(level > last, "{i}: {level}");
            last = level;
        }
    }

    /// Coefficients of the normalised GGX lobe in Legendre polynomials from degree 1 on.
    fn spectrum(alpha: f64) -> Vec<f64> {
        const STEPS: u32 = 4000;
        const DEGREES: usize = 300;
        let mut found = vec![0.0; DEGREES];
        let mut sum = 0.0;
        for i in 0..STEPS {
            let angle = (f64::from(i) + 0.5) * FRAC_PI_2 / f64::from(STEPS);
            let (sin, cos) = angle.sin_cos();
            let weight = ggx_lobe(DVec3::Z, DVec3::new(sin, 0.0, cos), alpha) * sin;
            sum += weight;
            let [mut before, mut now] = [1.0, cos];
            for (l, coefficient) in (1u32..).zip(&mut found) {
                *coefficient += weight * now;
                let l = f64::from(l);
                [before, now] = [now, ((2.0 * l + 1.0) * cos * now - l * before) / (l + 1.0)];
            }
        }
        found.into_iter().map(|coefficient| coefficient / sum).collect()
    }

    /// Of two functions by their coefficients, where power falls with the square of the frequency.
    fn overlap(p: &[f64], q: &[f64]) -> f64 {
        let all = (1u32..).zip(p.iter().zip(q));
        all.map(|(l, (p, q))| {
            let l = f64::from(l);
            (2.0 * l + 1.0) / (l * (l + 1.0)) * p * q
        })
        .sum()
    }

    #[test]
    fn mixtures_are_near_the_lobe() {
        let alphas = LightProbeDesc {
            map: ProbeMap::Octahedron,
            side: 512,
            finest: 256,
        }
        .alphas();
        let mut worst = 0.0f64;
        for pair in alphas[1..].windows(2) {
            let [a, b] = [f64::from(pair[0]), f64::from(pair[1])];
            let [of_a, of_b] = [a, b].map(spectrum);
            let less = |p: &[f64], q: &[f64]| -> Vec<f64> { p.iter().zip(q).map(|(p, q)| p - q).collect() };
            let step = less(&of_b, &of_a);
            for i in 1..20 {
                let alpha = a * (b / a).powf(f64::from(i) * 0.05);
                let of_alpha = spectrum(alpha);
                let best = overlap(&less(&of_alpha, &of_a), &step) / overlap(&step, &step);
                let off = |t: f64| {
                    let mixed: Vec<f64> = of_a.iter().zip(&step).map(|(a, step)| a + t * step).collect();
                    let apart = less(&mixed, &of_alpha);
                    (overlap(&apart, &apart) / overlap(&of_alpha, &of_alpha)).sqrt()
                };
                let part = probe_part(alpha, a, b);
                assert!(off(part) < off(best) + 0.025, "{alpha}: {part} instead of {best}");
                worst = worst.max(off(part));
            }
        }
        assert!((0.05..0.06).contains(&worst), "{worst}");
    }

    #[test]
    fn solid_angles_give_their_widths_back() {
        for alpha in [0.004, 0.05, 0.4, 0.9] {
            let found = alpha_of_solid_angle(ggx_solid_angle(alpha));
            assert!((found - alpha).abs() < 1e-6, "{alpha}: {found}");
        }
    }
}
