//! Plots: error against work on logarithmic axes, as SVG.
//!
//! Legible in black and white: every curve has a marker and a dash of its own besides its colour, which is one of the eight of Okabe and Ito (*Color
//! Universal Design*, 2008) that people with any colour vision tell apart. Bars span the least and greatest repeat; rings mark the Pareto front; a
//! guide shows the slope −½ of independent samples. The legend stands beside the frame.

use clerestory::{Error, Result};
use plotters::element::{DashedPathElement, Drawable, DynElement, IntoDynElement, PointCollection};
use plotters::prelude::*;
use plotters_backend::{BackendCoord, DrawingErrorKind};

use super::legend::{self, Entry};

/// A point of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlotPoint {
    /// Work, above 0.
    pub x: f64,
    /// Error; points whose error is not above 0 are not drawn.
    pub y: f64,
    /// Ends of the error bar.
    pub y_range: [f64; 2],
    /// Whether it gets a ring.
    pub ringed: bool,
}

/// A curve with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// For the legend.
    pub name: String,
    /// In the order of drawing.
    pub points: Vec<PlotPoint>,
}

/// Words of a plot.
#[derive(Debug, Clone, Copy)]
pub struct Words<'a> {
    /// What is shown.
    pub title: &'a str,
    /// The axis of work, with its unit.
    pub x: &'a str,
    /// The axis of error, with its unit.
    pub y: &'a str,
}

/// Pixels across and, where the legend is no longer, down.
const SIZE: (u32, u32) = (760, 400);
pub(super) const FONT: &str = "sans-serif";
/// Okabe and Ito without yellow, which white paper swallows.
pub(super) const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];
/// Dash and gap in pixels; no gap is a full line.
pub(super) const DASHES: [(u32, u32); 4] = [(1, 0), (8, 4), (2, 3), (14, 5)];
const GUIDE_GREY: RGBColor = RGBColor(120, 120, 120);
const GUIDE_DASH: (u32, u32) = (3, 5);
/// The slope of the guide.
const GUIDE_SLOPE: f64 = -0.5;
/// Room around the points, as a factor.
const MARGIN: f64 = 1.35;
const MARKER: i32 = 4;
const SHAPES: usize = 6;
const RING: i32 = 8;
/// Pixels of a line in a legend.
pub(super) const LEGEND_LINE: i32 = 28;

/// Draws curves; `None` when there is no point to draw.
///
/// # Errors
/// [`Error::Io`] when it cannot be drawn.
pub fn log_log(words: Words<'_>, curves: &[Curve]) -> Result<Option<String>> {
    of(words, curves, true)
}

/// As [`log_log`] of rates, which grow with their number: without the guide.
///
/// # Errors
/// As [`log_log`].
pub fn log_log_of_rates(words: Words<'_>, curves: &[Curve]) -> Result<Option<String>> {
    of(words, curves, false)
}

fn of(words: Words<'_>, curves: &[Curve], of_errors: bool) -> Result<Option<String>> {
    let drawn = |point: &&PlotPoint| point.x > 0.0 && point.y > 0.0 && point.x.is_finite() && point.y.is_finite();
    let curves: Vec<Curve> = curves
        .iter()
        .map(|curve| Curve {
            name: curve.name.clone(),
            points: curve.points.iter().filter(drawn).copied().collect(),
        })
        .filter(|curve| !curve.points.is_empty())
        .collect();
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let heights = || points().flat_map(|point| [point.y, point.y_range[0], point.y_range[1]]);
    let (Some(x), Some(y)) = (span(points().map(|point| point.x)), span(heights())) else {
        return Ok(None);
    };
    let mut svg = String::new();
    draw(&mut svg, words, &curves, x, y, of_errors)
        .map_err(|cause| Error::io(words.title, std::io::Error::other(cause)))?;
    Ok(Some(svg))
}

