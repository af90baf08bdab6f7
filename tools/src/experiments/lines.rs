//! Line charts on linear axes, as SVG: functions along a path, of which the parts above the frame are left out.
//!
//! Legible in black and white, by the dashes and colours of [`super::plot`]; the legend stands beside the frame.

use clerestory::{Error, Result};
use plotters::prelude::*;

use super::legend::{self, Entry};
use super::plot::{COLORS, DASHES, FONT, Words, line};

/// Pixels across and, where the legend is no longer, down.
const SIZE: (u32, u32) = (760, 400);

/// A function by its points.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// For the legend.
    pub name: String,
    /// From left to right; what is not finite interrupts it.
    pub points: Vec<(f64, f64)>,
}

impl Line {
    /// The runs of points within the frame.
    fn pieces(&self, top: f64) -> Vec<Vec<(f64, f64)>> {
        let runs = self.points.split(|(x, y)| !(x.is_finite() && (0.0..=top).contains(y)));
        runs.filter(|run| run.len() > 1).map(<[_]>::to_vec).collect()
    }
}

/// Decimals that multiples of a step need.
fn decimals(step: f64) -> usize {
    const MOST: usize = 3;
    let is_whole = |scaled: f64| (scaled - scaled.round()).abs() < 1e-9;
    let scales = [1.0, 10.0, 100.0];
    scales.iter().position(|scale| is_whole(step * scale)).unwrap_or(MOST)
}

/// Draws functions from 0 to `top`, over as many steps of an axis from 0 on, each of which is named.
///
/// # Errors
/// [`Error::Io`] when they cannot be drawn.
pub fn draw(words: Words<'_>, (steps, step): (u32, f64), top: f64, lines: &[Line]) -> Result<String> {
    let mut svg = String::new();
    onto(&mut svg, words, (steps, step), top, lines)
        .map_err(|cause| Error::io(words.title, std::io::Error::other(cause)))?;
    Ok(svg)
}

fn onto(
    svg: &mut String,
    words: Words<'_>,
    (steps, step): (u32, f64),
    top: f64,
    lines: &[Line],
) -> std::result::Result<(), String> {
    let failed = |cause: &dyn std::fmt::Display| cause.to_string();
    let named = lines.iter().enumerate().map(|(index, function)| Entry {
        name: &function.name,
        color: COLORS[index % COLORS.len()],
        dash: DASHES[index % DASHES.len()],
        shape: None,
    });
    let entries: Vec<Entry<'_>> = named.collect();
    let size = (SIZE.0, SIZE.1.max(legend::height(&entries)));
    let root = SVGBackend::with_string(svg, size).into_drawing_area();
    root.fill(&WHITE).map_err(|e| failed(&e))?;
    let (left, right) = root.split_horizontally(SIZE.0 - legend::WIDTH);
    legend::draw(&right, &entries)?;
    let digits = decimals(step);
    let mut chart = ChartBuilder::on(&left)
        .caption(words.title, (FONT, 15))
        .margin(10)
        .x_label_area_size(42)
        .y_label_area_size(58)
        .build_cartesian_2d(0.0..f64::from(steps), 0.0..top)
        .map_err(|e| failed(&e))?;
    chart
        .configure_mesh()
        .x_desc(words.x)
        .y_desc(words.y)
        .x_labels(steps as usize + 1)
        .x_label_formatter(&|at| format!("{:.digits$}", at * step))
        .axis_desc_style((FONT, 14))
        .label_style((FONT, 12))
        .bold_line_style(RGBColor(210, 210, 210))
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(|e| failed(&e))?;
    for (index, function) in lines.iter().enumerate() {
        let style = COLORS[index % COLORS.len()].stroke_width(2);
        let dash = DASHES[index % DASHES.len()];
        let scaled = |piece: Vec<(f64, f64)>| piece.into_iter().map(|(x, y)| (x / step, y)).collect::<Vec<_>>();
        let pieces = function
            .pieces(top)
            .into_iter()
            .map(|piece| line(scaled(piece), dash, style));
        chart.draw_series(pieces).map_err(|e| failed(&e))?;
    }
    root.present().map_err(|e| failed(&e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_name_steps_by_their_decimals() {
        assert_eq!([10.0, 1.0, 0.1, 0.25, 0.125].map(decimals), [0, 0, 1, 2, 3]);
        let words = Words {
            title: "t",
            x: "x",
            y: "y",
        };
        let svg = draw(words, (4, 0.25), 1.0, &[]).unwrap();
        assert!(svg.contains("0.75"), "{svg}");
    }

    #[test]
    fn what_leaves_the_frame_is_left_out() {
        let points = vec![
            (0.0, 0.5),
            (1.0, 0.6),
            (2.0, f64::INFINITY),
            (3.0, 9.0),
            (4.0, 0.1),
            (5.0, 0.2),
            (6.0, f64::NAN),
        ];
        let function = Line {
            name: "a < b".into(),
            points,
        };
        let expected = [vec![(0.0, 0.5), (1.0, 0.6)], vec![(4.0, 0.1), (5.0, 0.2)]];
        assert_eq!(function.pieces(1.0), expected);
        let words = Words {
            title: "t",
            x: "x",
            y: "y",
        };
        let svg = draw(words, (2, 3.0), 1.0, &[function]).unwrap();
        assert!(
            svg.contains("a &lt; b") && !svg.contains("NaN") && !svg.contains("inf"),
            "{svg}"
        );
    }
}
