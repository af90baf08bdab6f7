use super::*;
use crate::scene::{Instance, LightKind, Material};
use glam::DQuat;

/// Meshes that are placed once and often, one that shines, one that only a plane would hold, instances of no triangles, and of one without an area.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let stone = scene.add_material(Material::lambert("stone", Vec3::splat(0.5)));
    let lamp = scene.add_material(Material {
        emission: Vec3::ONE,
        ..Material::lambert("lamp", Vec3::ZERO)
    });
    let fan = |material: u32, count: u32| Mesh {
        positions: (0..count + 2)
            .map(|i| Vec3::new((i as f32).cos(), 0.1 * i as f32, (i as f32).sin()))
            .collect(),
        normals: vec![Vec3::Y; count as usize + 2],
        triangles: (0..count).map(|i| [i, i + 1, i + 2]).collect(),
        material: Some(material),
        ..Mesh::default()
    };
    let line = Mesh {
        positions: [0.0, 1.0, 2.0].map(|x| Vec3::X * x).into(),
        ..fan(stone, 1)
    };
    let meshes = [fan(stone, 7), fan(lamp, 3), fan(stone, 5), fan(stone, 0), line].map(|mesh| scene.add_mesh(mesh));
    let turn = DAffine3::from_rotation_translation(DQuat::from_rotation_x(1.1), DVec3::new(3.0, -1.0, 2.0));
    let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    let mirror = turn * DAffine3::from_scale(DVec3::new(-2.0, 2.0, 2.0));
    let places = [
        (2, DAffine3::IDENTITY),
        (0, turn),
        (1, turn),
        (1, DAffine3::IDENTITY),
        (0, flat),
        (0, mirror),
        (3, turn),
        (0, DAffine3::IDENTITY),
        (3, mirror),
        (4, turn),
        (4, mirror),
    ];
    scene.instances = places
        .into_iter()
        .map(|(mesh, transform): (usize, DAffine3)| Instance {
            mesh: meshes[mesh],
            transform,
            name: String::new(),
        })
        .collect();
    scene
}

#[test]
fn triangles_have_the_numbers_and_places_of_flattened_ones() {
    let scene = scene();
    let profile = SceneProfile::of(&scene);
    let keeping = Keeping::of(&scene, &profile).expect("a mesh that is placed often");
    let kept_objects: Vec<usize> = (0..scene.instances.len()).filter(|i| keeping.instances[*i]).collect();
    assert_eq!((kept_objects, keeping.meshes.clone()), (vec![1, 5, 7], vec![0]));
    let flat = Geometry::flatten(&scene, &profile).expect("small");
    let mut all = Geometry::keep(&scene, &profile, &keeping).expect("small");
    let mut kept = all.kept.clone().expect("instances");
    let index = kept.index(&all.triangles, &WideSettings::default()).expect("valid");
    assert_eq!(index.work().meshes, 2);
    all.kept = Some(kept.clone());
    let records = &kept.records;
    assert!(records.is_sorted_by_key(|record| record.first));
    // Three that are kept, and four runs of others, the last of lines.
    assert_eq!((records.len(), all.triangles.len()), (7, 5 + 2 * 3 + 7 + 2 + 7));
    for (number, expected) in flat.triangles.iter().enumerate() {
        let number = number as u32;
        let record = &records[records.partition_point(|record| record.first <= number) - 1];
        let stored = (record.record + number - record.first) as usize;
        let found = &all.triangles[stored];
        assert_eq!(found.material, expected.material);
        if stored < all.in_world() {
            assert_eq!((found, all.name(stored)), (expected, number));
            continue;
        }
        let instance = kept
            .instances
            .iter()
            .find(|instance| records[instance.record].first == record.first);
        let transform = InstanceTransform::of(
            &instance.expect("a kept instance").transform,
            &[spared_box(&scene.meshes[0])],
        );
        let image = transform.expect("a transform").triangle(corners_of(found));
        for (a, b) in image.into_iter().zip(corners_of(expected)) {
            assert!((a - b).abs().max_element() < 1e-5, "{number}: {a} {b}");
        }
    }
    let (bounds, area) = (flat.bounds(), flat.surface_area());
    for (a, b) in all.bounds().into_iter().zip(bounds) {
        assert!((a - b).abs().max_element() < 1e-5, "{a} {b}");
    }
    assert!(
        (all.surface_area() / area - 1.0).abs() < 1e-6,
        "{} {area}",
        all.surface_area()
    );
    assert_eq!(kept.first_vertex(&scene, 0), all.normals.len() - 9);
}

