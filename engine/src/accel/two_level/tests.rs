use super::*;
use crate::accel::bvh2::tests::{grid, hard_rays, hard_scenes, same_bits, soup};
use crate::accel::input::can_be_met;
use crate::accel::test_support::{Random, U, brute_force, with_threads};
use crate::accel::{FINISHED, NO_HIT};
use glam::{DMat3, DQuat};

type Triangles = Vec<[Vec3; 3]>;

/// Meshes in places, and the images that they stand for.
struct World {
    meshes: Vec<Triangles>,
    placements: Vec<Placement>,
}

impl World {
    fn new(meshes: Vec<Triangles>, places: &[(usize, DAffine3)]) -> Self {
        let mut first = 0;
        let placements = places
            .iter()
            .map(|(mesh, transform)| {
                let placement = Placement {
                    mesh: *mesh as u32,
                    transform: *transform,
                    first,
                };
                first += meshes[*mesh].len() as u32;
                placement
            })
            .collect();
        Self { meshes, placements }
    }

    fn build(&self) -> TwoLevelBvh {
        TwoLevelBvh::build(&self.geometry(), &self.placements, &WideSettings::default()).expect("valid input")
    }

    fn geometry(&self) -> Vec<MeshGeometry<'_>> {
        fn of(triangles: &Triangles) -> MeshGeometry<'_> {
            MeshGeometry { triangles, names: None }
        }
        self.meshes.iter().map(of).collect()
    }

    /// All images in the order of their numbers, and which of them rays can meet.
    fn images(&self, bvh: &TwoLevelBvh) -> (Triangles, Vec<bool>) {
        let (mut images, mut usable) = (Vec::new(), Vec::new());
        for (placement, transform) in self.placements.iter().zip(bvh.transforms()) {
            for triangle in &self.meshes[placement.mesh as usize] {
                images.push(transform.triangle(*triangle));
                usable.push(can_be_met(triangle));
            }
        }
        (images, usable)
    }
}

fn turned(random: &mut Random, scale: DVec3, translation: DVec3) -> DAffine3 {
    let axis = random.direction().as_dvec3().normalize();
    let turn = DQuat::from_axis_angle(axis, 3.0 * f64::from(random.signed()));
    DAffine3::from_mat3_translation(DMat3::from_quat(turn) * DMat3::from_diagonal(scale), translation)
}

/// Worlds of every awkward kind: each hard scene in several places, among them mirrored, uneven, far and small ones, and ones that coincide.
fn worlds(random: &mut Random) -> Vec<(String, World)> {
    let mut worlds = Vec::new();
    for (name, triangles) in hard_scenes() {
        // Meshes with corners at the end of the range or beyond, or without an extent, cannot be turned.
        let of_any_shape = ["none", "invalid", "one", "spread"].contains(&name);
        let mut places = vec![(0, DAffine3::IDENTITY)];
        if !of_any_shape {
            let far = |random: &mut Random, reach: f32| (random.vector() * reach).as_dvec3();
            let size = triangles
                .iter()
                .flatten()
                .fold(0.0f32, |size, v| size.max(v.abs().max_element()));
            for scale in [
                DVec3::ONE,
                DVec3::new(0.3, 2.0, 1.0),
                DVec3::new(-1.0, 1.0, 1.0),
                DVec3::splat(-0.01),
            ] {
                let translation = far(random, 2.0 * size);
                places.push((0, turned(random, scale, translation)));
            }
            places.push((0, DAffine3::from_translation(DVec3::X * 1e5)));
            places.push(places[1]);
            places.push((0, turned(random, DVec3::new(1.0, 1e-3, 1.0), DVec3::ZERO)));
        }
        worlds.push((name.to_owned(), World::new(vec![triangles], &places)));
    }
    let meshes = vec![
        grid(4),
        soup(random, 60, 0.4, 1.0, Vec3::ZERO),
        soup(random, 1, 0.5, 1.0, Vec3::ZERO),
    ];
    let places: Vec<_> = (0..200)
        .map(|i| {
            let scale = DVec3::splat(0.2 + f64::from(random.unit()));
            let translation = (random.vector() * 20.0).as_dvec3();
            (i % 3, turned(random, scale, translation))
        })
        .collect();
    worlds.push(("many".into(), World::new(meshes, &places)));
    worlds.push(("nothing".into(), World::new(Vec::new(), &[])));
    worlds
}

