//! Pictures of parts of the light paths: does their sum show what the whole shows, and what do the parts cost?
//!
//! Oracle: the whole picture, by a z-test of every pixel.

use clerestory::render::Renderer;
use clerestory::{Result, scene};

use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::Image;
use crate::experiments::table::Table;

/// A scene, the paths of its whole picture and the parts they divide into.
const CASES: [(&str, &str, &[&str]); 3] = [
    (
        "builtin:cornell-box",
        "all",
        &["emitted", "direct", "bounces=2..3", "bounces=4.."],
    ),
    ("builtin:cornell-box", "all", &["bounces=0..1", "indirect"]),
    (
        "builtin:white-furnace?frequency=8&roughness=0.5",
        "direct",
        &["direct,lobes=diffuse+reflection", "direct,lobes=glossy+reflection"],
    ),
];

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let (size, spp) = if context.smoke { (8, 32) } else { (48, 256) };
    let gpu = (context.gpu)()?;
    let mut table = Table::new(
        "Sums of pictures of parts of the light paths",
        &[
            "scene",
            "paths",
            "mean",
            "mean over the whole's − 1",
            "z of the mean",
            "accepted pixels",
            "worst z",
            "mean variance",
            "rays",
            "GPU seconds",
        ],
    );
    for (address, whole_paths, parts) in CASES {
        let renderer = Renderer::new(&gpu, &scene::load(address)?)?;
        let whole = Image::render(&renderer, size, spp, 1, whole_paths)?;
        let name = address.trim_start_matches("builtin:");
        let variance = |image: &Image| {
            image.variance.iter().map(|v| f64::from(*v)).sum::<f64>() / image.variance.len().max(1) as f64
        };
        let mean = |image: &Image| [0, 1, 2].iter().map(|c| image.mean(*c).0).sum::<f64>() / 3.0;
        let mut row = |paths: &str, image: &Image, compared: bool, rays: u64, seconds: f64| -> Result<()> {
            let mut cells = vec![name.into(), paths.into(), mean(image).into()];
            if compared {
                let test = image.z_test(&whole)?;
                cells.push((mean(image) / mean(&whole) - 1.0).into());
                cells.extend([test.bias_z, test.accepted_fraction, test.worst_z].map(Into::into));
            } else {
                cells.extend(["", "", "", ""].map(Into::into));
            }
            cells.extend([variance(image).into(), rays.into(), seconds.into()]);
            table.row(cells);
            Ok(())
        };
        let rays = |image: &Image| image.count("rays");
        row(whole_paths, &whole, false, rays(&whole), whole.report.gpu_seconds)?;
        let mut sum: Option<Image> = None;
        let (mut all_rays, mut all_seconds) = (0, 0.0);
        for (seed, paths) in (100..).zip(parts) {
            let part = Image::render(&renderer, size, spp, seed, paths)?;
            row(paths, &part, false, rays(&part), part.report.gpu_seconds)?;
            all_rays += rays(&part);
            all_seconds += part.report.gpu_seconds;
            match &mut sum {
                Some(sum) => sum.add(&part),
                None => sum = Some(part),
            }
        }
        if let Some(sum) = sum {
            row("sum of the parts", &sum, true, all_rays, all_seconds)?;
        }
    }
    table.note(format!(
        "{size} × {size} pixels, {spp} independent samples each, a seed for each part. The z-tests compare the sum with the whole: pixels with \
         Šidák's correction for a rate of one false alarm in a hundred pictures. Channels of a pixel are correlated: the z of the mean is up \
         to √3 times a standard normal one."
    ));
    Ok(vec![table])
}
