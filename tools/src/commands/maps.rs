//! `clerestory maps`: environment maps from one parametrization to another.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use clerestory::Error;
use clerestory::film::{Picture, exr, hdr};
use clerestory::maps::resample::{MAX_SAMPLES, Reconstruction, ResampleSettings, resample_watched};
use clerestory::maps::{MapImage, Parametrization};
use glam::{DMat3, DVec3, UVec2, Vec3};

use crate::failure::{Code, Failure, Outcome};
use crate::output::{self, Table};
use crate::outputs::{Inputs, Outputs, Overwriting};
use crate::pictures;
use crate::stop::Stop;

/// Converts environment maps between parametrizations, each texel to the mean radiance over its solid angle
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory maps sky.hdr sky.exr --to octahedron --size 512
  clerestory maps sky.exr back.hdr --from octahedron --to lat-long
  clerestory maps sky.hdr faces.exr --to cube --size 256 --border 1

Maps: lat-long, cube, paraboloid, octahedron, octahedron-rectangular, octahedron-c=NUMBER, equal-area, sphere, nusselt (the upper \
hemisphere only). Layers lie side by side from left to right: the cube's +x −x +y −y +z −z with the axes of Vulkan's cube images, the \
paraboloid's upper and lower disc. Latitude–longitude files follow the convention of [environment] in a scene: +y is up, −z in the middle, +x to \
the right of it. All other maps but the cube have the world's up as their pole, and the map's x and y are the world's +x and −z. Texels \
outside discs are black.

It prints the integral of radiance over the sphere before and after. The two differ where texels of one map straddle those of the other: with 4 samples per side of the finer \
map's texels by less than 1e-3 for most maps, by much less where one map refines the other; more --samples bring them closer.

Ctrl-C ends the conversion before anything is written: an older output is left untouched.")]
pub struct Arguments {
    /// The map to read: EXR or Radiance HDR
    input: PathBuf,
    /// The map to write: EXR or Radiance HDR, by its ending
    output: PathBuf,
    /// Parametrization of the input
    #[arg(long, value_name = "MAP", default_value = "lat-long", value_parser = map)]
    from: Parametrization,
    /// Parametrization of the output
    #[arg(long, value_name = "MAP", value_parser = map)]
    to: Parametrization,
    /// Rows of a layer of the output; maps of two squares are twice as wide. By default about as many texels as the input has
    #[arg(long, value_name = "ROWS", value_parser = clap::value_parser!(u32).range(1..=16_384))]
    size: Option<u32>,
    /// Width in texels of the border around each layer of the output, which repeats the texels where the map continues
    #[arg(long, value_name = "TEXELS", default_value_t = 0)]
    border: u32,
    /// Width in texels of the border around each layer of the input
    #[arg(long, value_name = "TEXELS", default_value_t = 0)]
    from_border: u32,
    /// Samples along the side of the finer map's texels
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    samples: u32,
    /// How the input is interpolated between the centres of its texels
    #[arg(long, value_enum, default_value_t = Filter::Box)]
    filter: Filter,
    /// Prints JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwriting: Overwriting,
}

/// What a map is between its texels' centres.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Filter {
    /// Constant over each texel; keeps the integral
    Box,
    /// Bilinear, smooth where the output is finer
    Bilinear,
}

fn map(text: &str) -> std::result::Result<Parametrization, String> {
    text.parse::<Parametrization>().map_err(|error| match error {
        Error::Setting { cause, .. } => cause,
        other => other.to_string(),
    })
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    let (from, to) = (arguments.from, arguments.to);
    let ending = pictures::extension(&arguments.output);
    if !matches!(ending.as_str(), "exr" | "hdr") {
        return Err(Failure::usage(format!(
            "{} cannot be written: maps are .exr or .hdr files",
            arguments.output.display()
        )));
    }
    let inputs = Inputs::of([&arguments.input]);
    let plan = Outputs::one(&arguments.output, &inputs, arguments.overwriting.overwrite)?;
    let picture = pictures::read(&arguments.input)?;
    let source = source(arguments, &picture)?;
    let size = arguments
        .size
        .map_or_else(|| size_like(&source, to), |rows| UVec2::new(rows * to.aspect(), rows));
    let settings = ResampleSettings {
        samples: arguments.samples,
        reconstruction: match arguments.filter {
            Filter::Box => Reconstruction::Box,
            Filter::Bilinear => Reconstruction::Bilinear,
        },
    };
    check_output(to, size, arguments.border)?;
    // Axes are orthonormal: the transpose leads back to the world.
    let to_source = from.world_axes() * to.world_axes().transpose();
    let Some(converted) = convert(&source, to, size, to_source, &settings)? else {
        output::note(&format!("stopped; {} was not written", arguments.output.display()));
        return Ok(Code::Interrupted.into());
    };
    let (extent, texels) = converted.to_strip(arguments.border)?;
    let mut map = Picture::from_radiance(extent.x, extent.y, texels.iter().flat_map(Vec3::to_array).collect())?;
    map.metadata = picture.metadata.clone();
    let facts = [("map", to.to_string()), ("map_border", arguments.border.to_string())];
    let facts = facts.map(|(key, value)| (format!("clerestory.{key}"), value));
    map.metadata.other.extend(facts);
    let name = arguments.output.display().to_string();
    let bytes = match ending.as_str() {
        "hdr" => hdr::to_bytes(&map, &name)?,
        _ => exr::to_bytes(&map, &name)?,
    };
    let written = plan.write(&[bytes], || None);
    let place = written.paths.first().unwrap_or(&arguments.output);
    report(arguments, place, &source, &converted)?;
    written.check()?;
    Ok(ExitCode::SUCCESS)
}

