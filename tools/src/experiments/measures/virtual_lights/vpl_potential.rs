//! What it takes the device to find the potential of virtual lights, against their number, and beside the host.
//!
//! Source of what this follows: the chapter on virtual light sources of a doctoral thesis on metals and reflections on graphics hardware, §6.4 and figure 6.9.

use clerestory::Result;
use clerestory::gpu::{DeviceKind, Gpu};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene;
use serde_json::json;

use super::unit_box::ADDRESS;
use super::vpl_shares::Pixels;
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Measured, Repeats, Study, curves, rows};
use crate::experiments::measures::{Context, MEMORY_OF_ITS_OWN};
use crate::timing::{median, timed};

/// Walks of a pass, whose lights are some five times as many.
const WALKS: [u32; 4] = [25, 50, 100, 200];
/// Side of the picture; the same of a smoke run.
const SIDE: [u32; 2] = [128, 8];
/// Published time for a pair of a pixel and a light, ns, on a card of 2002.
const PUBLISHED: f64 = 39.0;
/// A pass of the device that a picture takes.
const GATHER: &str = "vpl: gather";
/// Times that a pair is looked at where a share of none is taken: for the sum, and then against the least potential.
const LOOKS: f64 = 2.0;

rows! {
    /// Lights of walks.
    struct Row = "Potential of all pairs of a pixel and a light" by [walks] {
        walks: u64 = "walks",
        lights: u64 = "virtual lights",
        pairs: u64 = "pairs",
        rays: u64 = "shadow rays",
        time: Repeats = "time (s)",
        pair: Repeats = "a pair (ns)",
        with_rays: Repeats = "a pair with its shadow ray, all lights (ns)",
    }
}

rows! {
    /// The same walks' lights by the host.
    struct Host = "Potential by one thread of the host" by [walks] {
        walks: u64 = "walks",
        lights: u64 = "virtual lights",
        pair: Repeats = "a pair (ns)",
        over: Repeats = "over a pair by the device",
        by_hardware: bool = "by a GPU",
    }
}

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    device: Vec<Row>,
    host: Vec<Host>,
}

/// Exponent of the time against the number of lights, by least squares of logarithms.
fn exponent(rows: &[&Row]) -> Option<Measured> {
    if rows.len() < 2 {
        return None;
    }
    let points: Vec<(f64, f64)> = rows
        .iter()
        .map(|row| ((row.lights as f64).ln(), median(row.time.0.clone()).ln()))
        .collect();
    let n = points.len() as f64;
    let (x, y) = points
        .iter()
        .fold((0.0, 0.0), |(x, y), point| (x + point.0 / n, y + point.1 / n));
    let (above, below) = points.iter().fold((0.0, 0.0), |(above, below), point| {
        let along = point.0 - x;
        (above + along * (point.1 - y), below + along * along)
    });
    Some((above / below).into())
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::all(
        "time is linear in the number of lights: exponent",
        Bound::Between(0.9, 1.1),
        exponent,
    ),
    Criterion::each("no shadow ray is sent: rays", Bound::AtMost(0.0), |row: &Row| {
        row.rays.into()
    })
    .in_every_form(),
    Criterion::each(
        "a pair takes no longer than published (ns)",
        Bound::AtMost(PUBLISHED),
        |row: &Row| (&row.pair).into(),
    ),
];

const OF_HOST: &[Criterion<Host>] = &[Criterion::each(
    "the device takes a tenth of the host's time for a pair: the host's over it",
    Bound::AtLeast(10.0),
    |row: &Host| (&row.over).into(),
)
.among(|row| row.by_hardware)
.because("published, of a graphics card")
.needs(MEMORY_OF_ITS_OWN)];

/// Seconds for a pair of all points and lights, by the host.
fn by_host(pixels: &Pixels) -> f64 {
    let (mut potentials, mut keys) = (Vec::new(), Vec::new());
    let (sum, seconds) = timed(|| {
        let of_point = |point| {
            pixels.potentials(point, &mut potentials, &mut keys);
            keys.first().copied().unwrap_or(0.0)
        };
        pixels.points.iter().map(of_point).sum::<f64>()
    });
    std::hint::black_box(sum);
    seconds / (pixels.points.len() * pixels.lights.len()) as f64
}

