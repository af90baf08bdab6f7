//! The last look at a scene's media: indices in range, coefficients that can be, grids as long as their size says, and sizes that fit.

use glam::{DVec3, Vec3};

use super::{DensityGrid, Medium, Phase};
use crate::scene::{AlphaMode, Material, Scene};

/// Most media of a scene.
pub const MAX_MEDIA: usize = 1 << 12;
/// Most cells of all density grids of a scene together: 512 MiB.
pub const MAX_DENSITY_CELLS: u64 = 1 << 27;
/// Greatest optical depth of a grid: its greatest density times the extinction times its diagonal. A walk through it makes as many tentative collisions,
/// whatever else the grid holds; with more, f32 does not tell one place of them from the next, and a path takes minutes.
pub const MAX_GRID_DEPTH: f64 = (1u32 << 24) as f64;

type Fault = (String, String);

fn fault<T>(at: impl Into<String>, cause: impl Into<String>) -> Result<T, Fault> {
    Err((at.into(), cause.into()))
}

/// The first fault of a scene's media and of what refers to them: its place and its cause.
pub(in crate::scene) fn check(scene: &Scene) -> Result<(), Fault> {
    let count = scene.media.len();
    if count > MAX_MEDIA {
        return fault("media", format!("{count} are more than {MAX_MEDIA}"));
    }
    let mut cells = 0u64;
    for (i, medium) in scene.media.iter().enumerate() {
        check_medium(medium).map_err(|(at, cause)| (format!("media[{i}] {:?}.{at}", medium.name), cause))?;
        cells += medium.density.as_ref().map_or(0, |grid| grid.values.len() as u64);
    }
    if cells > MAX_DENSITY_CELLS {
        let cause = format!("hold {cells} cells; at most {MAX_DENSITY_CELLS} are allowed");
        return fault("density grids of media", cause);
    }
    if let Some(index) = scene.surrounding.filter(|&index| index as usize >= count) {
        return fault(
            "surrounding",
            format!("{index} is out of range; there are {count} media"),
        );
    }
    if let Some(index) = scene.surrounding
        && let medium = &scene.media[index as usize]
        && medium.density.is_none()
        && (medium.emission.cmpgt(Vec3::ZERO) & medium.sigma_t().cmpeq(Vec3::ZERO)).any()
    {
        let cause =
            format!("{index} emits without extinction in some band: without end, it would be infinitely bright");
        return fault("surrounding", cause);
    }
    for (i, material) in scene.materials.iter().enumerate() {
        check_use(material, count)
            .map_err(|(at, cause)| (format!("materials[{i}] {:?}.{at}", material.name), cause))?;
    }
    Ok(())
}

fn check_medium(medium: &Medium) -> Result<(), Fault> {
    for (name, value) in [
        ("sigma_a", medium.sigma_a),
        ("sigma_s", medium.sigma_s),
        ("emission", medium.emission),
    ] {
        if !value.is_finite() || value.min_element() < 0.0 {
            return fault(name, format!("{value} is negative or not finite"));
        }
    }
    if let Phase::HenyeyGreenstein { g: value } | Phase::Schlick { k: value } = medium.phase
        && (value.is_nan() || value.abs() >= 1.0)
    {
        return fault("phase", format!("{value} does not lie between -1 and 1"));
    }
    let greatest = match &medium.density {
        Some(grid) => check_grid(grid)?,
        None => 1.0,
    };
    if !(medium.sigma_t() * greatest).is_finite() || !(medium.emission * greatest).is_finite() {
        return fault("sigma_t", "or emission times the greatest density is not finite");
    }
    if let Some(grid) = &medium.density {
        // A grid that is sheared has diagonals of several lengths.
        let corners = [
            DVec3::ONE,
            DVec3::new(-1.0, 1.0, 1.0),
            DVec3::new(1.0, -1.0, 1.0),
            DVec3::new(1.0, 1.0, -1.0),
        ];
        let diagonals = corners.map(|corner| grid.to_world.transform_vector3(corner).length());
        let diagonal = diagonals.into_iter().fold(0.0, f64::max);
        let depth = f64::from(medium.sigma_t().max_element()) * f64::from(greatest) * diagonal;
        if depth.is_nan() || depth > MAX_GRID_DEPTH {
            let cause = format!(
                "has a greatest density of {greatest} in a grid whose diagonal is {diagonal} m: with the extinction an optical depth of {depth:.3e}, through \
                 which no path would end in time; at most {MAX_GRID_DEPTH:.3e} is allowed. Lower the density, the extinction or the size, or take a surface instead"
            );
            return fault("density", cause);
        }
    }
    Ok(())
}

