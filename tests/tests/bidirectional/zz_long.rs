use super::*;
#[test]
fn zz_long() {
    let Ok(which) = std::env::var("BDPT_LONG") else { return };
    with_gpu(|gpu| {
        let scene = builtin(&format!("builtin:sphere-light?rho=0.7&light={which}"));
        let found = passes(gpu, &scene, &settings(), 4096);
        for means in &found.means {
            expect_mean_of("long", means, 1.0, 0.0, 1.0);
        }
    });
}