/// Steps of the bar.
const STEPS: u64 = 1000;

/// Converts under a bar, which shows itself on a terminal alone; `None` when somebody has asked to stop.
fn convert(
    source: &MapImage,
    to: Parametrization,
    size: UVec2,
    to_source: DMat3,
    settings: &ResampleSettings,
) -> Outcome<Option<MapImage>> {
    let bar = output::bar(STEPS);
    let stop = Stop::listen(&bar, "stopping; nothing is written")?;
    tracing::info!("converting {} to {to}", source.map());
    bar.set_message(format!("{} to {to}", source.map()));
    bar.enable_steady_tick(output::TICK);
    let converted = resample_watched(source, to, size, to_source, settings, &mut |share| {
        bar.set_position((share * STEPS as f64) as u64);
        !stop.requested()
    });
    bar.finish_and_clear();
    Ok(converted?)
}

fn source(arguments: &Arguments, picture: &Picture) -> Outcome<MapImage> {
    let layer = picture.main_layer()?;
    let bad = layer.count_non_finite();
    if bad.nan + bad.infinite > 0 {
        let cause = format!("holds {} NaN and {} infinite values", bad.nan, bad.infinite);
        let path = arguments.input.display().to_string();
        return Err(Error::Picture { path, cause }.into());
    }
    let texels: Vec<Vec3> = layer.pixels().map(Vec3::from_array).collect();
    let extent = UVec2::new(picture.width(), picture.height());
    Ok(MapImage::from_strip(
        arguments.from,
        extent,
        arguments.from_border,
        &texels,
    )?)
}

/// The size of a layer that comes next to as many texels with directions as a map has; of even height, so that the lat-long map has borders.
fn size_like(source: &MapImage, to: Parametrization) -> UVec2 {
    let texels = source.texels().len() as f64 * source.map().coverage() / to.coverage();
    2 * to.size_for(0.25 * texels)
}

/// Bytes of the texels of an output at most: a conversion holds them several times.
const MAX_BYTES: u64 = 1 << 31;

/// Refuses outputs that could not be written, before the conversion.
fn check_output(to: Parametrization, size: UVec2, border: u32) -> Outcome<()> {
    to.check_size(size)?;
    to.check_border(size, border)?;
    let tile = size.as_u64vec2() + 2 * u64::from(border);
    let texels = tile.element_product() * u64::from(to.layers());
    if texels > MAX_BYTES / size_of::<Vec3>() as u64 {
        return Err(Failure::usage(format!(
            "--size {}: the map's {texels} texels would take more than {} GiB",
            size.y,
            MAX_BYTES >> 30
        )));
    }
    Ok(())
}

/// The integral of radiance over the sphere.
#[derive(Debug, serde::Serialize)]
struct Held {
    file: PathBuf,
    map: String,
    /// Columns and rows of a layer.
    size: [u32; 2],
    layers: u32,
    /// ∫ L dω of red, green and blue.
    integral: [f64; 3],
}

fn held(file: &Path, image: &MapImage) -> Held {
    Held {
        file: file.into(),
        map: image.map().to_string(),
        size: image.size().to_array(),
        layers: image.map().layers(),
        integral: image.integral().to_array(),
    }
}

fn report(arguments: &Arguments, place: &Path, source: &MapImage, converted: &MapImage) -> Outcome {
    let both = [held(&arguments.input, source), held(place, converted)];
    let [before, after] = &both;
    let difference = DVec3::from(after.integral) - DVec3::from(before.integral);
    let relative: Vec<Option<f64>> = (0..3)
        .map(|i| (before.integral[i] != 0.0).then(|| difference[i] / before.integral[i]))
        .collect();
    if arguments.json {
        return output::print_json(
            &serde_json::json!({ "before": before, "after": after, "relative_difference": relative }),
        );
    }
    let mut table = Table::new(&["", "map", "texels of a layer", "∫ L dω: red", "green", "blue"], &[1]);
    for (what, one) in ["before", "after"].into_iter().zip(&both) {
        let size = match one.layers {
            1 => format!("{} × {}", one.size[0], one.size[1]),
            layers => format!("{layers} × {} × {}", one.size[0], one.size[1]),
        };
        let [red, green, blue] = one.integral.map(|value| format!("{value:.6e}"));
        table.row([what.into(), one.map.clone(), size, red, green, blue]);
    }
    let cells = relative
        .iter()
        .map(|value| value.map_or("–".into(), |value| format!("{value:+.2e}")));
    table.row(
        ["relative difference".into(), String::new(), String::new()]
            .into_iter()
            .chain(cells),
    );
    let mut text = table.text();
    if arguments.to == Parametrization::Nusselt && arguments.from != Parametrization::Nusselt {
        text += "the output holds only the upper hemisphere\n";
    }
    output::print(&text)
}