#[test]
fn traversal_equals_trying_all_images_bit_for_bit() {
    let mut random = Random(31);
    for (name, world) in worlds(&mut random) {
        let bvh = world.build();
        let (images, usable) = world.images(&bvh);
        let mut hits = 0;
        for ray in hard_rays(&mut random, &images, 400) {
            let expected = brute_force(&images, |i| usable[i], &ray);
            let hit = bvh.closest_hit(&ray);
            assert!(same_bits(&hit, &expected), "{name}: {ray:?}\n{hit:?}\n{expected:?}");
            assert_eq!(bvh.any_hit(&ray), expected.is_hit(), "{name}: {ray:?}");
            hits += u32::from(expected.is_hit());
        }
        assert!(hits > 40 || images.is_empty(), "{name}: {hits} hits");
    }
}

#[test]
fn one_mesh_that_is_where_it_is_has_the_hits_of_the_wide_tree() {
    let mut random = Random(32);
    for (name, triangles) in hard_scenes() {
        let wide = WideBvh::build(&triangles, &WideSettings::default()).expect("valid input");
        let world = World::new(vec![triangles], &[(0, DAffine3::IDENTITY)]);
        let bvh = world.build();
        for ray in hard_rays(&mut random, &world.meshes[0], 500) {
            let (expected, hit) = (wide.closest_hit(&ray), bvh.closest_hit(&ray));
            assert!(same_bits(&hit, &expected), "{name}: {ray:?}\n{hit:?}\n{expected:?}");
        }
        let of_wide = wide.statistics();
        let statistics = bvh.statistics();
        assert_eq!(statistics.triangles, of_wide.triangles, "{name}");
        assert_eq!(statistics.excluded_range, of_wide.excluded_range, "{name}");
        assert_eq!(statistics.bytes, 16 * bvh.texels().len() as u64, "{name}");
    }
}

#[test]
fn images_keep_their_stated_error() {
    let mut random = Random(33);
    let mut worst = 0.0f64;
    for (name, world) in worlds(&mut random) {
        let bvh = world.build();
        for (placement, transform) in world.placements.iter().zip(bvh.transforms()) {
            let rows = transform.rows.map(|row| row.as_dvec3());
            for p in world.meshes[placement.mesh as usize].iter().flatten() {
                let p64 = p.as_dvec3();
                if transform.is_identity() || !p.is_finite() {
                    continue;
                }
                let exact = DVec3::from_array(rows.map(|row| row.dot(p64))) + transform.translation.as_dvec3();
                let image = transform::instance_vertex(&transform.rows, transform.translation, *p);
                let error = (image.as_dvec3() - exact).abs().max_element();
                worst = worst.max(error / transform.vertex_error);
                assert!(error <= transform.vertex_error, "{name}: {error}");
                assert!(
                    image.cmpge(transform.bounds.lower).all() && image.cmple(transform.bounds.upper).all(),
                    "{name}: {image} in {:?}",
                    transform.bounds
                );
                // Against what was asked for, A and b are rounded besides.
                let asked = placement.transform.transform_point3(p64);
                let products = placement.transform.matrix3.abs() * p64.abs() + placement.transform.translation.abs();
                let bound = transform.vertex_error + 1.01 * U * products.max_element();
                assert!((image.as_dvec3() - asked).abs().max_element() <= bound, "{name}");
            }
        }
    }
    assert!(worst > 0.1, "{worst}");
}