/// The range of the values above 0, with room; `None` without any.
fn span(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let sound = values.filter(|value| *value > 0.0 && value.is_finite());
    let (least, most) = sound.fold((f64::INFINITY, 0.0f64), |(least, most), value| {
        (least.min(value), most.max(value))
    });
    (most > 0.0).then(|| (least / MARGIN, most * MARGIN))
}

/// Powers of ten within a range, with their double and fivefold where the powers are few.
pub(super) fn ticks((least, most): (f64, f64)) -> Vec<f64> {
    let decades = least.log10().floor() as i32..=most.log10().ceil() as i32;
    let with = |steps: &[f64]| -> Vec<f64> {
        let all = decades
            .clone()
            .flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)));
        all.filter(|tick| (least..=most).contains(tick)).collect()
    };
    let powers = with(&[1.0]);
    if powers.len() < 3 {
        with(&[1.0, 2.0, 5.0])
    } else {
        powers
    }
}

pub(super) fn tick_text(value: &f64) -> String {
    if (0.000_99..10_000.0).contains(value) {
        // Ticks have one digit that counts; their product with a power of ten is not exact.
        let digits = (-value.log10().floor()).max(0.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.0e}")
    }
}

/// A marker at each of its points; in a legend with a piece of its line.
pub(super) struct Glyph<C> {
    pub points: Vec<C>,
    /// Which marker; `None` draws none.
    pub shape: Option<usize>,
    /// Dash and gap of the line, in a legend.
    pub legend: Option<(u32, u32)>,
    pub color: RGBColor,
}

impl<'a, C: 'a> PointCollection<'a, C> for &'a Glyph<C> {
    type Point = &'a C;
    type IntoIter = std::slice::Iter<'a, C>;

    fn point_iter(self) -> Self::IntoIter {
        self.points.iter()
    }
}

impl<C, DB: DrawingBackend> Drawable<DB> for Glyph<C> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        points: I,
        backend: &mut DB,
        _: (u32, u32),
    ) -> std::result::Result<(), DrawingErrorKind<DB::ErrorType>> {
        let line = self.color.stroke_width(2);
        for (x, y) in points {
            let (mut x, y) = (x, y);
            if let Some((dash, gap)) = self.legend {
                let (dash, gap) = (dash as i32, gap as i32);
                let (dash, step) = if gap == 0 {
                    (LEGEND_LINE, LEGEND_LINE)
                } else {
                    (dash, dash + gap)
                };
                for start in (0..LEGEND_LINE).step_by(step.max(1) as usize) {
                    let end = (start + dash).min(LEGEND_LINE);
                    backend.draw_line((x + start, y), (x + end, y), &line)?;
                }
                x += LEGEND_LINE / 2;
            }
            let corners = ((x - MARKER, y - MARKER), (x + MARKER, y + MARKER));
            match self.shape.map(|shape| shape % SHAPES) {
                None => {}
                Some(0) => backend.draw_circle((x, y), MARKER as u32, &self.color, true)?,
                Some(1) => backend.draw_rect(corners.0, corners.1, &line, false)?,
                Some(2) => {
                    let up = [
                        (x, y - MARKER - 2),
                        (x - MARKER - 1, y + MARKER),
                        (x + MARKER + 1, y + MARKER),
                    ];
                    backend.fill_polygon(up, &self.color)?;
                }
                Some(3) => {
                    backend.draw_line(corners.0, corners.1, &line)?;
                    backend.draw_line((x - MARKER, y + MARKER), (x + MARKER, y - MARKER), &line)?;
                }
                Some(4) => backend.draw_circle((x, y), MARKER as u32, &line, false)?,
                Some(_) => backend.draw_rect(corners.0, corners.1, &self.color, true)?,
            }
        }
        Ok(())
    }
}

/// A line with dashes of some pixels, or a full one.
pub(super) fn line<DB, C>(points: Vec<C>, (dash, gap): (u32, u32), style: ShapeStyle) -> DynElement<'static, DB, C>
where
    DB: DrawingBackend,
    C: Clone + 'static,
{
    if gap == 0 {
        PathElement::new(points, style).into_dyn()
    } else {
        DashedPathElement::new(points, dash, gap, style).into_dyn()
    }
}