#[test]
fn meshes_without_an_area_are_flattened() {
    let mut scene = scene();
    let profile = SceneProfile::of(&scene);
    let lines = 9..11;
    let keeping = Keeping::of(&scene, &profile).expect("others are kept");
    assert!(!keeping.instances[lines.clone()].contains(&true));
    let all = Geometry::keep(&scene, &profile, &keeping).expect("small");
    let mut kept = all.kept.expect("instances");
    let index = kept.index(&all.triangles, &WideSettings::default()).expect("valid");
    // What is in world space, and the three that are kept.
    assert_eq!(index.transforms().len(), 4);
    // A line beside a triangle that is too small to be turned, and a triangle beside one that is out of range in its own space only.
    let line = scene.meshes.len() - 1;
    for (corner, size, other) in [(1e-14, 1.0, [0, 0, 3]), (2e9, 0.01, [0, 3, 4])] {
        scene.meshes[line] = Mesh {
            positions: [Vec3::ZERO, Vec3::X * corner, Vec3::Y * corner, Vec3::X, Vec3::Y].into(),
            normals: vec![Vec3::Y; 5],
            triangles: vec![[0, 1, 2], other],
            ..scene.meshes[line].clone()
        };
        for instance in &mut scene.instances[lines.clone()] {
            instance.transform *= DAffine3::from_scale(DVec3::splat(size));
        }
        let keeping = Keeping::of(&scene, &profile).expect("others are kept");
        assert!(!keeping.instances[lines.clone()].contains(&true), "{corner}");
    }
    // Where there is nothing else, nothing is kept.
    scene.instances = scene.instances[lines].to_vec();
    assert!(Keeping::of(&scene, &profile).is_none());
}

#[test]
fn bodies_that_absorb_are_flattened_where_a_light_may_be_inside() {
    let mut scene = scene();
    scene.materials[1].emission = Vec3::ZERO;
    scene.materials[0] = Material {
        attenuation_color: Vec3::splat(0.5),
        ..Material::glass("tinted", 1.5)
    };
    let kept = |scene: &Scene| -> Vec<usize> {
        let keeping = Keeping::of(scene, &SceneProfile::of(scene)).expect("some are kept");
        (0..scene.instances.len()).filter(|i| keeping.instances[*i]).collect()
    };
    assert_eq!(kept(&scene), [1, 2, 3, 5, 7]);
    // In the box around the mirror image alone.
    let position = Vec3::new(1.05, -0.95, 2.05);
    let intensity = Vec3::ONE;
    scene.add_light("point", LightKind::Point { position, intensity });
    assert_eq!(kept(&scene), [1, 2, 3, 7]);
    // Lamps are in the same places as two of the others.
    scene.materials[1].emission = Vec3::ONE;
    assert!(Keeping::of(&scene, &SceneProfile::of(&scene)).is_none());
    scene.materials[0].attenuation_color = Vec3::ONE;
    assert_eq!(kept(&scene), [1, 5, 7]);
}

#[test]
fn errors_have_the_numbers_of_the_scene() {
    let scene = scene();
    let profile = SceneProfile::of(&scene);
    let keeping = Keeping::of(&scene, &profile).expect("a mesh that is placed often");
    let all = Geometry::keep(&scene, &profile, &keeping).expect("small");
    let mut kept = all.kept.expect("instances");
    kept.instances[1].transform = DAffine3::ZERO;
    match kept.index(&all.triangles, &WideSettings::default()) {
        Err(Error::Setting { name, .. }) => assert_eq!(name, "instances[5].transform"),
        other => panic!("{other:?}"),
    }
    let other = Error::setting("placements[0].mesh", 0, "is in world space");
    assert!(kept.in_scene(other).to_string().contains("placements[0]"));
}

#[test]
fn keeping_pays_where_flattening_needs_much_more_or_does_not_fit() {
    let mut scene = scene();
    scene.meshes[0].triangles = vec![[0, 1, 2]; 10_000];
    let profile = SceneProfile::of(&scene);
    let pays = |scene: &Scene, texels, bytes| {
        let room = Room { texels, bytes };
        Keeping::of(scene, &profile).is_some_and(|k| k.pays(scene, &profile, room))
    };
    assert!(!pays(&scene, u64::MAX, u64::MAX), "few bytes");
    assert!(pays(&scene, 100_000, u64::MAX), "triangles do not fit into a buffer");
    // Four instances of 10,000 triangles, 128 bytes each.
    assert!(
        pays(&scene, u64::MAX, 5_000_000) && !pays(&scene, u64::MAX, 6_000_000),
        "memory"
    );
    let mut dense = scene.clone();
    dense.meshes[0].positions.resize(60_000, Vec3::Y);
    assert!(
        pays(&dense, 200_000, u64::MAX) && !pays(&dense, 300_000, u64::MAX),
        "vertices"
    );
    let instance = scene.instances[1].clone();
    scene.instances.extend(vec![instance; 60]);
    assert!(pays(&scene, u64::MAX, u64::MAX), "80 MB, and 61 for one");
    scene.instances.truncate(1);
    assert!(Keeping::of(&scene, &profile).is_none(), "nothing is placed twice");
}