#[test]
fn no_ray_passes_between_the_triangles_of_an_instance() {
    let mut random = Random(34);
    // A closed surface: rays from inside meet it, through its edges and corners too.
    let (_, sphere) = hard_scenes()
        .into_iter()
        .find(|(name, _)| *name == "sphere")
        .expect("a sphere");
    let transforms = [
        DAffine3::from_scale(DVec3::splat(3.0)),
        turned(&mut random, DVec3::new(1.0, 7.0, 0.2), DVec3::new(100.0, -3.0, 20.0)),
        turned(&mut random, DVec3::new(-1.0, 1e-2, 1.0), DVec3::new(1e4, 1e4, -1e4)),
        turned(&mut random, DVec3::splat(1e-3), DVec3::new(0.3, 0.1, 0.7)),
    ];
    for transform in transforms {
        let world = World::new(vec![sphere.clone()], &[(0, transform)]);
        let bvh = world.build();
        let (images, _) = world.images(&bvh);
        let centre = images.iter().flatten().map(|v| v.as_dvec3()).sum::<DVec3>() / (3 * images.len()) as f64;
        let origin = centre.as_vec3();
        for triangle in &images {
            for i in 0..3 {
                let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
                for at in [a, 0.5 * (a + b), a + (b - a) * random.unit()] {
                    let ray = Ray::new(origin, at - origin);
                    assert!(bvh.closest_hit(&ray).is_hit(), "{transform:?}: {ray:?}");
                }
            }
        }
    }
}

#[test]
fn stopped_traversals_go_on_without_loss_or_repetition() {
    let mut random = Random(35);
    let (mut stops, mut quota) = (0, 0);
    for (name, world) in worlds(&mut random) {
        let bvh = world.build();
        let (images, _) = world.images(&bvh);
        for ray in hard_rays(&mut random, &images, 150) {
            for start in [TwoLevelTraversal::closest(&ray), TwoLevelTraversal::any(&ray)] {
                let mut whole = start;
                let mut counters = TraversalCounters::default();
                whole.run(&bvh, &ray, u64::MAX, &mut |_, _| true, &mut counters);
                let mut parts = start;
                let mut parts_counters = TraversalCounters::default();
                // The least that gets on: a node beyond the way back, and the round that goes into an instance.
                quota = u64::from(bvh.statistics().max_depth + 1 + constants::WIDE_ROUND_ITERATIONS);
                let mut runs = 0;
                while parts.resume != FINISHED {
                    parts.run(&bvh, &ray, quota, &mut |_, _| true, &mut parts_counters);
                    runs += 1;
                    assert!(runs < 10_000, "{name}: no progress");
                }
                assert!(same_bits(&whole.hit, &parts.hit), "{name}: {ray:?}");
                // Fewer when the hit so far culls a sibling that the stack would have kept.
                assert!(parts_counters.triangles <= counters.triangles, "{name}: {ray:?}");
                stops += runs - 1;
            }
        }
    }
    assert!(stops > 1000, "{stops} stops, the last quota {quota}");
}

#[test]
fn filters_see_the_numbers_of_images() {
    let mut random = Random(36);
    let mesh = soup(&mut random, 80, 0.5, 1.0, Vec3::ZERO);
    let places = [DVec3::ZERO, DVec3::X * 1.5, DVec3::Y].map(|at| (0, turned(&mut random, DVec3::ONE, at)));
    let world = World::new(vec![mesh], &places);
    let bvh = world.build();
    let (images, _) = world.images(&bvh);
    let accepts = |triangle: u32| triangle.is_multiple_of(3);
    let mut hits = 0;
    for ray in hard_rays(&mut random, &images, 800) {
        let expected = brute_force(&images, |i| accepts(i as u32), &ray);
        let hit = bvh.closest_hit_filtered(&ray, &mut |i, _| accepts(i), &mut TraversalCounters::default());
        assert!(same_bits(&hit, &expected), "{ray:?}\n{hit:?}\n{expected:?}");
        let any = bvh.any_hit_filtered(&ray, &mut |i, _| accepts(i), &mut TraversalCounters::default());
        assert_eq!(any, expected.is_hit());
        hits += u32::from(hit.is_hit());
    }
    assert!(hits > 100, "{hits}");
}