fn draw(
    svg: &mut String,
    words: Words<'_>,
    curves: &[Curve],
    x: (f64, f64),
    y: (f64, f64),
    of_errors: bool,
) -> std::result::Result<(), String> {
    let failed = |cause: &dyn std::fmt::Display| cause.to_string();
    let guide = of_errors.then_some(Entry {
        name: "slope −½",
        color: GUIDE_GREY,
        dash: GUIDE_DASH,
        shape: None,
    });
    let named = curves.iter().enumerate().map(|(index, curve)| Entry {
        name: &curve.name,
        color: COLORS[index % COLORS.len()],
        dash: DASHES[index % DASHES.len()],
        shape: Some(index),
    });
    let entries: Vec<Entry<'_>> = guide.into_iter().chain(named).collect();
    let size = (SIZE.0, SIZE.1.max(legend::height(&entries)));
    let root = SVGBackend::with_string(svg, size).into_drawing_area();
    root.fill(&WHITE).map_err(|e| failed(&e))?;
    let (left, right) = root.split_horizontally(SIZE.0 - legend::WIDTH);
    legend::draw(&right, &entries)?;
    let mut chart = ChartBuilder::on(&left)
        .caption(words.title, (FONT, 15))
        .margin(10)
        .x_label_area_size(42)
        .y_label_area_size(58)
        .build_cartesian_2d(
            (x.0..x.1).log_scale().with_key_points(ticks(x)),
            (y.0..y.1).log_scale().with_key_points(ticks(y)),
        )
        .map_err(|e| failed(&e))?;
    chart
        .configure_mesh()
        .x_desc(words.x)
        .y_desc(words.y)
        .axis_desc_style((FONT, 14))
        .label_style((FONT, 12))
        .bold_line_style(RGBColor(210, 210, 210))
        .light_line_style(TRANSPARENT)
        .x_label_formatter(&tick_text)
        .y_label_formatter(&tick_text)
        .draw()
        .map_err(|e| failed(&e))?;
    // Through the last point of the first curve, where fixed costs weigh least; cut off where it leaves the plot.
    if of_errors && let Some(last) = curves.iter().find_map(|curve| curve.points.last()) {
        let height = |at: f64| last.y * (at / last.x).powf(GUIDE_SLOPE);
        let start = x.0.max(last.x * (y.1 / last.y).powf(1.0 / GUIDE_SLOPE));
        let end = x.1.min(last.x * (y.0 / last.y).powf(1.0 / GUIDE_SLOPE));
        let style = GUIDE_GREY.stroke_width(1);
        let ends = vec![(start, height(start)), (end, height(end))];
        chart
            .draw_series(std::iter::once(line(ends, GUIDE_DASH, style)))
            .map_err(|e| failed(&e))?;
    }
    for (index, curve) in curves.iter().enumerate() {
        let color = COLORS[index % COLORS.len()];
        let (dash, style) = (DASHES[index % DASHES.len()], color.stroke_width(2));
        let ends: Vec<(f64, f64)> = curve.points.iter().map(|point| (point.x, point.y)).collect();
        chart
            .draw_series(std::iter::once(line(ends, dash, style)))
            .map_err(|e| failed(&e))?;
        let thin = color.stroke_width(1);
        let bars = curve.points.iter().map(|point| {
            let low = if point.y_range[0] > 0.0 { point.y_range[0] } else { y.0 };
            PathElement::new([(point.x, low.max(y.0)), (point.x, point.y_range[1].min(y.1))], thin)
        });
        chart.draw_series(bars).map_err(|e| failed(&e))?;
        let markers = Glyph {
            points: curve.points.iter().map(|point| (point.x, point.y)).collect(),
            shape: Some(index),
            legend: None,
            color,
        };
        chart.draw_series(std::iter::once(markers)).map_err(|e| failed(&e))?;
        let ringed = curve.points.iter().filter(|point| point.ringed);
        let rings = ringed.map(|point| Circle::new((point.x, point.y), RING, BLACK.stroke_width(1)));
        chart.draw_series(rings).map_err(|e| failed(&e))?;
    }
    root.present().map_err(|e| failed(&e))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(name: &str, scale: f64) -> Curve {
        let point = |n: f64| PlotPoint {
            x: n,
            y: scale * n.powf(-0.5),
            y_range: [0.9 * scale * n.powf(-0.5), 1.1 * scale * n.powf(-0.5)],
            ringed: n == 4.0,
        };
        Curve {
            name: name.into(),
            points: [1.0, 4.0, 16.0, 64.0].map(point).to_vec(),
        }
    }

    const WORDS: Words<'static> = Words {
        title: "a < b & c",
        x: "time (s)",
        y: "relative RMSE",
    };

    #[test]
    fn a_plot_has_its_words_and_is_sound_xml() {
        let svg = log_log(WORDS, &[curve("first", 1.0), curve("se<cond>", 0.5)])
            .unwrap()
            .unwrap();
        for word in [
            "time (s)",
            "relative RMSE",
            "first",
            "slope −½",
            "a &lt; b &amp; c",
            "se&lt;cond&gt;",
        ] {
            assert!(svg.contains(word), "{word}: {svg}");
        }
        assert!(svg.trim_start().starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert_eq!(
            svg,
            log_log(WORDS, &[curve("first", 1.0), curve("se<cond>", 0.5)])
                .unwrap()
                .unwrap()
        );
    }

    #[test]
    fn the_legend_stands_beside_the_frame_whatever_its_length() {
        let names: Vec<String> = (0..20)
            .map(|index| format!("number {index}, a long name of a curve"))
            .collect();
        let curves: Vec<Curve> = names.iter().map(|name| curve(name, 1.0)).collect();
        let svg = log_log(WORDS, &curves).unwrap().unwrap();
        let number = |line: &str, key: &str| -> u32 {
            let (_, rest) = line.split_once(&format!(" {key}=\"")).unwrap();
            rest.split_once('"').unwrap().0.parse().unwrap()
        };
        let height = number(svg.lines().next().unwrap(), "height");
        assert!(height > SIZE.1);
        // The text of an element stands on the line below it.
        let lines: Vec<&str> = svg.lines().collect();
        let legend: Vec<&str> = lines
            .windows(2)
            .filter(|pair| pair[0].starts_with("<text") && pair[1].starts_with("number"))
            .map(|pair| pair[0])
            .collect();
        assert_eq!(legend.len(), names.len());
        for line in legend {
            assert!(
                number(line, "x") > SIZE.0 - legend::WIDTH && number(line, "y") < height,
                "{line}"
            );
        }
    }

    #[test]
    fn points_without_a_logarithm_are_left_out() {
        let mut odd = curve("odd", 1.0);
        odd.points[0].y = f64::NAN;
        odd.points[1].x = 0.0;
        odd.points[2].y_range = [0.0, f64::NAN];
        let svg = log_log(WORDS, &[odd]).unwrap().unwrap();
        assert!(!svg.contains("NaN"), "{svg}");
        assert_eq!(log_log(WORDS, &[]).unwrap(), None);
        let alone = Curve {
            points: vec![curve("x", 1.0).points[0]],
            name: "x".into(),
        };
        assert!(log_log(WORDS, &[alone]).unwrap().is_some());
    }

    #[test]
    fn ticks_are_round_and_never_few() {
        assert_eq!(ticks((0.5, 2000.0)), [1.0, 10.0, 100.0, 1000.0]);
        let few = ticks((1.5, 30.0));
        assert_eq!(few, [2.0, 5.0, 10.0, 20.0]);
        let texts: Vec<String> = [0.001, 0.02, 5.0, 1000.0, 1e6, 2e-5].iter().map(tick_text).collect();
        assert_eq!(texts, ["0.001", "0.02", "5", "1000", "1e6", "2e-5"]);
    }
}
