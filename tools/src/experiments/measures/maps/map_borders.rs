//! What look-ups jump by over the seams of an octahedron map, against the width of its border and the level of detail; and what levels lose.
//!
//! Source: T. Engelhardt, PhD thesis, KIT, 2013, §7.2.2 and Fig. 7.5. Oracle: seamless look-ups, which do not jump, and ∫ L dω of level 0.

use clerestory::Result;
use clerestory::film::atomic;
use clerestory::maps::{MapImage, Parametrization};
use glam::{DVec3, IVec2, UVec2};

use crate::experiments::lines::{self, Line};
use crate::experiments::measures::Context;
use crate::experiments::plot::Words;
use crate::experiments::table::Table;
use crate::random::Random;

const TEXELS: u32 = 128;
/// Widths of the border at level 0, from which those of coarser levels are halved.
const BORDERS: [u32; 6] = [0, 1, 2, 4, 8, 16];
/// How far directions lie beside a seam.
const ASIDE: f64 = 1e-7;
const LOBES: usize = 64;
/// Concentration of a lobe, exp(κ(cos − 1)): a twelfth wide.
const CONCENTRATION: f64 = 150.0;

fn field(lobes: &[(DVec3, DVec3)], d: DVec3) -> DVec3 {
    let light = |(middle, color): &(DVec3, DVec3)| (CONCENTRATION * (middle.dot(d) - 1.0)).exp() * *color;
    lobes.iter().map(light).sum()
}

/// A bilinear look-up of a tile: beyond its border the last texel goes on.
fn clamped(image: &MapImage, border: u32, d: DVec3) -> Option<DVec3> {
    let (map, size) = (image.map(), image.size());
    let at = map.encode(d)?;
    let place = at.uv * size.as_dvec2() - 0.5;
    let (corner, part) = (place.floor().as_ivec2(), place.fract_gl());
    let border = border.cast_signed();
    let held = |x: i32, y: i32| {
        let p = (corner + IVec2::new(x, y)).clamp(IVec2::splat(-border), size.as_ivec2() - 1 + border);
        Some(image.at(map.wrap(size, 0, p.x, p.y)?).as_dvec3())
    };
    let upper = held(0, 0)?.lerp(held(1, 0)?, part.x);
    Some(upper.lerp(held(0, 1)?.lerp(held(1, 1)?, part.x), part.y))
}

/// Directions at both sides of the seams of the square layout: the planes x = 0 and y = 0 below the equator.
fn pairs(count: u32) -> Vec<[DVec3; 2]> {
    let mut random = Random::new(17);
    let pair = |i: u32| {
        let turn = random.range(0.0, std::f64::consts::PI);
        let (sin, cos) = turn.sin_cos();
        [ASIDE, -ASIDE].map(|aside| match i % 2 {
            0 => DVec3::new(aside, cos, -sin),
            _ => DVec3::new(cos, aside, -sin),
        })
    };
    (0..count).map(pair).collect()
}

fn jump(pairs: &[[DVec3; 2]], look_up: impl Fn(DVec3) -> Option<DVec3>) -> f64 {
    let squares = pairs
        .iter()
        .filter_map(|[a, b]| Some((look_up(*a)? - look_up(*b)?).length_squared()));
    (squares.sum::<f64>() / (3.0 * pairs.len() as f64)).sqrt()
}