#[test]
fn names_stand_for_places_in_a_mesh() {
    let mut random = Random(37);
    let triangles = soup(&mut random, 50, 0.5, 1.0, Vec3::ZERO);
    let names: Vec<u32> = (0..50).map(|i| 1000 - 3 * i).collect();
    let mesh = MeshGeometry {
        triangles: &triangles,
        names: Some(&names),
    };
    let bvh = TwoLevelBvh::build(&[mesh], &[Placement::identity(0)], &WideSettings::default()).expect("valid input");
    let plain = World::new(vec![triangles.clone()], &[(0, DAffine3::IDENTITY)]).build();
    for ray in hard_rays(&mut random, &triangles, 300) {
        let (hit, expected) = (bvh.closest_hit(&ray), plain.closest_hit(&ray));
        assert_eq!((hit.t, hit.is_hit()), (expected.t, expected.is_hit()));
        assert!(!hit.is_hit() || names.contains(&hit.triangle));
    }
    let twice = [Placement::identity(0), Placement::identity(0)];
    assert!(TwoLevelBvh::build(&[mesh], &twice, &WideSettings::default()).is_err());
}

#[test]
fn names_that_no_hit_could_have_are_refused() {
    let triangles = grid(1);
    let build = |names: &[u32]| {
        let mesh = MeshGeometry {
            triangles: &triangles,
            names: Some(names),
        };
        TwoLevelBvh::build(&[mesh], &[Placement::identity(0)], &WideSettings::default())
    };
    assert_eq!(triangles.len(), 2);
    assert!(build(&[7, NO_HIT - 1]).is_ok());
    for (names, at) in [
        (&[7][..], "meshes[0].names"),
        (&[7, 8, 9][..], "meshes[0].names"),
        (&[7, NO_HIT][..], "meshes[0].names[1]"),
    ] {
        match build(names) {
            Err(Error::Setting { name, .. }) => assert_eq!(name, at),
            other => panic!("{names:?}: {other:?}"),
        }
    }
}

#[test]
fn moving_makes_the_tree_above_and_nothing_else() {
    let mut random = Random(38);
    let (_, mut world) = worlds(&mut random)
        .into_iter()
        .find(|(name, _)| name == "many")
        .expect("many");
    let mut bvh = world.build();
    let built = TwoLevelWork {
        meshes: 3,
        refits: 0,
        tops: 1,
    };
    assert_eq!(bvh.work(), built);
    let before = bvh.texels().to_vec();
    let moves: Vec<_> = (0..200)
        .step_by(3)
        .map(|i| {
            let translation = (random.vector() * 20.0).as_dvec3();
            (i, turned(&mut random, DVec3::new(1.0, -1.0, 2.0), translation))
        })
        .collect();
    bvh.move_instances(&moves).expect("valid moves");
    assert_eq!(bvh.work(), TwoLevelWork { tops: 2, ..built });
    for (i, transform) in &moves {
        world.placements[*i].transform = *transform;
    }
    let anew = world.build();
    assert!(bvh.texels() == anew.texels(), "as if it had been built so");
    assert_eq!(bvh.statistics(), anew.statistics());
    let kept = bvh.top_texels().end..bvh.instance_texels().start;
    assert!(bvh.texels()[kept.clone()] == before[kept] && !bvh.mesh_texels(0)[0].is_empty());
    let (images, usable) = world.images(&bvh);
    for ray in hard_rays(&mut random, &images, 300) {
        let expected = brute_force(&images, |i| usable[i], &ray);
        assert!(same_bits(&bvh.closest_hit(&ray), &expected));
    }
    // What is refused moves nothing.
    let now = bvh.texels().to_vec();
    let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    for moves in [
        [(0, DAffine3::IDENTITY), (1, flat)],
        [(0, DAffine3::IDENTITY), (200, DAffine3::IDENTITY)],
    ] {
        assert!(matches!(bvh.move_instances(&moves), Err(Error::Setting { .. })));
        assert!(bvh.texels() == now && bvh.work().tops == 2);
    }
}

