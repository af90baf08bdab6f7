//! Counts and fluxes of photons: nothing is lost on the way to the map.

use super::*;
use clerestory::techniques::photon_mapping::MappedPhoton;
use clerestory_tests::render::{builtin, lamp};
use clerestory_tests::statistics::{expect_counts, expect_mean_of};
use clerestory_tests::with_gpu;

const PHOTONS: u32 = 1 << 14;

/// A closed room of a coloured reflectance.
fn room(rho: Vec3) -> Scene {
    let mut scene = builtin("builtin:furnace-box?rho=0.5&emission=0");
    scene.materials[0] = Material::lambert("wall", rho);
    scene
}

fn all_photons(gpu: &Gpu, scene: &Scene, pass: u32) -> (Vec<MappedPhoton>, MapperCounts) {
    let settings = PhotonSettings {
        photons: PHOTONS,
        direct_photons: true,
        ..settings("all")
    };
    let mut mapper = mapper(gpu, scene, &settings);
    let photons = mapper.photons(pass).unwrap_or_else(|error| panic!("{error}"));
    (photons, mapper.counts())
}

/// Sum of the fluxes of hit number `hit`, and the sum of squares.
fn flux(photons: &[MappedPhoton], hit: u32, channel: usize) -> (f64, f64) {
    let of_hit = photons.iter().filter(|photon| photon.bounce + 1 == hit);
    of_hit.fold((0.0, 0.0), |(sum, squares), photon| {
        let flux = f64::from(photon.record.flux[channel]);
        (sum + flux, squares + flux * flux)
    })
}

#[test]
fn closed_rooms_keep_every_photon_and_lose_flux_by_reflection_alone() {
    with_gpu(|gpu| {
        let power = Vec3::new(3.0, 2.0, 1.0);
        // The last is saved by the cap of survival alone.
        for rho in [Vec3::splat(0.5), Vec3::new(0.8, 0.4, 0.1), Vec3::ONE] {
            let mut scene = room(rho);
            add_point(&mut scene, Vec3::new(0.3, 0.2, -0.4), power);
            let (photons, counts) = all_photons(gpu, &scene, 0);
            let c = counts.photons;
            assert_eq!(
                (c.emitted, c.escaped, c.absorbed),
                (u64::from(PHOTONS), 0, u64::from(PHOTONS))
            );
            assert_eq!((c.deposits, c.without_kernel), (photons.len() as u64, 0));
            // Each ray of a closed room ends at a surface that stores its photon.
            assert_eq!(c.rays, c.deposits);
            for hit in 1..=12 {
                for channel in 0..3 {
                    let expected = f64::from(power[channel]) * f64::from(rho[channel]).powi(hit - 1);
                    let (sum, squares) = flux(&photons, hit as u32, channel);
                    // Photons are independent: of n, the variance of the sum of values x is Σx² − (Σx)²/n at most.
                    let variance = squares - sum * sum / f64::from(PHOTONS);
                    // All photons of a hit have one flux, which dithering keeps from erring alike; the last hits may have none at all.
                    let one = f64::from(power.max_element()) / f64::from(PHOTONS);
                    let what = format!("rho {rho}, hit {hit}, channel {channel}");
                    expect_mean(&what, sum, variance.max(one * one), expected, 0.0);
                }
            }
        }
    });
}

#[test]
fn what_surfaces_absorb_is_what_lights_send() {
    with_gpu(|gpu| {
        let (power, rho) = (Vec3::new(3.0, 2.0, 1.0), Vec3::new(0.8, 0.4, 0.1));
        let mut scene = room(rho);
        add_point(&mut scene, Vec3::new(0.3, 0.2, -0.4), power);
        let settings = PhotonSettings {
            photons: 1 << 12,
            direct_photons: true,
            ..settings("all")
        };
        let mut mapper = mapper(gpu, &scene, &settings);
        // Each photon that lands leaves 1 − ρ of its flux, whether it goes on or not; passes are independent.
        let absorbed: Vec<[f64; 3]> = (0..16)
            .map(|pass| {
                let photons = mapper.photons(pass).unwrap_or_else(|error| panic!("{error}"));
                [0, 1, 2].map(|channel| {
                    let landed: f64 = photons.iter().map(|p| f64::from(p.record.flux[channel])).sum();
                    (1.0 - f64::from(rho[channel])) * landed
                })
            })
            .collect();
        for channel in 0..3 {
            let values: Vec<f64> = absorbed.iter().map(|pass| pass[channel]).collect();
            let what = format!("absorbed, channel {channel}");
            expect_mean_of(&what, &values, f64::from(power[channel]), 0.0, 0.0);
        }
    });
}

#[test]
fn photons_that_leave_are_counted() {
    with_gpu(|gpu| {
        // A lamp that shines up sends all to infinity; one that shines down a share of (radius / distance)² of parallel disks, which is counted.
        let mut scene = Scene {
            name: "lamps".into(),
            ..Scene::default()
        };
        let one_sided = Material {
            double_sided: false,
            ..lamp(Vec3::ONE)
        };
        let shining = scene.add_material(one_sided);
        let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
        scene.place(ceiling("up", shining, Vec3::new(0.0, 3.0, 0.0), 0.5, false));
        scene.place(floor("floor", grey, 1.0, 0.0));
        scene.cameras.push(camera_down(1.0, 2.0));
        let (photons, counts) = all_photons(gpu, &scene, 0);
        assert!(photons.is_empty());
        assert_eq!(counts.photons.escaped, u64::from(PHOTONS));
        assert_eq!(counts.photons.rays, u64::from(PHOTONS));

        scene.meshes[0].triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let (photons, counts) = all_photons(gpu, &scene, 0);
        let c = counts.photons;
        assert_eq!(c.escaped + c.absorbed, c.emitted);
        assert_eq!(c.deposits, photons.len() as u64);
        // The form factor of parallel squares of sides 1 and 2, 3 apart, by the path tracer's measure: a sum over 64⁴ pairs of points.
        let share = form_factor();
        let n = f64::from(PHOTONS);
        let hits = photons.len() as f64;
        expect_counts("form factor", &[hits, n - hits], &[share * n, (1.0 - share) * n]);
        // Half of those are absorbed at the floor; the other half leaves, or ends at the lamp's black back.
        assert!(
            photons
                .iter()
                .all(|photon| photon.bounce == 0 && photon.record.position.y == 0.0)
        );
        let power: f64 = photons.iter().map(|p| f64::from(p.record.flux.x)).sum();
        expect_mean("power", power, PI * PI * share * (1.0 - share) / n, PI * share, 0.0);
    });
}