/// Seconds of the gathers of a picture, and its counters.
fn gathers(renderer: &Renderer, side: u32, walks: u32, selection: &str) -> Result<(f64, [u64; 3])> {
    let rendered = renderer.render(&RenderOptions {
        technique: Some("vpl".into()),
        size: [side; 2],
        spp: 1,
        settings: json!({
            "walks": walks, "selection": selection, "potential_share": 0.0, "compensation": "none", "fractional": true
        })
        .into(),
        ..RenderOptions::default()
    })?;
    let passes = rendered
        .report
        .passes
        .iter()
        .filter(|pass| pass.name.starts_with(GATHER));
    let counter = |name: &str| rendered.report.counters.get(name).copied().unwrap_or(0);
    let all = counter("connections");
    // Direct light has rays of its own.
    let rays = if selection == "all" {
        all
    } else {
        counter("shadow_rays")
    };
    Ok((
        passes.map(|pass| pass.gpu_ms.unwrap_or(f64::NAN) / 1e3).sum(),
        [counter("virtual_lights"), all, rays],
    ))
}

fn of_walks(context: &Context<'_>, renderer: &Renderer, walks: u32, by_hardware: bool) -> Result<(Row, Host)> {
    let side = context.pick(SIDE[0], SIDE[1]);
    let (_, [lights, pairs, direct_rays]) = gathers(renderer, side, walks, "potential")?;
    // Those of direct light alone, one a pixel at most.
    let rays = direct_rays.saturating_sub(u64::from(side * side));
    let pixels = Pixels::of([side; 2], walks, 0)?;
    let found = context.in_turns(5, 3, |i| match ["potential", "all"].get(i) {
        Some(selection) => Ok(gathers(renderer, side, walks, selection)?.0),
        None => Ok(by_host(&pixels)),
    })?;
    let [potential, all, host] = [0, 1, 2].map(|i| Repeats(found[i].clone()));
    let pair = potential.scaled(1e9 / (LOOKS * pairs as f64));
    let host = Host {
        walks: walks.into(),
        lights: pixels.lights.len() as u64,
        over: host.scaled(1e9).over(&pair),
        pair: host.scaled(1e9),
        by_hardware,
    };
    let row = Row {
        walks: walks.into(),
        lights,
        pairs,
        rays,
        pair,
        with_rays: all.scaled(1e9 / pairs as f64),
        time: potential,
    };
    Ok((row, host))
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu: Gpu = (context.gpu)()?;
        let renderer = Renderer::new(&gpu, &scene::load(ADDRESS)?)?;
        let is_hardware = gpu.caps().kind != DeviceKind::Cpu;
        let walks = context.first(&WALKS, 2);
        let mut host = Vec::new();
        let device = context.each(
            walks,
            |walks| format!("{walks} walks"),
            |walks| {
                let (by_device, by_host) = of_walks(context, &renderer, *walks, is_hardware)?;
                host.push(by_host);
                Ok(vec![by_device])
            },
        )?;
        Ok(Self { device, host })
    }

    fn findings(&self) -> Findings {
        let last = self.device.last().map(|row| row.pair.measured());
        let device = Findings::of(&self.device, CRITERIA)
            .headline("time to find the potential of a pair of a pixel and a light (ns)", last)
            .note(format!(
                "The unit box, a pixel a place, the first surface alone. A share of none of the potential is taken, so that each pair is looked at {LOOKS} times: for the sum, and to be \
                 left out; a pair's time is that of one look, and none is kept or read back. Published: 262 million pairs in about ten seconds, half of which reads them back, on a Radeon 9700 Pro."
            ))
            .curves(
                "time",
                "Time of potentials against the number of lights",
                Axes::rates("virtual lights", "time (s)"),
                curves(
                    &self.device,
                    |_| "potential".into(),
                    |row| (row.lights as f64, row.time.measured()),
                ),
            );
        let host = Findings::of(&self.host, OF_HOST).note(
            "In f64, as many points and walks, whose own points are lights, too. On a software driver the device is all threads of the host, which evaluate materials as they do for pictures; the host has \
             Lambert's law alone. Published: about ten times as fast by the card.",
        );
        device.and(host)
    }
}