#[test]
fn refitted_meshes_have_the_hits_of_new_ones() {
    let mut random = Random(39);
    let (_, mut world) = worlds(&mut random)
        .into_iter()
        .find(|(name, _)| name == "many")
        .expect("many");
    let mut bvh = world.build();
    for triangle in &mut world.meshes[1] {
        let shift = random.vector() * 0.5;
        *triangle = triangle.map(|v| v + shift);
    }
    let before = bvh.texels().to_vec();
    bvh.refit_mesh(1, &world.meshes[1]).expect("valid triangles");
    let work = bvh.work();
    assert_eq!((work.meshes, work.refits, work.tops), (3, 1, 2));
    for mesh in [0, 2] {
        for range in bvh.mesh_texels(mesh) {
            assert!(bvh.texels()[range.clone()] == before[range], "mesh {mesh} has stayed");
        }
    }
    let (images, usable) = world.images(&bvh);
    let mut hits = 0;
    for ray in hard_rays(&mut random, &images, 1500) {
        let expected = brute_force(&images, |i| usable[i], &ray);
        let hit = bvh.closest_hit(&ray);
        assert!(same_bits(&hit, &expected), "{ray:?}\n{hit:?}\n{expected:?}");
        hits += u32::from(hit.is_hit());
    }
    assert!(hits > 200, "{hits}");
    let now = bvh.texels().to_vec();
    let mut far = world.meshes[1].clone();
    far[7][1].y = f32::NAN;
    for triangles in [&far, &world.meshes[0]] {
        assert!(matches!(bvh.refit_mesh(1, triangles), Err(Error::Setting { .. })));
        assert!(bvh.texels() == now, "what is refused changes nothing");
    }
}

#[test]
fn bytes_grow_with_meshes_and_little_with_instances() {
    let mut random = Random(40);
    let mesh = soup(&mut random, 5000, 0.05, 1.0, Vec3::ZERO);
    let bytes = |instances: usize| {
        let places: Vec<_> = (0..instances)
            .map(|i| {
                (
                    0,
                    DAffine3::from_translation(DVec3::new(3.0 * (i % 40) as f64, 0.0, 3.0 * (i / 40) as f64)),
                )
            })
            .collect();
        let bvh = World::new(vec![mesh.clone()], &places).build();
        assert_eq!(bvh.work().meshes, 1);
        assert_eq!(bvh.statistics().triangles, 5000 * instances as u64);
        bvh.statistics().bytes
    };
    let (one, many) = (bytes(1), bytes(1000));
    assert_eq!(many - one, 999 * INSTANCE_BYTES);
    assert!(many < 2 * one, "{one} {many}");
}

#[test]
fn the_number_of_threads_does_not_show() {
    let mut random = Random(41);
    let (_, world) = worlds(&mut random)
        .into_iter()
        .find(|(name, _)| name == "many")
        .expect("many");
    let [one, four] = [1, 4].map(|threads| with_threads(threads, || world.build()));
    assert!(one.texels() == four.texels());
}

#[test]
fn what_rays_cannot_be_traced_through_is_refused() {
    let meshes = vec![grid(2)];
    for transform in [
        DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)),
        DAffine3::from_scale(DVec3::new(1.0, 1e-6, 1.0)),
        DAffine3::from_scale(DVec3::splat(1e8)),
        DAffine3::from_translation(DVec3::X * 2e9),
        DAffine3::from_translation(DVec3::X * f64::NAN),
    ] {
        let world = World::new(meshes.clone(), &[(0, transform)]);
        let built = TwoLevelBvh::build(&world.geometry(), &world.placements, &WideSettings::default());
        assert!(matches!(built, Err(Error::Setting { .. })), "{transform:?}");
    }
    let absent = [Placement::identity(7)];
    let world = World::new(meshes.clone(), &[]);
    assert!(TwoLevelBvh::build(&world.geometry(), &absent, &WideSettings::default()).is_err());
    let last = [Placement {
        first: NO_HIT - 3,
        ..Placement::identity(0)
    }];
    let built = TwoLevelBvh::build(&world.geometry(), &last, &WideSettings::default());
    assert!(matches!(built, Err(Error::LimitExceeded { .. })));
}
