//! The plot of `map-choice`: bars of storage and density above, below them errors against texels, and the same over those of the first map.

use clerestory::{Error, Result};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::experiments::plot::{COLORS, DASHES, FONT, Glyph, line, tick_text, ticks};

const SIZE: (u32, u32) = (1500, 1130);
/// Heights of the three rows.
const ROWS: [u32; 3] = [350, 390, 390];
/// For the names beside the bars and the legend.
const NAMES: u32 = 190;
const BAR: f64 = 0.36;
const TITLE: u32 = 16;
const LABEL: u32 = 13;
const GREY: RGBColor = RGBColor(210, 210, 210);
/// Where ratios end: those beyond leave the frame.
const RATIOS: [f64; 2] = [0.35, 5.0];
const MARGIN: f64 = 1.3;

/// A map, with texels and errors by environment.
pub struct Subject {
    /// Its name.
    pub name: String,
    /// By panel.
    pub curves: Vec<Vec<(f64, f64)>>,
}

/// A panel of bars, one a subject.
pub struct Bars<'a> {
    /// What they are.
    pub title: &'a str,
    /// Where the axis ends; bars beyond have an arrow.
    pub top: f64,
    /// A line to compare with.
    pub mark: Option<f64>,
    /// From where to where.
    pub spans: Vec<[f64; 2]>,
}

/// A panel of curves.
pub struct Panel<'a> {
    /// The environment.
    pub title: &'a str,
}

type Drawn = std::result::Result<(), String>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn failed(cause: impl std::fmt::Display) -> String {
    cause.to_string()
}

/// Draws all of it as SVG.
///
/// # Errors
/// [`Error::Io`] when it cannot be drawn.
pub fn draw(bars: &[Bars<'_>], panels: &[Panel<'_>], subjects: &[Subject]) -> Result<String> {
    let mut svg = String::new();
    onto(&mut svg, bars, panels, subjects).map_err(|cause| Error::io("choice.svg", std::io::Error::other(cause)))?;
    Ok(svg)
}

fn onto(svg: &mut String, bars: &[Bars<'_>], panels: &[Panel<'_>], subjects: &[Subject]) -> Drawn {
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE).map_err(failed)?;
    let (above, below) = root.split_vertically(ROWS[0]);
    let (middle, below) = below.split_vertically(ROWS[1]);
    let (names, charts) = above.split_horizontally(NAMES);
    legend(&names, subjects)?;
    for (area, panel) in charts.split_evenly((1, bars.len())).iter().zip(bars) {
        panel_of_bars(area, panel)?;
    }
    for (at, (area, panel)) in middle.split_evenly((1, panels.len())).iter().zip(panels).enumerate() {
        let curves: Vec<Vec<(f64, f64)>> = subjects.iter().map(|subject| subject.curves[at].clone()).collect();
        let title = format!("{}: RMS error over its deviation", panel.title);
        panel_of_curves(area, &title, &curves, None)?;
    }
    for (at, (area, panel)) in below.split_evenly((1, panels.len())).iter().zip(panels).enumerate() {
        let first = &subjects[0].curves[at];
        let over = |curve: &Vec<(f64, f64)>| {
            let pairs = curve.iter().zip(first);
            pairs
                .map(|((texels, error), (_, other))| (*texels, error / other))
                .collect()
        };
        let curves: Vec<Vec<(f64, f64)>> = subjects.iter().map(|subject| over(&subject.curves[at])).collect();
        let title = format!("{}: error over that of the {}", panel.title, subjects[0].name);
        panel_of_curves(area, &title, &curves, Some(RATIOS))?;
    }
    root.present().map_err(failed)
}

fn text(size: u32, across: HPos) -> TextStyle<'static> {
    let pos = Pos::new(across, VPos::Center);
    (FONT, size).into_font().color(&BLACK).pos(pos)
}

/// Names beside the bars, each with its line: the legend of all panels.
fn legend(area: &Area<'_>, subjects: &[Subject]) -> Drawn {
    // As high as the bars are.
    let (top, bottom) = (BAR_TOP, ROWS[0] - BAR_BOTTOM);
    for (index, subject) in subjects.iter().enumerate() {
        let share = (index as f64 + 0.5) / subjects.len() as f64;
        let y = f64::from(top) + share * f64::from(bottom - top);
        let y = y.round() as i32;
        let glyph = Glyph {
            points: vec![(8, y)],
            shape: Some(index),
            legend: Some(DASHES[index % DASHES.len()]),
            color: COLORS[index % COLORS.len()],
        };
        area.draw(&glyph).map_err(failed)?;
        area.draw(&Text::new(subject.name.clone(), (44, y), text(LABEL, HPos::Left)))
            .map_err(failed)?;
    }
    Ok(())
}

/// Pixels above and below the frame of bars.
const BAR_TOP: u32 = 42;
const BAR_BOTTOM: u32 = 40;

