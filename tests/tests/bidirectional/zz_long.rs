use super::*;
#[test]
fn zz_long() {
    let Ok(which) = std::env::var("BDPT_LONG") else { return };
    with_gpu(|gpu| {
        let mut scene = room();
        scene.name = "point and spot".into();
        add_point(&mut scene, Vec3::new(0.3, 0.4, -0.1), 1.0);
        if which == "spot" {
            scene.add_light(
                "spot",
                LightKind::Spot {
                    position: Vec3::new(-0.5, 0.9, 0.5),
                    direction: Vec3::new(0.3, -1.0, -0.2).normalize(),
                    intensity: Vec3::splat(2.0),
                    inner: 0.3,
                    outer: 0.7,
                },
            );
        }
        let reference = traced(gpu, &scene, "bounces=1..", 262_144);
        let s = BidirectionalSettings {
            least_bounces: 1,
            light_paths: 256,
            ..settings()
        };
        passes(gpu, &scene, &s, 16_384).expect_same_as("long", &reference);
    });
}