fn seams(context: &Context<'_>, chain: &[MapImage], deviation: f64) -> Result<Table> {
    let pairs = pairs(if context.smoke { 200 } else { 20_000 });
    let mut heads = vec!["border at level 0 (texels)".to_owned()];
    heads.extend((0..chain.len()).map(|level| format!("level {level}")));
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let mut table = Table::new("Jump over seams against border and level", &heads);
    let mut curves = Vec::new();
    let mut add = |name: String, jumps: Vec<f64>| {
        let points = jumps
            .iter()
            .enumerate()
            .map(|(level, jump)| (level as f64, *jump))
            .collect();
        curves.push(Line {
            name: name.clone(),
            points,
        });
        table.row(std::iter::once(name.into()).chain(jumps.into_iter().map(Into::into)));
    };
    for border in BORDERS {
        let jumps = chain.iter().enumerate().map(|(level, image)| {
            let left = border >> level;
            jump(&pairs, |d| clamped(image, left, d)) / deviation
        });
        add(border.to_string(), jumps.collect());
    }
    let jumps = chain
        .iter()
        .map(|image| jump(&pairs, |d| clamped(image, 1, d)) / deviation);
    add("1 at each level".into(), jumps.collect());
    let words = Words {
        title: "Jump of bilinear look-ups over seams",
        x: "level of detail",
        y: "RMS jump over the field's deviation",
    };
    let top = curves
        .iter()
        .flat_map(|line| &line.points)
        .map(|(_, y)| *y)
        .fold(0.0, f64::max);
    let svg = lines::draw(words, (chain.len() as u32 - 1, 1.0), 1.1 * top, &curves)?;
    atomic::write(&context.file("seams.svg")?, svg.as_bytes())?;
    table.note(format!(
        "RMS difference of bilinear look-ups at both sides of seams ({} pairs of directions, {ASIDE:e} beside the planes x = 0 and y = 0 below the \
         equator), over the field's deviation. The map has {TEXELS} × {TEXELS} texels of {LOBES} lobes a twelfth wide, in each level means by solid angle. Tiles whose \
         border is halved with each level have none left beyond log₂ of its width, and look-ups stop at the last texel. What is left with a border is the \
         slope over the distance. Plot beside this table: `seams.svg`.",
        pairs.len(),
    ));
    Ok(table)
}

/// Relative change of ∫ L dω, worst of the channels.
fn lost(image: &MapImage, before: DVec3) -> f64 {
    ((image.integral() - before) / before).abs().max_element()
}

fn energy(context: &Context<'_>, field_of: impl Fn(Parametrization) -> Result<MapImage>) -> Result<Table> {
    let mut table = Table::new(
        "Energy through levels",
        &[
            "map",
            "level",
            "texels",
            "change by means of four",
            "change by means by solid angle",
        ],
    );
    let maps = [
        Parametrization::OctahedronQuadratic,
        Parametrization::OctahedronRectangular,
        Parametrization::EqualArea,
        Parametrization::LatLong,
    ];
    for (done, map) in maps.into_iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(&format!("levels of {map}"), done, maps.len());
        let first = field_of(map)?;
        let before = first.integral();
        let (mut plain, mut weighted) = (first.clone(), first);
        let mut level = 0u64;
        while let Ok(next) = weighted.coarser() {
            weighted = next;
            plain = MapImage::from_fn(map, plain.size() / 2, |texel| {
                let taps = map.children(plain.size(), texel);
                taps.iter().map(|tap| 0.25 * plain.at(tap.texel).as_dvec3()).sum()
            })?;
            level += 1;
            let size = weighted.size();
            table.row([
                map.to_string().into(),
                level.into(),
                format!("{} × {}", size.x, size.y).into(),
                lost(&plain, before).into(),
                lost(&weighted, before).into(),
            ]);
        }
    }
    table.note("Relative change of ∫ L dω against level 0, the worst of three channels, of the same field.");
    Ok(table)
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let mut random = Random::new(18);
    let lobes: Vec<(DVec3, DVec3)> = (0..LOBES)
        .map(|_| {
            (
                random.direction(),
                DVec3::new(random.unit(), random.unit(), random.unit()),
            )
        })
        .collect();
    let rows = if context.smoke { TEXELS / 4 } else { TEXELS };
    let field_of = |map: Parametrization| {
        let size = UVec2::new(rows * map.aspect(), rows);
        MapImage::from_fn(map, size, |texel| {
            map.texel_direction(size, texel)
                .map_or(DVec3::ZERO, |d| field(&lobes, d))
        })
    };
    let mut chain = vec![field_of(Parametrization::OctahedronQuadratic)?];
    while let Some(next) = chain.last().and_then(|last| last.coarser().ok()) {
        if next.size().x < 2 {
            break;
        }
        chain.push(next);
    }
    let first = &chain[0];
    let (map, size) = (first.map(), first.size());
    let mean = first.integral() / map.solid_angle();
    let squares: f64 = map
        .texels(size)
        .map(|texel| map.texel_solid_angle(size, texel) * (first.at(texel).as_dvec3() - mean).length_squared())
        .sum();
    let deviation = (squares / (3.0 * map.solid_angle())).sqrt();
    Ok(vec![seams(context, &chain, deviation)?, energy(context, field_of)?])
}
