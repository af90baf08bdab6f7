//! Where filters lie: the edge of an occluder along rows of texels, whose filtered shadow is known in closed form, inside layers and across seams.

use clerestory::gpu::Gpu;
use clerestory::maps::cube::cube_decode;
use clerestory::maps::octahedron::octahedron_decode;
use clerestory::raster::{OmniShadowDesc, OmniShadowMaps, ShadowLayout, ShadowPlace};
use clerestory::scene::Scene;
use clerestory_tests::with_gpu;
use glam::{DVec2, DVec3, Vec3};

use crate::subject::{Subject, place};

const SIDE: u32 = 128;
/// Texels from the seam down to where the occluder begins.
const BEGIN: f64 = -30.0;
/// Rows as v of the map from -1 to 1: of one octant below the octahedron's middle, and of one face of the cube.
const ROWS: [f64; 3] = [0.65, 0.75, 0.85];
/// Steps of a texel.
const STEPS: i32 = 50;

/// The direction that is so many texels beyond the seam at u = 1 of layer 0, in a row v of the layer that it lies in.
fn direction(layout: ShadowLayout, beyond: f64, v: f64) -> DVec3 {
    let u = 1.0 + 2.0 * beyond / f64::from(SIDE);
    match layout {
        // Beyond the edge the square goes on, turned about the edge's middle.
        ShadowLayout::Octahedron if u > 1.0 => octahedron_decode(DVec2::new(2.0 - u, -v)),
        ShadowLayout::Octahedron => octahedron_decode(DVec2::new(u, v)),
        // The next face is as deep there.
        ShadowLayout::Cube if u > 1.0 => cube_decode(0, DVec2::new(1.0, v) / (2.0 - u)),
        ShadowLayout::Cube => cube_decode(0, DVec2::new(u, v)),
    }
}

/// On the cube or the octahedron itself, where texels' borders are straight lines.
fn on_solid(layout: ShadowLayout, beyond: f64, v: f64) -> Vec3 {
    let d = direction(layout, beyond, v);
    let reach = match layout {
        ShadowLayout::Octahedron => d.abs().element_sum(),
        ShadowLayout::Cube => d.abs().max_element(),
    };
    (d / reach).as_vec3()
}

/// An occluder from [`BEGIN`] to an edge, folded at the seam, seen from the origin.
fn occluder(layout: ShadowLayout, edge: f64) -> Scene {
    let mut scene = Scene::default();
    let mut corners = Vec::new();
    let mut strip = |from: f64, to: f64| {
        let [a, b, c, d] =
            [(from, 0.55), (to, 0.55), (to, 0.95), (from, 0.95)].map(|(beyond, v)| on_solid(layout, beyond, v));
        corners.extend([[a, b, c], [a, c, d]]);
    };
    strip(BEGIN, edge.min(0.0));
    if edge > 0.0 {
        // From the seam as the next octant or face has it.
        strip(1e-9, edge);
    }
    place(&mut scene, "occluder", &corners);
    // Something on all sides of the light.
    place(
        &mut scene,
        "far",
        &[[
            -9.0 * Vec3::ONE,
            Vec3::new(-9.0, -9.0, -8.0),
            Vec3::new(-9.0, -8.0, -9.0),
        ]],
    );
    scene
}

fn shares(gpu: &Gpu, layout: ShadowLayout, edge: f64, width: u32, v: f64) -> Vec<(f64, f64)> {
    let subject = Subject::new(gpu, &occluder(layout, edge));
    let surfaces = subject.on_device.surfaces();
    let desc = OmniShadowDesc {
        layout,
        side: SIDE,
        maps: 1,
    };
    let maps = OmniShadowMaps::new(gpu, &surfaces, desc).unwrap();
    let mut recorder = gpu.recorder("penumbra").unwrap();
    maps.record(&mut recorder, &surfaces, &[Vec3::ZERO]).unwrap();
    recorder.submit().unwrap().wait().unwrap();
    // Halves of steps, so that none lies on a border of texels.
    let offsets: Vec<f64> = (-3 * STEPS..3 * STEPS)
        .map(|i| (f64::from(i) + 0.5) / f64::from(STEPS))
        .collect();
    let places: Vec<_> = offsets
        .iter()
        .map(|offset| {
            let d = direction(layout, edge + offset, v).as_vec3().normalize();
            // Facing the light, so that the look-up stays in its direction.
            ShadowPlace {
                position: 4.0 * d,
                normal: -d,
                slack: 0.0,
            }
        })
        .collect();
    let found = maps.look_up(0, Vec3::ZERO, width, &places).unwrap();
    offsets.into_iter().zip(found.into_iter().map(f64::from)).collect()
}

/// The share of a square of `width` texels beyond an edge of texels is a ramp about the edge: 0 and 1 half the width off, a half at the edge.
#[test]
fn filtered_edges_are_ramps_about_the_edge() {
    with_gpu(|gpu| {
        for layout in ShadowLayout::ALL {
            // Far inside the layer, and with the filter across the seam: its edge before, in and beyond it.
            for edge in [-20.0, -1.0, 0.0, 1.0] {
                for width in 1..=3 {
                    for v in ROWS {
                        let ramp = shares(gpu, layout, edge, width, v);
                        let name = format!("{} at {edge}, width {width}, row {v}", layout.name());
                        let mut worst = 0.0f64;
                        for (offset, share) in &ramp {
                            let exact = (0.5 + offset / f64::from(width)).clamp(0.0, 1.0);
                            worst = worst.max((share - exact).abs());
                        }
                        let crossing = ramp.windows(2).find(|pair| pair[0].1 < 0.5 && pair[1].1 >= 0.5);
                        let crossing = crossing.map(|pair| {
                            let [(x, low), (y, high)] = [pair[0], pair[1]];
                            x + (y - x) * (0.5 - low) / (high - low)
                        });
                        let crossing = crossing.unwrap_or(f64::NAN);
                        println!("{name}: half at {crossing:.4}, off by {worst:.1e}");
                        assert!(crossing.abs() < 0.1, "{name}: half at {crossing}");
                        // Places in texels are rounded by 2⁻²⁴ · 128 and more where directions are.
                        assert!(worst < 1e-3, "{name}: {worst}");
                    }
                }
            }
        }
    });
}