/// The greatest density, or what is wrong.
fn check_grid(grid: &DensityGrid) -> Result<f32, Fault> {
    let [x, y, z] = grid.size;
    let cells = u128::from(x) * u128::from(y) * u128::from(z);
    if cells == 0 || cells != grid.values.len() as u128 {
        let cause = format!("is {x} × {y} × {z} but holds {} values", grid.values.len());
        return fault("density", cause);
    }
    if let Some(i) = grid.values.iter().position(|v| !v.is_finite() || *v < 0.0) {
        let cause = format!("{} is negative or not finite", grid.values[i]);
        return fault(format!("density.values[{i}]"), cause);
    }
    let inverse = grid.to_world.inverse();
    if !grid.to_world.is_finite() || grid.to_world.matrix3.determinant() == 0.0 || !inverse.is_finite() {
        return fault("density.to_world", "is not finite or flattens the grid");
    }
    Ok(grid.max())
}

fn check_use(material: &Material, media: usize) -> Result<(), Fault> {
    if let Some(index) = material.interior {
        if index as usize >= media {
            return fault("interior", format!("{index} is out of range; there are {media} media"));
        }
        let solid = material.transmission > 0.0 && material.thickness > 0.0 && !material.unlit;
        if !material.boundary && !solid {
            let cause = "is a medium that no light reaches: the material is neither a boundary nor a solid that transmits (transmission and \
                         thickness above 0)";
            return fault("interior", cause);
        }
        if material.attenuation_distance.is_finite() && material.attenuation_color != Vec3::ONE {
            let cause = "stands beside an attenuation colour and distance; put the absorption into the medium's sigma_a instead";
            return fault("interior", cause);
        }
    }
    if material.boundary {
        let cause = if material.interior.is_none() {
            "bounds no medium; for a hole in another medium give it one whose coefficients are 0"
        } else if material.unlit || material.emission != Vec3::ZERO {
            "cannot be seen, and so cannot emit"
        } else if material.alpha_mode != AlphaMode::Opaque {
            "cannot be seen, and so has no holes: its alpha must be opaque"
        } else {
            return Ok(());
        };
        return fault("boundary", cause);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DMat3};

    use super::*;
    use crate::scene::builtin::generate;

    /// A cube of fog in a cube of glass.
    fn scene() -> Scene {
        let mut scene = generate("builtin:slab").expect("scene");
        scene.media.push(Medium {
            name: "fog".into(),
            sigma_a: Vec3::ONE,
            sigma_s: Vec3::ONE,
            phase: Phase::HenyeyGreenstein { g: 0.5 },
            density: Some(DensityGrid::from_fn([2, 3, 4], |p| p.x as f32)),
            ..Medium::default()
        });
        scene.materials[0].interior = Some(0);
        scene.add_material(Material {
            interior: Some(0),
            boundary: true,
            ..Material::default()
        });
        scene.surrounding = Some(0);
        scene
    }

    fn refusal(change: impl FnOnce(&mut Scene)) -> String {
        let mut scene = scene();
        scene.check().expect("sound");
        change(&mut scene);
        scene.check().expect_err("must be refused").to_string()
    }

    fn grid_refusal(change: impl FnOnce(&mut DensityGrid)) -> String {
        refusal(|s| change(s.media[0].density.as_mut().expect("grid")))
    }

    #[test]
    fn every_kind_of_fault_is_named() {
        for (message, expected) in [
            (refusal(|s| s.media[0].sigma_a.x = -1.0), "media[0] \"fog\".sigma_a"),
            (refusal(|s| s.media[0].sigma_s.y = f32::NAN), "sigma_s"),
            (refusal(|s| s.media[0].emission.z = f32::INFINITY), "emission"),
            (
                refusal(|s| {
                    s.media[0].sigma_a = Vec3::splat(f32::MAX);
                    s.media[0].sigma_s = Vec3::splat(f32::MAX);
                }),
                "sigma_t",
            ),
            (
                refusal(|s| s.media[0].phase = Phase::HenyeyGreenstein { g: 1.0 }),
                "phase",
            ),
            (refusal(|s| s.media[0].phase = Phase::Schlick { k: f32::NAN }), "phase"),
            (
                refusal(|s| s.media = vec![Medium::default(); MAX_MEDIA + 1]),
                "more than 4096",
            ),
            (refusal(|s| s.surrounding = Some(1)), "surrounding: 1 is out of range"),
            (
                refusal(|s| {
                    s.media[0].density = None;
                    s.media[0].emission.y = 1.0;
                    (s.media[0].sigma_a.y, s.media[0].sigma_s.y) = (0.0, 0.0);
                }),
                "infinitely bright",
            ),
            (
                refusal(|s| s.materials[0].interior = Some(7)),
                "interior: 7 is out of range",
            ),
            (refusal(|s| s.materials[0].transmission = 0.0), "no light reaches"),
            (refusal(|s| s.materials[0].thickness = 0.0), "no light reaches"),
            (
                refusal(|s| {
                    s.materials[0].attenuation_color = Vec3::splat(0.5);
                    s.materials[0].attenuation_distance = 1.0;
                }),
                "beside an attenuation",
            ),
            (refusal(|s| s.materials[1].interior = None), "bounds no medium"),
            (refusal(|s| s.materials[1].emission.x = 1.0), "cannot emit"),
            (refusal(|s| s.materials[1].alpha_mode = AlphaMode::Blend), "opaque"),
            (grid_refusal(|g| g.size = [0, 3, 4]), "0 × 3 × 4"),
            (grid_refusal(|g| g.size = [u32::MAX; 3]), "holds 24 values"),
            (grid_refusal(|g| g.values[3] = -0.5), "values[3]"),
            (grid_refusal(|g| g.values[23] = f32::INFINITY), "values[23]"),
            (
                grid_refusal(|g| g.to_world = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))),
                "flattens",
            ),
            (grid_refusal(|g| g.to_world.translation.x = f64::NAN), "to_world"),
            (grid_refusal(|g| g.values[5] = 1e30), "at most 1.678e7"),
            (
                grid_refusal(|g| g.to_world = DAffine3::from_scale(DVec3::splat(1e8))),
                "optical depth",
            ),
        ] {
            assert!(message.contains(expected), "{expected}: {message}");
        }
    }

    #[test]
    fn thick_grids_are_refused_where_walks_would_not_end_and_not_before() {
        // An extinction of 2, a diagonal of √3, and one cell that is not empty.
        let depth = |density: f32| {
            let mut scene = scene();
            let grid = scene.media[0].density.as_mut().expect("grid");
            grid.values.iter_mut().for_each(|value| *value = 0.0);
            grid.values[0] = density;
            scene.check()
        };
        let most = MAX_GRID_DEPTH / (2.0 * 3f64.sqrt());
        depth((0.999 * most) as f32).expect("a depth just below");
        depth((1.001 * most) as f32).expect_err("a depth just above");
        depth(0.0).expect("nothing");
        // Flat along one diagonal, and as long as before along the others.
        let mut scene = scene();
        let grid = scene.media[0].density.as_mut().expect("grid");
        grid.values.iter_mut().for_each(|value| *value = 0.0);
        grid.values[0] = 1.0;
        let side = 2.0 * MAX_GRID_DEPTH;
        grid.to_world.matrix3 = DMat3::from_cols(
            DVec3::new(side, 0.0, 0.0),
            DVec3::new(-side, 1.0, 0.0),
            DVec3::new(0.0, 0.0, 1.0),
        );
        let refusal = scene.check().expect_err("a long diagonal beside a short one");
        assert!(refusal.to_string().contains("optical depth"), "{refusal}");
    }
}
