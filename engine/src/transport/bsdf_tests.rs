//! Proofs of the scattering function on its double-precision twin: densities, energy, reciprocity, limits.

use super::*;

fn context(features: BsdfFeatures) -> BsdfContext<'static> {
    BsdfContext {
        features,
        table: AlbedoTable::shared(),
    }
}

#[test]
fn smoke() {
    let c = context(BsdfFeatures::ALL);
    let m = Bsdf::from_material(&Material::lambert("w", glam::Vec3::splat(0.5)));
    let s = bsdf_sample(&c, &m, DVec3::Z, DVec3::new(0.3, 0.4, 0.5), LOBE_ALL);
    assert_eq!(s.weight, DVec3::splat(0.5));
}