fn panel_of_bars(area: &Area<'_>, bars: &Bars<'_>) -> Drawn {
    let count = bars.spans.len() as f64;
    area.draw(&Text::new(bars.title.to_owned(), (10, 22), text(TITLE, HPos::Left)))
        .map_err(failed)?;
    let mut chart = ChartBuilder::on(area)
        .margin_top(BAR_TOP)
        .margin_left(10)
        .margin_right(24)
        .margin_bottom(BAR_BOTTOM - 30)
        .x_label_area_size(30)
        .build_cartesian_2d(0.0..bars.top, 0.0..count)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .disable_y_mesh()
        .disable_y_axis()
        .label_style((FONT, LABEL))
        .bold_line_style(GREY)
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(failed)?;
    for (index, [from, to]) in bars.spans.iter().enumerate() {
        let (color, y) = (COLORS[index % COLORS.len()], count - index as f64 - 0.5);
        let ends = [(from.clamp(0.0, bars.top), y - BAR), (to.clamp(0.0, bars.top), y + BAR)];
        chart
            .draw_series([Rectangle::new(ends, color.filled())])
            .map_err(failed)?;
        let shown = if *to > bars.top {
            let more = if to.is_finite() {
                format!("{to:.1} ▸")
            } else {
                "∞ ▸".into()
            };
            Text::new(more, (0.98 * bars.top, y), text(LABEL, HPos::Right).color(&WHITE))
        } else {
            let value = if *from > 0.0 {
                format!("{from:.2} – {to:.2}")
            } else {
                label(*to)
            };
            // Beside the bar, or in it where there is no room.
            if *to > 0.7 * bars.top && *from < 0.3 * bars.top {
                Text::new(value, (to - 0.01 * bars.top, y), text(LABEL, HPos::Right).color(&WHITE))
            } else {
                Text::new(value, (to + 0.015 * bars.top, y), text(LABEL, HPos::Left))
            }
        };
        chart.draw_series([shown]).map_err(failed)?;
    }
    if let Some(mark) = bars.mark {
        let ends = vec![(mark, 0.0), (mark, count)];
        chart
            .draw_series([PathElement::new(ends, BLACK.stroke_width(1))])
            .map_err(failed)?;
    }
    Ok(())
}

fn label(value: f64) -> String {
    if value == 0.0 {
        "0".into()
    } else {
        format!("{value:.3}").trim_end_matches('0').trim_end_matches('.').into()
    }
}

fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (least, most) = values
        .filter(|value| *value > 0.0 && value.is_finite())
        .fold((f64::INFINITY, 0.0f64), |(a, b), value| (a.min(value), b.max(value)));
    if most > 0.0 {
        (least / MARGIN, most * MARGIN)
    } else {
        (0.5, 2.0)
    }
}

/// Curves on logarithmic axes, of which those beyond the frame are cut off.
fn panel_of_curves(area: &Area<'_>, title: &str, curves: &[Vec<(f64, f64)>], heights: Option<[f64; 2]>) -> Drawn {
    let points = || curves.iter().flatten();
    let x = span(points().map(|(x, _)| *x));
    let y = heights.map_or_else(|| span(points().map(|(_, y)| *y)), |[low, high]| (low, high));
    let mut chart = ChartBuilder::on(area)
        .caption(title, (FONT, TITLE - 2))
        .margin(10)
        .x_label_area_size(44)
        .y_label_area_size(46)
        .build_cartesian_2d(
            (x.0..x.1).log_scale().with_key_points(ticks(x)),
            (y.0..y.1)
                .log_scale()
                .with_key_points(heights.map_or_else(|| ticks(y), |_| steps_of_ratios())),
        )
        .map_err(failed)?;
    chart
        .configure_mesh()
        .x_desc("texels of the sphere, unused ones included")
        .axis_desc_style((FONT, LABEL))
        .label_style((FONT, LABEL - 1))
        .bold_line_style(GREY)
        .light_line_style(TRANSPARENT)
        .x_label_formatter(&tick_text)
        .y_label_formatter(&|value| heights.map_or_else(|| tick_text(value), |_| value.to_string()))
        .draw()
        .map_err(failed)?;
    for (index, curve) in curves.iter().enumerate() {
        let color = COLORS[index % COLORS.len()];
        let inside = |(x, value): &&(f64, f64)| x.is_finite() && (y.0..=y.1).contains(value);
        let kept: Vec<(f64, f64)> = curve.iter().filter(inside).copied().collect();
        let dash = DASHES[index % DASHES.len()];
        chart
            .draw_series([line(kept.clone(), dash, color.stroke_width(2))])
            .map_err(failed)?;
        let glyph = Glyph {
            points: kept,
            shape: Some(index),
            legend: None,
            color,
        };
        chart.draw_series([glyph]).map_err(failed)?;
    }
    Ok(())
}

/// Round numbers within the frame of ratios.
fn steps_of_ratios() -> Vec<f64> {
    vec![0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plot_names_its_subjects_and_is_sound_xml() {
        let subject = |name: &str, scale: f64| Subject {
            name: name.into(),
            curves: vec![vec![(100.0, scale), (1000.0, 0.1 * scale), (1e4, f64::NAN)]; 2],
        };
        let bars = [
            Bars {
                title: "unused (%)",
                top: 25.0,
                mark: None,
                spans: vec![[0.0, 21.5], [0.0, f64::INFINITY]],
            },
            Bars {
                title: "ratio",
                top: 3.0,
                mark: Some(1.0),
                spans: vec![[0.3, 1.6], [0.0, 9.0]],
            },
        ];
        let panels = [Panel { title: "sky" }, Panel { title: "a < b" }];
        let svg = draw(&bars, &panels, &[subject("cube", 1.0), subject("<disc>", 1.7)]).unwrap();
        for word in ["cube", "&lt;disc&gt;", "unused (%)", "sky", "a &lt; b", "∞", "21.5"] {
            assert!(svg.contains(word), "{word}");
        }
        assert!(svg.trim_end().ends_with("</svg>") && !svg.contains("NaN"));
    }
}