#[test]
fn spots_send_photons_into_their_cone_alone() {
    with_gpu(|gpu| {
        let mut scene = room(Vec3::splat(0.5));
        scene.add_light(
            "spot",
            LightKind::Spot {
                position: Vec3::ZERO,
                direction: Vec3::NEG_Y,
                intensity: Vec3::ONE,
                inner: 0.2,
                outer: 0.4,
            },
        );
        let (photons, _) = all_photons(gpu, &scene, 0);
        let first: Vec<&MappedPhoton> = photons.iter().filter(|photon| photon.bounce == 0).collect();
        assert_eq!(first.len(), PHOTONS as usize);
        assert!(first.iter().all(|photon| photon.record.flux.x > 0.0));
    });
}

#[test]
fn photons_end_where_no_picture_asks_for_more() {
    with_gpu(|gpu| {
        let mut scene = room(Vec3::ONE);
        add_point(&mut scene, Vec3::new(0.3, 0.2, -0.4), Vec3::ONE);
        for most in 1..4 {
            let settings = PhotonSettings {
                photons: PHOTONS,
                direct_photons: true,
                ..settings(&format!("bounces=0..{most}"))
            };
            let mut mapper = mapper(gpu, &scene, &settings);
            let photons = mapper.photons(0).unwrap_or_else(|error| panic!("{error}"));
            // The eye's own hit is the last of the bounces.
            let last = photons.iter().map(|photon| photon.bounce).max();
            assert_eq!(last, Some(most - 1), "{most}");
            let c = mapper.counts().photons;
            assert!(
                c.rays <= u64::from(most * PHOTONS) && c.rays > u64::from((most - 1) * PHOTONS),
                "{c:?}"
            );
        }
    });
}

/// From a square of side 1 to one of side 2 that faces it at a distance of 3: midpoints of 24 × 24 and 48 × 48 cells.
fn form_factor() -> f64 {
    let middles =
        |cells: u32, half: f64| (0..cells).map(move |i| half * (2.0 * (f64::from(i) + 0.5) / f64::from(cells) - 1.0));
    let mut sum = 0.0;
    // By differences along each axis, whose numbers of pairs multiply.
    let pairs: Vec<f64> = middles(24, 0.5)
        .flat_map(|a| middles(48, 1.0).map(move |b| (a - b) * (a - b)))
        .collect();
    for dx in &pairs {
        for dz in &pairs {
            sum += 9.0 / (dx + dz + 9.0).powi(2);
        }
    }
    sum / (pairs.len() as f64).powi(2) * 4.0 / PI
}

#[test]
fn the_picture_has_the_flux_of_the_map() {
    with_gpu(|gpu| {
        // The middle of a floor, lit through a disk that lies within what is seen: radiance times π / ρ integrates to the photons' flux.
        let mut scene = Scene {
            name: "spot".into(),
            ..Scene::default()
        };
        let rho = 0.6;
        let grey = scene.add_material(Material::lambert("grey", Vec3::splat(rho)));
        scene.place(floor("floor", grey, 2.0, 0.0));
        scene.add_light(
            "spot",
            LightKind::Spot {
                position: Vec3::new(0.1, 2.0, -0.1),
                direction: Vec3::NEG_Y,
                intensity: Vec3::new(1.0, 3.0, 0.2),
                inner: 0.1,
                outer: 0.25,
            },
        );
        scene.cameras.push(camera_down(1.0, 5.0));
        let settings = PhotonSettings {
            direct_photons: true,
            photons: 1 << 12,
            samples_per_pass: 64,
            ..fixed("bounces=1..1", 0.2)
        };
        let mut mapper = mapper(gpu, &scene, &settings);
        let passes = 2;
        let picture = advance(&mut mapper, passes * settings.samples_per_pass);
        let gathered = sums(&picture)[0];
        for (channel, sum) in gathered.iter().enumerate() {
            let mut mapped = 0.0;
            for pass in 0..passes {
                let photons = mapper.photons(pass).unwrap_or_else(|error| panic!("{error}"));
                assert!(
                    photons.iter().all(|p| p.record.position.length() < 0.8),
                    "within the picture"
                );
                mapped += flux(&photons, 1, channel).0 / f64::from(passes);
            }
            // Eye paths sample what the kernels make of it: within a pixel of 0.125 m the light of a spot with rims 0.3 m wide has a deviation
            // of an eighth at most. 50 pixels of 128 samples leave 0.16 %, of which the bound is six.
            let area = 4.0 / f64::from(SIDE * SIDE);
            let flux = sum * area * PI / f64::from(rho);
            println!("channel {channel}: {flux} of {mapped}");
            assert!(
                (flux / mapped - 1.0).abs() < 0.01,
                "channel {channel}: {flux}, not {mapped}"
            );
        }
    });
}
