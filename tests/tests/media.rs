//! smoke
use clerestory::scene::{LightKind, Scene, Medium};
use clerestory::transport::PathTracerSettings;
use clerestory_tests::render::{camera_down, independent, render};
use clerestory_tests::with_gpu;
use glam::Vec3;

#[test]
fn smoke() {
    with_gpu(|gpu| {
        let mut scene = Scene::default();
        scene.media.push(Medium { sigma_a: Vec3::splat(0.0), sigma_s: Vec3::splat(1.0), ..Medium::default() });
        scene.surrounding = Some(0);
        scene.cameras.push(camera_down(1.0, 10.0));
        scene.add_light("p", LightKind::Point { position: Vec3::ZERO, intensity: Vec3::ONE });
        let _ = PathTracerSettings::default();
        let picture = render(gpu, &scene, [8, 8], 16, &independent());
        println!("{:?} {:?}", picture.mean(), picture.counters);
    });
}
